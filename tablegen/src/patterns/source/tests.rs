//! The fit of the distortion, checked by the property of least squares.

use super::*;
use crate::patterns::BRANCHES;

#[test]
fn three_equations_are_solved() {
    let matrix = [[2.0, -1.0, 3.0], [0.5, 4.0, 1.0], [-3.0, 2.5, 7.0]];
    let wanted = [1.5, -2.0, 0.25];
    let right = matrix.map(|row: [f64; 3]| row.iter().zip(wanted).map(|(a, b)| a * b).sum::<f64>());
    for (found, wanted) in solved(matrix, right).into_iter().zip(wanted) {
        assert!((found - wanted).abs() < 1e-12, "{found}, not {wanted}");
    }
}

/// The residual, as a share of the distortion, is orthogonal to each of the three powers.
#[test]
fn the_fit_leaves_least_squares() {
    let branch = BRANCHES.into_iter().find(|branch| branch.name == "opp5b").unwrap();
    let node = |index: f64| (index, vec![0.35 + 0.1 * index * index, 0.7 - 0.2 * index]);
    let followed = Followed { branch, nodes: [0.76, 0.8, 0.83, 0.88, 0.94].map(node).into() };
    let [a, b, c] = ripple_fit(&followed);
    let mut along = [0.0_f64; 3];
    for (index, angles) in &followed.nodes {
        let share = Waveform { first: -1.0, angles_rad: angles }.weighted_distortion();
        let lacks = 1.0 - index;
        let left = (a + b * lacks + c * lacks * lacks) / share - 1.0;
        for (power, along) in along.iter_mut().enumerate() {
            *along += left * lacks.powi(power as i32) / share;
        }
    }
    assert!(along.iter().all(|along| along.abs() < 1e-6), "{along:?}");
}
