//! In QEMU: the image's own interrupts, in lockstep with the bench.

use crate::run::{Emulator, Progress, Supervised, Supervisor, emulate, turn};
use crate::zs9::bench::Bench;
use crate::zs9::trace::Recording;
use anyhow::{Context, Result, bail};
use tractive::drive::dual::DualReport;
use tractive::link::{self, DualRequest, DualSetup};

/// Runs until the recording is complete; a supervisor commands over the protocol.
///
/// # Errors
/// Where the bench cannot go on, or the emulator ends early.
pub fn run_in_qemu(
    name: &str,
    mut bench: Bench,
    setup: DualSetup,
    emulator: &Emulator,
    mut supervisor: Option<&mut dyn Supervisor>,
) -> Result<Recording> {
    let mut progress = Progress::new(name);
    let (mut calls, mut records) = (Calls::default(), Vec::new());
    let outcome = emulate(emulator, |block, answers| {
        let Some(request) = DualRequest::from_block(block) else {
            bail!("the firmware sent a request that is none: {block:?}");
        };
        match request {
            DualRequest::Hello => answers.control(&link::dual_setup_to_block(setup))?,
            DualRequest::ControlSample(at) => {
                let sample = bench.control_sample(at)?;
                let done = bench.is_done();
                answers.control(&link::dual_sample_to_block(&sample, done))?;
            }
            DualRequest::ControlReport(at, report) => {
                calls.control(&report, bench.speeds_rpm());
                bench.control_report(at, report);
            }
            DualRequest::PowerSample(at) => answers.pwm(&link::power_to_block(&bench.power_sample(at)?))?,
            DualRequest::Play(_, next) => {
                calls.pwm();
                bench.play(next);
            }
            DualRequest::GatesOff(at) => bench.gates_off(at),
            DualRequest::Leave(at) => bench.leave(at),
            DualRequest::Ask(at) => {
                let feedback = bench.ask(at)?;
                let frame = match &mut supervisor {
                    Some(supervisor) => turn(*supervisor, &mut bench, at)?,
                    None => None,
                };
                answers.idle(&link::dual_asked_to_block(&feedback, frame))?;
            }
            DualRequest::Tell(from, status, frame) => {
                bench.told(from, status)?;
                if let (Some(supervisor), Some(frame)) = (&mut supervisor, frame) {
                    supervisor.hear(bench.instant_s(from), &frame);
                }
            }
            DualRequest::Recorded(record) => records.push(record),
            DualRequest::End => return Ok(true),
            DualRequest::Dead => bail!("the firmware stopped in a panic or a HardFault, gates off"),
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

/// What every interrupt was about, in the order in which they ended: the scheme and what the motors do, as `rthd-braking`.
#[derive(Default)]
struct Calls {
    mode: String,
    lines: String,
}

impl Calls {
    /// A control interrupt, at these speeds.
    fn control(&mut self, report: &DualReport, speeds_rpm: [f64; 2]) {
        let braking = report.torque_nm.iter().zip(speeds_rpm).any(|(nm, rpm)| f64::from(*nm) * rpm < 0.0);
        let does = match report {
            _ if report.voltage_v == [0.0; 2] => None,
            _ if braking => Some("braking"),
            _ if report.weakening.contains(&true) => Some("weakening"),
            _ => Some("motoring"),
        };
        self.mode = does.map_or("off".to_owned(), |does| format!("{}-{does}", report.scheme.name()));
        self.lines += &format!("control,{},\n", self.mode);
    }

    /// A PWM interrupt.
    fn pwm(&mut self) {
        self.lines += &format!("pwm,{},\n", self.mode);
    }
}
