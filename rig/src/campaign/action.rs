//! The drive's action when a fault comes, and the time of it.

use serde::{Deserialize, Serialize};
use tractive::named;

named! {
    /// The drive's action when the fault comes.
    #[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
    #[serde(rename_all = "kebab-case")]
    pub enum Action {
        /// Torque along the speed.
        Motoring => "motoring",
        /// Torque against the speed.
        Braking => "braking",
        /// Pulses, and no torque.
        Coasting => "coasting",
    }
}

impl Action {
    /// Sign of the torque.
    pub const fn sign(self) -> f64 {
        match self {
            Self::Motoring => 1.0,
            Self::Braking => -1.0,
            Self::Coasting => 0.0,
        }
    }

    /// Torque wanted at a time of a run's stages, as a share of what is asked for.
    pub fn share(self, stages: &Stages, t_s: f64) -> f64 {
        match t_s {
            t_s if t_s < stages.torque_s => 0.0,
            t_s if t_s < stages.turn_s => self.sign(),
            _ if self == Self::Motoring => -0.5,
            _ => 0.5,
        }
    }
}

/// The stages of a run, in s from the recording's beginning.
#[derive(Clone, Copy, Debug)]
pub struct Stages {
    /// The time at which the torque comes, before the recording.
    pub torque_s: f64,
    /// The time at which another torque is wanted: a fault that has not shown must not hide for ever.
    pub turn_s: f64,
    /// End.
    pub end_s: f64,
    /// The time for which the aftermath is watched, in s.
    pub aftermath_s: f64,
}

/// Before the recording, in s.
pub const LEAD_S: f64 = 0.12;
/// The time of the first fault, in s from the recording's beginning: not at a sample.
pub const FAULT_S: f64 = 0.005_037;
/// Every case a little later than the one before, in s, so that faults come at all angles.
const LATER_S: f64 = 0.000_173;
const LATER_STEPS: usize = 23;

/// The time of a case's fault, in s, by the case's number.
pub fn fault_s(number: usize) -> f64 {
    FAULT_S + LATER_S * (number % LATER_STEPS) as f64
}
