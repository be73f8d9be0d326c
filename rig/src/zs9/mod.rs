//! The rig of the ZS9: two motors, the nine-switch bridge and the Z-source network, behind the drive's ports.

pub mod bench;
pub mod bound;
pub mod figures;
pub mod line;
mod operator;
pub mod run;
pub mod settings;
pub mod trace;

pub use operator::{Operator, Orders, SeenMotors};
