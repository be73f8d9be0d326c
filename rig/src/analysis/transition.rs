//! Transitions from one steady state to another, and from coasting to driving.

use super::window;
use crate::rows::mean;
use crate::trace::{Recording, Row};
use serde::Serialize;
use tractive::modulation::Mode;

/// The effect of a change on the current, compared with the steady states before and after it.
#[derive(Clone, Debug, Serialize)]
pub struct Transition {
    /// The time, in s.
    pub at_s: f64,
    /// Mechanical speed, in r/min.
    pub speed_rpm: f64,
    /// Mode at the end.
    pub mode: &'static str,
    /// Torque demanded at the end, in N·m.
    pub demand_nm: f64,
    /// Largest |phase current| from the change on, in A.
    pub peak_current_a: f64,
    /// Larger of the largest |phase current| in the 60 ms before and in the last 60 ms, in A.
    pub steady_current_a: f64,
    /// Ratio of the two.
    pub peak_ratio: f64,
    /// Mean torque of the last 60 ms minus the demand, in N·m.
    pub final_error_nm: f64,
}

/// Measures a change at `at_s` whose steady state ends at `until_s`.
pub fn transition(recording: &Recording, at_s: f64, until_s: f64) -> Transition {
    const WINDOW_S: f64 = 0.06;
    let peak = |from_s: f64, to_s: f64| {
        window(recording, from_s, to_s).iter().map(Row::peak_current_a).fold(0.0, f64::max)
    };
    let last = window(recording, until_s - WINDOW_S, until_s);
    let steady_current_a = peak(at_s - WINDOW_S, at_s).max(peak(until_s - WINDOW_S, until_s));
    let peak_current_a = peak(at_s, until_s);
    Transition {
        at_s,
        speed_rpm: last.last().map_or(0.0, |row| row.speed_rpm),
        mode: last.last().map_or("off", |row| row.mode.name()),
        demand_nm: last.last().map_or(0.0, |row| row.te_ref_nm),
        peak_current_a,
        steady_current_a,
        peak_ratio: peak_current_a / steady_current_a,
        final_error_nm: mean(last, |row| row.te_nm - row.te_ref_nm),
    }
}

/// The flying start on a coasting machine.
#[derive(Clone, Debug, Serialize)]
pub struct FlyingStart {
    /// Mechanical speed, in r/min.
    pub speed_rpm: f64,
    /// First mode in which pulses were made.
    pub first_mode: &'static str,
    /// Mode 30 ms later.
    pub then_mode: &'static str,
    /// Largest |phase current| in the 20 ms before, in A: that of the diodes.
    pub coasting_current_a: f64,
    /// Largest |phase current| in the first 30 ms, in A.
    pub catching_current_a: f64,
    /// The latter as a share of the machine's largest current.
    pub share_of_largest: f64,
    /// Largest |torque| in these 30 ms, in N·m.
    pub catching_torque_nm: f64,
    /// Torque demanded at the end of driving, in N·m.
    pub demand_nm: f64,
    /// Mean torque of the last 60 ms of driving minus that, in N·m.
    pub final_error_nm: f64,
}

/// Measures a catch at `at_s`, with no torque demanded until 30 ms later, and the drive's torque until `until_s`.
pub fn catch(recording: &Recording, (at_s, until_s): (f64, f64), max_current_a: f64) -> FlyingStart {
    const CATCH_S: f64 = 0.03;
    let peak = |rows: &[Row]| rows.iter().map(Row::peak_current_a).fold(0.0, f64::max);
    let rows = window(recording, at_s, at_s + CATCH_S);
    let driven = window(recording, until_s - 0.06, until_s);
    let catching_current_a = peak(rows);
    FlyingStart {
        speed_rpm: rows.first().map_or(0.0, |row| row.speed_rpm),
        first_mode: rows.iter().find(|row| row.mode != Mode::Off).map_or("off", |row| row.mode.name()),
        then_mode: rows.last().map_or("off", |row| row.mode.name()),
        coasting_current_a: peak(window(recording, at_s - 0.02, at_s)),
        catching_current_a,
        share_of_largest: catching_current_a / max_current_a,
        catching_torque_nm: rows.iter().map(|row| row.te_nm.abs()).fold(0.0, f64::max),
        demand_nm: driven.last().map_or(0.0, |row| row.te_ref_nm),
        final_error_nm: mean(driven, |row| row.te_nm - row.te_ref_nm),
    }
}
