//! The angles as Rust source, for the modulator.

use super::branch::STEP;
use super::{Followed, Waveform};
use std::fmt::Write as _;

/// The source of the table of angles: one `Branch` for each, named by the branch in capitals.
pub fn angle_table(branches: &[Followed]) -> String {
    let mut out = String::from(
        "//! The angles of the optimised patterns, in rad, from node to node of the modulation index. Made by `cargo rig patterns --write`.\n#![allow(clippy::excessive_precision, clippy::unreadable_literal)]\n\nuse super::Branch;\n",
    );
    for followed in branches {
        let branch = &followed.branch;
        let name = branch.name.to_uppercase();
        let first = followed.nodes.first().map_or(0.0, |(index, _)| *index);
        let last = followed.nodes.last().map_or(0.0, |(index, _)| *index);
        let [least, linear, square] = ripple_fit(followed);
        let [along, along_linear] = along_fit(followed);
        let _ = write!(
            out,
            "
/// {} pulses a turn, modulation index {first:.2} to {last:.2}.
#[rustfmt::skip]
pub static {name}: Branch = Branch {{
    starts_high: {},
    halves: {},
    calm: {},
    place: {},
    angles: {},
    first: {first:?},
    last: {last:?},
    inverse_step: {:?},
    ripple: [{least:.4}, {linear:.4}, {square:.4}],
    along: [{along:.4}, {along_linear:.4}],
    nodes: &[
",
            branch.pulses,
            branch.starts_high,
            branch.halves,
            branch.calm,
            branch.place,
            branch.pulses / 2,
            1.0 / STEP
        );
        for (_, angles) in &followed.nodes {
            let angles: Vec<_> = angles.iter().map(|angle| format!("{angle:.6}")).collect();
            let _ = writeln!(out, "        {},", angles.join(", "));
        }
        out.push_str("    ],\n};\n");
    }
    out
}

/// The weighted distortion, fitted by least squares as a quadratic function of the share of six-step that the fundamental lacks.
fn ripple_fit(followed: &Followed) -> [f64; 3] {
    let (mut matrix, mut right) = ([[0.0; 3]; 3], [0.0; 3]);
    for (index, angles) in &followed.nodes {
        let share = Waveform { first: followed.branch.first(), angles_rad: angles }.weighted_distortion();
        let powers = [1.0, 1.0 - index, (1.0 - index) * (1.0 - index)];
        // The deviation counts as a share of the distortion.
        for (row, a) in powers.iter().enumerate() {
            right[row] += a / share;
            for (column, b) in powers.iter().enumerate() {
                matrix[row][column] += a * b / (share * share);
            }
        }
    }
    solved(matrix, right)
}

/// The rms value of the ripple flux along the fundamental's, as a share of that, fitted by least squares as a linear function of the share of six-step that the
/// fundamental lacks.
fn along_fit(followed: &Followed) -> [f64; 2] {
    let mut sums = [0.0; 5];
    for (index, angles) in &followed.nodes {
        let (lacks, along) =
            (1.0 - index, Waveform { first: followed.branch.first(), angles_rad: angles }.along());
        let terms = [1.0, lacks, lacks * lacks, along, lacks * along];
        sums.iter_mut().zip(terms).for_each(|(sum, term)| *sum += term);
    }
    let [count, lack, square, along, both] = sums;
    let linear = (count * both - lack * along) / (count * square - lack * lack);
    [(along - linear * lack) / count, linear]
}

/// Cramer's rule.
fn solved(matrix: [[f64; 3]; 3], right: [f64; 3]) -> [f64; 3] {
    let determinant = |[a, b, c]: [[f64; 3]; 3]| {
        a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0])
            + a[2] * (b[0] * c[1] - b[1] * c[0])
    };
    let whole = determinant(matrix);
    std::array::from_fn(|column| {
        let mut replaced = matrix;
        replaced.iter_mut().zip(right).for_each(|(row, value)| row[column] = value);
        determinant(replaced) / whole
    })
}

#[cfg(test)]
mod tests;
