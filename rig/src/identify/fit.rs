//! The fit of an experiment's observations: one set of linear equations, solved by least squares.
//!
//! In the stationary frame, from a boundary to any later one, `ψ(i) turned to the rotor's angle` changes by the volt-seconds that acted
//! less `R ∫i dt` and the inverter's voltage error. All is linear in what is unknown: the terms of the co-energy, the resistance, the
//! voltage error. What was before each part of the experiment is a constant of that part, and so each part counts from its mean.

use super::basis::Basis;
use super::check::{Turning, turning};
use super::corrected::turned_by;
use super::equations::{BESIDE, Equations, Scope, Spread, by_boundary};
use super::half::{Half, add};
use anyhow::{Result, ensure};
use tractive::identification::{Observation, Stage};
use tractive_tablegen::FluxMap;

/// Weight of the flux linkage's curvature beside a sample's residual, in squares of the bound: how smooth a machine is.
const SMOOTHNESS: f64 = 4e-4;
/// Phase current, as a share of the bound, whose sign is not sure.
const SMALL_SHARE: f64 = 0.006;
/// Rounds in which ripple, inductances and the angle's zero find each other: at least, at most, and the change of the zero, in rad, below
/// which they have.
const LEAST_ROUNDS: u32 = 2;
const MOST_ROUNDS: u32 = 10;
const SAME_RAD: f64 = 2e-4;
/// Largest change of the zero in a round, in rad.
const MOST_RAD: f64 = 0.1;

/// A machine as the observations show it.
#[derive(Clone, Debug)]
pub struct Fit {
    basis: Basis,
    terms: Vec<f64>,
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
    still: Vec<f64>,
    /// Flux linkages of the turning rotor beside those.
    pub turning: Vec<Turning>,
    spread: Spread,
}

/// A boundary, and what has acted until then, stationary frame.
pub struct Boundary {
    /// The part of the experiment.
    pub stage: Stage,
    /// Current along d and q, in A.
    pub current: (f64, f64),
    /// Sine and cosine of the d axis.
    pub frame: (f64, f64),
    /// Volt-seconds that the modulator made, in V·s.
    pub volt_seconds: [f64; 2],
    /// `∫i dt`, in A·s.
    pub charge: [f64; 2],
    /// Volt-seconds that a dead time of one second takes away, in V.
    pub lacking: [f64; 2],
    /// Volt-seconds that a threshold of one volt takes away, in s.
    pub opposed: [f64; 2],
    /// Edges so far whose sign was not sure.
    pub unsure: f64,
    /// Time so far, in s.
    pub passed_s: f64,
}

/// Turned from the rotor's frame to the stationary one.
pub fn turned((sin, cos): (f64, f64), [d, q]: [f64; 2]) -> [f64; 2] {
    [d * cos - q * sin, d * sin + q * cos]
}

/// The observations' own side of the fit.
struct Experiment<'a> {
    observations: &'a [Observation],
    bound_a: f64,
    /// Length of a carrier half, in s.
    half_s: f64,
    /// `true` if the first half begins with the upper devices on.
    falls: bool,
}

impl Experiment<'_> {
    /// The boundaries in the frame that a fit has found; its inductances make the ripple.
    fn boundaries(&self, known: Option<&Fit>) -> Vec<Boundary> {
        let per_flux = |current| known.map_or([[0.0; 2]; 2], |fit| fit.per_flux(current));
        let mut sums = [[0.0; 2]; 4];
        let mut before: Option<([f64; 2], (f64, f64))> = None;
        let (mut halves, mut unsure, mut passed_s) = (0, 0.0, 0.0);
        let step = |observation: &Observation| {
            let current = (f64::from(observation.current.d), f64::from(observation.current.q));
            let frame = (f64::from(observation.frame.sin), f64::from(observation.frame.cos));
            let here = turned(frame, [current.0, current.1]);
            let (last, last_dq) = before.replace((here, current)).unwrap_or((here, current));
            let acted = [f64::from(observation.volt_seconds.alpha), f64::from(observation.volt_seconds.beta)];
            let length_s = f64::from(observation.length_s);
            // Two halves of one command, where control sees every second boundary.
            let count = (length_s / self.half_s).round().max(1.0);
            let mean = (0.5 * (current.0 + last_dq.0), 0.5 * (current.1 + last_dq.1));
            let [first, second] = per_flux(mean).map(|row| turned(frame, row));
            let per_flux = [
                [first[0] * frame.1 - second[0] * frame.0, first[1] * frame.1 - second[1] * frame.0],
                [first[0] * frame.0 + second[0] * frame.1, first[1] * frame.0 + second[1] * frame.1],
            ];
            let mut from = last;
            for part in 1..=count as u32 {
                let share = f64::from(part) / count;
                let to = [0, 1].map(|axis| last[axis] + share * (here[axis] - last[axis]));
                let half = Half {
                    ends: [from, to],
                    acted: acted.map(|sum| sum / count),
                    length_s: length_s / count,
                    udc_v: f64::from(observation.udc_v).max(f64::MIN_POSITIVE),
                    per_flux,
                    falls: (halves % 2 == 0) == self.falls,
                };
                halves += 1;
                let inside = half.inside(SMALL_SHARE * self.bound_a);
                unsure += inside.unsure;
                sums[1] = add(sums[1], inside.charge, 1.0);
                sums[2] = add(sums[2], inside.lacking, 1.0);
                sums[3] = add(sums[3], inside.opposed, 1.0);
                from = to;
            }
            sums[0] = add(sums[0], acted, 1.0);
            passed_s += length_s;
            let [volt_seconds, charge, lacking, opposed] = sums;
            let stage = observation.stage;
            Boundary { stage, current, frame, volt_seconds, charge, lacking, opposed, unsure, passed_s }
        };
        turned_by(self.observations, known.map_or(0.0, |fit| fit.zero_rad)).iter().map(step).collect()
    }
}

impl Experiment<'_> {
    /// The fit: at first as if the current went straight from boundary to boundary, then with the ripple that its own inductances make, and
    /// in the frame in which it explains most.
    fn fit(&self) -> Result<Fit> {
        let mut fit = self.solved(None)?;
        for round in 1..=MOST_ROUNDS {
            let next = self.solved(Some(&fit))?;
            let turned_rad = (next.zero_rad - fit.zero_rad).abs();
            fit = next;
            if round >= LEAST_ROUNDS && turned_rad < SAME_RAD {
                break;
            }
        }
        let boundaries = self.boundaries(Some(&fit));
        fit.still = self.still(&boundaries, &fit)?;
        fit.turning = turning(&boundaries, &fit);
        Ok(fit)
    }

    fn equations(
        &self,
        boundaries: &[Boundary],
        basis: &Basis,
        known: Option<&Fit>,
        scope: Scope,
    ) -> Equations {
        let mut equations = Equations::of(boundaries, basis, known, scope);
        equations.smooth(basis, SMOOTHNESS * self.bound_a * self.bound_a);
        equations
    }

    fn solved(&self, known: Option<&Fit>) -> Result<Fit> {
        let boundaries = &self.boundaries(known);
        let basis = Basis::new(self.bound_a);
        let equations = self.equations(boundaries, &basis, known, Scope::All);
        let count = self.observations.len();
        ensure!(equations.suffice(), "{count} observations: too few for a flux map");
        let solution = equations.solve()?;
        let residuals = by_boundary(boundaries, Scope::All, &solution.left);
        let (mut terms, beside) = (solution.unknowns, basis.len());
        let beside = terms.split_off(beside);
        let unknown = |place: usize| beside.get(place).copied().unwrap_or(f64::NAN);
        let more_rad = if known.is_some() { unknown(BESIDE) } else { 0.0 };
        Ok(Fit {
            basis,
            terms,
            resistance_ohm: unknown(0),
            dead_time_s: unknown(1),
            threshold_v: unknown(2),
            zero_rad: known.map_or(0.0, |fit| fit.zero_rad) + more_rad.clamp(-MOST_RAD, MOST_RAD),
            residuals,
            still: Vec::new(),
            turning: Vec::new(),
            spread: solution.spread,
        })
    }

    /// The terms that the pulses at standstill show: the magnets' flux linkage is no part of it, and stays what it is in the fit of all.
    fn still(&self, boundaries: &[Boundary], fit: &Fit) -> Result<Vec<f64>> {
        let mut equations = self.equations(boundaries, &fit.basis, Some(fit), Scope::Pulses);
        let [along_d, _] = fit.basis.flux((0.0, 0.0));
        equations.add(along_d, fit.flux(0.0, 0.0).0);
        let mut terms = equations.solve()?.unknowns;
        terms.truncate(fit.basis.len());
        Ok(terms)
    }
}

impl Fit {
    /// Of all observations, with the bound of the current in A and the length of a carrier half in s.
    ///
    /// # Errors
    /// Observations that do not tell the machine.
    pub fn of(observations: &[Observation], bound_a: f64, half_s: f64) -> Result<Self> {
        // The kind of the first half is not told: the one that explains more is it.
        let tried = [true, false].map(|falls| Experiment { observations, bound_a, half_s, falls }.fit());
        let [rising, falling] = tried;
        let (rising, falling) = (rising?, falling?);
        Ok(if rising.left_wb() < falling.left_wb() { rising } else { falling })
    }

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
    fn per_flux(&self, current: (f64, f64)) -> [[f64; 2]; 2] {
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

    /// What the inverter's voltage lacks in all, in V, of a leg with this link in V and this length of a carrier half in s: dead time and threshold
    /// together, and the standard error of the sum.
    pub fn lacking_v(&self, udc_v: f64, half_s: f64) -> (f64, f64) {
        let per_s = 0.5 * udc_v / half_s;
        let mut shares = vec![0.0; self.terms.len() + BESIDE];
        shares[self.terms.len() + 1..].copy_from_slice(&[per_s, 1.0]);
        (per_s * self.dead_time_s + self.threshold_v, self.spread.error(&shares))
    }

    /// The map on a grid that the table generator takes: up to the bound and a little more, along +d a fifth of it.
    pub fn map(&self, bound_a: f64) -> FluxMap {
        const STEPS: i32 = 25;
        let current_a = |step: i32| crate::folder::digits(bound_a * f64::from(step) / f64::from(STEPS));
        let id_a: Vec<f64> = (-STEPS - 2..=5).map(current_a).collect();
        let iq_a: Vec<f64> = (-STEPS - 2..=STEPS + 2).map(current_a).collect();
        let nodes = id_a.iter().flat_map(|id| iq_a.iter().map(|iq| self.flux(*id, *iq)));
        let short = crate::folder::digits;
        let (psi_d_wb, psi_q_wb) = nodes.map(|(d, q)| (short(d), short(q))).unzip();
        FluxMap { psi_d_wb, psi_q_wb, id_a, iq_a }
    }
}
