//! The smooth map against the closed form that the reference map was made from.
#![allow(missing_docs)]

mod common;

use common::{Folder, REFERENCE, axis, good_toml, linear, reference_folder};
use tractive_tablegen::{FluxPoint, MachineFolder, SmoothMap};

const MAX_CURRENT_A: f64 = 233.0;

fn reference() -> SmoothMap {
    SmoothMap::new(&MachineFolder::read(&reference_folder()).unwrap().map)
}

/// Points of a disc that lie on no grid of whole amperes; id up to the grid's edge.
fn disc() -> impl Iterator<Item = (f64, f64)> {
    let rings = (1..=120).map(|k| MAX_CURRENT_A * f64::from(k) / 120.0);
    let points = rings.flat_map(|radius| {
        (0..360).map(move |k| {
            (radius * f64::from(k).to_radians().cos(), radius * f64::from(k).to_radians().sin())
        })
    });
    points.filter(|(id, _)| *id <= 50.0)
}

fn torque_nm(at: &FluxPoint, id: f64, iq: f64) -> f64 {
    6.0 * (at.psi_d_wb * iq - at.psi_q_wb * id)
}

#[test]
fn torque_is_that_of_the_closed_form() {
    let map = reference();
    let (mut worst, mut worst_flux, mut worst_share) = (0.0_f64, 0.0_f64, 0.0_f64);
    for (id, iq) in disc() {
        let at = map.at(id, iq);
        let (psi_d, psi_q) = REFERENCE.flux(id, iq);
        let truth = REFERENCE.torque_nm(4, id, iq);
        let error = (torque_nm(&at, id, iq) - truth).abs();
        worst = worst.max(error);
        worst_share = worst_share.max(error / (2e-4 * truth.abs()).max(0.1));
        worst_flux = worst_flux.max((at.psi_d_wb - psi_d).abs().max((at.psi_q_wb - psi_q).abs()));
    }
    println!("torque {worst:.4} N·m ({worst_share:.3} of the bound), flux linkage {worst_flux:.2e} Wb");
    assert!(worst_share < 1.0, "{worst} N·m: 0.02 % or 0.1 N·m");
    assert!(worst_flux < 5e-5, "{worst_flux} Wb");
}

#[test]
fn the_jacobian_is_the_slope() {
    let map = reference();
    let h = 1e-4;
    let (mut worst, mut reciprocity, mut model) = (0.0_f64, 0.0_f64, 0.0_f64);
    for (id, iq) in disc() {
        let at = map.at(id, iq);
        let (right, left) = (map.at(id + h, iq), map.at(id - h, iq));
        let (up, down) = (map.at(id, iq + h), map.at(id, iq - h));
        let slope = |a: f64, b: f64| (a - b) / (2.0 * h);
        for (value, slope) in [
            (at.ldd_h, slope(right.psi_d_wb, left.psi_d_wb)),
            (at.lqd_h, slope(right.psi_q_wb, left.psi_q_wb)),
            (at.ldq_h, slope(up.psi_d_wb, down.psi_d_wb)),
            (at.lqq_h, slope(up.psi_q_wb, down.psi_q_wb)),
        ] {
            worst = worst.max((value - slope).abs());
        }
        reciprocity = reciprocity.max((at.ldq_h - at.lqd_h).abs());
        let truth = (REFERENCE.flux(id + h, iq).0 - REFERENCE.flux(id - h, iq).0) / (2.0 * h);
        model = model.max((at.ldd_h - truth).abs());
    }
    println!("slope {worst:.2e} H, reciprocity {reciprocity:.2e} H, incremental Ld {model:.2e} H");
    assert!(worst < 1e-7 && reciprocity < 1e-5 && model < 2e-5);
}

#[test]
fn it_is_even_in_iq_and_smooth_across_zero() {
    let map = reference();
    for (id, iq) in disc() {
        let (a, b) = (map.at(id, iq), map.at(id, -iq));
        assert!((a.psi_d_wb - b.psi_d_wb).abs() < 1e-12 && (a.psi_q_wb + b.psi_q_wb).abs() < 1e-12);
        assert!((a.ldd_h - b.ldd_h).abs() < 1e-12 && (a.ldq_h + b.ldq_h).abs() < 1e-12);
    }
    for id in axis(-230.0, 3.7, 60) {
        let at = map.at(id, 0.0);
        assert!(at.psi_q_wb.abs() < 1e-12 && at.ldq_h.abs() < 1e-9, "{id}");
    }
}

#[test]
fn nodes_are_kept() {
    let machine = MachineFolder::read(&reference_folder()).unwrap();
    let map = SmoothMap::new(&machine.map);
    for (r, id) in machine.map.id_a.iter().enumerate() {
        for (c, iq) in machine.map.iq_a.iter().enumerate() {
            let at = map.at(*id, *iq);
            let k = r * machine.map.iq_a.len() + c;
            assert!((at.psi_d_wb - machine.map.psi_d_wb[k]).abs() < 1e-12);
            assert!((at.psi_q_wb - machine.map.psi_q_wb[k]).abs() < 1e-12);
        }
    }
}

#[test]
fn beyond_the_grid_it_goes_on_in_a_straight_line() {
    let map = reference();
    for (edge, outside) in [
        ((50.0, 100.0), (80.0, 100.0)),
        ((-250.0, 30.0), (-300.0, 30.0)),
        ((-100.0, 250.0), (-100.0, 400.0)),
        ((-250.0, -30.0), (-400.0, -30.0)),
    ] {
        let (at, far) = (map.at(edge.0, edge.1), map.at(outside.0, outside.1));
        let (dd, dq) = (outside.0 - edge.0, outside.1 - edge.1);
        assert!((far.psi_d_wb - (at.psi_d_wb + at.ldd_h * dd + at.ldq_h * dq)).abs() < 1e-12);
        assert!((far.psi_q_wb - (at.psi_q_wb + at.lqd_h * dd + at.lqq_h * dq)).abs() < 1e-12);
    }
}

#[test]
fn beyond_the_grid_the_jacobian_is_the_slope_too_and_one_flux_has_one_current() {
    let map = reference();
    for id in (-12..=6).map(|k| 50.0 * f64::from(k) + 1.0) {
        for iq in (-10..=10).map(|k| 60.0 * f64::from(k) + 1.0) {
            const STEP_A: f64 = 1e-3;
            let at = map.at(id, iq);
            let along_d = (map.at(id - STEP_A, iq), map.at(id + STEP_A, iq));
            let along_q = (map.at(id, iq - STEP_A), map.at(id, iq + STEP_A));
            let slope = |high: f64, low: f64| (high - low) / (2.0 * STEP_A);
            assert!((slope(along_d.1.psi_d_wb, along_d.0.psi_d_wb) - at.ldd_h).abs() < 1e-8);
            assert!((slope(along_q.1.psi_d_wb, along_q.0.psi_d_wb) - at.ldq_h).abs() < 1e-8);
            assert!((slope(along_d.1.psi_q_wb, along_d.0.psi_q_wb) - at.lqd_h).abs() < 1e-8);
            assert!((slope(along_q.1.psi_q_wb, along_q.0.psi_q_wb) - at.lqq_h).abs() < 1e-8);
            assert!(at.ldd_h * at.lqq_h > at.ldq_h * at.lqd_h, "{id} {iq} {at:?}");
        }
    }
}

#[test]
fn the_inverse_finds_the_current_from_far_away() {
    let map = reference();
    for (id, iq) in disc() {
        let at = map.at(id, iq);
        for start in [(0.0, 0.0), (-230.0, 0.0), (0.0, 200.0), (-100.0, -200.0)] {
            let (found_d, found_q) = map.inverse(at.psi_d_wb, at.psi_q_wb, start).expect("converges");
            assert!((found_d - id).abs() < 1e-6 && (found_q - iq).abs() < 1e-6, "{id} {iq} from {start:?}");
        }
    }
    assert_eq!(map.inverse(f64::NAN, 0.0, (0.0, 0.0)), None);
}

#[test]
fn a_linear_machine_stays_linear() {
    let truth = linear(0.002, 0.003, 0.3);
    let text = truth.map(&axis(-250.0, 10.0, 27), &axis(0.0, 10.0, 26));
    let toml = good_toml().replace("max_torque_nm = 1235.0", "max_torque_nm = 500.0");
    let toml = toml.replace("rated_torque_nm = 859.4", "rated_torque_nm = 400.0");
    let map = SmoothMap::new(&Folder::new(&toml, &text).read().unwrap().map);
    for (id, iq) in disc() {
        let (at, (psi_d, psi_q)) = (map.at(id, iq), truth.flux(id, iq));
        assert!((at.psi_d_wb - psi_d).abs() < 1e-8 && (at.psi_q_wb - psi_q).abs() < 1e-8);
        assert!((at.ldd_h - 0.002).abs() < 1e-8 && (at.lqq_h - 0.003).abs() < 1e-8);
        assert!(at.ldq_h.abs() < 1e-8);
    }
}
