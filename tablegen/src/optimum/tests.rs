//! The least current compared with its closed form, on machines without saturation.

use super::*;
use crate::testing::{IPM, Linear, MOST_A, POLE_PAIRS, near};
use std::f64::consts::FRAC_PI_4;

#[test]
fn the_largest_value_is_found_wherever_it_lies() {
    for at in [-1.0, -0.73, 0.0, 0.31, 2.0] {
        let found = largest(-1.0, 2.0, |x| -(x - at) * (x - at));
        assert!((found - at).abs() < 1e-6, "{found}, not {at}");
    }
    // A corner is found just as precisely.
    let found = largest(-1.0, 2.0, |x: f64| -(x - 0.123_456_789).abs());
    assert!((found - 0.123_456_789).abs() < 1e-10, "{found}");
}

#[test]
fn the_best_angle_is_the_closed_forms() {
    let machine = IPM.folder(&[]);
    let map = SmoothMap::new(&machine.map);
    let optimum = Optimum::new(&map, &machine.parameters);
    for current_a in [0.5, 3.0, 12.0, MOST_A] {
        let (id, iq) = IPM.best(current_a);
        let (torque, angle) = optimum.at_magnitude(current_a);
        near(torque, IPM.torque_nm(id, iq), 1e-9);
        near(angle, (-id).atan2(iq), 1e-6);
        let (found_id, found_iq) = optimum.least_current(torque);
        near(found_id, id, 1e-5);
        near(found_iq, iq, 1e-5);
    }
    let (id, iq) = IPM.best(MOST_A);
    near(optimum.most_torque_nm(), IPM.torque_nm(id, iq), 1e-9);
    assert_eq!((optimum.least_current(0.0), optimum.least_current(-5.0)), ((0.0, 0.0), (0.0, 0.0)));
}

/// With a larger inductance along the magnets the optimum lies at i_d > 0.
#[test]
fn the_best_angle_may_lie_on_the_other_side() {
    let other = Linear { ld_h: 0.012, lq_h: 0.006, psi_m_wb: 0.2 };
    let machine = IPM.folder(&[]);
    let mut map = machine.map.clone();
    let nodes: Vec<_> = map.id_a.iter().flat_map(|id| map.iq_a.iter().map(|iq| (*id, *iq))).collect();
    for (k, (id, iq)) in nodes.into_iter().enumerate() {
        (map.psi_d_wb[k], map.psi_q_wb[k]) = other.flux_wb(id, iq);
    }
    let map = SmoothMap::new(&map);
    let optimum = Optimum::of(&map, 3, MOST_A);
    let (id, iq) = other.best(10.0);
    assert!(id > 0.0);
    let (torque, angle) = optimum.at_magnitude(10.0);
    near(torque, other.torque_nm(id, iq), 1e-9);
    near(angle, -id.atan2(iq), 1e-6);
    assert!(angle > -FRAC_PI_4);
}

/// The demagnetisation limit holds: if the optimum lies beyond it, i_d stays at the limit.
#[test]
fn least_current_keeps_the_least_id() {
    let machine = IPM.folder(&[
        "min_id_a = -5.0",
        "max_torque_nm = 15.0",
        "rated_torque_nm = 10.0",
        "dc_link_min_v = 400.0",
        "dc_link_nominal_v = 400.0",
        "dc_link_max_v = 400.0",
    ]);
    let map = SmoothMap::new(&machine.map);
    let optimum = Optimum::new(&map, &machine.parameters);
    for current_a in [2.0, 4.0, 9.0, 15.0, MOST_A] {
        let (id, _) = IPM.best(current_a);
        let id = id.max(-5.0);
        let iq = (current_a * current_a - id * id).sqrt();
        let (torque, angle) = optimum.at_magnitude(current_a);
        near(torque, IPM.torque_nm(id, iq), 1e-8);
        near(angle, (-id).atan2(iq), 1e-6);
        let (found_id, found_iq) = optimum.least_current(torque);
        near(found_id, id, 1e-5);
        near(found_iq, iq, 1e-5);
    }
}

/// Without saturation the torque's curvature over flux linkage comes from the saliency alone: the torque is the product of both axes, so across the
/// flux linkage it is the negative of that along.
#[test]
fn the_curvature_is_the_saliencys() {
    let machine = IPM.folder(&[]);
    let map = SmoothMap::new(&machine.map);
    let optimum = Optimum::new(&map, &machine.parameters);
    for current in [(-8.0, 5.0), (-2.0, 14.0), (0.0, 9.0)] {
        let (psi_d, psi_q) = IPM.flux_wb(current.0, current.1);
        let product = psi_d * psi_q / (psi_d * psi_d + psi_q * psi_q);
        let wanted = 1.5 * f64::from(POLE_PAIRS) * (1.0 / IPM.lq_h - 1.0 / IPM.ld_h) * product;
        for ripple_wb in [1e-3, 5e-3] {
            let [along, across] = optimum.curvature(current, ripple_wb);
            near(along / wanted, 1.0, 1e-4);
            near(across / wanted, -1.0, 1e-4);
        }
    }
    let mut map = machine.map.clone();
    map.psi_d_wb.iter_mut().for_each(|psi_d| *psi_d -= IPM.psi_m_wb);
    let map = SmoothMap::new(&map);
    let at_rest = Optimum::of(&map, POLE_PAIRS, MOST_A).curvature((0.0, 0.0), 1e-3);
    assert_eq!(at_rest, [0.0; 2], "no flux linkage");
}
