//! The drive in QEMU: the image's own interrupts, in lockstep with the bench over four FIFOs.

use super::calls::Calls;
use super::emulator::{Emulator, emulate};
use super::{Progress, Supervisor};
use crate::bench::Bench;
use crate::trace::Recording;
use anyhow::{Result, bail};
use tractive::modulation::Mode;
use tractive::wire::{self, Request, Setup};

/// Runs until the recording is complete; a supervisor commands over the protocol.
pub fn run_in_qemu(
    name: &str,
    mut bench: Bench,
    setup: Setup,
    emulator: &Emulator,
    mut supervisor: Option<&mut dyn Supervisor>,
) -> Result<Recording> {
    let (mut calls, mut records) = (Calls::new(Mode::default().name()), Vec::new());
    let mut progress = Progress::new(name);
    let outcome = emulate(emulator, |block, answers| {
        let Some(request) = Request::from_block(block) else {
            bail!("the firmware sent a request that is none: {block:?}");
        };
        match request {
            Request::Hello => answers.control(&wire::setup_to_block(setup))?,
            Request::ControlSample(at) => {
                let sample = bench.control_sample(at)?;
                let done = bench.is_done();
                answers.control(&wire::sample_to_block(&sample, done))?;
            }
            Request::ControlReport(at, report) => {
                calls.traction(&report);
                bench.control_report(at, report);
            }
            Request::PwmSample(at) => answers.pwm(&wire::currents_to_block(bench.pwm_sample(at)?))?,
            Request::Play(at, half) => {
                calls.mode = half.mode.name().to_owned();
                calls.pwm();
                bench.play(at, half);
            }
            Request::Enter(at, safe) => bench.enter(at, safe),
            Request::Leave(at) => bench.leave(at),
            Request::Ask(at) => {
                let (asked, feedback) = bench.ask(at)?;
                let frame = match &mut supervisor {
                    Some(supervisor) => super::turn(*supervisor, &mut bench, at)?,
                    None => None,
                };
                answers.idle(&wire::asked_to_block(&asked, &feedback, frame))?;
            }
            Request::Tell(from, status, frame) => {
                bench.told(from, status)?;
                if let (Some(supervisor), Some(frame)) = (&mut supervisor, frame) {
                    supervisor.hear(bench.instant_s(from), &frame);
                }
            }
            Request::Recorded(record) => records.push(record),
            Request::End => return Ok(true),
            Request::Dead => bail!("the firmware stopped in a panic or a HardFault, gates off"),
        }
        progress.show(bench.progress());
        Ok(false)
    });
    calls.write(emulator.calls.as_deref())?;
    outcome?;
    Ok(bench.into_recording(records))
}
