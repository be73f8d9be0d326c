//! The axes of a map, and their required range.

use super::samples::Sample;
use super::write::digits;
use anyhow::{Result, ensure};
use std::path::Path;
use tractive::start_up::SALIENT;
use tractive_tablegen::{FluxMap, SmoothMap};

/// Share of the largest current by which a map may end too early: rounding.
pub const SHORT: f64 = 1e-4;
/// The same for nodes that are not on a grid: a coarse circle cuts its arcs.
pub const GAP: f64 = 0.02;
/// Factor by which a map may exceed the largest current: beyond that hardly a node lies below it.
const FAR: f64 = 50.0;
/// Magnets' flux linkage against d that counts as measurement error, as a share of the largest.
const AGAINST: f64 = 0.01;

/// The units of currents, and the value of each in A.
const UNITS: [(&str, f64); 3] = [("mA", 1e-3), ("A", 1.0), ("kA", 1e3)];

/// The question about currents that would be right in a unit a thousand times as large as the one stated, or as small; the units' values are in A, and
/// without a stated one it is A.
fn unit_question(stated_a: Option<f64>, times: f64) -> String {
    let near = |unit_a: f64| UNITS.into_iter().find(|(_, size_a)| (size_a / unit_a - 1.0).abs() < 1e-6);
    let (wanted, stated) = (near(times * stated_a.unwrap_or(1.0)), stated_a.and_then(near));
    match (wanted, stated) {
        (Some((unit, _)), None) => format!(": are its currents in {unit} (a head such as id [{unit}])?"),
        (Some((unit, _)), Some((stated, _))) => {
            format!(": are its currents in {unit}, and not in {stated} as its head says?")
        }
        (None, _) => String::new(),
    }
}

/// Checks that rows reach the largest current, in A, along −d and along q, and zero current along d, except for a share of it. The values in A of the units
/// that the head states for these two currents serve the hint.
///
/// # Errors
/// The axis that ends too early or is too long, and the unit that is probably wrong.
pub fn check_ends(
    rows: &[Sample],
    units_a: [Option<f64>; 2],
    (most_a, short): (f64, f64),
    path: &Path,
) -> Result<()> {
    let file = path.display();
    let (mut first, mut last, mut last_q) = (f64::INFINITY, f64::NEG_INFINITY, 0.0_f64);
    for [id, iq, ..] in rows.iter().map(|row| row.values) {
        (first, last, last_q) = (first.min(id), last.max(id), last_q.max(iq.abs()));
    }
    let short = short * most_a;
    ensure!(first < 0.0, "{file}: id: begins at {first}: must go below 0, with d along the magnets");
    ensure!(last >= -short, "{file}: id: ends at {last}: must reach 0, with d along the magnets");
    for ((ends, what), unit_a) in [(-first, "−d"), (last_q, "q")].into_iter().zip(units_a) {
        let hint = match most_a / ends {
            ratio if ratio > FAR => unit_question(unit_a, 1e3),
            ratio if ratio < 1.42 => ": if its currents are rms, --rms".to_owned(),
            _ => String::new(),
        };
        ensure!(
            ends >= most_a - short,
            "--max-current {most_a}: must be at most {}: {file} ends there along {what}{hint}",
            digits(ends)
        );
        ensure!(
            ends <= FAR * most_a,
            "--max-current {most_a}: must be at least {}: {file} goes to {} along {what}{}",
            digits(ends / FAR),
            digits(ends),
            unit_question(unit_a, 1e-3)
        );
    }
    Ok(())
}

/// Checks that d is where start-up looks for it: along the magnets, or the least inductance. Saturation may make L_q slightly smaller than L_d, as long
/// as the pulses of start-up do not confuse them.
///
/// # Errors
/// Magnets against d, or inductances that are swapped.
pub fn check(map: &FluxMap, path: &Path) -> Result<()> {
    let file = path.display();
    let at = SmoothMap::new(map).at(0.0, 0.0);
    let largest = map.psi_d_wb.iter().chain(&map.psi_q_wb).fold(0.0, |most: f64, psi| most.max(psi.abs()));
    ensure!(
        at.psi_d_wb >= -AGAINST * largest,
        "{file}: psi_d: {:.4} Wb without current: must be above 0, as d lies along the magnets",
        at.psi_d_wb
    );
    ensure!(
        at.ldd_h - at.lqq_h <= f64::from(SALIENT) * (at.ldd_h + at.lqq_h),
        "{file}: L_d {:.4e} H and L_q {:.4e} H without current: L_d must be the smaller one, as d lies along the magnets",
        at.ldd_h,
        at.lqq_h
    );
    Ok(())
}
