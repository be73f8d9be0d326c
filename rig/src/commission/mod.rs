//! `cargo rig commission`: an unknown machine brought to its first torque, step by step, on the rig, in QEMU or on a board over CAN.
//!
//! 1. **Wiring**: the link is charged and discharged, gates off: its voltage, and the current readings while no current flows.
//! 2. **Identification**, with a free rotor; from its observations the order, signs and offsets of the sensors and the angle's zero and
//!    direction are reported as well.
//! 3. **Tables**: the machine folder, as the table generator reads it.
//! 4. **First torque** with these tables: a small torque, and whether the torque that results is what was asked for.
//!
//! Each step's results are kept in a record, also if the step has not passed; the steps after it are then not done.

mod options;
mod record;
mod steps;

pub use options::Commission;
pub use record::{Record, Step};

use crate::folder::check_place;
use crate::machine::Machine;
use crate::scenario::System as _;
use crate::scenario::traction::Traction;
use anyhow::{Context, Result, bail};
use std::io::{BufRead, Write};
use std::process::ExitCode;

/// Leads through the steps. Exit code 1 if one has not passed.
///
/// # Errors
/// Options that make no sense, and what [`crate::identify::command`] and a talk may refuse.
pub fn command(commission: &Commission) -> Result<ExitCode> {
    let identify = &commission.identify;
    let Some(out) = &identify.options.out else {
        bail!("--out: must name the machine folder to make");
    };
    check_place(out)?;
    let machine = Machine::load(identify.options.machine.as_deref().unwrap_or(Traction::MACHINE))?;
    let path = commission.record.clone().unwrap_or_else(|| {
        let name = out.file_name().unwrap_or_default().to_string_lossy();
        out.with_file_name(format!("{name}-commissioning.toml"))
    });
    let mut record = Record::new(machine.tables.name, identify);
    if commission.resume {
        record = record.resumed(&path)?;
    }
    for step in steps::ALL.iter().skip(record.steps.len()) {
        if !commission.yes && !asked(step)? {
            crate::say!("stopped before: {}", step.name);
            break;
        }
        crate::say!("{} …", step.name);
        let done = (step.run)(commission, &machine, &record).with_context(|| step.name)?;
        crate::say!("{done}");
        let passed = done.passed;
        record.steps.push(done);
        // The record so far, whatever comes next.
        record.write(&path)?;
        if !passed || commission.until.as_deref() == Some(step.name) {
            break;
        }
    }
    let passed = record.steps.iter().all(|step| step.passed);
    record.finished = passed && record.steps.len() == steps::ALL.len();
    record.write(&path)?;
    crate::say!("record: {}", path.display());
    let is_last = |step: &Step| commission.until.as_ref().is_some_and(|until| *until == step.name);
    let done = record.finished || (passed && record.steps.last().is_some_and(is_last));
    Ok(ExitCode::from(u8::from(!done)))
}

/// The answer of the person at the terminal: `true` if ready for a step.
fn asked(step: &steps::Stage) -> Result<bool> {
    crate::say!("\n{}\n{}", step.name, step.asks);
    eprint!("[Enter] to go on, q to stop: ");
    std::io::stderr().flush()?;
    let mut answer = String::new();
    let read = std::io::stdin().lock().read_line(&mut answer)?;
    Ok(read > 0 && answer.trim().is_empty())
}
