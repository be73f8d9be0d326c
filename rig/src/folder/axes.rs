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

/// Checks that rows reach the largest current, in A, along −d and along q, and zero current along d, except for a share of it.
///
/// # Errors
/// The axis that ends too early or is too long, and the unit that is probably wrong.
pub fn check_ends(rows: &[Sample], most_a: f64, short: f64, path: &Path) -> Result<()> {
    let file = path.display();
    let (mut first, mut last, mut last_q) = (f64::INFINITY, f64::NEG_INFINITY, 0.0_f64);
    for [id, iq, ..] in rows.iter().map(|row| row.values) {
        (first, last, last_q) = (first.min(id), last.max(id), last_q.max(iq.abs()));
    }
    let short = short * most_a;
    ensure!(first < 0.0, "{file}: id: begins at {first}: must go below 0, with d along the magnets");
    ensure!(last >= -short, "{file}: id: ends at {last}: must reach 0, with d along the magnets");
    for (ends, what) in [(-first, "−d"), (last_q, "q")] {
        let hint = match most_a / ends {
            ratio if ratio > FAR => ": are its currents in kA (a head such as id [kA])?",
            ratio if ratio < 1.42 => ": if its currents are rms, --rms",
            _ => "",
        };
        ensure!(
            ends >= most_a - short,
            "--max-current {most_a}: must be at most {}: {file} ends there along {what}{hint}",
            digits(ends)
        );
        ensure!(
            ends <= FAR * most_a,
            "--max-current {most_a}: must be at least {}: {file} goes to {} along {what}: are its currents in mA (a head such as id [mA])?",
            digits(ends / FAR),
            digits(ends)
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
