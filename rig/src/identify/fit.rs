//! The fit of an experiment's observations: one set of linear equations, solved by least squares.
//!
//! In the stationary frame, from a boundary to any later one, `ψ(i) turned to the rotor's angle` changes by the volt-seconds that acted
//! less `R ∫i dt` and the inverter's voltage error. All is linear in what is unknown: the terms of the co-energy, the resistance, the
//! voltage error. What was before each part of the experiment is a constant of that part, and so each part counts from its mean.

use super::basis::Basis;
use super::corrected::turned_by;
use super::half::{Half, add};
use anyhow::{Result, ensure};
use nalgebra::{DMatrix, DVector};
use tractive::identification::{Observation, Stage};
use tractive_tablegen::FluxMap;

/// Boundaries in a part that counts from its own mean.
const PART: usize = 100;
/// Edges of an unsure sign after which a part ends: what they may have left out is no longer carried on.
const UNSURE_EDGES: f64 = 1.0;
/// Shortest part.
const LEAST_PART: usize = 4;
/// Weight of the flux linkage's curvature beside a sample's residual, in squares of the bound: how smooth a machine is.
const SMOOTHNESS: f64 = 4e-4;
const GRID: (u32, u32) = (26, 18);
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
    /// The dead time that explains the inverter's voltage error, thresholds included, in s.
    pub dead_time_s: f64,
    /// The angle by which the d axis lies ahead of where the observations say that it is, electrical, in rad.
    pub zero_rad: f64,
    /// The unexplained part of each boundary's flux linkage, by its stage, in Wb: along d and along q.
    pub residuals: Vec<(Stage, [f64; 2])>,
}

/// A boundary, and what has acted until then, stationary frame.
struct Boundary {
    stage: Stage,
    current: (f64, f64),
    frame: (f64, f64),
    volt_seconds: [f64; 2],
    charge: [f64; 2],
    lacking: [f64; 2],
    /// Edges so far whose sign was not sure.
    unsure: f64,
}

/// Turned from the rotor's frame to the stationary one.
fn turned((sin, cos): (f64, f64), [d, q]: [f64; 2]) -> [f64; 2] {
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
        let mut sums = [[0.0; 2]; 3];
        let mut before: Option<([f64; 2], (f64, f64))> = None;
        let (mut halves, mut unsure) = (0, 0.0);
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
                from = to;
            }
            sums[0] = add(sums[0], acted, 1.0);
            let [volt_seconds, charge, lacking] = sums;
            Boundary { stage: observation.stage, current, frame, volt_seconds, charge, lacking, unsure }
        };
        turned_by(self.observations, known.map_or(0.0, |fit| fit.zero_rad)).iter().map(step).collect()
    }
}

/// The parts that count from their own mean: without what lies at no current, where no edge's sign is sure.
fn parts(all: &[Boundary]) -> Vec<&[Boundary]> {
    let used = |boundary: &Boundary| !matches!(boundary.stage, Stage::Probe | Stage::Rest | Stage::Done);
    let (mut parts, mut from) = (Vec::new(), 0);
    for (k, boundary) in all.iter().enumerate() {
        let unsure = boundary.unsure - all[from].unsure > UNSURE_EDGES;
        if !used(boundary) || k - from >= PART || unsure {
            parts.push(&all[from..k]);
            from = if used(boundary) { k } else { k + 1 };
        }
    }
    parts.push(&all[from.min(all.len())..]);
    parts.retain(|part| part.len() >= LEAST_PART);
    parts
}

/// Rows of equations: unknowns' coefficients, and what they are to give.
struct Equations {
    unknowns: usize,
    rows: Vec<f64>,
    right: Vec<f64>,
}

impl Equations {
    /// The two rows of each boundary, every part's from its mean. With a fit that is known the last unknown is a turn of the frame.
    fn of(boundaries: &[Boundary], basis: &Basis, known: Option<&Fit>) -> Self {
        let unknowns = basis.len() + 2 + usize::from(known.is_some());
        let mut equations = Self { unknowns, rows: Vec::new(), right: Vec::new() };
        for part in parts(boundaries) {
            let mut own: [Vec<Vec<f64>>; 2] = [Vec::new(), Vec::new()];
            for boundary in part {
                let [along_d, along_q] = basis.flux(boundary.current);
                let mut pair = [Vec::with_capacity(unknowns + 1), Vec::with_capacity(unknowns + 1)];
                for (d, q) in along_d.iter().zip(&along_q) {
                    let flux = turned(boundary.frame, [*d, *q]);
                    pair[0].push(flux[0]);
                    pair[1].push(flux[1]);
                }
                let turns = known.map(|fit| turned(boundary.frame, fit.turns(boundary.current)));
                for (axis, row) in pair.into_iter().enumerate() {
                    let mut row = row;
                    row.extend([boundary.charge[axis], boundary.lacking[axis]]);
                    row.extend(turns.map(|turns| turns[axis]));
                    row.push(boundary.volt_seconds[axis]);
                    own[axis].push(row);
                }
            }
            own.into_iter().for_each(|rows| equations.add_from_mean(rows));
        }
        equations
    }

    fn add_from_mean(&mut self, rows: Vec<Vec<f64>>) {
        let count = rows.len() as f64;
        let mean: Vec<f64> =
            (0..=self.unknowns).map(|k| rows.iter().map(|row| row[k]).sum::<f64>() / count).collect();
        for row in rows {
            let mut less = row.iter().zip(&mean).map(|(value, mean)| value - mean);
            self.rows.extend(less.by_ref().take(self.unknowns));
            self.right.extend(less);
        }
    }

    /// The wish that flux linkages bend little, all over the rectangle: what no sample shows goes on straight.
    fn smooth(&mut self, basis: &Basis, weight: f64) {
        let weight = weight * (self.right.len() as f64 / 2.0 / f64::from(GRID.0 * GRID.1)).sqrt();
        for current in basis.grid(GRID.0, GRID.1) {
            for (orders, share) in
                [((3, 0), 1.0), ((2, 1), 3.0_f64.sqrt()), ((1, 2), 3.0_f64.sqrt()), ((0, 3), 1.0)]
            {
                let bends = basis.derivative(current, orders);
                self.rows.extend(bends.into_iter().map(|value| weight * share * value));
                self.rows.resize(self.rows.len() + self.unknowns - basis.len(), 0.0);
                self.right.push(0.0);
            }
        }
    }

    /// The solution by least squares.
    fn solve(&self) -> Result<Vec<f64>> {
        let matrix = DMatrix::from_row_slice(self.right.len(), self.unknowns, &self.rows);
        // Columns of one length, so that rounding treats all alike.
        let lengths: Vec<f64> =
            matrix.column_iter().map(|column| column.norm().max(f64::MIN_POSITIVE)).collect();
        let mut scaled = matrix;
        for (mut column, length) in scaled.column_iter_mut().zip(&lengths) {
            column /= *length;
        }
        let qr = scaled.qr();
        let right = qr.q().transpose() * DVector::from_column_slice(&self.right);
        let solution = qr.r().solve_upper_triangular(&right);
        let solution = solution.filter(|found| found.iter().all(|value| value.is_finite()));
        ensure!(
            solution.is_some(),
            "the observations do not tell the machine: the equations have no one solution"
        );
        let found = solution.unwrap_or_default();
        Ok(found.iter().zip(&lengths).map(|(value, length)| value / length).collect())
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
        Ok(fit)
    }

    fn solved(&self, known: Option<&Fit>) -> Result<Fit> {
        let boundaries = &self.boundaries(known);
        let basis = Basis::new(self.bound_a);
        let mut equations = Equations::of(boundaries, &basis, known);
        let count = self.observations.len();
        ensure!(
            equations.right.len() > 4 * equations.unknowns,
            "{count} observations: too few for a flux map"
        );
        let samples = equations.right.len();
        equations.smooth(&basis, SMOOTHNESS * self.bound_a * self.bound_a);
        let mut terms = equations.solve()?;
        let residual = |row: usize| {
            let own = &equations.rows[row * equations.unknowns..(row + 1) * equations.unknowns];
            equations.right[row] - own.iter().zip(&terms).map(|(a, b)| a * b).sum::<f64>()
        };
        let left: Vec<f64> = (0..samples).map(residual).collect();
        let residuals = by_boundary(boundaries, &left);
        let more_rad = if known.is_some() { terms.pop().unwrap_or(f64::NAN) } else { 0.0 };
        let zero_rad = known.map_or(0.0, |fit| fit.zero_rad) + more_rad.clamp(-MOST_RAD, MOST_RAD);
        let dead_time_s = terms.pop().unwrap_or(f64::NAN);
        let resistance_ohm = terms.pop().unwrap_or(f64::NAN);
        Ok(Fit { basis, terms, resistance_ohm, dead_time_s, zero_rad, residuals })
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
    fn turns(&self, (id, iq): (f64, f64)) -> [f64; 2] {
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

    /// Flux linkages along d and q at a current in A, in Wb.
    pub fn flux(&self, id_a: f64, iq_a: f64) -> (f64, f64) {
        let [d, q] = self.basis.flux((id_a, iq_a));
        let sum = |gives: &[f64]| gives.iter().zip(&self.terms).map(|(a, b)| a * b).sum();
        (sum(&d), sum(&q))
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

/// Residuals of both rows of each boundary, in the rotor's frame.
fn by_boundary(boundaries: &[Boundary], left: &[f64]) -> Vec<(Stage, [f64; 2])> {
    let mut found = Vec::with_capacity(boundaries.len());
    let mut begins = 0;
    for part in parts(boundaries) {
        for (k, boundary) in part.iter().enumerate() {
            let pair = [left[begins + k], left[begins + part.len() + k]];
            let (sin, cos) = boundary.frame;
            found.push((boundary.stage, turned((-sin, cos), pair)));
        }
        begins += 2 * part.len();
    }
    found
}
