//! The linear equations of a fit, their solution by least squares, and how sure it is.

use super::basis::Basis;
use super::boundary::{Boundary, turned};
use super::fit::Fit;
use super::spread::{BESIDE, Spread};
use anyhow::{Context, Result};
use nalgebra::{DMatrix, DVector};
use tractive::identification::Stage;

/// Boundaries in a part that counts from its own mean.
const PART: usize = 100;
/// Edges of an unsure sign after which a part ends: what they may have left out is no longer carried on. More of the turn, whose parts tell the magnets
/// by the turn that is in them: with 8 the worst of 100 experiments had 0.43 % of the magnets' flux linkage wrong, with 5 0.53 %, by the law of pulses before this one.
const UNSURE_EDGES: f64 = 1.5;
const UNSURE_EDGES_TURNING: f64 = 8.0;
/// Shortest part.
const LEAST_PART: usize = 4;
/// Rows of a block of the factorisation.
const BLOCK: usize = 512;
/// Currents along d and q at which the map's bends are weighed.
const GRID: (u32, u32) = (26, 18);

/// The boundaries that a solution is made of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scope {
    /// All with currents: pulses and turn.
    All,
    /// Those at standstill alone.
    Pulses,
}

impl Scope {
    /// `true` if a stage's boundaries are used: not those at no current, where no edge's sign is sure.
    fn uses(self, stage: Stage) -> bool {
        match stage {
            Stage::Probe | Stage::Rest | Stage::Done => false,
            Stage::Turn => self == Self::All,
            Stage::Staircase | Stage::AlongD | Stage::AlongQ | Stage::AlongBoth => true,
        }
    }
}

/// The parts that count from their own mean.
fn parts(all: &[Boundary], scope: Scope) -> Vec<&[Boundary]> {
    let (mut parts, mut from) = (Vec::new(), 0);
    for (k, boundary) in all.iter().enumerate() {
        let turns = boundary.stage == Stage::Turn;
        let most = if turns { UNSURE_EDGES_TURNING } else { UNSURE_EDGES };
        let unsure = boundary.unsure - all[from].unsure > most;
        let used = scope.uses(boundary.stage);
        if !used || k - from >= PART || unsure {
            parts.push(&all[from..k]);
            from = if used { k } else { k + 1 };
        }
    }
    parts.push(&all[from.min(all.len())..]);
    parts.retain(|part| part.len() >= LEAST_PART);
    parts
}

/// Rows of equations: unknowns' coefficients, and what they are to give.
pub struct Equations {
    unknowns: usize,
    rows: Vec<f64>,
    right: Vec<f64>,
    /// Rows that samples have made.
    samples: usize,
}

impl Equations {
    /// The two rows of each boundary, every part's from its mean. With a fit that is known the last unknown is a turn of the frame.
    pub fn of(boundaries: &[Boundary], basis: &Basis, known: Option<&Fit>, scope: Scope) -> Self {
        let unknowns = basis.len() + BESIDE + usize::from(known.is_some());
        let mut equations = Self { unknowns, rows: Vec::new(), right: Vec::new(), samples: 0 };
        for part in parts(boundaries, scope) {
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
                    row.extend([boundary.charge[axis], boundary.lacking[axis], boundary.opposed[axis]]);
                    row.extend(turns.map(|turns| turns[axis]));
                    row.push(boundary.volt_seconds[axis]);
                    own[axis].push(row);
                }
            }
            own.into_iter().for_each(|rows| equations.add_from_mean(rows));
        }
        equations.samples = equations.right.len();
        equations
    }

    /// `true` if there are far more samples than unknowns.
    pub fn suffice(&self) -> bool {
        self.samples > 4 * self.unknowns
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

    /// One more row: what the co-energy's terms are to give.
    pub fn add(&mut self, terms: impl IntoIterator<Item = f64>, gives: f64) {
        self.rows.extend(terms);
        self.right.push(gives);
        self.rows.resize(self.right.len() * self.unknowns, 0.0);
    }

    /// The same with the unknowns beside the co-energy's terms known.
    pub fn given(mut self, beside: &[f64]) -> Self {
        let terms = self.unknowns - beside.len();
        let rows = core::mem::take(&mut self.rows);
        for (row, right) in rows.chunks_exact(self.unknowns).zip(&mut self.right) {
            let (own, known) = row.split_at(terms);
            self.rows.extend(own);
            *right -= known.iter().zip(beside).map(|(a, b)| a * b).sum::<f64>();
        }
        Self { unknowns: terms, ..self }
    }

    /// The wish that the co-energy's derivatives of an order are small, all over the rectangle, with a weight beside a sample's residual.
    pub fn smooth(&mut self, basis: &Basis, order: usize, weight: f64) {
        let weight = weight * (self.samples as f64 / 2.0 / f64::from(GRID.0 * GRID.1)).sqrt();
        for current in basis.grid(GRID.0, GRID.1) {
            // As much in every direction.
            let mut binomial = 1.0_f64;
            for along_q in 0..=order {
                let along_d = order - along_q;
                let share = weight * binomial.sqrt();
                let bends = basis.derivative(current, (along_d, along_q));
                self.add(bends.into_iter().map(|value| share * value), 0.0);
                binomial *= along_d as f64 / (along_q + 1) as f64;
            }
        }
    }

    /// The solution by least squares.
    ///
    /// # Errors
    /// Equations without one.
    pub fn solve(&self) -> Result<Solution> {
        let lengths = self.lengths();
        let (factor, right) = self.factor(&lengths);
        let solution = factor.solve_upper_triangular(&right);
        let solution = solution
            .filter(|found| found.iter().all(|value| value.is_finite()))
            .context("the observations do not tell the machine: the equations have no one solution")?;
        let unknowns: Vec<f64> =
            solution.iter().zip(&lengths).map(|(value, length)| value / length).collect();
        let left: Vec<f64> = (0..self.samples).map(|row| self.left(row, &unknowns)).collect();
        let freedom = self.samples.saturating_sub(self.unknowns).max(1);
        let sigma = (left.iter().map(|value| value * value).sum::<f64>() / freedom as f64).sqrt();
        Ok(Solution { unknowns, left, spread: Spread { factor, lengths, sigma } })
    }

    /// The lengths of the columns, by which they are divided, so that rounding treats all alike.
    fn lengths(&self) -> Vec<f64> {
        let mut squares = vec![0.0; self.unknowns];
        for row in self.rows.chunks_exact(self.unknowns) {
            squares.iter_mut().zip(row).for_each(|(square, value)| *square += value * value);
        }
        squares.into_iter().map(|square: f64| square.sqrt().max(f64::MIN_POSITIVE)).collect()
    }

    /// The triangular factor of the rows and what it is to give, by QR of one block of them after the other below the factor of those before: a block stays in
    /// the processor's cache.
    fn factor(&self, lengths: &[f64]) -> (DMatrix<f64>, DVector<f64>) {
        let unknowns = self.unknowns;
        let mut factor = DMatrix::zeros(0, unknowns + 1);
        for (rows, right) in self.rows.chunks(BLOCK * unknowns).zip(self.right.chunks(BLOCK)) {
            let before = factor.nrows();
            let block = DMatrix::from_fn(before + right.len(), unknowns + 1, |row, column| {
                match (row.checked_sub(before), lengths.get(column)) {
                    (None, _) => factor[(row, column)],
                    (Some(row), Some(length)) => rows[row * unknowns + column] / length,
                    (Some(row), None) => right[row],
                }
            });
            factor = block.qr().unpack_r();
        }
        let right = factor.column(unknowns).rows(0, unknowns).into_owned();
        (factor.view((0, 0), (unknowns, unknowns)).into_owned(), right)
    }

    /// The rest of a row that the unknowns leave.
    fn left(&self, row: usize, unknowns: &[f64]) -> f64 {
        let own = &self.rows[row * self.unknowns..(row + 1) * self.unknowns];
        self.right[row] - own.iter().zip(unknowns).map(|(a, b)| a * b).sum::<f64>()
    }
}

/// A solution by least squares.
pub struct Solution {
    /// The unknowns.
    pub unknowns: Vec<f64>,
    /// The rest of each sample's row.
    pub left: Vec<f64>,
    /// Its covariance.
    pub spread: Spread,
}

/// Residuals of both rows of each boundary, in the rotor's frame.
pub fn by_boundary(boundaries: &[Boundary], scope: Scope, left: &[f64]) -> Vec<(Stage, [f64; 2])> {
    let mut found = Vec::with_capacity(boundaries.len());
    let mut begins = 0;
    for part in parts(boundaries, scope) {
        for (k, boundary) in part.iter().enumerate() {
            let pair = [left[begins + k], left[begins + part.len() + k]];
            let (sin, cos) = boundary.frame;
            found.push((boundary.stage, turned((-sin, cos), pair)));
        }
        begins += 2 * part.len();
    }
    found
}
