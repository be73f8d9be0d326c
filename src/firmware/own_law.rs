//! The project's own control law, which needs no set-up.

use crate::qemu;
use tractive::built_in::traction::BuiltIn;
use tractive::control::Controller;
use tractive::drive::traction::{ControlTask, Shared};
use tractive::time::Instant;
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

/// The idle loop's side of the board.
pub use qemu::Idle;

/// Its words for the host at the end of a control interrupt, beside the report: nothing.
#[inline(always)]
pub fn tell(_task: &mut ControlTask<BuiltIn, Law>, _shared: &Shared, _now: Instant) {}
