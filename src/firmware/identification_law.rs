//! The law whose voltages reveal the properties of an unknown machine. If the rig commands it, each observation is sent to the host at once; over the
//! protocol the observations are kept, and sent in frames once the experiment is over.

use crate::qemu::{self, exchange};
use core::sync::atomic::{AtomicBool, Ordering};
use tractive::built_in::traction::{BUILT_IN, BuiltIn};
use tractive::drive::traction::{ControlTask, Shared};
use tractive::experiment::{Memory, Teller};
use tractive::identification::{Identification, Units};
use tractive::operator::{Feedback, OperatorPort, Request, Status};
use tractive::ports::Report;
use tractive::protocol::CanEndpoint;
use tractive::time::Instant;
use tractive::wire::Setup;

/// The law.
pub type Law = Identification;

/// The law before the first interrupt.
pub const AT_REST: Law = Identification::new();

static MEMORY: Memory = Memory::new();
static UNITS: Units = Units::of(&BUILT_IN.ratings);
static OVER_PROTOCOL: AtomicBool = AtomicBool::new(false);

/// Opens the link and fetches the set-up. Nothing compensates the dead time, whatever the host says: the fit uses the pulses as they are commanded.
pub fn connect() -> Setup {
    let setup = qemu::connect();
    OVER_PROTOCOL.store(setup.over_protocol, Ordering::Relaxed);
    Setup { uncompensated: true, dead_time_ticks: 0, ..setup }
}

/// Its set-up before the first interrupt's work: none.
pub const SET_UP: Option<fn(&mut ControlTask<BuiltIn, Law>)> = None;

/// Its words for the host at the end of a control interrupt, beside the report: the newest observation, unless it is kept.
pub fn tell(task: &mut ControlTask<BuiltIn, Law>, shared: &Shared, now: Instant) {
    let newest = task.law_mut().take();
    if OVER_PROTOCOL.load(Ordering::Relaxed) {
        MEMORY.take(newest.as_ref(), &UNITS, shared.operator.has_told(now));
    } else if let Some(observation) = newest {
        exchange::observed(now, &observation);
    }
}

/// The idle loop's side of the board, with the experiment's frames in the slots that the drive's frames leave free.
pub struct Idle {
    /// The protocol, if the operator's request comes over it; `None`: the rig's request comes in words.
    pub station: Option<&'static mut CanEndpoint>,
    teller: Teller,
}

impl Idle {
    /// The state at power-up.
    pub const fn new(station: Option<&'static mut CanEndpoint>) -> Self {
        Self { station, teller: Teller::new() }
    }
}

impl OperatorPort for Idle {
    fn ask(&mut self, at: Instant, slots: u32) -> (Request, Feedback) {
        let (request, feedback, frame) = exchange::ask(at);
        let request = match &mut self.station {
            Some(station) => station.listen(slots, frame.as_ref()),
            None => request,
        };
        (request, feedback)
    }

    fn tell(&mut self, from: Instant, status: &Status, report: Option<&Report>) {
        let own = self.station.as_mut().and_then(|station| station.tell(status, report));
        let frame = match own {
            None if self.station.is_some() => self.teller.tell(&MEMORY),
            frame => frame,
        };
        exchange::tell(from, status, frame);
    }
}
