//! Tables of a machine without saturation, compared with closed forms.

use super::*;
use crate::testing::{IPM, Linear, MOST_A, POLE_PAIRS, RESISTANCE_OHM, near};

const FACTOR: f64 = 1.5 * POLE_PAIRS as f64;

#[test]
fn the_universal_curve_solves_its_quartic() {
    let universal = universal();
    assert_eq!((universal.len(), universal[0], universal[64]), (65, 0.0, 1.0));
    for (k, share) in universal.iter().enumerate().take(64).skip(1) {
        let x = k as f64 / 64.0;
        let s = x / (1.0 - x);
        let i = s * share;
        near(i * (1.0 + i).powi(3), s.powi(4), 1e-12);
    }
}

#[test]
fn cells_along_an_axis() {
    for (own, cells) in [
        (3, 21),
        (7, 21),
        (10, 20),
        (19, 38),
        (20, 20),
        (21, 21),
        (63, 63),
        (64, 64),
        (65, 33),
        (128, 64),
        (129, 43),
        (200, 50),
    ] {
        assert_eq!(intervals(own), cells, "{own}");
    }
    assert_eq!(even_axis(-2.0, 4.0, 4), [-2.0, -0.5, 1.0, 2.5, 4.0]);
}

fn parameter_grid(machine: &Linear, regular: &Regular) -> ParameterGrid {
    let folder = IPM.folder(&[]);
    let mut map = folder.map;
    let nodes: Vec<_> = map.id_a.iter().flat_map(|d| map.iq_a.iter().map(|q| (*d, *q))).collect();
    for (k, (d, q)) in nodes.into_iter().enumerate() {
        (map.psi_d_wb[k], map.psi_q_wb[k]) = machine.flux_wb(d, q);
    }
    ParameterGrid::new(&CurrentGrid::new(&map), &SmoothMap::new(&map), regular)
}

#[test]
fn parameters_of_a_linear_machine_are_constants() {
    let least = Regular { psi_f_wb: 0.01, saliency_h: 0.001 };
    let grid = parameter_grid(&IPM, &least);
    assert_eq!((grid.id_a.len(), grid.iq_a.len()), (25, 21));
    assert_eq!((grid.id_a[0], grid.id_a[24], grid.iq_a[0], grid.iq_a[20]), (-22.0, 2.0, 0.0, 20.0));
    for (psi_f, saliency) in &grid.nodes {
        near(*psi_f, 0.2, 1e-9);
        near(*saliency, 0.009, 1e-9);
    }
    let without = Linear { ld_h: 0.01, lq_h: 0.01, psi_m_wb: 0.0 };
    for (psi_f, saliency) in parameter_grid(&without, &least).nodes {
        near(psi_f, 0.01, 1e-6);
        near(saliency, 0.001, 1e-6);
    }
}

/// The static inductance along d is the chord from zero d current, also next to the axis; on the axis itself it is the incremental one.
#[test]
fn static_inductances_of_a_curved_machine_are_chords() {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../tables/pmasynrm-180kw");
    let MachineFolder { map, .. } = MachineFolder::read(std::path::Path::new(folder)).unwrap();
    let smooth = SmoothMap::new(&map);
    let least = Regular { psi_f_wb: 0.0, saliency_h: f64::NEG_INFINITY };
    let ParameterGrid { id_a, iq_a, nodes } = ParameterGrid::new(&CurrentGrid::new(&map), &smooth, &least);
    let (axis, column) = (id_a.iter().position(|id| id.abs() < 1e-9).unwrap(), iq_a.len() - 1);
    let iq = iq_a[column];
    for row in [axis - 2, axis - 1, axis] {
        let (here, id) = (smooth.at(id_a[row], iq), id_a[row]);
        let chord = (here.psi_d_wb - smooth.at(0.0, iq).psi_d_wb) / id;
        let ld = if row == axis { here.ldd_h } else { chord };
        near(nodes[row * iq_a.len() + column].1, here.psi_q_wb / iq - ld, 1e-12);
    }
}

/// A surface that is itself bilinear is read exactly, also beyond the grid.
#[test]
fn parameters_are_read_between_nodes() {
    let own =
        |d: f64, q: f64| (1.0 + 0.5 * d - 0.2 * q + 0.1 * d * q, 3.0 - 0.1 * d + 0.4 * q - 0.05 * d * q);
    let (id_a, iq_a) = (vec![-4.0, -2.5, -1.0, 0.5], vec![0.0, 2.0, 4.0]);
    let nodes = id_a.iter().flat_map(|d| iq_a.iter().map(|q| own(*d, *q))).collect();
    let grid = ParameterGrid { id_a, iq_a, nodes };
    for (id, iq) in [(-4.0, 0.0), (-3.3, 1.2), (-1.0, 2.0), (0.1, 3.9), (0.5, 4.0), (1.5, 5.0), (-5.0, -1.0)]
    {
        let (found, expected) = (grid.bilinear(id, iq), own(id, iq));
        near(found.0, expected.0, 1e-12);
        near(found.1, expected.1, 1e-12);
    }
}

/// For constant parameters one pass equals the closed form, within the error of a line between two nodes of the universal curve.
#[test]
fn two_passes_are_the_best_current() {
    let grid = parameter_grid(&IPM, &Regular { psi_f_wb: 0.01, saliency_h: 0.001 });
    let universal = universal();
    for current_a in [2.0, 8.0, MOST_A, 35.0] {
        let (id, iq) = IPM.best(current_a);
        let torque_nm = IPM.torque_nm(id, iq);
        let (found_d, found_q) = grid.two_passes(torque_nm / FACTOR, (0.0, 0.0), &universal);
        near(found_d, id, 5e-3);
        near(found_q, iq, 2e-3);
        near(IPM.torque_nm(found_d, found_q), torque_nm, 1e-9);
    }
}

#[test]
fn best_currents_over_torque() {
    for (most_nm, last_nm) in [("max_torque_nm = 20.0", 21.2), ("max_torque_nm = 22.0", f64::INFINITY)] {
        let machine = IPM.folder(&[most_nm]);
        let map = SmoothMap::new(&machine.map);
        let optimum = Optimum::new(&map, &machine.parameters);
        let best = BestCurrents::new(&optimum, &machine.parameters);
        let (id, iq) = IPM.best(MOST_A);
        let last_nm = last_nm.min(IPM.torque_nm(id, iq));
        near(best.last_torque_nm(), last_nm, 1e-9);
        assert_eq!(best.0.len(), 125);
        for (k, (torque_nm, (id, iq))) in best.0.iter().enumerate() {
            near(*torque_nm, last_nm * k as f64 / 124.0, 1e-9);
            near(IPM.torque_nm(*id, *iq), *torque_nm, 1e-9);
        }
        let currents = best.currents();
        assert_eq!(currents.last_torque_nm, best.last_torque_nm());
        assert_eq!(currents.currents_a[60], best.0[60].1);
        // The trim is the error that the passes leave.
        let grid = parameter_grid(&IPM, &Regular { psi_f_wb: 0.01, saliency_h: 0.001 });
        for (node, (torque_nm, best)) in best.start(&grid, &universal(), FACTOR).iter().zip(&best.0) {
            let passed = grid.two_passes(torque_nm / FACTOR, *best, &universal());
            let trimmed = [passed.0 + f64::from(node[2]), passed.1 + f64::from(node[3])];
            assert!((trimmed[0] - best.0).abs() < 1e-6 && (trimmed[1] - best.1).abs() < 1e-6);
            assert_eq!([node[0], node[1]], [best.0 as f32, best.1 as f32]);
        }
    }
}

/// Straight lines have no second difference.
#[test]
fn flux_of_a_linear_machine_is_on_its_nodes() {
    let machine = IPM.folder(&[]);
    let grid = CurrentGrid::new(&machine.map);
    let nodes = grid.flux(&SmoothMap::new(&machine.map));
    let places = grid.id_a.iter().flat_map(|d| grid.iq_a.iter().map(|q| (*d, *q)));
    for ([psi_d, psi_q], (id, iq)) in nodes.into_iter().zip(places) {
        let (d, q) = IPM.flux_wb(id, iq);
        assert!((f64::from(psi_d) - d).abs() < 1e-7 && (f64::from(psi_q) - q).abs() < 1e-7);
    }
}

/// With squares of both currents each node lies lower by a twelfth of their second differences.
#[test]
fn flux_of_a_curved_machine_is_right_on_average() {
    let mut map = IPM.folder(&[]).map;
    let own = |d: f64, q: f64| {
        (0.2 + 0.006 * d + 1e-4 * d * d + 3e-5 * q * q, 0.015 * q + 2e-5 * d * d - 4e-5 * q * q)
    };
    let nodes: Vec<_> = map.id_a.iter().flat_map(|d| map.iq_a.iter().map(|q| (*d, *q))).collect();
    for (k, (d, q)) in nodes.into_iter().enumerate() {
        (map.psi_d_wb[k], map.psi_q_wb[k]) = own(d, q);
    }
    let grid = CurrentGrid::new(&map);
    let nodes = grid.flux(&SmoothMap::new(&map));
    // Steps of 1 A: the second differences are 2 (1e-4 + 3e-5) and 2 (2e-5 − 4e-5).
    let rows = grid.id_a.iter().enumerate().filter(|(_, id)| **id < 1.5 && **id > -21.5);
    for (r, id) in rows {
        for (c, iq) in grid.iq_a.iter().enumerate().take(20).skip(1) {
            let [psi_d, psi_q] = nodes[r * grid.iq_a.len() + c].map(f64::from);
            let (d, q) = own(*id, *iq);
            assert!((psi_d - (d - 2.6e-4 / 12.0)).abs() < 1e-7, "{id} {iq}: {psi_d} {d}");
            assert!((psi_q - (q + 0.4e-4 / 12.0)).abs() < 1e-7, "{id} {iq}: {psi_q} {q}");
        }
    }
}

#[test]
fn ratings_of_a_machine() {
    let parameters = IPM.folder(&["min_id_a = -19.0"]).parameters;
    let ratings = ratings(&parameters, 0.2);
    for (value, expected) in [
        (ratings.pole_pairs, 3.0),
        (ratings.stator_resistance_ohm, RESISTANCE_OHM),
        (ratings.max_torque_nm, 22.0),
        (ratings.max_power_w, 4e3),
        (ratings.max_current_a, MOST_A),
        (ratings.min_id_a, -19.0),
        (ratings.max_speed_rad_s, 314.159_265),
        (ratings.magnet_flux_wb, 0.2),
        (ratings.dc_link_min_v, 250.0),
        (ratings.dc_link_nominal_v, 300.0),
        (ratings.dc_link_max_v, 350.0),
        (ratings.max_switching_hz, 5e3),
        (ratings.trip_current_a, 26.0),
        (ratings.trip_dc_over_v, 402.5),
        (ratings.trip_dc_under_v, 212.5),
        (ratings.trip_speed_rad_s, 345.575_192),
        (ratings.torque_slew_nm_s, 220.0),
        (ratings.max_acceleration_rad_s2, f64::from(parameters.pole_pairs) * 22.0 * 314.159_265 / 22.0),
    ] {
        near(value.into(), expected, 1e-6);
    }
    assert_eq!(super::ratings(&parameters, -0.1).magnet_flux_wb, 0.0);
}

/// The least saliency and magnet flux are shares of what full torque has.
#[test]
fn parameters_that_vanish_are_kept_above_zero() {
    let plain = Linear { ld_h: 0.01, lq_h: 0.01, psi_m_wb: 0.3 };
    let tables = plain.folder(&[]).tables();
    for [psi_f, saliency] in tables.mtpa.parameters.nodes {
        near(f64::from(*psi_f), 0.3, 1e-5);
        near(f64::from(*saliency), 0.02 * 0.01, 1e-4);
    }
    let reluctance = Linear { ld_h: 0.004, lq_h: 0.03, psi_m_wb: 0.0 };
    let lines = ["max_torque_nm = 20.0", "max_power_w = 3e3", "rated_torque_nm = 15.0"];
    let tables = reluctance.folder(&lines).tables();
    // Full torque at 45°: T = 4.5 · 0.026 · i²/2.
    let current_a = (20.0 / 4.5 / 0.026_f64).sqrt();
    let top_wb = current_a * 0.004_f64.hypot(0.03);
    for [psi_f, saliency] in tables.mtpa.parameters.nodes {
        near(f64::from(*psi_f), 0.02 * top_wb, 1e-4);
        near(f64::from(*saliency), 0.026, 1e-5);
    }
}

/// A small part of the saliency at the largest torque is the lower limit: for a linear machine the tables have its own saliency everywhere.
#[test]
fn tables_of_a_linear_machine_have_its_saliency() {
    let tables = IPM.folder(&[]).tables();
    for (id, iq) in [(0.0, 2.0), (-8.0, 11.0), (-20.0, 20.0)] {
        let [psi_f, saliency] = tables.mtpa.parameters.at(id, iq);
        near(f64::from(psi_f), 0.2, 1e-6);
        near(f64::from(saliency), 0.009, 1e-6);
    }
}
