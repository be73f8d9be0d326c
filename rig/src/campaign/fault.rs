//! Faults with their names and rules, whatever a drive's faults are made of.

use super::judge::Rule;
use crate::inject::sensor::CurrentFault;
use tractive::protection::Fault;

/// A fault with its name and its rule.
#[derive(Clone, Debug)]
pub struct Named<C> {
    /// What the tables call it.
    pub name: String,
    /// What it is made of.
    pub cause: C,
    /// What may come of it.
    pub rule: Rule,
    /// One of its kind is enough for the fast campaign.
    pub fast: bool,
}

impl<C> Named<C> {
    /// A fault that the drive may call by these names, or go on with at a mean torque error of this share.
    pub fn new(name: &str, cause: C, names: &'static [Fault], torque_share: Option<f64>, fast: bool) -> Self {
        Self { name: name.to_owned(), cause, rule: Rule { names, torque_share }, fast }
    }
}

/// Mean torque error where a fault must not be felt, as a share of the largest torque.
pub const UNFELT: f64 = 0.03;
/// Where a sensor bends the torque.
pub const BENT: f64 = 0.1;

/// Sizes of what a current sensor does wrong.
#[derive(Clone, Copy, Debug)]
pub struct SensorErrors {
    /// Offset, in A.
    pub offset_a: f64,
    /// Reading over the true current.
    pub scale: f64,
    /// Noise, rms, in A.
    pub noise_a: f64,
    /// Range of the converter, in A.
    pub range_a: f64,
}

/// How a current sensor fails, what that may be called, and the torque error where it may pass.
pub type SensorFailure = (&'static str, CurrentFault, &'static [Fault], Option<f64>);

impl SensorErrors {
    /// What every phase's sensor can do.
    pub const fn failures(&self) -> [SensorFailure; 6] {
        const SUM: &[Fault] = &[Fault::PhaseSum];
        const TOO_MUCH: &[Fault] = &[Fault::PhaseSum, Fault::Overcurrent];
        const RAILED: &[Fault] = &[Fault::Overcurrent];
        [
            ("stuck", CurrentFault::Stuck, SUM, Some(BENT)),
            ("open", CurrentFault::Open, SUM, Some(BENT)),
            ("offset", CurrentFault::Offset(self.offset_a), SUM, None),
            ("scaled", CurrentFault::Scaled(self.scale), TOO_MUCH, Some(BENT)),
            ("noisy", CurrentFault::Noisy(self.noise_a), SUM, None),
            ("railed", CurrentFault::Railed(-self.range_a), RAILED, None),
        ]
    }
}
