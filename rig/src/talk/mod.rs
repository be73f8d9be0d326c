//! `rig talk`: commands the drive over the protocol, as a vehicle's computer would over CAN, and logs what it answers.

mod lines;
mod listener;
mod page;
pub mod script;
mod sender;
mod speed_loop;
mod supervisor;

pub use lines::Lines;
pub use listener::{COLUMNS, Listener};
pub use supervisor::Talk;

use crate::analysis::Figures;
use crate::machine::Machine;
use crate::options::RunOptions;
use crate::scenario;
use crate::trace::{self, Recording};
use anyhow::Result;
use std::path::{Path, PathBuf};

/// Step of trace.csv unless told otherwise, in s.
const TRACE_STEP_S: f64 = 1e-3;

/// What is wanted.
#[derive(Clone, Debug, clap::Args)]
pub struct TalkOptions {
    /// A script; without one commands are read from standard input, one a line.
    pub script: Option<PathBuf>,
    /// The machine's and its load's inertia, in kg·m².
    #[arg(long, default_value_t = 10.0, value_parser = crate::options::positive)]
    pub inertia: f64,
    /// What all runs share.
    #[command(flatten)]
    pub run: RunOptions,
}

/// A run that is over.
pub struct Outcome {
    /// What was said and heard.
    pub talk: Talk,
    /// What really happened.
    pub recording: Recording,
    /// The figures.
    pub figures: Figures,
}

/// Talks.
///
/// # Errors
/// A bad script, or a run that could not go on.
pub fn run(options: &TalkOptions) -> Result<Outcome> {
    let lines = match &options.script {
        Some(path) => Lines::of_script(path)?,
        None => Lines::Typed(0),
    };
    let machine = Machine::load(options.run.machine())?;
    let mut talk = Talk::new(lines, options.inertia, machine.folder.parameters.max_torque_nm);
    let run = RunOptions { dt: Some(options.run.dt.unwrap_or(TRACE_STEP_S)), ..options.run.clone() };
    let recording = scenario::drive_supervised("talk", &mut talk, options.inertia, &run, &machine)?;
    let figures = figures(&talk, &recording);
    Ok(Outcome { talk, recording, figures })
}

fn figures(talk: &Talk, recording: &Recording) -> Figures {
    let mut figures = Figures::default();
    let speeds = || recording.rows.iter().map(|row| row.speed_rpm);
    figures.set("simulated_s", recording.rows.last().map_or(0.0, |row| row.t_s));
    figures.set("frames_sent", talk.sent);
    figures.set("frames_received", talk.received);
    figures.set("telemetry_errors", talk.listener.errors);
    figures.set("frames_rejected", talk.listener.counts.rejected());
    figures.set("highest_speed_rpm", speeds().fold(0.0, f64::max));
    figures.set("last_speed_rpm", speeds().last().unwrap_or(0.0));
    figures.set("fault", recording.trip().map_or("", |trip| trip.fault.name()));
    figures.set("expectations", talk.expectations);
    figures.set("not_met", &talk.failures);
    figures
}

/// Writes telemetry.csv, frames.log, trace.csv, summary.json and report.html into a folder that exists.
///
/// # Errors
/// A file that cannot be written.
pub fn write(options: &TalkOptions, outcome: &Outcome, out: &Path) -> Result<()> {
    let Outcome { talk, recording, figures } = outcome;
    trace::write_whole(&out.join("telemetry.csv"), |file| {
        file.write_record(COLUMNS)?;
        for row in &talk.rows {
            file.write_record(row)?;
        }
        Ok(())
    })?;
    trace::write_text(&out.join("frames.log"), &talk.frames)?;
    recording.write_trace(&out.join("trace.csv"))?;
    let summary = serde_json::json!({
        "scenario": "talk",
        "script": options.script,
        "version": env!("CARGO_PKG_VERSION"),
        "machine": options.run.machine(),
        "on": options.run.on.name(),
        "inertia_kg_m2": options.inertia,
        "figures": figures.values(),
    });
    trace::write_text(&out.join("summary.json"), &(serde_json::to_string_pretty(&summary)? + "\n"))?;
    trace::write_text(&out.join("report.html"), &page::page(options, outcome)?)
}
