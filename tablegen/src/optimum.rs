//! The true optimum on the smooth map: the least current for a torque.

use crate::{Parameters, SmoothMap};
use libm::{asin, cos, hypot, sin};

/// Searches on the smooth map.
pub struct Optimum<'a> {
    map: &'a SmoothMap,
    factor: f64,
    max_current_a: f64,
    least_id_a: f64,
}

/// Golden-section steps: 0.618⁶⁰ of the interval is below 1e-12 of it.
const SECTIONS: u32 = 60;
/// Bisections.
const HALVINGS: u32 = 80;

impl<'a> Optimum<'a> {
    /// Made for a machine.
    pub fn new(map: &'a SmoothMap, parameters: &Parameters) -> Self {
        let whole = Self::of(map, parameters.pole_pairs, parameters.max_current_a);
        Self { least_id_a: parameters.least_id_a(), ..whole }
    }

    /// Made for a map with so many pole pairs, within a largest current in A, peak, with any i_d.
    pub fn of(map: &'a SmoothMap, pole_pairs: u32, max_current_a: f64) -> Self {
        Self { map, factor: 1.5 * f64::from(pole_pairs), max_current_a, least_id_a: f64::NEG_INFINITY }
    }

    /// Air-gap torque at a current, in N·m.
    pub fn torque_nm(&self, id_a: f64, iq_a: f64) -> f64 {
        let at = self.map.at(id_a, iq_a);
        self.factor * (at.psi_d_wb * iq_a - at.psi_q_wb * id_a)
    }

    /// The excess of the mean torque over a flux ripple above the torque at a current, in N·m/Wb², per mean square of the ripple along the flux linkage and
    /// across it; computed over `ripple_wb` either way. Zero if there is no flux linkage, or if no current of the map has the flux linkage with that ripple.
    pub fn curvature(&self, (id_a, iq_a): (f64, f64), ripple_wb: f64) -> [f64; 2] {
        let at = self.map.at(id_a, iq_a);
        let size_wb = hypot(at.psi_d_wb, at.psi_q_wb);
        let (along, here_nm) = ((at.psi_d_wb / size_wb, at.psi_q_wb / size_wb), self.torque_nm(id_a, iq_a));
        let moved_nm = |(d, q): (f64, f64), by_wb: f64| {
            let (d, q) = (at.psi_d_wb + by_wb * d, at.psi_q_wb + by_wb * q);
            let (id, iq) = self.map.inverse(d, q, (id_a, iq_a))?;
            Some(self.factor * (d * iq - q * id))
        };
        [along, (-along.1, along.0)].map(|way| {
            let ends_nm = moved_nm(way, ripple_wb).zip(moved_nm(way, -ripple_wb));
            ends_nm.map_or(0.0, |(forth, back)| (0.5 * (forth + back) - here_nm) / (ripple_wb * ripple_wb))
        })
    }

    /// The largest torque of a current magnitude, and its angle from the q axis towards −d, in rad.
    fn at_magnitude(&self, current_a: f64) -> (f64, f64) {
        let torque = |angle: f64| self.torque_nm(-current_a * sin(angle), current_a * cos(angle));
        // For a machine with L_d > L_q the optimum lies on the other side of the q axis.
        let most_rad = asin((-self.least_id_a / current_a).min(1.0));
        let angle = largest(-std::f64::consts::FRAC_PI_4, most_rad, torque);
        (torque(angle), angle)
    }

    /// The largest torque within the largest current, in N·m.
    pub fn most_torque_nm(&self) -> f64 {
        self.at_magnitude(self.max_current_a).0
    }

    /// The least current (id, iq), in A, for a torque in N·m from 0 to [`Optimum::most_torque_nm`].
    pub fn least_current(&self, torque_nm: f64) -> (f64, f64) {
        if torque_nm <= 0.0 {
            return (0.0, 0.0);
        }
        let (mut low, mut high) = (0.0, 1.05 * self.max_current_a);
        for _ in 0..HALVINGS {
            let middle = 0.5 * (low + high);
            if self.at_magnitude(middle).0 < torque_nm { low = middle } else { high = middle }
        }
        let (_, angle) = self.at_magnitude(high);
        (-high * sin(angle), high * cos(angle))
    }
}

/// The argument at which a function with a single maximum is largest.
fn largest(low: f64, high: f64, value: impl Fn(f64) -> f64) -> f64 {
    const RATIO: f64 = 0.618_033_988_749_894_9;
    let (mut a, mut b) = (low, high);
    let (mut x, mut y) = (b - RATIO * (b - a), a + RATIO * (b - a));
    let (mut fx, mut fy) = (value(x), value(y));
    for _ in 0..SECTIONS {
        if fx > fy {
            (b, y, fy) = (y, x, fx);
            x = b - RATIO * (b - a);
            fx = value(x);
        } else {
            (a, x, fx) = (x, y, fy);
            y = a + RATIO * (b - a);
            fy = value(y);
        }
    }
    0.5 * (a + b)
}

#[cfg(test)]
mod tests;
