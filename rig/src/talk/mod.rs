//! `rig talk`: commands the drive over the protocol, as a vehicle's computer would over CAN, and logs what it answers.

mod lines;
mod listener;
mod outcome;
mod page;
pub mod script;
mod sender;
mod speed_loop;
mod supervisor;
mod system;

pub use lines::Lines;
pub use listener::Listener;
pub use outcome::{Outcome, Recorded, TalkOptions};
pub use supervisor::Talk;
pub use system::System;

use crate::analysis::Figures;
use crate::files;
use crate::machine::Machine;
use crate::options::RunOptions;
use crate::scenario;
use crate::zs9;
use anyhow::Result;
use std::path::Path;

/// Step of trace.csv unless told otherwise, in s.
const TRACE_STEP_S: f64 = 1e-3;

/// Talks.
///
/// # Errors
/// A bad script, or a run that could not go on.
pub fn run(options: &TalkOptions) -> Result<Outcome> {
    let system = options.system;
    let lines = match &options.script {
        Some(path) => Lines::of_script(path, system)?,
        None => Lines::Typed(0),
    };
    let machine = match system {
        System::Pmasynrm => options.run.machine(),
        System::Zs9 => options.run.machine.as_deref().unwrap_or(zs9::command::MACHINE),
    };
    let machine = Machine::load(machine)?;
    let inertia = options.inertia();
    let mut talk = Talk::new(system, lines, inertia, machine.folder.parameters.max_torque_nm);
    let run = RunOptions { dt: Some(options.run.dt.unwrap_or(TRACE_STEP_S)), ..options.run.clone() };
    let recording = match system {
        System::Pmasynrm => {
            Recorded::Pmasynrm(scenario::drive_supervised("talk", &mut talk, inertia, &run, &machine)?)
        }
        System::Zs9 => Recorded::Zs9(zs9::scenario::drive_supervised(&mut talk, inertia, &run, &machine)?),
    };
    let figures = figures(&talk, &recording);
    Ok(Outcome { talk, system, recording, figures })
}

fn figures(talk: &Talk, recording: &Recorded) -> Figures {
    let mut figures = Figures::default();
    let speeds = recording.speeds_rpm();
    let (last_s, last_rpm) = speeds.last().copied().unwrap_or_default();
    let highest = |k: usize| speeds.iter().map(|(_, rpm)| rpm[k]).fold(0.0, f64::max);
    figures.set("simulated_s", last_s);
    figures.set("frames_sent", talk.sent);
    figures.set("frames_received", talk.received);
    figures.set("telemetry_errors", talk.listener.errors);
    figures.set("frames_rejected", talk.listener.counts.rejected());
    match recording {
        Recorded::Pmasynrm(_) => {
            figures.set("highest_speed_rpm", highest(0));
            figures.set("last_speed_rpm", last_rpm[0]);
        }
        Recorded::Zs9(_) => {
            for (k, motor) in ["1", "2"].into_iter().enumerate() {
                figures.set(&format!("highest_speed{motor}_rpm"), highest(k));
                figures.set(&format!("last_speed{motor}_rpm"), last_rpm[k]);
            }
        }
    }
    figures.set("fault", recording.trip().map_or("", |trip| trip.fault.name()));
    figures.set("expectations", talk.expectations);
    figures.set("not_met", &talk.failures);
    figures
}

/// Writes telemetry.csv, frames.log, trace.csv, recorder.csv after a fault, summary.json and report.html into a folder that exists.
///
/// # Errors
/// A file that cannot be written.
pub fn write(options: &TalkOptions, outcome: &Outcome, out: &Path) -> Result<()> {
    let Outcome { talk, system, recording, figures } = outcome;
    files::write_whole(&out.join("telemetry.csv"), |file| {
        file.write_record(system.columns())?;
        for row in &talk.rows {
            file.write_record(row)?;
        }
        Ok(())
    })?;
    files::write_text(&out.join("frames.log"), &talk.frames)?;
    let (trace, recorder) = (out.join("trace.csv"), out.join("recorder.csv"));
    match recording {
        Recorded::Pmasynrm(recording) => {
            recording.write_trace(&trace)?;
            recording.write_recorder(&recorder)?;
        }
        Recorded::Zs9(recording) => {
            recording.write_trace(&trace)?;
            recording.write_recorder(&recorder)?;
        }
    }
    let summary = serde_json::json!({
        "scenario": "talk",
        "script": options.script,
        "version": env!("CARGO_PKG_VERSION"),
        "system": system.name(),
        "machine": options.run.machine.as_deref().unwrap_or(match system {
            System::Pmasynrm => options.run.machine(),
            System::Zs9 => zs9::command::MACHINE,
        }),
        "on": options.run.on.name(),
        "inertia_kg_m2": options.inertia(),
        "figures": figures.values(),
    });
    files::write_text(&out.join("summary.json"), &(serde_json::to_string_pretty(&summary)? + "\n"))?;
    files::write_text(&out.join("report.html"), &page::page(options, outcome)?)
}
