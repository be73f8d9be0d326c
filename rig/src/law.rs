//! The names of the control laws.

use clap::ValueEnum;
use serde::Serialize;
use tractive::named;

named! {
    /// The control law that the drive runs.
    #[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum, Serialize)]
    #[serde(rename_all = "lowercase")]
    pub enum LawName {
        /// The project's own
        Tractive => "tractive",
        /// The papers' ordinary one: PI loops on measured currents
        Pi => "pi",
    }
}
