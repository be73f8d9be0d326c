//! The optimum of a machine, found by looking everywhere: no table and no solver of the drive's is used, only the machine's own
//! equations. A current of either sign of iq; the machine is even in iq.

use super::folders::CoEnergy;
use std::f64::consts::FRAC_2_PI;

/// A machine by its equations.
#[derive(Clone, Copy)]
pub struct Truth {
    pub co_energy: CoEnergy,
    pub pole_pairs: u32,
    pub resistance_ohm: f64,
    pub max_current_a: f64,
}

/// The question: an electrical speed, and the available voltage.
#[derive(Clone, Copy)]
pub struct Supply {
    pub omega: f64,
    pub voltage_v: f64,
}

impl Supply {
    pub fn new(speed_rpm: f64, pole_pairs: u32, udc_v: f64) -> Self {
        let omega = speed_rpm * std::f64::consts::TAU / 60.0 * f64::from(pole_pairs);
        Self { omega, voltage_v: FRAC_2_PI * udc_v }
    }
}

/// A current with its flux linkage, iq of either sign.
#[derive(Clone, Copy)]
pub struct Point {
    id: f64,
    iq: f64,
    psi_d: f64,
    psi_q: f64,
}

impl Point {
    pub fn current_a(&self) -> f64 {
        self.id.hypot(self.iq)
    }

    /// The same with iq of the other sign.
    fn mirrored(self) -> Self {
        Self { iq: -self.iq, psi_q: -self.psi_q, ..self }
    }
}

/// Steps of id per largest current of a curve of constant torque, and of the search for the most torque.
const CURVE_STEPS: u32 = 2400;
const SEARCH_STEPS: u32 = 400;
/// Bisections: 2⁻⁴⁸ of an interval is below 1e-14 of it.
const HALVINGS: u32 = 48;

/// All currents within the limit that give a torque of one sign, at even steps of id from −i_max to 0.
pub struct TorqueCurve(Vec<Point>);

impl Truth {
    pub fn point(&self, id: f64, iq: f64) -> Point {
        let (psi_d, psi_q) = self.co_energy.flux(id, iq);
        Point { id, iq, psi_d, psi_q }
    }

    pub fn torque_nm(&self, at: &Point) -> f64 {
        1.5 * f64::from(self.pole_pairs) * (at.psi_d * at.iq - at.psi_q * at.id)
    }

    /// Stator voltage in steady state, equation (3), in V.
    pub fn voltage_v(&self, at: &Point, omega: f64) -> f64 {
        let ud = self.resistance_ohm * at.id - omega * at.psi_q;
        let uq = self.resistance_ohm * at.iq + omega * at.psi_d;
        ud.hypot(uq)
    }

    /// iq of largest magnitude at an id within the current limit.
    fn edge_iq(&self, id: f64) -> f64 {
        (self.max_current_a * self.max_current_a - id * id).max(0.0).sqrt()
    }

    /// The curve of a torque of at least zero; torque rises with iq where id ≤ 0.
    pub fn torque_curve(&self, torque_nm: f64) -> TorqueCurve {
        let at = |k: u32| {
            let id = -self.max_current_a * f64::from(k) / f64::from(CURVE_STEPS);
            let (mut low, mut high) = (0.0, self.edge_iq(id));
            if self.torque_nm(&self.point(id, high)) < torque_nm {
                return None;
            }
            for _ in 0..HALVINGS {
                let middle = 0.5 * (low + high);
                if self.torque_nm(&self.point(id, middle)) < torque_nm { low = middle } else { high = middle }
            }
            Some(self.point(id, if torque_nm == 0.0 { 0.0 } else { high }))
        };
        TorqueCurve((0..=CURVE_STEPS).filter_map(at).collect())
    }

    /// The least current on a curve that the voltage allows, iq of the given sign; `None` where it allows none.
    pub fn least_current_a(&self, curve: &TorqueCurve, sign: f64, supply: &Supply) -> Option<f64> {
        let over = |point: &Point| {
            let point = if sign < 0.0 { point.mirrored() } else { *point };
            self.voltage_v(&point, supply.omega) - supply.voltage_v
        };
        let mut least: Option<f64> = None;
        let mut keep = |current_a: f64| least = Some(least.map_or(current_a, |other| other.min(current_a)));
        let mut before: Option<(f64, f64)> = None;
        for point in &curve.0 {
            let (excess, current) = (over(point), point.current_a());
            if excess <= 0.0 {
                keep(current);
            }
            // Where the limit is crossed between two steps.
            if let Some((last_excess, last_current)) = before
                && (last_excess <= 0.0) != (excess <= 0.0)
            {
                keep(last_current + (current - last_current) * last_excess / (last_excess - excess));
            }
            before = Some((excess, current));
        }
        least
    }

    /// The most torque magnitude of a sign within current and voltage.
    pub fn most_torque_nm(&self, sign: f64, supply: &Supply) -> f64 {
        let step = self.max_current_a / f64::from(SEARCH_STEPS);
        let coarse = (0..=SEARCH_STEPS).map(|k| -step * f64::from(k));
        let best = |ids: &mut dyn Iterator<Item = f64>| {
            ids.map(|id| (self.most_at(id, step, sign, supply), id))
                .fold((0.0, 0.0), |a, b| if b.0 > a.0 { b } else { a })
        };
        let (_, near) = best(&mut coarse.into_iter());
        let fine = (-100..=100).map(|k| (near + 0.01 * step * f64::from(k)).clamp(-self.max_current_a, 0.0));
        best(&mut fine.into_iter()).0
    }

    /// The most torque at an id: from the current limit towards zero, the first iq that the voltage allows.
    fn most_at(&self, id: f64, step: f64, sign: f64, supply: &Supply) -> f64 {
        let allowed = |iq: f64| self.voltage_v(&self.point(id, sign * iq), supply.omega) <= supply.voltage_v;
        let mut outer = self.edge_iq(id);
        if allowed(outer) {
            return self.torque_nm(&self.point(id, outer));
        }
        while outer > 0.0 {
            let inner = (outer - step).max(0.0);
            if allowed(inner) {
                let (mut low, mut high) = (inner, outer);
                for _ in 0..HALVINGS {
                    let middle = 0.5 * (low + high);
                    if allowed(middle) { low = middle } else { high = middle }
                }
                return self.torque_nm(&self.point(id, low));
            }
            outer = inner;
        }
        0.0
    }

    /// The least current magnitude for a torque of at least zero, whatever the voltage: at every angle of a fine raster the
    /// magnitude that gives it.
    pub fn optimum_a(&self, torque_nm: f64) -> f64 {
        const ANGLES: u32 = 4000;
        let at = |k: u32| {
            let (sin, cos) = (f64::from(k) / f64::from(ANGLES) * std::f64::consts::FRAC_PI_2).sin_cos();
            let (mut low, mut high) = (0.0, 1.1 * self.max_current_a);
            for _ in 0..HALVINGS {
                let middle = 0.5 * (low + high);
                let torque = self.torque_nm(&self.point(-middle * sin, middle * cos));
                if torque < torque_nm { low = middle } else { high = middle }
            }
            high
        };
        (0..ANGLES).map(at).fold(f64::INFINITY, f64::min)
    }
}
