//! The values that are drawn for a run at random.

use super::Outcome;

/// A dimension: its range, and its value if nothing is odd about it.
#[derive(Clone, Copy, Debug)]
pub struct Dimension {
    /// Its name, with its unit.
    pub name: &'static str,
    /// The lowest value.
    pub low: f64,
    /// The highest value.
    pub high: f64,
    /// The value of a sound drive; `None` if any is as good as another.
    pub sound: Option<f64>,
}

impl Dimension {
    /// The value at a coordinate from 0 to 1.
    pub fn at(&self, coordinate: f64) -> f64 {
        self.low + (self.high - self.low) * coordinate
    }
}

/// The values that were drawn for a run.
#[derive(Clone, Debug)]
pub struct Drawn {
    /// Its number.
    pub run: usize,
    /// The seed of its noise.
    pub seed: u64,
    /// The modes that it went through, separated by >.
    pub modes: String,
    /// The source of the current reference when the fault occurred, or a note that there were no pulses.
    pub region: String,
    /// Its values, in the order of the dimensions.
    pub values: Vec<f64>,
}

/// A run.
#[derive(Clone, Debug)]
pub struct Run {
    /// Its outcome.
    pub outcome: Outcome,
    /// The values that were drawn for it.
    pub drawn: Drawn,
}
