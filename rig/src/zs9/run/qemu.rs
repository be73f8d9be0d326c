//! The ZS9's image in QEMU.

use crate::bench::Simulated;
use crate::run::{Emulator, Supervisor, in_qemu};
use crate::zs9::bench::Bench;
use crate::zs9::trace::Recording;
use anyhow::{Result, bail};
use tractive::ports::DualReport;
use tractive::wire::{self, DualRequest, DualSetup};

/// Runs until the recording is complete; a supervisor commands over the protocol.
pub fn run_in_qemu(
    name: &str,
    bench: Bench,
    setup: DualSetup,
    emulator: &Emulator,
    supervisor: Option<&mut dyn Supervisor>,
) -> Result<Recording> {
    in_qemu((name, ""), bench, emulator, supervisor, |block, answers, served| {
        let Some(request) = DualRequest::from_block(block) else {
            bail!("the firmware sent a request that is none: {block:?}");
        };
        let bench = &mut served.bench;
        match request {
            DualRequest::Hello => answers.control(&wire::dual_setup_to_block(setup))?,
            DualRequest::ControlSample(at) => {
                let (sample, command) = bench.control_sample(at)?;
                let done = bench.is_done();
                answers.control(&wire::dual_sample_to_block(&sample, &command, done))?;
            }
            DualRequest::ControlReport(at, report) => {
                served.calls.mode = what(&report, bench.speeds_rpm());
                served.calls.control();
                bench.control_report(at, report);
            }
            DualRequest::PowerSample(at) => answers.pwm(&wire::power_to_block(&bench.power_sample(at)?))?,
            DualRequest::Play(_, next) => {
                served.calls.pwm();
                bench.play(next);
            }
            DualRequest::GatesOff(at) => bench.gates_off(at),
            DualRequest::Leave(at) => bench.leave(at),
            DualRequest::Ask(at) => {
                let feedback = bench.ask(at)?;
                let frame = served.turn(at)?;
                answers.idle(&wire::dual_asked_to_block(&feedback, frame))?;
            }
            DualRequest::Tell(from, status, frame) => {
                bench.told(from, status)?;
                served.hear(from, frame);
            }
            DualRequest::Recorded(record) => served.records.push(record),
            DualRequest::End => return Ok(true),
            DualRequest::Dead => bail!("the firmware stopped in a panic or a HardFault, gates off"),
        }
        Ok(false)
    })
}

/// The name of a control interrupt's work: the scheme and the motors' state, as `rthd-braking`.
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
