//! The papers' ordinary control law for both motors. The motors are linear, so the start of MTPA makes no difference.

use tractive::control::PiLaw;
use tractive::drive::dual::TRACKING_RAD_S;

/// The law.
pub type Law = PiLaw;

/// A motor's law before the first interrupt.
pub const AT_REST: Law = PiLaw::with_tracking(TRACKING_RAD_S);
