//! The project's own control law for both motors.

use tractive::control::Controller;
use tractive::drive::dual::TRACKING_RAD_S;

/// The law.
pub type Law = Controller<false>;

/// A motor's law before the first interrupt.
pub const AT_REST: Law = Controller::with_tracking(TRACKING_RAD_S);
