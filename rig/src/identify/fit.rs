//! A machine as an experiment's observations show it.

use super::basis::Basis;
use super::boundary::Boundary;
use super::half::add;
use super::spread::{BESIDE, Spread};
use tractive::identification::Stage;
use tractive_tablegen::FluxMap;

/// Current over the bound up to which the polynomial is the map: what has no sample near it, and where no ripple goes, goes on straight.
const KNOWN_SHARE: f64 = 1.1;

/// A flux linkage at a current, as the turning rotor shows it, and as the pulses do.
#[derive(Clone, Copy, Debug)]
pub struct Turning {
    /// Current along d and q, in A.
    pub current: (f64, f64),
    /// Flux linkage of the turning rotor, in Wb.
    pub found: (f64, f64),
    /// That of the map of the pulses, in Wb.
    pub map: (f64, f64),
}

/// A machine as the observations show it.
#[derive(Clone, Debug)]
pub struct Fit {
    pub(super) basis: Basis,
    pub(super) terms: Vec<f64>,
    /// Stator resistance, in ohm.
    pub resistance_ohm: f64,
    /// The dead time, in s: what the inverter's voltage lacks at the edges of its pulses.
    pub dead_time_s: f64,
    /// The devices' threshold, in V: what it lacks meanwhile, against each phase's current. Its slope is part of the resistance.
    pub threshold_v: f64,
    /// The angle by which the d axis lies ahead of where the observations say that it is, electrical, in rad.
    pub zero_rad: f64,
    /// The unexplained part of each boundary's flux linkage, by its stage, in Wb: along d and along q.
    pub residuals: Vec<(Stage, [f64; 2])>,
    /// The flux linkages' own terms as the pulses at standstill alone show them, but for the magnets', which is this fit's.
    pub(super) still: Vec<f64>,
    /// Flux linkages of the turning rotor beside those.
    pub turning: Vec<Turning>,
    pub(super) spread: Spread,
}

impl Fit {
    /// Root mean square of what is left, in Wb.
    pub fn left_wb(&self) -> f64 {
        let sum: f64 = self.residuals.iter().map(|(_, [d, q])| d * d + q * q).sum();
        (sum / self.residuals.len() as f64).sqrt()
    }

    /// Incremental inductances, in H: of d, of both, of q.
    fn inductances(&self, current: (f64, f64)) -> [f64; 3] {
        [(2, 0), (1, 1), (0, 2)].map(|orders| {
            self.basis.derivative(current, orders).iter().zip(&self.terms).map(|(a, b)| a * b).sum::<f64>()
        })
    }

    /// The flux linkage in the observations' frame, in Wb, by which a frame that is turned by one rad makes it another.
    pub fn turns(&self, (id, iq): (f64, f64)) -> [f64; 2] {
        let ((psi_d, psi_q), [dd, dq, qq]) = (self.flux(id, iq), self.inductances((id, iq)));
        [dd * iq - dq * id - psi_q, psi_d + dq * iq - qq * id]
    }

    /// Current, in A, of a small flux linkage, in Wb, at a current: the inverse of the incremental inductance.
    pub(super) fn per_flux(&self, current: (f64, f64)) -> [[f64; 2]; 2] {
        let [dd, dq, qq] = self.inductances(current);
        let determinant = dd * qq - dq * dq;
        if dd <= 0.0 || determinant <= 0.0 {
            return [[0.0; 2]; 2];
        }
        [[qq / determinant, -dq / determinant], [-dq / determinant, dd / determinant]]
    }

    /// Volt-seconds that resistance and inverter have taken until a boundary, in V·s.
    pub fn taken(&self, boundary: &Boundary) -> [f64; 2] {
        let charge = boundary.charge.map(|charge| self.resistance_ohm * charge);
        add(add(charge, boundary.lacking, self.dead_time_s), boundary.opposed, self.threshold_v)
    }

    /// Flux linkages along d and q at a current in A, in Wb.
    pub fn flux(&self, id_a: f64, iq_a: f64) -> (f64, f64) {
        self.flux_of(&self.terms, (id_a, iq_a))
    }

    /// The same as the pulses at standstill alone show them, with this fit's magnets.
    pub fn flux_at_standstill(&self, id_a: f64, iq_a: f64) -> (f64, f64) {
        self.flux_of(&self.still, (id_a, iq_a))
    }

    fn flux_of(&self, terms: &[f64], current: (f64, f64)) -> (f64, f64) {
        let [d, q] = self.basis.flux(current);
        let sum = |gives: &[f64]| gives.iter().zip(terms).map(|(a, b)| a * b).sum();
        (sum(&d), sum(&q))
    }

    /// Standard errors of the flux linkages along d and q at a current in A, in Wb.
    pub fn flux_error(&self, id_a: f64, iq_a: f64) -> (f64, f64) {
        let [d, q] = self.basis.flux((id_a, iq_a)).map(|shares| self.spread.error(&shares));
        (d, q)
    }

    /// Standard errors of resistance, dead time and threshold, in ohm, s and V.
    pub fn errors(&self) -> [f64; BESIDE] {
        core::array::from_fn(|place| {
            let mut shares = vec![0.0; self.terms.len() + BESIDE];
            shares[self.terms.len() + place] = 1.0;
            self.spread.error(&shares)
        })
    }

    /// The voltage that the inverter lacks in all, in V, of a leg with this link in V and this length of a carrier half in s: dead time and threshold
    /// together, and the standard error of the sum.
    pub fn lacking_v(&self, udc_v: f64, half_s: f64) -> (f64, f64) {
        let per_s = 0.5 * udc_v / half_s;
        let mut shares = vec![0.0; self.terms.len() + BESIDE];
        shares[self.terms.len() + 1..].copy_from_slice(&[per_s, 1.0]);
        (per_s * self.dead_time_s + self.threshold_v, self.spread.error(&shares))
    }

    /// Flux linkages at a current in A, which beyond a circle go on straight outward from it: with the incremental inductances that the circle has. As
    /// these are not the same all around it, a part along the circle keeps both the derivatives of one co-energy, `W + W_r h + W_rr h²/2`.
    fn flux_further(&self, current: (f64, f64), from_a: f64) -> (f64, f64) {
        let r = current.0.hypot(current.1);
        if r <= from_a {
            return self.flux(current.0, current.1);
        }
        let (h, c, s) = (r - from_a, current.0 / r, current.1 / r);
        let at = (from_a * c, from_a * s);
        let of = |orders| self.basis.derivative(at, orders).iter().zip(&self.terms).map(|(a, b)| a * b).sum();
        let (psi, [dd, dq, qq]) = (self.flux(at.0, at.1), self.inductances(at));
        let [ddd, ddq, dqq, qqq]: [f64; 4] = [(3, 0), (2, 1), (1, 2), (0, 3)].map(of);
        let around =
            c * s * (qqq * s - ddd * c) + ddq * c * (c * c - 2.0 * s * s) + dqq * s * (2.0 * c * c - s * s);
        let bent = 0.5 * h * h * from_a / r * around;
        (psi.0 + h * (dd * c + dq * s) - bent * s, psi.1 + h * (dq * c + qq * s) + bent * c)
    }

    /// The map on a grid that the table generator takes: up to the bound and a little more, along +d a fifth of it.
    pub fn map(&self, bound_a: f64) -> FluxMap {
        const STEPS: i32 = 25;
        let current_a = |step: i32| crate::folder::digits(bound_a * f64::from(step) / f64::from(STEPS));
        let id_a: Vec<f64> = (-STEPS - 2..=5).map(current_a).collect();
        let iq_a: Vec<f64> = (-STEPS - 2..=STEPS + 2).map(current_a).collect();
        let from_a = KNOWN_SHARE * bound_a;
        let nodes = id_a.iter().flat_map(|id| iq_a.iter().map(|iq| self.flux_further((*id, *iq), from_a)));
        let short = crate::folder::digits;
        let (psi_d_wb, psi_q_wb) = nodes.map(|(d, q)| (short(d), short(q))).unzip();
        FluxMap { psi_d_wb, psi_q_wb, id_a, iq_a }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::DMatrix;

    #[test]
    fn the_map_beyond_the_circle_is_still_one_co_energys_gradient() {
        let basis = Basis::new(100.0);
        let terms: Vec<f64> = (0..basis.len()).map(|k| (1.0 + k as f64).sin() / (1.0 + k as f64)).collect();
        let spread = Spread { factor: DMatrix::zeros(0, 0), lengths: Vec::new(), sigma: 0.0 };
        let fit = Fit {
            basis,
            terms,
            resistance_ohm: 0.0,
            dead_time_s: 0.0,
            threshold_v: 0.0,
            zero_rad: 0.0,
            residuals: Vec::new(),
            still: Vec::new(),
            turning: Vec::new(),
            spread,
        };
        let (flux, step_a) = (|d: f64, q: f64| fit.flux_further((d, q), 90.0), 1e-4);
        for (d, q) in [(-80.0, 60.0), (-100.0, 20.0), (-70.0, -95.0), (15.0, 100.0)] {
            let by_q = (flux(d, q + step_a).0 - flux(d, q - step_a).0) / (2.0 * step_a);
            let by_d = (flux(d + step_a, q).1 - flux(d - step_a, q).1) / (2.0 * step_a);
            assert!((by_q - by_d).abs() < 1e-6 * (1.0 + by_q.abs()), "{d}, {q}: {by_q}, {by_d}");
        }
        let (within, beyond) = (flux(-53.999, 71.999), flux(-54.001, 72.001));
        assert!((within.0 - beyond.0).hypot(within.1 - beyond.1) < 1e-3, "{within:?}, {beyond:?}");
    }
}
