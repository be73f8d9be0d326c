//! A drive in QEMU: the image's own interrupts, in lockstep with the bench over four FIFOs.

use super::calls::Calls;
use super::emulator::{Answers, Emulator, emulate};
use super::{Progress, Supervisor};
use crate::bench::Simulated;
use anyhow::Result;
use tractive::protocol::Frame;
use tractive::time::Instant;
use tractive::wire::Block;

/// The bench that the image runs on, and its records.
pub(crate) struct Served<'s, B: Simulated> {
    pub(crate) bench: B,
    pub(crate) calls: Calls,
    /// The records that the flight recorder has sent.
    pub(crate) records: Vec<B::Record>,
    supervisor: Option<&'s mut dyn Supervisor>,
}

impl<B: Simulated> Served<'_, B> {
    /// The supervisor's turn in the slot that began at `at`.
    pub(crate) fn turn(&mut self, at: Instant) -> Result<Option<Frame>> {
        match &mut self.supervisor {
            Some(supervisor) => super::turn(*supervisor, &mut self.bench, at),
            None => Ok(None),
        }
    }

    /// A frame for the supervisor, if there is one.
    pub(crate) fn hear(&mut self, from: Instant, frame: Option<Frame>) {
        if let (Some(supervisor), Some(frame)) = (&mut self.supervisor, frame) {
            supervisor.hear(self.bench.instant_s(from), &frame);
        }
    }
}

/// Runs until `answer` says for a block that the scenario is done; a supervisor gives commands over the protocol. `mode` is that of the
/// first interrupts.
pub(crate) fn in_qemu<B: Simulated>(
    (name, mode): (&str, &str),
    bench: B,
    emulator: &Emulator,
    supervisor: Option<&mut dyn Supervisor>,
    mut answer: impl FnMut(&Block, &mut Answers, &mut Served<B>) -> Result<bool>,
) -> Result<B::Recording> {
    let mut served = Served { bench, calls: Calls::new(mode), records: Vec::new(), supervisor };
    let mut progress = Progress::new(name);
    let outcome = emulate(emulator, |block, answers| {
        let done = answer(block, answers, &mut served)?;
        progress.show(served.bench.progress());
        Ok(done)
    });
    served.calls.write(emulator.calls.as_deref())?;
    outcome?;
    Ok(served.bench.into_recording(served.records))
}
