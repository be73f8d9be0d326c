//! Steady states.

use super::{whole_turns, window};
use crate::options::RunOptions;
use crate::rows::mean;
use crate::trace::{Recording, Row};
use crate::verdict::{Verdict, torque_bound, worst};
use serde::Serialize;
use tractive_tablegen::MachineFolder;

/// A steady operating point, averaged.
#[derive(Clone, Debug, Serialize)]
pub struct SteadyPoint {
    /// Mechanical speed, in r/min.
    pub speed_rpm: f64,
    /// Torque demanded, in N·m.
    pub demand_nm: f64,
    /// The torque that the drive reports as its reference, in N·m: less than the demand if current or voltage do not allow more.
    pub reference_nm: f64,
    /// Mean air-gap torque, in N·m.
    pub torque_nm: f64,
    /// Mean of the torque that the drive reports as its actual one, in N·m.
    pub told_nm: f64,
    /// The largest deviation of that from the true mean, in percent of the largest torque.
    pub told_error_percent: f64,
    /// Error of the mean torque, in percent of the demand, or of 2 % of the largest torque if that is more.
    pub torque_error_percent: f64,
    /// Its error in the same way, relative to the drive's reported reference.
    pub reference_error_percent: f64,
    /// Phase current, rms, in A.
    pub current_rms_a: f64,
    /// Peak to peak torque ripple, in N·m.
    pub torque_ripple_nm: f64,
    /// Output power over input power, with the machine folder's speed-dependent loss, in percent: shaft over electrical while motoring, electrical
    /// over shaft while braking; `None` if all of the input is lost.
    pub efficiency_percent: Option<f64>,
    /// Mode in use at the end.
    pub mode: &'static str,
}

/// Share of the largest torque below which an error is no longer related to the torque wanted, but to this share.
const LEAST_SHARE: f64 = 0.02;

/// The error of a torque, in percent of the one wanted; positive if its magnitude is too large.
fn error_percent(torque_nm: f64, wanted_nm: f64, largest_nm: f64) -> f64 {
    let of_nm = wanted_nm.abs().max(LEAST_SHARE * largest_nm);
    (torque_nm - wanted_nm) * wanted_nm.signum() / of_nm * 100.0
}

/// The efficiency in percent, from the powers at the shaft and at the terminals.
fn efficiency_percent(shaft_w: f64, electrical_w: f64) -> Option<f64> {
    if shaft_w > 0.0 && electrical_w > 0.0 {
        Some(shaft_w / electrical_w * 100.0)
    } else if shaft_w < 0.0 && electrical_w < 0.0 {
        Some(electrical_w / shaft_w * 100.0)
    } else {
        None
    }
}

/// Averages over a window, shortened to whole turns of the stator field.
pub fn steady_point(
    recording: &Recording,
    within: (f64, f64),
    demand_nm: f64,
    machine: &MachineFolder,
) -> SteadyPoint {
    let parameters = &machine.parameters;
    let rows = whole_turns(recording, within, parameters.pole_pairs);
    let speed_rpm = rows.last().map_or(0.0, |row| row.speed_rpm);
    let torque_nm = mean(rows, |row| row.te_nm);
    let reference_nm = mean(rows, |row| row.te_ref_nm);
    let told_nm = mean(rows, |row| row.flowing_nm);
    let told_off_nm = rows.iter().map(|row| (row.flowing_nm - torque_nm).abs()).fold(0.0, f64::max);
    let current_squared = mean(rows, |row| row.id_a * row.id_a + row.iq_a * row.iq_a);
    let omega = speed_rpm * core::f64::consts::TAU / 60.0;
    let air_gap_w = torque_nm * omega;
    let copper_w = 1.5 * parameters.stator_resistance_ohm * current_squared;
    let shaft_w = air_gap_w - parameters.speed_loss_w(speed_rpm);
    let low = rows.iter().map(|row| row.te_nm).fold(f64::INFINITY, f64::min);
    let high = rows.iter().map(|row| row.te_nm).fold(f64::NEG_INFINITY, f64::max);
    SteadyPoint {
        speed_rpm,
        demand_nm,
        reference_nm,
        torque_nm,
        told_nm,
        told_error_percent: told_off_nm / parameters.max_torque_nm * 100.0,
        torque_error_percent: error_percent(torque_nm, demand_nm, parameters.max_torque_nm),
        reference_error_percent: error_percent(torque_nm, reference_nm, parameters.max_torque_nm),
        current_rms_a: (current_squared / 2.0).sqrt(),
        torque_ripple_nm: high - low,
        efficiency_percent: efficiency_percent(shaft_w, air_gap_w + copper_w),
        mode: rows.last().map_or("off", |row| row.mode.name()),
    }
}

/// The verdict on the mean torque in square wave; `None` if there is no square wave.
pub fn square_verdict(recording: &Recording, options: &RunOptions, largest_nm: f64) -> Option<Verdict> {
    let error = square_torque_error_percent(recording, largest_nm)?;
    let most = torque_bound(options, 0.5, 1.5);
    Some(Verdict::at_most("mean torque error in square wave in %", error, most))
}

/// Largest error of the mean torque in square wave over tenths of a second, in percent; `None` without square wave.
fn square_torque_error_percent(recording: &Recording, largest_nm: f64) -> Option<f64> {
    const WINDOW_S: f64 = 0.1;
    let end_s = recording.rows.last().map_or(0.0, |row| row.t_s);
    let windows = (0..(end_s / WINDOW_S) as usize)
        .map(|k| window(recording, k as f64 * WINDOW_S, (k + 1) as f64 * WINDOW_S));
    let square = windows.filter(|rows| !rows.is_empty() && rows.iter().all(|row| row.mode.is_whole()));
    let error = |rows: &[Row]| {
        error_percent(mean(rows, |row| row.te_nm), mean(rows, |row| row.te_ref_nm), largest_nm).abs()
    };
    worst(square.map(error))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn efficiency_is_what_comes_out_of_what_goes_in() {
        assert_eq!(efficiency_percent(90.0, 100.0), Some(90.0), "motoring");
        assert_eq!(efficiency_percent(-100.0, -90.0), Some(90.0), "braking");
        assert_eq!(efficiency_percent(-5.0, 3.0), None, "both sides feed the losses");
        assert_eq!(efficiency_percent(0.0, 0.0), None);
    }

    #[test]
    fn an_error_is_a_number_where_no_torque_is_wanted() {
        assert!((error_percent(101.0, 100.0, 1000.0) - 1.0).abs() < 1e-9);
        assert!((error_percent(-101.0, -100.0, 1000.0) - 1.0).abs() < 1e-9);
        assert_eq!(error_percent(1.0, 0.0, 1000.0), 5.0);
        assert_eq!(error_percent(1.0, 1e-15, 1000.0).round(), 5.0);
    }
}
