//! Several drives on one line filter: how the others differ from the first, and the operator that all of them share.

use crate::bench::Operator;
use crate::plant::SpeedSource;
use anyhow::{Result, ensure};
use std::sync::{Arc, Mutex, PoisonError};

/// Share by which the wheels of each further drive on a line are larger.
const LARGER_WHEELS: f64 = 0.01;
/// The electrical angle at which each further drive's rotor begins, in turns.
const FURTHER_TURNS: f64 = 0.37;

/// The check that a drive is alone, for everything that has no place for others.
pub fn alone(drives: u32) -> Result<()> {
    ensure!(
        drives == 1,
        "--drives {drives}: only a scenario that is commanded directly has others beside its drive"
    );
    Ok(())
}

/// An operator shared by several drives.
pub struct Shared(Arc<Mutex<Box<dyn Operator + Send>>>);

impl Shared {
    /// Shares an operator.
    pub fn new(operator: Box<dyn Operator + Send>) -> Self {
        Self(Arc::new(Mutex::new(operator)))
    }

    /// The operator of one of them.
    pub fn operator(&self) -> Box<dyn Operator + Send> {
        let operator = Arc::clone(&self.0);
        Box::new(move |t_s: f64| operator.lock().unwrap_or_else(PoisonError::into_inner).demand(t_s))
    }
}

/// The speed of a further drive, numbered from 1 on: lower if it is prescribed.
pub fn speed(first: &SpeedSource, number: u32) -> SpeedSource {
    let share = 1.0 / (1.0 + f64::from(number) * LARGER_WHEELS);
    match first {
        SpeedSource::Profile(points) => {
            SpeedSource::profile(points.iter().map(|(t_s, rpm)| (*t_s, rpm * share)).collect())
        }
        free => free.clone(),
    }
}

/// The electrical angle at which its rotor begins, in turns.
pub fn turns(number: u32) -> f64 {
    f64::from(number) * FURTHER_TURNS
}
