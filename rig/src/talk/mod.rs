//! `rig talk`: commands the drive over the protocol, as a vehicle's computer would over CAN, and logs what it answers.

mod lines;
mod listener;
mod page;
pub mod script;
mod sender;
mod speed_loop;
mod supervisor;

pub use lines::Lines;
pub use listener::{COLUMNS, Listener, ZS9_COLUMNS};
pub use supervisor::Talk;

use crate::analysis::Figures;
use crate::machine::Machine;
use crate::options::RunOptions;
use crate::scenario;
use crate::trace::{self, Recording};
use crate::zs9;
use anyhow::Result;
use std::path::{Path, PathBuf};
use tractive::protection::Trip;

/// Who is talked to.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub enum System {
    /// The PMaSynRM drive.
    #[default]
    Pmasynrm,
    /// Two motors on a Z-source nine-switch inverter.
    Zs9,
}

impl System {
    /// Columns of its telemetry.csv.
    pub fn columns(self) -> &'static [&'static str] {
        match self {
            Self::Pmasynrm => &COLUMNS,
            Self::Zs9 => &ZS9_COLUMNS,
        }
    }

    /// As on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Pmasynrm => "pmasynrm",
            Self::Zs9 => "zs9",
        }
    }

    /// The machine's and its load's inertia unless told otherwise, in kg·m².
    const fn inertia_kg_m2(self) -> f64 {
        match self {
            Self::Pmasynrm => 10.0,
            Self::Zs9 => 0.1,
        }
    }
}

/// Step of trace.csv unless told otherwise, in s.
const TRACE_STEP_S: f64 = 1e-3;

/// What is wanted.
#[derive(Clone, Debug, clap::Args)]
pub struct TalkOptions {
    /// A script; without one commands are read from standard input, one a line.
    pub script: Option<PathBuf>,
    /// Who is talked to.
    #[arg(long, value_enum, default_value_t)]
    pub system: System,
    /// The machine's and its load's inertia, in kg·m²; default 10, of each of the ZS9's 0.1, for which its speed loops are made.
    #[arg(long, value_parser = crate::options::positive)]
    pub inertia: Option<f64>,
    /// What all runs share.
    #[command(flatten)]
    pub run: RunOptions,
}

/// What really happened, by system.
pub enum Recorded {
    /// Of the PMaSynRM drive.
    Pmasynrm(Recording),
    /// Of the ZS9.
    Zs9(zs9::trace::Recording),
}

impl Recorded {
    fn trip(&self) -> Option<Trip> {
        match self {
            Self::Pmasynrm(recording) => recording.trip(),
            Self::Zs9(recording) => recording.trip(),
        }
    }

    /// Times, and the speeds then.
    fn speeds_rpm(&self) -> Vec<(f64, [f64; 2])> {
        match self {
            Self::Pmasynrm(recording) => {
                recording.rows.iter().map(|row| (row.t_s, [row.speed_rpm, 0.0])).collect()
            }
            Self::Zs9(recording) => {
                let of = |row: &zs9::trace::Row| row.motors.each_ref().map(|motor| motor.speed_rpm);
                recording.rows.iter().map(|row| (row.t_s, of(row))).collect()
            }
        }
    }
}

/// A run that is over.
pub struct Outcome {
    /// What was said and heard.
    pub talk: Talk,
    /// Who was talked to.
    pub system: System,
    /// What really happened.
    pub recording: Recorded,
    /// The figures.
    pub figures: Figures,
}

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

impl TalkOptions {
    fn inertia(&self) -> f64 {
        self.inertia.unwrap_or(self.system.inertia_kg_m2())
    }
}

/// Writes telemetry.csv, frames.log, trace.csv, recorder.csv after a fault, summary.json and report.html into a folder that exists.
///
/// # Errors
/// A file that cannot be written.
pub fn write(options: &TalkOptions, outcome: &Outcome, out: &Path) -> Result<()> {
    let Outcome { talk, system, recording, figures } = outcome;
    trace::write_whole(&out.join("telemetry.csv"), |file| {
        file.write_record(system.columns())?;
        for row in &talk.rows {
            file.write_record(row)?;
        }
        Ok(())
    })?;
    trace::write_text(&out.join("frames.log"), &talk.frames)?;
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
    trace::write_text(&out.join("summary.json"), &(serde_json::to_string_pretty(&summary)? + "\n"))?;
    trace::write_text(&out.join("report.html"), &page::page(options, outcome)?)
}
