//! The fit of an experiment's observations: one set of linear equations, solved by least squares.
//!
//! In the stationary frame, from a boundary to any later one, `ψ(i) turned to the rotor's angle` changes by the volt-seconds that acted minus
//! `R ∫i dt` and the inverter's voltage error. All of this is linear in the unknowns: the terms of the co-energy, the resistance, the voltage error.
//! The state before each part of the experiment is a constant of that part, so each part is taken relative to its mean.

use super::boundary::{Boundary, turned};
use super::check::turning;
use super::corrected::turned_by;
use super::equations::{Scope, by_boundary, equations};
use super::fit::{BESIDE, Fit};
use super::half::{Half, add};
use crate::coenergy::{Basis, Equations, Polynomial};
use anyhow::{Result, ensure};
use tractive::identification::Observation;

/// Weight of the flux linkages' bends relative to a sample's residual, in squares of the bound: how straight a machine is taken to be when resistance,
/// inverter, zero and magnets are told apart. And weight of the change of the bends, in cubes of it, for the map itself: iron saturates further where no pulse
/// has been. With 1.5e-5 for the latter, 3 of 100 maps fell in the corner that the pulses show least, by an earlier law of the pulses.
const STRAIGHT: f64 = 4e-4;
const ONWARD: f64 = 3.5e-5;
/// Weight of exactly known values relative to a sample's residual.
const SURE: f64 = 1e3;
/// Phase current, as a share of the bound, below which its sign is uncertain.
const SMALL_SHARE: f64 = 0.015;
/// Rounds in which ripple, inductances and the angle's zero converge: at least, at most, and the change of the zero, in rad, below which they have
/// converged.
const LEAST_ROUNDS: u32 = 2;
const MOST_ROUNDS: u32 = 10;
const SAME_RAD: f64 = 2e-4;
/// Largest change of the zero in a round, in rad.
const MOST_RAD: f64 = 0.1;

/// The input of the fit: the observations.
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
            // Two halves with one command, if control sees every second boundary.
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
    /// The fit: first as if the current went straight from boundary to boundary, then with the ripple from its own inductances, and in the frame in
    /// which it explains most.
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
        Ok(fit)
    }

    /// That fit with the results that it does not need for itself: the map at standstill, the bends beyond the pulses, and the turning rotor's own flux
    /// linkages.
    fn completed(&self, mut fit: Fit) -> Result<Fit> {
        let boundaries = self.boundaries(Some(&fit));
        fit.still.terms = self.still(&boundaries, &fit)?;
        fit.coenergy.terms = self.onward(&boundaries, &fit)?;
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
        let mut equations = equations(boundaries, basis, known, scope);
        equations.smooth(basis, 3, STRAIGHT * self.bound_a * self.bound_a);
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
            still: Polynomial { basis: basis.clone(), terms: Vec::new() },
            coenergy: Polynomial { basis, terms },
            resistance_ohm: unknown(0),
            dead_time_s: unknown(1),
            threshold_v: unknown(2),
            zero_rad: known.map_or(0.0, |fit| fit.zero_rad) + more_rad.clamp(-MOST_RAD, MOST_RAD),
            residuals,
            turning: Vec::new(),
            spread: solution.spread,
        })
    }

    /// The terms of a map whose bends change little: everything outside the map, and the magnets' flux linkage, keep their values from the fit of all
    /// observations, whose straighter map separates them.
    fn onward(&self, boundaries: &[Boundary], fit: &Fit) -> Result<Vec<f64>> {
        let beside = [fit.resistance_ohm, fit.dead_time_s, fit.threshold_v];
        let mut equations = equations(boundaries, &fit.coenergy.basis, None, Scope::All).given(&beside);
        equations.smooth(&fit.coenergy.basis, 4, ONWARD * self.bound_a.powi(3));
        let [along_d, _] = fit.coenergy.basis.flux((0.0, 0.0));
        let magnet_wb = fit.flux(0.0, 0.0).0;
        equations.add(along_d.into_iter().map(|share| SURE * share), SURE * magnet_wb);
        Ok(equations.solve()?.unknowns)
    }

    /// The terms that the pulses at standstill determine: the magnets' flux linkage is not one of them, and keeps its value from the fit of all observations.
    fn still(&self, boundaries: &[Boundary], fit: &Fit) -> Result<Vec<f64>> {
        let mut equations = self.equations(boundaries, &fit.coenergy.basis, Some(fit), Scope::Pulses);
        let [along_d, _] = fit.coenergy.basis.flux((0.0, 0.0));
        equations.add(along_d, fit.flux(0.0, 0.0).0);
        let mut terms = equations.solve()?.unknowns;
        terms.truncate(fit.coenergy.basis.len());
        Ok(terms)
    }
}

/// The fit of all observations, with the bound of the current in A and the length of a carrier half in s.
///
/// # Errors
/// If the observations do not determine the machine.
pub fn fit(observations: &[Observation], bound_a: f64, half_s: f64) -> Result<Fit> {
    // The kind of the first half is not reported: it is the one that explains more.
    let of_kind = |falls| Experiment { observations, bound_a, half_s, falls };
    let (rising, falling) = (of_kind(true), of_kind(false));
    let (of_rising, of_falling) = (rising.fit()?, falling.fit()?);
    if of_rising.left_wb() < of_falling.left_wb() {
        rising.completed(of_rising)
    } else {
        falling.completed(of_falling)
    }
}
