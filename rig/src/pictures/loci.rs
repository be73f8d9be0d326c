//! Currents in the rotor's plane of any machine: ellipses of a voltage, hyperbolas of a torque, and the drive's path between them.

use super::sheet::Point;
use crate::machine::Machine;
use core::f64::consts::TAU;
use tractive::control::{VoltageLimit, mtpa, operating_point};
use tractive_tablegen::{Optimum, SmoothMap};

/// A machine's plane of currents.
pub struct Loci<'a> {
    machine: &'a Machine,
    map: SmoothMap,
    /// Largest fundamental, peak phase, in V.
    voltage_v: f64,
    /// The two-level link whose square wave has that fundamental, in V.
    udc_v: f64,
}

impl<'a> Loci<'a> {
    /// The plane of a machine behind a link whose square wave is its voltage limit.
    pub fn new(machine: &'a Machine, udc_v: f64) -> Self {
        let voltage_v = udc_v * core::f64::consts::FRAC_2_PI;
        Self { machine, map: SmoothMap::new(&machine.folder.map), voltage_v, udc_v }
    }

    /// Electrical angular speed, in rad/s, of a mechanical one in r/min.
    fn omega(&self, rpm: f64) -> f64 {
        rpm / 60.0 * TAU * f64::from(self.machine.folder.parameters.pole_pairs)
    }

    /// Largest current, in A.
    pub fn largest_a(&self) -> f64 {
        self.machine.folder.parameters.max_current_a
    }

    /// Upper half of the circle of the largest current.
    pub fn circle(&self) -> impl Iterator<Item = Point> {
        let largest = self.largest_a();
        (0..=180).map(move |degrees| {
            let (sin, cos) = f64::from(degrees).to_radians().sin_cos();
            (largest * cos, largest * sin)
        })
    }

    /// The current without flux linkage: the centre of the ellipses.
    fn centre(&self) -> Option<Point> {
        self.map.inverse(0.0, 0.0, (-0.5 * self.largest_a(), 0.0))
    }

    /// The ellipse of the largest voltage at a speed, neglecting the resistance, as far as the map is known.
    pub fn ellipse(&self, rpm: f64) -> Vec<Point> {
        let flux_wb = self.voltage_v / self.omega(rpm);
        let start = self.centre().unwrap_or((-0.5 * self.largest_a(), 0.0));
        let mut last = start;
        let turn = (0..=360).filter_map(|degrees| {
            let (sin, cos) = f64::from(degrees).to_radians().sin_cos();
            let found = self.map.inverse(flux_wb * cos, flux_wb * sin, last);
            last = found.unwrap_or(start);
            found
        });
        turn.collect()
    }

    /// Air-gap torque, in N·m.
    fn torque_nm(&self, (id_a, iq_a): Point) -> f64 {
        let at = self.map.at(id_a, iq_a);
        let factor = 1.5 * f64::from(self.machine.folder.parameters.pole_pairs);
        factor * (at.psi_d_wb * iq_a - at.psi_q_wb * id_a)
    }

    /// The hyperbola of a torque within the circle.
    pub fn torque(&self, torque_nm: f64) -> Vec<Point> {
        let largest = self.largest_a();
        let of = |id_a: f64| {
            let (mut low, mut high) = (0.0, 1.05 * largest);
            for _ in 0..50 {
                let middle = 0.5 * (low + high);
                if self.torque_nm((id_a, middle)) < torque_nm { low = middle } else { high = middle }
            }
            (id_a, high)
        };
        let points = (0..=240).map(|k| of(-largest * f64::from(k) / 240.0));
        points.filter(|(d, q)| d.hypot(*q) <= 1.03 * largest).collect()
    }

    /// MTPA from no torque to the most.
    pub fn mtpa(&self) -> Vec<Point> {
        let most = self.machine.tables.mtpa.start.last();
        let of = |k: u16| {
            let current = mtpa(most * f32::from(k) / 100.0, self.machine.tables);
            (f64::from(current.d), f64::from(current.q))
        };
        (0..=100).map(of).collect()
    }

    /// The MTPA point with the largest current.
    pub fn mtpa_end(&self) -> Point {
        let optimum = Optimum::new(&self.map, &self.machine.folder.parameters);
        optimum.least_current(optimum.most_torque_nm())
    }

    /// The drive's current for a torque at a speed, up to square wave; the last column is the torque that it gives, in N·m.
    fn drives(&self, torque_nm: f64, rpm: f64) -> (Point, f64) {
        let limit = VoltageLimit { udc_v: self.udc_v as f32, modulation_index: 1.0, filled: false };
        let point = operating_point(torque_nm as f32, self.omega(rpm) as f32, &limit, self.machine.tables);
        ((f64::from(point.current.d), f64::from(point.current.q)), f64::from(point.torque_nm))
    }

    /// The drive's currents for a torque, from standstill to a speed, each with that speed; they end where the torque does.
    pub fn held(&self, torque_nm: f64, to_rpm: f64) -> Vec<(Point, f64)> {
        let speeds = (1..=400).map(|k| to_rpm * f64::from(k) / 400.0);
        let points = speeds.map(|rpm| (self.drives(torque_nm, rpm), rpm));
        let held = points.take_while(|((_, given), _)| *given >= 0.999 * torque_nm);
        held.map(|((point, _), rpm)| (point, rpm)).collect()
    }

    /// The drive's currents for all the torque there is, from standstill to a speed, each with that speed; they end where no current
    /// within the largest one is left.
    pub fn outer(&self, to_rpm: f64) -> Vec<(Point, f64)> {
        let beyond = 10.0 * self.machine.folder.parameters.max_torque_nm;
        let speeds = (1..=600).map(|k| to_rpm * (f64::from(k) / 600.0).powi(2));
        let points = speeds.map(|rpm| (self.drives(beyond, rpm).0, rpm));
        points.take_while(|((d, q), _)| d.hypot(*q) <= 1.01 * self.largest_a()).collect()
    }

    /// The drive's currents at full torque, then at full power, up to a speed.
    pub fn full_power(&self, to_rpm: f64) -> Vec<Point> {
        let of = |k: i32| {
            let rpm = to_rpm * f64::from(k) / 400.0;
            self.drives(self.machine.envelope_nm(rpm), rpm).0
        };
        (1..=400).map(of).collect()
    }
}
