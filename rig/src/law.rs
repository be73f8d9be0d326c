//! The names of the control laws.

use clap::ValueEnum;
use serde::Serialize;

/// The control law that the drive runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum LawName {
    /// The project's own
    Tractive,
    /// The papers' ordinary one: PI loops on measured currents
    Pi,
}

impl LawName {
    /// As on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Tractive => "tractive",
            Self::Pi => "pi",
        }
    }
}
