//! The drive's action when a fault occurs, and the time of the fault.

use serde::{Deserialize, Serialize};
use tractive::named;

named! {
    /// The drive's action when the fault occurs.
    #[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
    #[serde(rename_all = "kebab-case")]
    pub enum Action {
        /// Torque in the direction of rotation.
        Motoring => "motoring",
        /// Torque against the direction of rotation.
        Braking => "braking",
        /// Pulses, but no torque.
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

    /// Torque demanded at a time within a run's stages, as a share of the case's torque.
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
    /// The time at which the torque is applied, before the recording.
    pub torque_s: f64,
    /// The time at which the torque demand changes, so that a fault without effect so far does not stay hidden.
    pub turn_s: f64,
    /// End.
    pub end_s: f64,
    /// The time for which the aftermath is watched, in s.
    pub aftermath_s: f64,
}

/// Time before the recording, in s.
pub const LEAD_S: f64 = 0.12;
/// The time of the first fault, in s from the recording's beginning; it does not fall on a sample.
pub const FAULT_S: f64 = 0.005_037;
/// Delay of each case's fault after the one before, in s, so that faults occur at all angles.
const LATER_S: f64 = 0.000_173;
const LATER_STEPS: usize = 23;

/// The time of a case's fault, in s, by the case's number.
pub fn fault_s(number: usize) -> f64 {
    FAULT_S + LATER_S * (number % LATER_STEPS) as f64
}
