//! No CAN.

use crate::run::Supervisor;
use anyhow::{Result, bail};

/// None: an error.
pub(crate) fn drive(interface: &str, _supervisor: &mut dyn Supervisor) -> Result<()> {
    bail!("--can {interface}: there is no CAN here")
}
