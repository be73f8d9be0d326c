//! In QEMU: the image's own interrupts, in lockstep with the bench.

use crate::run::{Calls, Emulator, Progress, Supervised, Supervisor, emulate, turn};
use crate::zs9::bench::Bench;
use crate::zs9::trace::Recording;
use anyhow::{Result, bail};
use tractive::drive::dual::DualReport;
use tractive::wire::{self, DualRequest, DualSetup};

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
    let (mut calls, mut records) = (Calls::new(""), Vec::new());
    let outcome = emulate(emulator, |block, answers| {
        let Some(request) = DualRequest::from_block(block) else {
            bail!("the firmware sent a request that is none: {block:?}");
        };
        match request {
            DualRequest::Hello => answers.control(&wire::dual_setup_to_block(setup))?,
            DualRequest::ControlSample(at) => {
                let sample = bench.control_sample(at)?;
                let done = bench.is_done();
                answers.control(&wire::dual_sample_to_block(&sample, done))?;
            }
            DualRequest::ControlReport(at, report) => {
                calls.mode = what(&report, bench.speeds_rpm());
                calls.control();
                bench.control_report(at, report);
            }
            DualRequest::PowerSample(at) => answers.pwm(&wire::power_to_block(&bench.power_sample(at)?))?,
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
                answers.idle(&wire::dual_asked_to_block(&feedback, frame))?;
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
    calls.write(emulator.calls.as_deref())?;
    outcome?;
    Ok(bench.into_recording(records))
}

/// What a control interrupt was about: the scheme and what the motors do, as `rthd-braking`.
fn what(report: &DualReport, speeds_rpm: [f64; 2]) -> String {
    let braking = report.torque_nm.iter().zip(speeds_rpm).any(|(nm, rpm)| f64::from(*nm) * rpm < 0.0);
    let does = match report {
        _ if report.voltage_v == [0.0; 2] => None,
        _ if braking => Some("braking"),
        _ if report.weakening.contains(&true) => Some("weakening"),
        _ => Some("motoring"),
    };
    does.map_or("off".to_owned(), |does| format!("{}-{does}", report.scheme.name()))
}
