//! A running drive, whichever system it is.

use anyhow::{Result, bail};
use serde_json::Value;
use tractive_rig::scenario::live::Wanted;

/// The samples and events of a drive since the last time.
#[derive(Default)]
pub struct Taken {
    /// Time of the first row in s; `None` where there is no row.
    pub from_s: Option<f64>,
    /// Rows, one behind the other.
    pub rows: Vec<f32>,
    /// Edges: time in s; gate, and 16 more where it goes on.
    pub edges: Vec<f64>,
}

/// A row's values by the names of their columns.
pub type Column<R> = (&'static str, fn(&R) -> f64);

/// A drive on its bench.
pub trait Driven {
    /// The names of a row's values.
    fn columns(&self) -> Vec<String>;
    /// Lets so much time pass, in s.
    fn run(&mut self, seconds: f64) -> Result<()>;
    /// Time since it was switched on, in s.
    fn time_s(&self) -> f64;
    /// Adds the rows and edges since the last time.
    fn take(&mut self, taken: &mut Taken);
    /// The operator's and the drive's status.
    fn state(&self) -> Value;
    /// Names of the faults that can be injected.
    fn faults(&self) -> Vec<String>;
    /// The wishes.
    fn want(&mut self, wanted: Wanted);
    /// Sets something of motor 0 or 1, by its name.
    fn set(&mut self, name: &str, motor: usize, values: &[f64]) -> Result<()>;
    /// The fault is acknowledged.
    fn acknowledge(&mut self);
    /// Something goes wrong, by its name in the fault campaign.
    fn inject(&mut self, name: &str) -> Result<()>;
    /// Mends all that was injected.
    fn mend(&mut self);
    /// The bound that the pulses set to the current of motor 0 or 1 at the present operating point; nothing if the point is not steady. If the pulses
    /// repeat, lines of its spectrum: a frequency in Hz, a current in A, and so on; else the current in A, row by row.
    fn bound(&self, motor: usize) -> Vec<f64>;
}

/// Two values where they are wanted.
pub fn pair(name: &str, values: &[f64]) -> Result<(f64, f64)> {
    let [first, second] = values else { bail!("`{name}` takes two values") };
    Ok((*first, *second))
}

/// The one value where it is wanted.
pub fn single(name: &str, values: &[f64]) -> Result<f64> {
    let [value] = values else { bail!("`{name}` takes one value") };
    Ok(*value)
}

/// A number for JSON; text where it is not finite.
pub fn number(value: f32) -> Value {
    if value.is_finite() { f64::from(value).into() } else { value.to_string().into() }
}
