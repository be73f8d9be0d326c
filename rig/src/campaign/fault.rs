//! Faults with their names and rules, whatever the type of a drive's faults.

use super::judge::Rule;
use crate::inject::ControlFault;
use crate::inject::sensor::CurrentFault;
use tractive::protection::Fault;

/// A fault with its name and its rule.
#[derive(Clone, Debug)]
pub struct Named<C> {
    /// The name in the tables.
    pub name: String,
    /// The cause.
    pub cause: C,
    /// The rule for its consequences.
    pub rule: Rule,
    /// One of its kind is enough for the fast campaign.
    pub fast: bool,
}

/// Faults in the order in which they come.
pub struct Faults<C>(pub Vec<Named<C>>);

impl<C> Faults<C> {
    /// A list that begins with no fault at all, which must not be noticeable; the others follow it.
    pub fn beginning_with(nothing: impl Into<C>) -> Self {
        let mut list = Self(Vec::new());
        list.add("none", nothing, &[], Some(UNFELT), true);
        list
    }

    /// Adds a fault that the drive may call by these names, or ride through with a mean torque error of this share.
    pub fn add(
        &mut self,
        name: &str,
        cause: impl Into<C>,
        names: &'static [Fault],
        torque_share: Option<f64>,
        fast: bool,
    ) {
        let rule = Rule { names, torque_share };
        self.0.push(Named { name: name.to_owned(), cause: cause.into(), rule, fast });
    }

    /// Adds the faults of the control interrupt, and a torque demand that is not a number.
    pub fn add_control<K: Into<C>>(&mut self, control: fn(ControlFault) -> K, demand_not_finite: K) {
        self.add("control-late", control(ControlFault::Late(100)), &[Fault::ControlDeadline], None, true);
        self.add("commands-lost", control(ControlFault::Stopped), &[Fault::StaleCommand], None, true);
        self.add("demand-not-finite", demand_not_finite, &[Fault::NotFinite], None, true);
    }
}

/// Mean torque error if a fault must not be noticeable, as a share of the largest torque.
pub const UNFELT: f64 = 0.03;
/// The share by which a sensor bends the torque.
pub const BENT: f64 = 0.1;

/// Sizes of a current sensor's errors.
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

/// The failure of a current sensor, the names that it may get, and the torque error with which it may pass.
pub type SensorFailure = (&'static str, CurrentFault, &'static [Fault], Option<f64>);

impl SensorErrors {
    /// The errors of sensors for this multiple of the currents.
    pub const fn times(&self, scale: f64) -> Self {
        let Self { offset_a, noise_a, range_a, .. } = *self;
        Self { offset_a: scale * offset_a, noise_a: scale * noise_a, range_a: scale * range_a, ..*self }
    }

    /// The failures of every phase's sensor.
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
