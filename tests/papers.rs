//! The closed forms of the second paper, equations (16) to (19), against the tables that stand in their place.
#![allow(missing_docs)]

use tractive::built_in::zs9::BUILT_IN;
use tractive::control::{OperatingPoint, Region, VoltageLimit, mtpa, operating_point};
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

/// A line of the page's table: speed in r/min, torque in N·m, i_q, i_d of the tables, and by how much those of both closed forms differ, in A.
fn line(forms: &str, rpm: Option<u32>, torque_nm: u32, (d, q): (f64, f64), closed: (f64, f64)) -> String {
    let rpm = rpm.map_or("MTPA".to_owned(), |rpm| rpm.to_string());
    let [first, second] = [closed.0 - d, closed.1 - d].map(|off| format!("{:.4}", off + 0.0));
    format!("| {forms} | {rpm} | {torque_nm} | {q:.2} | {d:.2} | {first} | {second} |")
}

/// The page has each line of the closed forms beside the tables.
#[test]
fn the_page_has_the_closed_forms_beside_the_tables() {
    const PAGE: &str = include_str!("../docs/papers.md");
    let mut lines = Vec::new();
    for torque_nm in (20..=120).step_by(20) {
        let current = mtpa(torque_nm as f32, &BUILT_IN);
        let (d, q) = (f64::from(current.d), f64::from(current.q));
        lines.push(line("(16), (17)", None, torque_nm, (d, q), mtpa_id_a(d.hypot(q), q)));
    }
    let tables = without_resistance();
    for (rpm, torque_nm) in [(900, 40), (900, 80), (900, 120), (1_300, 20), (1_300, 40), (1_300, 60)] {
        let (point, flux_wb) = weakened(rpm, torque_nm, &tables);
        assert_eq!(point.region, Region::Weakening, "{rpm} r/min, {torque_nm} N·m");
        let (d, q) = (f64::from(point.current.d), f64::from(point.current.q));
        lines.push(line("(18), (19)", Some(rpm), torque_nm, (d, q), weakened_id_a(d.hypot(q), q, flux_wb)));
    }
    let missing: Vec<_> = lines.iter().filter(|line| !PAGE.lines().any(|one| one == *line)).collect();
    assert!(missing.is_empty(), "docs/papers.md lacks\n{missing:#?}");
}

/// The motor without resistance, which the paper neglects.
fn without_resistance() -> Tables {
    let mut tables: Tables = BUILT_IN;
    tables.ratings.stator_resistance_ohm = 0.0;
    tables
}

/// The tables' operating point on a link of 200 V in r/min and N·m, and the flux linkage that the voltage allows there, in Wb.
fn weakened(rpm: u32, torque_nm: u32, tables: &Tables) -> (OperatingPoint, f64) {
    let limit = VoltageLimit { udc_v: 200.0, modulation_index: 1.0, filled: false };
    let omega = f64::from(rpm) / 60.0 * core::f64::consts::TAU * 4.0;
    let point = operating_point(torque_nm as f32, omega as f32, &limit, tables);
    (point, core::f64::consts::FRAC_2_PI * 200.0 / omega)
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
    let tables = without_resistance();
    let mut seen = 0;
    for rpm in (700..=1_300).step_by(50) {
        for torque_nm in (10..=120).step_by(10) {
            let (point, flux_wb) = weakened(rpm, torque_nm, &tables);
            if point.region != Region::Weakening {
                continue;
            }
            let (d, q) = (f64::from(point.current.d), f64::from(point.current.q));
            let (by_18, by_19) = weakened_id_a(d.hypot(q), q, flux_wb);
            off_a[2] = off_a[2].max((d - by_18).abs());
            off_a[3] = off_a[3].max((d - by_19).abs());
            seen += 1;
        }
    }
    println!("off (16) to (19) by {off_a:.4?} A in {seen} points");
    assert!(seen > 50 && off_a[0].max(off_a[1]) < 0.001 && off_a[2].max(off_a[3]) < 0.1);
}
