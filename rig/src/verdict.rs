//! Figures beside what is wanted of them.

use crate::options::RunOptions;
use serde::Serialize;

/// A figure, its bound, and whether it is kept.
#[derive(Clone, Debug, Serialize)]
pub struct Verdict {
    /// What is judged, with its unit.
    pub what: String,
    /// Found.
    pub found: f64,
    /// Wanted at most.
    pub at_most: f64,
    /// `pass` or `falls short`.
    pub verdict: &'static str,
    /// What the paper, or an ordinary controller in simulation, reached.
    pub others: &'static str,
}

impl Verdict {
    /// Judges a figure that should be at most so large.
    pub fn at_most(what: &str, found: f64, at_most: f64, others: &'static str) -> Self {
        let verdict = if found <= at_most { "pass" } else { "falls short" };
        Self { what: what.to_owned(), found, at_most, verdict, others }
    }

    /// Whether the bound is kept.
    pub fn passes(&self) -> bool {
        self.verdict == "pass"
    }
}

/// The largest of some values; 0 of none.
pub fn worst(values: impl Iterator<Item = f64>) -> f64 {
    values.fold(0.0, f64::max)
}

/// A bound for ideal inverter and sensors, and one for flaws.
pub fn bound(options: &RunOptions, ideal: f64, with_flaws: f64) -> f64 {
    if options.is_ideal() { ideal } else { with_flaws }
}
