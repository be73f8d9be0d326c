//! The law whose voltages show what an unknown machine is like; the host is told what was observed.

use crate::qemu;
use tractive::built_in::traction::BuiltIn;
use tractive::drive::traction::ControlTask;
use tractive::identification::Identification;
use tractive::time::Instant;
use tractive::wire::Setup;

/// The law.
pub type Law = Identification;

/// The law before the first interrupt.
pub const AT_REST: Law = Identification::new();

/// Opens the link and fetches the set-up.
pub fn connect() -> Setup {
    qemu::connect()
}

/// Its set-up before the first interrupt's work: none.
pub const SET_UP: Option<fn(&mut ControlTask<BuiltIn, Law>)> = None;

/// Its words for the host at the end of a control interrupt, beside the report: the newest observation.
pub fn tell(task: &mut ControlTask<BuiltIn, Law>, now: Instant) {
    if let Some(observation) = task.law_mut().take() {
        qemu::exchange::observed(now, &observation);
    }
}
