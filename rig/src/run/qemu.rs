//! The drive in QEMU: the image's own interrupts, in lockstep with the bench over four FIFOs.

use super::Progress;
use super::emulator::{Emulator, emulate};
use crate::bench::Bench;
use crate::trace::Recording;
use anyhow::{Context, Result, bail};
use tractive::drive::Report;
use tractive::link::{self, Request, Setup};
use tractive::modulation::Mode;

/// Runs until the recording is complete.
pub fn run_in_qemu(name: &str, mut bench: Bench, setup: Setup, emulator: &Emulator) -> Result<Recording> {
    let (mut calls, mut records) = (Calls::default(), Vec::new());
    let mut progress = Progress::new(name);
    let outcome = emulate(emulator, |block, answers| {
        let Some(request) = Request::from_block(block) else {
            bail!("the firmware sent a request that is none: {block:?}");
        };
        match request {
            Request::Hello => answers.control(&link::setup_to_block(setup))?,
            Request::ControlSample(at) => {
                let sample = bench.control_sample(at)?;
                let done = bench.is_done();
                answers.control(&link::sample_to_block(&sample, done))?;
            }
            Request::ControlReport(at, report) => {
                calls.control(&report);
                bench.control_report(at, report);
            }
            Request::PwmSample(at) => answers.pwm(&link::currents_to_block(bench.pwm_sample(at)?))?,
            Request::Play(at, half) => {
                calls.pwm(half.mode);
                bench.play(at, half);
            }
            Request::Enter(at, safe) => bench.enter(at, safe),
            Request::Leave(at) => bench.leave(at),
            Request::Ask(at) => {
                let (asked, feedback) = bench.ask(at)?;
                answers.idle(&link::asked_to_block(&asked, &feedback))?;
            }
            Request::Tell(from, status) => bench.told(from, status)?,
            Request::Recorded(record) => records.push(record),
            Request::End => return Ok(true),
            Request::Dead => bail!("the firmware stopped in a panic or a HardFault, gates off"),
        }
        progress.show(bench.progress());
        Ok(false)
    });
    if let Some(path) = &emulator.calls {
        std::fs::write(path, &calls.lines).with_context(|| path.display().to_string())?;
    }
    outcome?;
    Ok(bench.into_recording(records))
}

/// What every interrupt was about, in the order in which they ended.
#[derive(Default)]
struct Calls {
    /// Of the newest half.
    mode: Mode,
    lines: String,
}

impl Calls {
    /// A control interrupt: the mode that it works for, and the stator frequency.
    fn control(&mut self, report: &Report) {
        self.lines += &format!("control,{},{}\n", self.mode.name(), report.frequency_hz);
    }

    /// A PWM interrupt, which made a half of this mode.
    fn pwm(&mut self, mode: Mode) {
        self.mode = mode;
        self.lines += &format!("pwm,{},\n", mode.name());
    }
}
