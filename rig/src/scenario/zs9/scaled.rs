//! Quantities of the paper's machine, for which the scenarios were written, on any machine.

use crate::machine::Machine;
use crate::options::within;

/// The paper's machine, in tables/.
pub const MACHINE: &str = "ipm-zs9";
/// Rated speed of the paper's machine in r/min, and its largest torque in N·m.
const RATED_RPM: f64 = 1_300.0;
const MAX_NM: f64 = 120.0;

/// A speed of that machine, in r/min, as the same share of this machine's rated one.
pub fn scaled_rpm(speed_rpm: f64, machine: &Machine) -> f64 {
    speed_rpm * (machine.folder.parameters.rated_speed_rpm / RATED_RPM)
}

/// A torque of that machine, in N·m, as the same share of this machine's largest one.
pub fn scaled_nm(torque_nm: f64, machine: &Machine) -> f64 {
    torque_nm * (machine.folder.parameters.max_torque_nm / MAX_NM)
}

/// An inertia of that machine, in kg·m², scaled so that the same shares of torque take this one as long to the same shares of speed.
pub fn scaled_kg_m2(inertia_kg_m2: f64, machine: &Machine) -> f64 {
    inertia_kg_m2 * (scaled_nm(1.0, machine) / scaled_rpm(1.0, machine))
}

/// A bound that is known to hold for the paper's machine, or that of any other one.
pub fn known(machine: &Machine, paper: f64, other: f64) -> f64 {
    if machine.is(MACHINE) { paper } else { other }
}

/// Largest deviation of link and capacitors with a machine other than the paper's, in %: network, source and carrier are the same for all.
pub const LINK_OFF_PERCENT: f64 = 3.0;

/// Load of the paper's motors before the load of one of them steps, in N·m.
pub const LOAD_NM: f64 = 60.0;

/// Share of the largest torque that a motor may carry after a step of its load: the rest brings its speed back.
const CARRIED_SHARE: f64 = 0.95;

/// The check that the machine can carry a step of the load, in N·m, and recover its speed.
///
/// # Errors
/// Names the option, and what is allowed.
pub fn check_step(step_nm: f64, machine: &Machine) -> anyhow::Result<()> {
    let load_nm = scaled_nm(LOAD_NM, machine);
    let most_nm = CARRIED_SHARE * machine.folder.parameters.max_torque_nm;
    within(&[("--step", step_nm, -most_nm - load_nm, most_nm - load_nm)])
}
