//! A machine as determined from an experiment's observations.

use super::boundary::Boundary;
use super::half::add;
use crate::coenergy::{Polynomial, Spread};
use tractive::identification::Stage;
use tractive_tablegen::FluxMap;

/// Number of unknowns in addition to the co-energy's terms: resistance, dead time, threshold.
pub const BESIDE: usize = 3;
/// Current over the bound up to which the polynomial is the map: beyond it, where there are no samples and no ripple reaches, the map continues straight.
const KNOWN_SHARE: f64 = 1.1;

/// A flux linkage at a current, from the turning rotor and from the pulses.
#[derive(Clone, Copy, Debug)]
pub struct Turning {
    /// Current along d and q, in A.
    pub current: (f64, f64),
    /// Flux linkage of the turning rotor, in Wb.
    pub found: (f64, f64),
    /// That of the map of the pulses, in Wb.
    pub map: (f64, f64),
}

/// A machine as determined from the observations.
#[derive(Clone, Debug)]
pub struct Fit {
    /// The co-energy.
    pub(super) coenergy: Polynomial,
    /// Stator resistance, in ohm.
    pub resistance_ohm: f64,
    /// The dead time, in s: the inverter's missing voltage at the edges of its pulses.
    pub dead_time_s: f64,
    /// The devices' threshold, in V: the missing voltage between the edges, against each phase's current. Its slope is part of the resistance.
    pub threshold_v: f64,
    /// The electrical angle by which the d axis lies ahead of its position in the observations, in rad.
    pub zero_rad: f64,
    /// The unexplained part of each boundary's flux linkage, by its stage, in Wb: along d and along q.
    pub residuals: Vec<(Stage, [f64; 2])>,
    /// The co-energy from the pulses at standstill alone, except for the magnets' flux linkage, which is this fit's.
    pub(super) still: Polynomial,
    /// Flux linkages of the turning rotor compared with those.
    pub turning: Vec<Turning>,
    pub(super) spread: Spread,
}

impl Fit {
    /// Root mean square of the residuals, in Wb.
    pub fn left_wb(&self) -> f64 {
        let sum: f64 = self.residuals.iter().map(|(_, [d, q])| d * d + q * q).sum();
        (sum / self.residuals.len() as f64).sqrt()
    }

    /// The change of the flux linkage in the observations' frame, in Wb, when the frame is rotated by one rad.
    pub fn turns(&self, (id, iq): (f64, f64)) -> [f64; 2] {
        let ((psi_d, psi_q), [dd, dq, qq]) = (self.flux(id, iq), self.coenergy.inductances((id, iq)));
        [dd * iq - dq * id - psi_q, psi_d + dq * iq - qq * id]
    }

    /// Current, in A, per small flux linkage, in Wb, at a current: the inverse of the incremental inductance.
    pub(super) fn per_flux(&self, current: (f64, f64)) -> [[f64; 2]; 2] {
        let [dd, dq, qq] = self.coenergy.inductances(current);
        let determinant = dd * qq - dq * dq;
        if dd <= 0.0 || determinant <= 0.0 {
            return [[0.0; 2]; 2];
        }
        [[qq / determinant, -dq / determinant], [-dq / determinant, dd / determinant]]
    }

    /// Volt-seconds taken by resistance and inverter up to a boundary, in V·s.
    pub fn taken(&self, boundary: &Boundary) -> [f64; 2] {
        let charge = boundary.charge.map(|charge| self.resistance_ohm * charge);
        add(add(charge, boundary.lacking, self.dead_time_s), boundary.opposed, self.threshold_v)
    }

    /// Flux linkages along d and q at a current in A, in Wb.
    pub fn flux(&self, id_a: f64, iq_a: f64) -> (f64, f64) {
        self.coenergy.flux((id_a, iq_a))
    }

    /// The same from the pulses at standstill alone, with this fit's magnets.
    pub fn flux_at_standstill(&self, id_a: f64, iq_a: f64) -> (f64, f64) {
        self.still.flux((id_a, iq_a))
    }

    /// Standard errors of the flux linkages along d and q at a current in A, in Wb.
    pub fn flux_error(&self, id_a: f64, iq_a: f64) -> (f64, f64) {
        let [d, q] = self.coenergy.basis.flux((id_a, iq_a)).map(|shares| self.spread.error(&shares));
        (d, q)
    }

    /// Standard errors of resistance, dead time and threshold, in ohm, s and V.
    pub fn errors(&self) -> [f64; BESIDE] {
        core::array::from_fn(|place| {
            let mut shares = vec![0.0; self.coenergy.terms.len() + BESIDE];
            shares[self.coenergy.terms.len() + place] = 1.0;
            self.spread.error(&shares)
        })
    }

    /// The inverter's total missing voltage, in V, of a leg with this link in V and this length of a carrier half in s: dead time and threshold
    /// together, and the standard error of the sum.
    pub fn lacking_v(&self, udc_v: f64, half_s: f64) -> (f64, f64) {
        let per_s = 0.5 * udc_v / half_s;
        let mut shares = vec![0.0; self.coenergy.terms.len() + BESIDE];
        shares[self.coenergy.terms.len() + 1..].copy_from_slice(&[per_s, 1.0]);
        (per_s * self.dead_time_s + self.threshold_v, self.spread.error(&shares))
    }

    /// The map on a grid that the table generator accepts: up to the bound and a little more, along +d a fifth of it.
    pub fn map(&self, bound_a: f64) -> FluxMap {
        const STEPS: i32 = 25;
        let current_a = |step: i32| crate::folder::digits(bound_a * f64::from(step) / f64::from(STEPS));
        let id_a: Vec<f64> = (-STEPS - 2..=5).map(current_a).collect();
        let iq_a: Vec<f64> = (-STEPS - 2..=STEPS + 2).map(current_a).collect();
        let from_a = KNOWN_SHARE * bound_a;
        let nodes =
            id_a.iter().flat_map(|id| iq_a.iter().map(|iq| self.coenergy.flux_further((*id, *iq), from_a)));
        let short = crate::folder::digits;
        let (psi_d_wb, psi_q_wb) = nodes.map(|(d, q)| (short(d), short(q))).unzip();
        FluxMap { psi_d_wb, psi_q_wb, id_a, iq_a }
    }
}
