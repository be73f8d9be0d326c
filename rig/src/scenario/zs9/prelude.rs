//! The names that every scenario of the ZS9 is written with.

pub use super::scaled::{LINK_OFF_PERCENT, known, scaled_kg_m2, scaled_nm, scaled_rpm};
pub use super::{Options, Plan, Zs9, Zs9Options, free, judge, link_v, rad_s, ramp};
pub use crate::analysis::Figures;
pub use crate::machine::Machine;
pub use crate::plant::SpeedSource;
pub use crate::report::Page;
pub use crate::rows::mean;
pub use crate::scenario::Scenario;
pub use crate::verdict::Verdict;
pub use crate::zs9::figures::{self, Curve, DEMANDS, INDUCTOR, SPEEDS, TORQUES, VOLTAGES, plot};
pub use crate::zs9::trace::{Recording, Row};
pub use crate::zs9::{Orders, SeenMotors};
pub use clap::Args;
pub use serde::Serialize;
pub use tractive::control::Demand;
pub use tractive::ports::MotorDemand;
