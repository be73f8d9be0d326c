//! The second paper's currents: figures 12 and 13. Its motor is linear, so the ellipses are known in closed form.

use super::super::ink::draw;
use super::super::loci::Loci;
use super::super::sheet::{Axis, BLACK, BLUE, GREY, ORANGE, Panel, Point, RED, Side, VIOLET, number};
use crate::machine::Machine;
use anyhow::Result;
use core::f64::consts::{FRAC_2_PI, TAU};
use tractive_tablegen::SmoothMap;

/// A motor of constant inductances.
struct Linear {
    psi_f_wb: f64,
    ld_h: f64,
    lq_h: f64,
    pole_pairs: f64,
    voltage_v: f64,
}

impl Linear {
    fn of(machine: &Machine) -> Self {
        let at = SmoothMap::new(&machine.folder.map).at(0.0, 0.0);
        let parameters = &machine.folder.parameters;
        Self {
            psi_f_wb: at.psi_d_wb,
            ld_h: at.ldd_h,
            lq_h: at.lqq_h,
            pole_pairs: f64::from(parameters.pole_pairs),
            voltage_v: parameters.dc_link_nominal_v * FRAC_2_PI,
        }
    }

    /// The current at an angle on the circle of a flux linkage.
    fn at(&self, flux_wb: f64, degrees: f64) -> Point {
        let (sin, cos) = degrees.to_radians().sin_cos();
        ((flux_wb * cos - self.psi_f_wb) / self.ld_h, flux_wb * sin / self.lq_h)
    }

    fn flux_wb(&self, rpm: f64) -> f64 {
        self.voltage_v / (rpm / 60.0 * TAU * self.pole_pairs)
    }

    /// Equation (15) at a speed.
    fn ellipse(&self, rpm: f64) -> impl Iterator<Item = Point> {
        (0..=360).map(move |k| self.at(self.flux_wb(rpm), f64::from(k)))
    }

    fn torque(&self, (d, q): Point) -> f64 {
        1.5 * self.pole_pairs * (self.psi_f_wb + (self.ld_h - self.lq_h) * d) * q
    }

    /// The most torque on the ellipse of a speed.
    fn mtpv(&self, rpm: f64) -> Point {
        let on = (0..=720).map(|k| self.at(self.flux_wb(rpm), 0.25 * f64::from(k)));
        on.fold((0.0, 0.0), |best, point| if self.torque(point) > self.torque(best) { point } else { best })
    }
}

/// Figure 12: the ellipse shrinks as speed grows; the current has to be in it and in the circle.
pub fn limits(machine: &Machine) -> Result<String> {
    let (motor, loci) =
        (Linear::of(machine), Loci::new(machine, machine.folder.parameters.dc_link_nominal_v));
    let largest = loci.largest_a();
    let mut panel = plane("Voltage ellipses by speed, and the circle of the current", largest, -largest);
    let fastest = motor.ellipse(1500.0).filter(|(d, q)| d.hypot(*q) <= largest);
    let mut both: Vec<Point> = fastest.collect();
    let edge = (0..=360)
        .map(|k| f64::from(k).to_radians().sin_cos())
        .map(|(sin, cos)| (largest * cos, largest * sin));
    let inside = |point: &Point| {
        let flux = (motor.psi_f_wb + motor.ld_h * point.0).hypot(motor.lq_h * point.1);
        flux <= motor.flux_wb(1500.0)
    };
    both.extend(edge.filter(inside));
    // Convex, so its corners are in the order of their angles about a point within.
    let middle = (-0.8 * largest, 0.0);
    both.sort_by(|a, b| {
        let angle = |point: &Point| (point.1 - middle.1).atan2(point.0 - middle.0);
        angle(a).total_cmp(&angle(b))
    });
    panel.area(both, BLUE, 0.15);
    for rpm in [700.0, 900.0, 1100.0, 1300.0, 1500.0] {
        panel.line(motor.ellipse(rpm), BLUE, 1.3);
        let right = motor.at(motor.flux_wb(rpm), 0.0);
        let (aside, side) = if right.0 < 0.45 * largest { (3.0, Side::Right) } else { (-3.0, Side::Left) };
        panel.words((right.0 + aside, -4.0), &number(rpm), side, BLUE);
    }
    let whole = (0..=180).map(|k| (2.0 * f64::from(k)).to_radians().sin_cos());
    panel.line(whole.map(|(sin, cos)| (largest * cos, largest * sin)), RED, 1.8);
    panel.words((0.72 * largest, 0.8 * largest), &format!("{} A", number(largest)), Side::Right, RED);
    panel.spot(motor.at(0.0, 0.0), BLACK);
    panel.words((motor.at(0.0, 0.0).0, 7.0), "(−ψ_{f}/L_{d}, 0)", Side::Middle, BLACK);
    panel.names = vec![
        ("voltage limit at a speed in r/min".to_owned(), BLUE),
        ("current limit".to_owned(), RED),
        ("shaded: both kept at 1,500 r/min".to_owned(), GREY),
    ];
    draw((900, 640), &[panel])
}

fn plane(title: &str, largest: f64, low: f64) -> Panel {
    let x = Axis::of("i_{d} in A", -2.1 * largest, 1.1 * largest);
    let y = Axis::of("i_{q} in A", 1.08 * low, 1.08 * largest);
    Panel::plane((0.0, 0.0, 900.0, 640.0), title, x, y)
}

/// Figure 13: the current's path from standstill up: MTPA to A1, then along the circle. MTPV (A2 to A4) lies outside it.
pub fn ways(machine: &Machine) -> Result<String> {
    let parameters = &machine.folder.parameters;
    let (motor, loci) = (Linear::of(machine), Loci::new(machine, parameters.dc_link_nominal_v));
    let largest = loci.largest_a();
    let mut panel =
        plane("Current loci: MTPA, most torque up to the machine's largest, and full power", largest, 0.0);
    for rpm in [700.0, 1000.0, 1300.0, 1500.0] {
        let ellipse: Vec<_> = motor.ellipse(rpm).filter(|(_, q)| *q >= 0.0).collect();
        let (top, right) = (motor.at(motor.flux_wb(rpm), 90.0), motor.at(motor.flux_wb(rpm), 0.0));
        let (at, side) = if top.1 < 1.05 * largest {
            ((top.0, top.1 + 4.0), Side::Middle)
        } else {
            ((right.0 - 3.0, 5.0), Side::Left)
        };
        panel.words(at, &format!("{} r/min", number(rpm)), side, GREY);
        panel.dashes(ellipse, GREY);
    }
    panel.line(loci.circle(), RED, 1.3);
    panel.line(loci.mtpa(), BLUE, 2.6);
    let outer: Vec<Point> = loci
        .outer(4.0 * parameters.max_speed_rpm)
        .into_iter()
        .map(|(point, _)| point)
        .filter(|point| point.1 > 0.0)
        .take_while(|point| point.0.hypot(point.1) <= 1.003 * largest)
        .collect();
    panel.dashes([loci.mtpa().pop().unwrap_or_default(), loci.mtpa_end()], BLUE);
    panel.line(outer.iter().copied(), VIOLET, 2.6);
    panel.line(loci.full_power(parameters.max_speed_rpm), ORANGE, 1.8);
    panel.dashes((3..=60).map(|k| motor.mtpv(1000.0 * 1.12_f64.powi(k))), BLACK);
    let mut spot = |at: Point, text: &str, aside: Point, side: Side| {
        panel.spot(at, BLACK).words((at.0 + aside.0, at.1 + aside.1), text, side, BLACK);
    };
    spot((0.0, 0.0), "O", (4.0, 4.0), Side::Right);
    spot(loci.mtpa_end(), "A1", (3.0, 5.0), Side::Right);
    if let Some(first) = outer.first() {
        spot(*first, &format!("{} N·m", number(parameters.max_torque_nm)), (4.0, 4.0), Side::Right);
    }
    spot(motor.at(0.0, 0.0), "A4 (−ψ_{f}/L_{d}, 0)", (-4.0, 5.0), Side::Left);
    panel.names = [
        ("MTPA", BLUE),
        ("most torque", VIOLET),
        ("full power", ORANGE),
        ("current limit", RED),
        ("voltage limit", GREY),
        ("MTPV, out of reach", BLACK),
    ]
    .map(|(name, colour)| (name.to_owned(), colour))
    .to_vec();
    panel.place.3 = 440.0;
    draw((900, 440), &[panel])
}
