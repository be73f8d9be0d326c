//! Steps of the demand.

use super::{carrier_averaged, window};
use crate::rows::mean;
use crate::trace::Recording;
use serde::Serialize;

/// A step of the demand.
#[derive(Clone, Copy, Debug)]
pub struct Step {
    /// The time, in s.
    pub at_s: f64,
    /// Torque before, in N·m.
    pub from_nm: f64,
    /// Torque after, in N·m.
    pub to_nm: f64,
    /// Time until which the torque holds, in s.
    pub until_s: f64,
    /// Carrier period over which torque is averaged, in s.
    pub carrier_s: f64,
}

/// The response to a step. Torque is averaged over one carrier period, centred.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct StepResponse {
    /// Torque before, in N·m.
    pub from_nm: f64,
    /// Torque after, in N·m.
    pub to_nm: f64,
    /// Time from the step to 90 % of it, in ms.
    pub t90_ms: f64,
    /// Overshoot beyond the final mean, as a share of the step, in percent: of the averaged torque, like t90 and the settling times.
    pub overshoot_percent: f64,
    /// Time until the torque stays within 5 % of the step about the final mean, in ms.
    pub settling_5_percent_ms: f64,
    /// The same for 2 %.
    pub settling_2_percent_ms: f64,
    /// Mean of the last 40 ms less the demand, in N·m.
    pub final_error_nm: f64,
    /// Lowest instantaneous torque, ripple included, in the first 10 ms, in N·m.
    pub lowest_nm: f64,
    /// Highest instantaneous torque in the same time, in N·m.
    pub highest_nm: f64,
}

/// Measures a step.
pub fn step_response(recording: &Recording, step: &Step) -> StepResponse {
    let torque = carrier_averaged(recording, (step.at_s, step.until_s), step.carrier_s, |row| row.te_nm);
    let final_mean = mean(window(recording, step.until_s - 0.04, step.until_s), |row| row.te_nm);
    let size = step.to_nm - step.from_nm;
    let start = final_mean - size;
    let progress = |torque_nm: f64| (torque_nm - start) / size;
    let reached = torque.iter().find(|(_, value)| progress(*value) >= 0.9);
    let settled = |band: f64| {
        let last_outside = torque.iter().rev().find(|(_, value)| (progress(*value) - 1.0).abs() > band);
        last_outside.map_or(0.0, |(t_s, _)| (t_s - step.at_s) * 1e3)
    };
    let first = window(recording, step.at_s, step.at_s + 0.01).iter().map(|row| row.te_nm);
    let highest = torque.iter().map(|(_, value)| progress(*value)).fold(0.0, f64::max);
    StepResponse {
        from_nm: step.from_nm,
        to_nm: step.to_nm,
        t90_ms: reached.map_or(f64::INFINITY, |(t_s, _)| (t_s - step.at_s) * 1e3),
        overshoot_percent: (highest - 1.0) * 100.0,
        settling_5_percent_ms: settled(0.05),
        settling_2_percent_ms: settled(0.02),
        final_error_nm: final_mean - step.to_nm,
        lowest_nm: first.clone().fold(f64::INFINITY, f64::min),
        highest_nm: first.fold(f64::NEG_INFINITY, f64::max),
    }
}
