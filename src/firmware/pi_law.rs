//! The papers' ordinary control law; the host gives the start of its MTPA.

use crate::qemu;
use core::sync::atomic::{AtomicBool, Ordering};
use tractive::built_in::traction::BuiltIn;
use tractive::control::{MtpaStart, PiLaw};
use tractive::drive::traction::{ControlTask, Shared};
use tractive::time::Instant;
use tractive::wire::Setup;

/// The law.
pub type Law = PiLaw;

/// The law before the first interrupt.
pub const AT_REST: Law = PiLaw::new();

static STARTS_AT_ZERO: AtomicBool = AtomicBool::new(false);

/// Opens the link and fetches the set-up, with the start of MTPA.
pub fn connect() -> Setup {
    let (setup, start) = qemu::connect_with_start();
    STARTS_AT_ZERO.store(start == MtpaStart::Zero, Ordering::Relaxed);
    setup
}

/// Its set-up before the first interrupt's work.
pub const SET_UP: Option<fn(&mut ControlTask<BuiltIn, Law>)> = Some(set_up);

/// The idle loop's side of the board.
pub use qemu::Idle;

/// Its words for the host at the end of a control interrupt, beside the report: nothing.
#[inline(always)]
pub fn tell(_task: &mut ControlTask<BuiltIn, Law>, _shared: &Shared, _now: Instant) {}

fn set_up(task: &mut ControlTask<BuiltIn, Law>) {
    if STARTS_AT_ZERO.load(Ordering::Relaxed) {
        task.set_law(PiLaw::starting(MtpaStart::Zero));
    }
}
