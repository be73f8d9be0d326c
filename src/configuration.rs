//! The settings of both drives, checked at start-up in addition to the checks of [`tractive_control::configuration`].
//!
//! The table generator makes the same checks when an image is built. From then on the compiler itself checks the contents of the image, its tables,
//! so that only the settings are left for the start-up. The only loop in the interrupts whose length is configured runs over the carriers of a
//! control period.

#![forbid(unsafe_code)]

mod drives;

pub use drives::LATEST_ANGLE_S;
pub use tractive_control::configuration::Refused;
