//! The PMaSynRM drive's image in QEMU.

use crate::bench::{Bench, Sampled, Simulated};
use crate::run::{Emulator, Supervisor, in_qemu};
use crate::trace::Recording;
use anyhow::{Result, bail};
use tractive::modulation::Mode;
use tractive::wire::{self, Block, Request};

/// Runs until the recording is complete, with the set-up that answers the image's first request; a supervisor gives commands over the protocol.
pub fn run_in_qemu(
    name: &str,
    bench: Bench,
    hello: Block,
    emulator: &Emulator,
    supervisor: Option<&mut dyn Supervisor>,
) -> Result<Recording> {
    in_qemu((name, Mode::default().name()), bench, emulator, supervisor, |block, answers, served| {
        let Some(request) = Request::from_block(block) else {
            bail!("the firmware sent a request that is none: {block:?}");
        };
        let bench = &mut served.bench;
        match request {
            Request::Hello => answers.control(&hello)?,
            Request::ControlSample(at) => {
                let Sampled { sample, command, counted } = bench.control_sample(at)?;
                let done = bench.is_done();
                answers.control(&wire::sample_to_block(&sample, &command, counted, done))?;
            }
            Request::ControlReport(at, report) => {
                served.calls.traction(&report);
                bench.control_report(at, report);
            }
            Request::PwmSample(at) => answers.pwm(&wire::currents_to_block(bench.pwm_sample(at)?))?,
            Request::Play(at, half) => {
                served.calls.mode = half.mode.name().to_owned();
                served.calls.pwm();
                bench.play(at, half);
            }
            Request::Enter(at, safe) => bench.enter(at, safe),
            Request::Leave(at) => bench.leave(at),
            Request::Ask(at) => {
                let (asked, feedback) = bench.ask(at)?;
                let frame = served.turn(at)?;
                answers.idle(&wire::asked_to_block(&asked, &feedback, frame))?;
            }
            Request::Tell(from, status, frame) => {
                bench.told(from, status)?;
                served.hear(from, frame);
            }
            Request::Align(_, zero) => bench.align(zero),
            Request::Observed(at, observation) => bench.identified(at, observation),
            Request::Recorded(record) => served.records.push(record),
            Request::End => return Ok(true),
            Request::Dead => bail!("the firmware stopped in a panic or a HardFault, gates off"),
        }
        Ok(false)
    })
}
