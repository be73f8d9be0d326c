//! The demagnetisation limit, and the operating points that a machine must still reach with it.

use crate::weakening::at_id;
use crate::{InputError, MachineFolder, Optimum, Parameters, SmoothMap};
use libm::hypot;
use std::f64::consts::{FRAC_2_PI, TAU};
use std::path::Path;

/// Number of i_d values that are tried, from zero to the largest current.
const STEPS: usize = 400;
/// Bisections between two of these values.
const HALVINGS: u32 = 40;

/// An operating point that the limit must allow.
struct Point {
    /// The keys that require it.
    what: &'static str,
    /// Torque, in N·m.
    torque_nm: f64,
    /// Electrical angular speed, in rad/s.
    omega: f64,
    /// Largest voltage, in V.
    voltage_v: f64,
}

/// The largest torque at standstill; the rated point at the nominal link voltage, and no torque at the largest speed at the lowest one, in six-step.
fn points(parameters: &Parameters) -> [Point; 3] {
    let omega = |speed_rpm: f64| speed_rpm * TAU / 60.0 * f64::from(parameters.pole_pairs);
    [
        Point {
            what: "max_torque_nm",
            torque_nm: parameters.max_torque_nm,
            omega: 0.0,
            voltage_v: f64::INFINITY,
        },
        Point {
            what: "rated_torque_nm at rated_speed_rpm on dc_link_nominal_v",
            torque_nm: parameters.rated_torque_nm,
            omega: omega(parameters.rated_speed_rpm),
            voltage_v: FRAC_2_PI * parameters.dc_link_nominal_v,
        },
        Point {
            what: "no torque at max_speed_rpm on dc_link_min_v",
            torque_nm: 0.0,
            omega: omega(parameters.max_speed_rpm),
            voltage_v: FRAC_2_PI * parameters.dc_link_min_v,
        },
    ]
}

/// Checks a given limit: it must allow every point that the largest current alone allows.
///
/// # Errors
/// Names the key, its value, the highest value allowed and what requires it.
pub(crate) fn check(machine: &MachineFolder, file: &Path) -> Result<(), InputError> {
    let parameters = &machine.parameters;
    if parameters.least_id_a().is_infinite() {
        return Ok(());
    }
    let map = SmoothMap::new(&machine.map);
    for point in points(parameters) {
        let Some(needed_a) = highest_id_a(&point, &map, parameters) else { continue };
        if parameters.min_id_a > needed_a {
            let problem = format!(
                "min_id_a: {}: must be at or below {:.1}, which {} takes",
                parameters.min_id_a,
                (10.0 * needed_a).floor() / 10.0,
                point.what
            );
            return Err(InputError::new(file, parameters.line_of("min_id_a"), problem));
        }
    }
    Ok(())
}

/// The highest i_d, up to 0, at which a current gives the point, in A; `None` if the largest current does not reach it.
fn highest_id_a(point: &Point, map: &SmoothMap, parameters: &Parameters) -> Option<f64> {
    let most_a = parameters.max_current_a;
    let optimum = Optimum::of(map, parameters.pole_pairs, most_a);
    let gives = |id: f64| {
        let (_, iq) = at_id(id, point.torque_nm, &optimum, most_a);
        let flux = map.at(id, iq);
        let resistance = parameters.stator_resistance_ohm;
        let volts =
            (resistance * id - point.omega * flux.psi_q_wb, resistance * iq + point.omega * flux.psi_d_wb);
        optimum.torque_nm(id, iq) >= point.torque_nm * (1.0 - 1e-9)
            && hypot(id, iq) <= most_a * (1.0 + 1e-9)
            && hypot(volts.0, volts.1) <= point.voltage_v
    };
    let mut tried: Vec<f64> = (0..=STEPS).map(|k| -most_a * k as f64 / STEPS as f64).collect();
    // The only one at the largest current.
    tried.push(optimum.least_current(point.torque_nm.min(optimum.most_torque_nm())).0);
    tried.sort_by(|a, b| b.total_cmp(a));
    let first = tried.iter().position(|id| gives(*id))?;
    let (mut low, mut high) = (tried[first], tried[first.saturating_sub(1)]);
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if gives(middle) { low = middle } else { high = middle }
    }
    Some(low.min(0.0))
}

#[cfg(test)]
mod tests;
