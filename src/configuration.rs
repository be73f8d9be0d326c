//! The settings of both drives, checked at start-up beside what [`tractive_control::configuration`] checks.
//!
//! The table generator refuses the same when an image is built; and what an image holds from then on, its tables, the compiler
//! itself checks, so that only the settings are left for the start-up. The only loop of the interrupts whose length is configured
//! runs over the carriers of a control period.

#![forbid(unsafe_code)]

mod drives;

pub use drives::LATEST_ANGLE_S;
pub use tractive_control::configuration::Refused;
