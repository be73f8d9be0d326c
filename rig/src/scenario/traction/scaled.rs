//! Quantities of the machine that the scenarios were written for, on any machine.

use super::plan::STEP_S;
use crate::machine::Machine;

/// A speed of the machine that the scenarios were written for, in r/min, as the same share of this machine's largest one.
pub(super) fn scaled_rpm(speed_rpm: f64, machine: &Machine) -> f64 {
    speed_rpm * (machine.folder.parameters.max_speed_rpm / 6000.0)
}

/// A torque of that machine, in N·m, as the same share of this machine's largest one.
pub(super) fn scaled_nm(torque_nm: f64, machine: &Machine) -> f64 {
    torque_nm * (machine.folder.parameters.max_torque_nm / 1235.0)
}

/// A speed of a machine rated at 2,000 r/min, in r/min, as the same share of this machine's rated one.
pub(super) fn of_rated_rpm(speed_rpm: f64, machine: &Machine) -> f64 {
    speed_rpm * (machine.folder.parameters.rated_speed_rpm / 2_000.0)
}

/// Slope of the speed in a sweep, in r/min a second.
pub(super) fn sweep_rpm_s(machine: &Machine) -> f64 {
    of_rated_rpm(250.0, machine)
}

/// Voltage of the machine without current at a speed in r/min, peak line to line, in V.
pub(crate) fn emf_v(speed_rpm: f64, machine: &Machine) -> f64 {
    let turns_s = speed_rpm.abs() / 60.0 * f64::from(machine.folder.parameters.pole_pairs);
    3.0_f64.sqrt() * core::f64::consts::TAU * turns_s * f64::from(machine.tables.ratings.magnet_flux_wb)
}

/// Ratio of this machine's stator frequencies to those of the machine that the scenarios were written for, at least 1. A ramp over the
/// same share of the speed takes longer by this factor; a quicker one would count as a lost angle.
pub(super) fn ramp_scale(machine: &Machine) -> f64 {
    let parameters = &machine.folder.parameters;
    let speeds = (parameters.max_speed_rpm / 6000.0).max(parameters.rated_speed_rpm / 2000.0);
    (speeds * (f64::from(parameters.pole_pairs) / 4.0)).max(1.0)
}

/// Ratio of a time in which torque changes to that of the machine that the scenarios were written for. The slower one counts: the link
/// driving flux linkage into the machine, measured by full power over full torque, or the carriers following each other.
pub(super) fn time_scale(machine: &Machine) -> f64 {
    let parameters = &machine.folder.parameters;
    let omega = |power_w: f64, torque_nm: f64, pole_pairs: f64| power_w / torque_nm * pole_pairs;
    let own = omega(parameters.max_power_w, parameters.max_torque_nm, f64::from(parameters.pole_pairs));
    let flux = omega(246.4e3, 1235.0, 4.0) / own;
    flux.max(900.0 / parameters.max_switching_hz)
}

/// Step of the rows over which the mean of a carrier is taken, in s: at least as many rows in a carrier as at 900 Hz.
pub(super) fn carrier_step_s(machine: &Machine) -> f64 {
    // Each gives whole ticks.
    const PARTS: [u32; 6] = [1, 2, 5, 10, 25, 50];
    let carriers = machine.folder.parameters.max_switching_hz / 900.0;
    let parts = PARTS.into_iter().find(|parts| f64::from(*parts) >= carriers).unwrap_or(125);
    STEP_S / f64::from(parts)
}
