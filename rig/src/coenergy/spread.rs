//! The covariance of a fit's unknowns.

use nalgebra::{DMatrix, DVector};

/// The covariance of a solution: the triangular factor of its equations, the lengths of their columns, and the standard deviation of a row.
#[derive(Clone, Debug)]
pub struct Spread {
    pub(super) factor: DMatrix<f64>,
    pub(super) lengths: Vec<f64>,
    pub(super) sigma: f64,
}

impl Spread {
    /// Standard error of a sum of the unknowns with these shares, missing ones being 0, provided that the samples' residuals are noise,
    /// independent from sample to sample.
    pub fn error(&self, shares: &[f64]) -> f64 {
        self.sigma * self.leverage(shares).norm()
    }

    /// The vector whose square is the weight of a row with these shares in its own estimate.
    pub(super) fn leverage(&self, shares: &[f64]) -> DVector<f64> {
        let scaled = self.lengths.iter().enumerate();
        let scaled =
            scaled.map(|(k, length)| shares.get(k).map_or(0.0, |share| share / length)).collect::<Vec<_>>();
        let count = scaled.len();
        let solved = self.factor.tr_solve_upper_triangular(&DVector::from_vec(scaled));
        solved.unwrap_or_else(|| DVector::from_element(count, f64::NAN))
    }
}
