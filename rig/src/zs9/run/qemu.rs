//! In QEMU: the image's own interrupts, in lockstep with the bench.

use crate::run::{Emulator, Progress, emulate};
use crate::zs9::bench::Bench;
use crate::zs9::trace::Recording;
use anyhow::{Result, bail};
use tractive::link::{self, DualRequest, DualSetup};

/// Runs until the recording is complete.
///
/// # Errors
/// Where the bench cannot go on, or the emulator ends early.
pub fn run_in_qemu(name: &str, mut bench: Bench, setup: DualSetup, emulator: &Emulator) -> Result<Recording> {
    let mut progress = Progress::new(name);
    emulate(emulator, |block, answers| {
        let Some(request) = DualRequest::from_block(block) else {
            bail!("the firmware sent a request that is none: {block:?}");
        };
        match request {
            DualRequest::Hello => answers.control(&link::dual_setup_to_block(setup))?,
            DualRequest::ControlSample(at) => {
                let sample = bench.control_sample(at)?;
                let done = bench.is_done();
                answers.control(&link::dual_sample_to_block(&sample, done))?;
                if done {
                    return Ok(true);
                }
            }
            DualRequest::ControlReport(at, report) => bench.control_report(at, report),
            DualRequest::PowerSample(at) => answers.pwm(&link::power_to_block(&bench.power_sample(at)?))?,
            DualRequest::Play(_, next) => bench.play(next),
            DualRequest::GatesOff(at) => bench.gates_off(at),
            DualRequest::Dead => bail!("the firmware stopped in a panic or a HardFault, gates off"),
        }
        progress.show(bench.progress());
        Ok(false)
    })?;
    let (rows, edges) = bench.into_recording();
    Ok(Recording { rows, edges })
}
