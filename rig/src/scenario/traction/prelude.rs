//! The names that every scenario of the PMaSynRM drive is written with.

pub use super::{Options, Plan, Traction};
pub use crate::analysis::{self, Figures};
pub use crate::machine::Machine;
pub use crate::options::{RunOptions, finite};
pub use crate::report::{Curve, Page};
pub use crate::rows::mean;
pub use crate::scenario::Scenario;
pub use crate::trace::{Recorded, Recording, Row};
pub use crate::verdict::{Verdict, torque_bound, worst};
pub use clap::Args;
pub use serde::Serialize;
pub use tractive::control::Demand;
