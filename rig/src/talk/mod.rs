//! `rig talk`: commands the drive over the protocol, as a vehicle's computer would over CAN, and logs its answers.

mod lines;
mod listener;
mod outcome;
mod page;
mod scales;
pub mod script;
pub mod sender;
mod supervisor;
mod system;
mod words;

pub use lines::Lines;
pub use listener::Listener;
pub use outcome::{Happened, Outcome, TalkOptions};
pub use supervisor::Talk;
pub use system::System;
pub use words::DriveOptions;
#[cfg(unix)]
pub(crate) use words::read;
pub(crate) use words::usual;

use crate::analysis::Figures;
use crate::bench::LinePlan;
use crate::machine::Machine;
use crate::options::{Options, RunOptions};
use crate::plant::SpeedSource;
use crate::run::Supervisor;
use crate::scenario::System as _;
use crate::scenario::traction::{self, Traction, fed_link};
use crate::scenario::zs9::{self as dual, Zs9};
use crate::trace::{Recording, name_of};
use crate::{files, zs9};
use anyhow::Result;
use serde_json::Map;
use std::path::Path;
use tractive::operator::Request;
use tractive::ports::MotorDemand;

/// Step of trace.csv unless told otherwise, in s.
const TRACE_STEP_S: f64 = 1e-3;

/// Longest talk, in s.
pub(crate) const LONGEST_S: f64 = 86_400.0;

/// Talks.
pub fn run(options: &TalkOptions) -> Result<Outcome> {
    let system = options.system;
    let lines = match options.script.as_deref() {
        Some(path) if path != Path::new("-") => Lines::of_script(path, system)?,
        _ => Lines::Typed(0),
    };
    let machine = Machine::load(options.machine_name())?;
    let mut talk = Talk::new(system, lines, options.inertia(), &machine.tables.ratings);
    let recording = match system {
        System::Pmasynrm => {
            let own = traction_options(options);
            let recording = with_traction(&own, options.inertia(), LONGEST_S, &machine, &mut talk)?;
            Happened::Pmasynrm(recording)
        }
        System::Zs9 => Happened::Zs9(with_zs9(options, LONGEST_S, &machine, &mut talk)?),
    };
    let figures = figures(&talk, &recording);
    Ok(Outcome { talk, system, recording, figures, on: options.run.on.name() })
}

fn run_options(options: &DriveOptions) -> RunOptions {
    RunOptions { dt: Some(options.run.dt.unwrap_or(TRACE_STEP_S)), ..options.run.clone() }
}

/// The same options as a run of the PMaSynRM drive takes them.
pub(crate) fn traction_options(options: &DriveOptions) -> traction::Options {
    Options { run: run_options(options), own: options.traction.clone() }
}

/// A rotor of this inertia, in kg·m², on a link, commanded over the protocol.
///
/// # Errors
/// Options that make no sense, or an emulator that fails.
pub(crate) fn with_traction(
    options: &traction::Options,
    inertia_kg_m2: f64,
    longest_s: f64,
    machine: &Machine,
    supervisor: &mut dyn Supervisor,
) -> Result<Recording> {
    Traction::check(options, &Map::new(), machine)?;
    let options = &Traction::filled(options, machine);
    let idle = Request::idle(&machine.tables.ratings);
    // The requests come from the frames, not from here.
    let line = LinePlan::new(fed_link(options, machine), Box::new(move |_| idle));
    let plan = traction::Plan {
        judged_step_s: options.dt.unwrap_or(TRACE_STEP_S),
        speed: SpeedSource::Inertia { inertia_kg_m2, load_nm: 0.0 },
        ..traction::Plan::operated(longest_s, vec![(0.0, 0.0)], line)
    };
    Traction::run("talk", plan, options, machine, Some(supervisor))
}

/// Two rotors on an empty network, commanded over the protocol.
pub(crate) fn with_zs9(
    options: &DriveOptions,
    longest_s: f64,
    machine: &Machine,
    supervisor: &mut dyn Supervisor,
) -> Result<zs9::trace::Recording> {
    let own = Options { run: run_options(options), own: options.zs9.clone() };
    Zs9::check(&own, &Map::new(), machine)?;
    let own = Zs9::filled(&own, machine);
    // The demands that the operator permits replace these.
    let operator = |_: f64, _: zs9::SeenMotors| zs9::Orders {
        demands: [MotorDemand::Speed(0.0); 2],
        loads_nm: [0.0; 2],
        enable: true,
    };
    let times_s = (0.0, longest_s);
    let plan = dual::Plan {
        edges: false,
        line: Some(zs9::line::TIMES),
        judged_step_s: own.dt,
        ..dual::Plan::driven(times_s, dual::free(options.inertia()), [0.0; 2], operator)
    };
    Zs9::run("talk", plan, &own, machine, Some(supervisor))
}

/// The figures of a talk and of what really happened.
pub fn figures(talk: &Talk, recording: &Happened) -> Figures {
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
        Happened::Pmasynrm(_) => {
            figures.set("highest_speed_rpm", highest(0));
            figures.set("last_speed_rpm", last_rpm[0]);
        }
        Happened::Zs9(_) => {
            for (k, motor) in ["1", "2"].into_iter().enumerate() {
                figures.set(&format!("highest_speed{motor}_rpm"), highest(k));
                figures.set(&format!("last_speed{motor}_rpm"), last_rpm[k]);
            }
        }
    }
    figures.set("fault", name_of(recording.common().trip()));
    figures.set("expectations", talk.expectations);
    figures.set("not_met", &talk.failures);
    figures
}

/// Writes telemetry.csv, frames.log, trace.csv, recorder.csv after a fault, summary.json and report.html into a folder that exists.
pub fn write(options: &TalkOptions, outcome: &Outcome, out: &Path) -> Result<()> {
    let Outcome { talk, system, recording, figures, on } = outcome;
    files::write_whole(&out.join("telemetry.csv"), |file| {
        file.write_record(system.columns())?;
        for row in &talk.rows {
            file.write_record(row)?;
        }
        Ok(())
    })?;
    files::write_text(&out.join("frames.log"), &talk.frames)?;
    recording.common().write_trace(&out.join("trace.csv"))?;
    recording.common().write_recorder(&out.join("recorder.csv"))?;
    let summary = serde_json::json!({
        "scenario": "talk",
        "script": options.script,
        "version": env!("CARGO_PKG_VERSION"),
        "system": system.name(),
        "machine": options.machine_name(),
        "on": on,
        "inertia_kg_m2": options.inertia(),
        "figures": figures.values(),
    });
    files::write_text(&out.join("summary.json"), &(serde_json::to_string_pretty(&summary)? + "\n"))?;
    files::write_text(&out.join("report.html"), &page::page(options, outcome)?)
}
