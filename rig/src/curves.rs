//! The limits and curves of a machine for the live page.

use crate::machine::Machine;
use crate::report::unit;
use serde_json::{Map, Value, json};
use tractive::protection::Fault;
use tractive_tablegen::{Optimum, SmoothMap};

/// Points of a curve.
const POINTS: u32 = 40;

/// Limits and curves, in V, A, N·m and r/min.
pub fn properties(machine: &Machine) -> Value {
    let parameters = &machine.folder.parameters;
    let map = SmoothMap::new(&machine.folder.map);
    let optimum = Optimum::new(&map, parameters);
    let mtpa: Vec<_> = (0..=POINTS)
        .map(|k| optimum.least_current(parameters.max_torque_nm * f64::from(k) / f64::from(POINTS)))
        .map(|(id_a, iq_a)| [id_a, iq_a])
        .collect();
    let units: Map<_, _> =
        Fault::ALL.map(|fault| (fault.name().to_owned(), unit(fault).into())).into_iter().collect();
    json!({
        "name": machine.tables.name,
        "polePairs": parameters.pole_pairs,
        "maxTorque": parameters.max_torque_nm,
        "maxCurrent": parameters.max_current_a,
        "maxSpeed": parameters.max_speed_rpm,
        "ratedSpeed": parameters.rated_speed_rpm,
        "nominalLink": parameters.dc_link_nominal_v,
        "lowestLink": parameters.dc_link_min_v,
        "highestLink": parameters.dc_link_max_v,
        "tripCurrent": parameters.trip_current_a,
        "tripSpeed": parameters.trip_speed_rpm,
        "tripLink": [parameters.trip_dc_under_v, parameters.trip_dc_over_v],
        "resistance": parameters.stator_resistance_ohm,
        "mtpa": mtpa,
        "maxSwitching": parameters.max_switching_hz,
        "units": units,
        "flux": flux(&map, parameters.max_current_a),
    })
}

/// Flux linkages over the plane of currents, d along the rows, both axes with their ends; iq from zero on, because of its symmetry.
fn flux(map: &SmoothMap, largest_a: f64) -> Value {
    const SIDE: u32 = 24;
    let step_a = 1.2 * largest_a / f64::from(SIDE);
    let axis = |from: f64| (0..=SIDE).map(move |k| from + step_a * f64::from(k));
    let nodes = |of: fn(&tractive_tablegen::FluxPoint) -> f64| -> Vec<f64> {
        axis(-1.2 * largest_a).flat_map(|id| axis(0.0).map(move |iq| of(&map.at(id, iq)))).collect()
    };
    json!({
        "step": step_a,
        "side": SIDE + 1,
        "d": nodes(|at| at.psi_d_wb),
        "q": nodes(|at| at.psi_q_wb),
    })
}
