//! Linear equations of a co-energy's terms, their solution by least squares, and its certainty.

use super::basis::Basis;
use super::spread::Spread;
use anyhow::{Context, Result};
use nalgebra::{DMatrix, DVector};

/// Rows of a block of the factorisation.
const BLOCK: usize = 512;
/// Number of currents along d and q at which the map's bends are weighted.
const GRID: (u32, u32) = (26, 18);

/// Rows of equations: the unknowns' coefficients, and the right-hand sides.
pub struct Equations {
    unknowns: usize,
    rows: Vec<f64>,
    right: Vec<f64>,
    /// Number of rows that come from samples.
    samples: usize,
}

impl Equations {
    /// Equations without a row yet.
    pub const fn new(unknowns: usize) -> Self {
        Self { unknowns, rows: Vec::new(), right: Vec::new(), samples: 0 }
    }

    /// Takes the rows so far as samples; the rows to come are wishes.
    pub const fn close_samples(&mut self) {
        self.samples = self.right.len();
    }

    /// `true` if there are far more samples than unknowns.
    pub fn suffice(&self) -> bool {
        self.samples > 4 * self.unknowns
    }

    /// Adds rows of samples, each with its right-hand side as the last value, every row less the mean of all.
    pub fn add_from_mean(&mut self, rows: Vec<Vec<f64>>) {
        let count = rows.len() as f64;
        let mean: Vec<f64> =
            (0..=self.unknowns).map(|k| rows.iter().map(|row| row[k]).sum::<f64>() / count).collect();
        for row in rows {
            let mut less = row.iter().zip(&mean).map(|(value, mean)| value - mean);
            self.rows.extend(less.by_ref().take(self.unknowns));
            self.right.extend(less);
        }
    }

    /// Adds a row: the coefficients of the co-energy's terms, and the right-hand side.
    pub fn add(&mut self, terms: impl IntoIterator<Item = f64>, gives: f64) {
        self.rows.extend(terms);
        self.right.push(gives);
        self.rows.resize(self.right.len() * self.unknowns, 0.0);
    }

    /// The same with known values for the unknowns besides the co-energy's terms.
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

    /// Adds the wish that the co-energy's derivatives of an order are small all over the rectangle, weighted against a sample's residual.
    pub fn smooth(&mut self, basis: &Basis, order: usize, weight: f64) {
        let weight = weight * (self.samples as f64 / 2.0 / f64::from(GRID.0 * GRID.1)).sqrt();
        for current in basis.grid(GRID.0, GRID.1) {
            // Equal weight in every direction.
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
    /// Equations without a unique solution.
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

    /// The residual of each sample's pair of rows when the others alone predict it: by the pair's own weight in the solution.
    pub fn left_out(&self, solution: &Solution) -> Vec<[f64; 2]> {
        let row = |k: usize| solution.spread.leverage(&self.rows[k * self.unknowns..(k + 1) * self.unknowns]);
        let pair = |k: usize| {
            let (a, b) = (row(k), row(k + 1));
            let (aa, ab, bb) = (1.0 - a.dot(&a), -a.dot(&b), 1.0 - b.dot(&b));
            let determinant = (aa * bb - ab * ab).max(f64::MIN_POSITIVE);
            let (d, q) = (solution.left[k], solution.left[k + 1]);
            [(bb * d - ab * q) / determinant, (aa * q - ab * d) / determinant]
        };
        (0..self.samples).step_by(2).map(pair).collect()
    }

    /// The columns' lengths, by which they are divided so that rounding affects all alike.
    fn lengths(&self) -> Vec<f64> {
        let mut squares = vec![0.0; self.unknowns];
        for row in self.rows.chunks_exact(self.unknowns) {
            squares.iter_mut().zip(row).for_each(|(square, value)| *square += value * value);
        }
        squares.into_iter().map(|square: f64| square.sqrt().max(f64::MIN_POSITIVE)).collect()
    }

    /// The triangular factor of the rows and its right-hand side, by QR of one block of rows after the other below the factor of those before: a
    /// block stays in the processor's cache.
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

    /// The residual of a row with these unknowns.
    fn left(&self, row: usize, unknowns: &[f64]) -> f64 {
        let own = &self.rows[row * self.unknowns..(row + 1) * self.unknowns];
        self.right[row] - own.iter().zip(unknowns).map(|(a, b)| a * b).sum::<f64>()
    }
}

/// A solution by least squares.
pub struct Solution {
    /// The unknowns.
    pub unknowns: Vec<f64>,
    /// The residual of each sample's row.
    pub left: Vec<f64>,
    /// Its covariance.
    pub spread: Spread,
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Samples of a polynomial with a small deviation, without one pair of rows, with a wish for smoothness.
    fn equations(basis: &Basis, without: Option<usize>) -> Equations {
        let mut equations = Equations::new(basis.len());
        for k in (0..150).filter(|k| Some(*k) != without) {
            let (x, y) = ((7.0 * f64::from(k as u32)).sin(), (3.0 * f64::from(k as u32)).cos());
            let [d, q] = basis.flux((-40.0 + 60.0 * x, 100.0 * y));
            equations.add(d, x + 0.1 * x * y * y + 0.01 * (11.0 * x).sin());
            equations.add(q, y + 0.1 * x * x * y);
        }
        equations.close_samples();
        equations.smooth(basis, 3, 0.1);
        equations
    }

    #[test]
    fn a_sample_that_is_left_out_is_foretold_as_by_the_others_alone() {
        let basis = Basis::new(100.0);
        let all = equations(&basis, None);
        let told = all.left_out(&all.solve().unwrap());
        for k in [0, 30, 149] {
            // The wishes' weight depends on the number of samples.
            let mut others = equations(&basis, Some(k));
            let wishes = others.samples * others.unknowns;
            let scale = (150.0_f64 / 149.0).sqrt();
            others.rows[wishes..].iter_mut().for_each(|value| *value *= scale);
            let terms = others.solve().unwrap().unknowns;
            for (row, told) in [2 * k, 2 * k + 1].into_iter().zip(told[k]) {
                let found = all.left(row, &terms);
                assert!((found - told).abs() < 1e-6 * found.abs(), "{k}: {found}, {told}");
            }
        }
    }
}
