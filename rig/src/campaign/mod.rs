//! The fault campaign: everything that can go wrong, in every mode, at every speed, motoring, braking and coasting; what the drive
//! made of it, and whether that is good enough.

pub mod judge;
pub mod traction;

use serde::Serialize;

/// What the drive does when the fault comes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Action {
    /// Torque along the speed.
    Motoring,
    /// Torque against the speed.
    Braking,
    /// Pulses, and no torque.
    Coasting,
}

impl Action {
    /// All three.
    pub const ALL: [Self; 3] = [Self::Motoring, Self::Braking, Self::Coasting];

    /// The name in tables.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Motoring => "motoring",
            Self::Braking => "braking",
            Self::Coasting => "coasting",
        }
    }

    /// Sign of the torque.
    pub const fn sign(self) -> f64 {
        match self {
            Self::Motoring => 1.0,
            Self::Braking => -1.0,
            Self::Coasting => 0.0,
        }
    }
}
