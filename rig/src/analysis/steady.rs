//! Steady states.

use super::{whole_turns, window};
use crate::options::RunOptions;
use crate::rows::mean;
use crate::trace::Recording;
use crate::verdict::{Verdict, torque_bound};
use serde::Serialize;
use tractive_tablegen::MachineFolder;

/// A steady operating point, averaged.
#[derive(Clone, Debug, Serialize)]
pub struct SteadyPoint {
    /// Mechanical speed, in r/min.
    pub speed_rpm: f64,
    /// Torque demanded, in N·m.
    pub demand_nm: f64,
    /// The torque that the drive says it gives of it, in N·m: less where current or voltage do not allow more.
    pub reference_nm: f64,
    /// Mean air-gap torque, in N·m.
    pub torque_nm: f64,
    /// Its error, in percent of the demand.
    pub torque_error_percent: f64,
    /// Its error, in percent of what the drive says.
    pub reference_error_percent: f64,
    /// Phase current, rms, in A.
    pub current_rms_a: f64,
    /// Peak to peak torque ripple, in N·m.
    pub torque_ripple_nm: f64,
    /// Shaft power over electrical power, with the machine folder's speed-dependent loss, in percent.
    pub efficiency_percent: f64,
    /// Mode in use at the end.
    pub mode: &'static str,
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
        torque_error_percent: (torque_nm / demand_nm - 1.0) * 100.0,
        reference_error_percent: (torque_nm / reference_nm - 1.0) * 100.0,
        current_rms_a: (current_squared / 2.0).sqrt(),
        torque_ripple_nm: high - low,
        efficiency_percent: shaft_w / (air_gap_w + copper_w) * 100.0,
        mode: rows.last().map_or("off", |row| row.mode.name()),
    }
}

/// The verdict on the mean torque in square wave; nothing where there is none.
pub fn square_verdict(recording: &Recording, options: &RunOptions) -> Option<Verdict> {
    let error = square_torque_error_percent(recording)?;
    let others = "0.5; 14 to 33 with an id trim";
    let most = torque_bound(options, 0.5, 1.5);
    Some(Verdict::at_most("mean torque error in square wave in %", error, most, others))
}

/// Largest error of the mean torque in square wave over tenths of a second, in percent; nothing without square wave.
fn square_torque_error_percent(recording: &Recording) -> Option<f64> {
    const WINDOW_S: f64 = 0.1;
    let end_s = recording.rows.last().map_or(0.0, |row| row.t_s);
    let windows = (0..(end_s / WINDOW_S) as usize)
        .map(|k| window(recording, k as f64 * WINDOW_S, (k + 1) as f64 * WINDOW_S));
    let square = windows.filter(|rows| !rows.is_empty() && rows.iter().all(|row| row.mode.is_whole()));
    square
        .map(|rows| (mean(rows, |row| row.te_nm) / mean(rows, |row| row.te_ref_nm) - 1.0).abs() * 100.0)
        .reduce(f64::max)
}
