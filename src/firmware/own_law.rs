//! The project's own control law, which needs no set-up.

use crate::qemu;
use tractive::built_in::traction::BuiltIn;
use tractive::control::Controller;
use tractive::drive::traction::ControlTask;
use tractive::modulation::Ladder;
use tractive::wire::Setup;

/// The law.
pub type Law = Controller;

/// The law before the first interrupt.
pub const AT_REST: Law = Controller::new();

/// Opens the link and fetches the set-up.
pub fn connect() -> Setup {
    qemu::connect()
}

/// Its set-up before the first interrupt's work: none.
pub const SET_UP: Option<fn(&mut ControlTask<BuiltIn, Law>)> = None;

/// The ladder of modes: the paper's, which the PWM task has without being told.
pub const LADDER: Option<Ladder> = None;

/// Highest frequency of the free carrier, as a share of the switches'.
pub const FREE_CARRIER_SHARE: f32 = 1.0;
