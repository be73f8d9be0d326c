//! The closed forms of the second paper, equations (16) to (19), against the tables that stand in their place.
#![allow(missing_docs)]

use tractive::built_in::zs9::BUILT_IN;
use tractive::control::{Region, VoltageLimit, mtpa, operating_point};
use tractive::machine::Tables;

/// The ZS9's motor, which is linear: ψ_f in Wb, L_d and L_q in H.
const MOTOR: (f64, f64, f64) = (0.33, 2.5e-3, 5e-3);

/// i_d by equation (16) for a current magnitude, and by (17) for i_q, in A.
fn mtpa_id_a(is_a: f64, iq_a: f64) -> (f64, f64) {
    let (psi, ld, lq) = MOTOR;
    let part = psi / (lq - ld);
    (
        part / 4.0 - ((part / 4.0).powi(2) + is_a * is_a / 2.0).sqrt(),
        part / 2.0 - ((part / 2.0).powi(2) + iq_a * iq_a).sqrt(),
    )
}

/// i_d by equation (18) for a current magnitude, its sign mended, and by (19) for i_q, in A, at a flux linkage in Wb.
fn weakened_id_a(is_a: f64, iq_a: f64, flux_wb: f64) -> (f64, f64) {
    let (psi, ld, lq) = MOTOR;
    let root = psi * psi + (lq * lq - ld * ld) * (is_a * is_a - (flux_wb / lq).powi(2));
    (
        (ld * psi - lq * root.sqrt()) / (lq * lq - ld * ld),
        -psi / ld + (flux_wb * flux_wb - (lq * iq_a).powi(2)).sqrt() / ld,
    )
}

#[test]
fn the_tables_are_the_closed_forms_of_a_linear_motor() {
    let mut off_a = [0.0_f64; 4];
    for torque_nm in (10..=120).step_by(5) {
        let current = mtpa(torque_nm as f32, &BUILT_IN);
        let (d, q) = (f64::from(current.d), f64::from(current.q));
        let (by_16, by_17) = mtpa_id_a(d.hypot(q), q);
        off_a[0] = off_a[0].max((d - by_16).abs());
        off_a[1] = off_a[1].max((d - by_17).abs());
    }
    // The paper neglects the resistance.
    let mut tables: Tables = BUILT_IN;
    tables.ratings.stator_resistance_ohm = 0.0;
    let limit = VoltageLimit { udc_v: 200.0, depth: 1.0, filled: false };
    let voltage_v = core::f64::consts::FRAC_2_PI * 200.0;
    let mut seen = 0;
    for rpm in (700..=1_300).step_by(50) {
        let omega = f64::from(rpm) / 60.0 * core::f64::consts::TAU * 4.0;
        for torque_nm in (10..=120).step_by(10) {
            let point = operating_point(torque_nm as f32, omega as f32, &limit, &tables);
            if point.region != Region::Weakening {
                continue;
            }
            let (d, q) = (f64::from(point.current.d), f64::from(point.current.q));
            let (by_18, by_19) = weakened_id_a(d.hypot(q), q, voltage_v / omega);
            off_a[2] = off_a[2].max((d - by_18).abs());
            off_a[3] = off_a[3].max((d - by_19).abs());
            seen += 1;
        }
    }
    println!("off (16) to (19) by {off_a:.4?} A in {seen} points");
    assert!(seen > 50 && off_a[0].max(off_a[1]) < 0.001 && off_a[2].max(off_a[3]) < 0.1);
}
