//! Figures beside what is wanted of them.

use crate::options::RunOptions;
use serde::Serialize;

/// What a verdict says where the bound is not kept.
pub const FALLS_SHORT: &str = "falls short";

/// A figure, its bound, and whether it is kept.
#[derive(Clone, Debug, Serialize)]
pub struct Verdict {
    /// What is judged, with its unit.
    pub what: String,
    /// Found.
    pub found: f64,
    /// Wanted at most; nothing where the figure is only reported.
    pub at_most: Option<f64>,
    /// `pass`, `falls short` or `reported`.
    pub verdict: &'static str,
    /// What the paper, or an ordinary controller in simulation, reached.
    pub others: &'static str,
}

impl Verdict {
    /// Judges a figure that should be at most so large; with an infinite bound it is reported.
    pub fn at_most(what: &str, found: f64, at_most: f64, others: &'static str) -> Self {
        let at_most = at_most.is_finite().then_some(at_most);
        let verdict = match at_most {
            None => "reported",
            Some(at_most) if found <= at_most => "pass",
            Some(_) => FALLS_SHORT,
        };
        Self { what: what.to_owned(), found, at_most, verdict, others }
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

/// A bound on the mean torque's error. An angle or a map that is wrong makes torque wrong: there it is only reported.
pub fn torque_bound(options: &RunOptions, ideal: f64, with_flaws: f64) -> f64 {
    let misled = options.angle_error != 0.0 || options.map_error != 0.0;
    if misled { f64::INFINITY } else { bound(options, ideal, with_flaws) }
}
