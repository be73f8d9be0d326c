//! `run`: drives a scenario, writes its files and reports the outcome.

use super::catalogue::{self, Chosen};
use super::{Choice, System};
use crate::analysis::Figures;
use crate::files::{forget, make_folder, write_text};
use crate::machine::Machine;
use crate::options::RunOptions;
use crate::report::{self, Page};
use crate::trace::Recorded;
use anyhow::Result;
use serde_json::{Value, json};
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;

/// Runs the words after `run`. Exit code 1 if the drive tripped or a bound is not kept.
pub fn run(words: Vec<OsString>) -> Result<ExitCode> {
    match catalogue::choose(words)? {
        Chosen::Traction(choice) => run_choice(&choice),
        Chosen::Zs9(choice) => run_choice(&choice),
    }
}

fn run_choice<S: System>(choice: &Choice<S>) -> Result<ExitCode> {
    let options = &choice.options.run;
    let machine = choice.machine()?;
    let out = folder(choice.name, options)?;
    let began = Instant::now();
    let recording = choice.drive(&machine)?;
    let wall_s = began.elapsed().as_secs_f64();
    let figures = choice.figures(&recording, &machine);
    let summary = summary(choice, &figures, &machine)?;
    write(choice, &recording, &machine, &figures, &out)?;
    write_text(&out.join("summary.json"), &(serde_json::to_string_pretty(&summary)? + "\n"))?;
    let trip = choice.trip(&recording);
    if options.json {
        crate::say!("{}", serde_json::to_string(&summary)?);
    } else {
        let headline = report::headline(&figures, trip);
        let law = format!(" · law {}", choice.options.law.name());
        crate::say!(
            "{headline} · {} · {}{law}\n\n{}",
            choice.name,
            choice.title(&machine),
            report::text(&figures)
        );
        let ratio = recording.end_s() / wall_s;
        crate::say!("simulated {ratio:.1} times as fast as real time ({})", options.on.name());
        crate::say!("report: {}", out.join("report.html").display());
    }
    if let Some(trip) = trip {
        eprintln!("fault {}", report::broken(trip));
    }
    let kept = trip.is_none() && !figures.fall_short();
    Ok(if kept { ExitCode::SUCCESS } else { ExitCode::from(1) })
}

/// Creates the folder for the files of a run.
pub fn folder(name: &str, options: &RunOptions) -> Result<PathBuf> {
    let usual = || std::env::var_os("TRACTIVE_OUT").map_or("target/tractive".into(), PathBuf::from);
    let out = options.out.clone().unwrap_or_else(|| usual().join(name));
    make_folder(&out)?;
    Ok(out)
}

/// The figures, and the run that they come from.
pub fn summary<S: System>(choice: &Choice<S>, figures: &Figures, machine: &Machine) -> Result<Value> {
    // The summary shows the values that were used, even those that nobody gave.
    let mut options = serde_json::to_value(choice.filled(machine))?;
    if let Value::Object(options) = &mut options {
        options.insert("machine".to_owned(), choice.machine_name().into());
        options.extend(choice.own.clone());
    }
    Ok(json!({
        "scenario": choice.name,
        "version": env!("CARGO_PKG_VERSION"),
        "machine": machine.tables.name,
        "on": choice.options.on.name(),
        "options": options,
        "figures": figures.values(),
    }))
}

/// Writes the recording's files and the report.
pub fn write<S: System>(
    choice: &Choice<S>,
    recording: &S::Recording,
    machine: &Machine,
    figures: &Figures,
    out: &Path,
) -> Result<()> {
    recording.write_trace(&out.join("trace.csv"))?;
    recording.write_events(out)?;
    recording.write_recorder(&out.join("recorder.csv"))?;
    let picture = out.join("overview.svg");
    match S::overview(recording)? {
        Some(overview) => write_text(&picture, &overview)?,
        None => forget(&picture)?,
    }
    let mut page = Page::new(choice.name, &choice.title(machine));
    page.headline(&report::headline(figures, choice.trip(recording)));
    page.carrier(machine.tables.ratings.max_switching_hz.into());
    ran(choice, machine, &mut page)?;
    if !machine.is(S::MACHINE) {
        page.answers_none();
    }
    choice.scenario.plots(recording, &choice.filled(machine), machine, &mut page);
    S::draw_common(recording, &mut page);
    let subtitle = format!("tractive {} · {}", env!("CARGO_PKG_VERSION"), S::NAME);
    write_text(&out.join("report.html"), &page.finish(&subtitle, figures)?)
}

/// Writes on the page what was run: machine, link, law, and each option that was given or filled in.
fn ran<S: System>(choice: &Choice<S>, machine: &Machine, page: &mut Page) -> Result<()> {
    let (name, folder) = (machine.tables.name, choice.machine_name());
    page.ran("machine", if name == folder { name.to_owned() } else { format!("{name} ({folder})") });
    let udc_v = choice.options.udc.unwrap_or_else(|| S::source_v(machine));
    page.ran("DC source", format!("{udc_v} V"));
    page.ran("ran on", choice.options.on.name());
    page.ran("version", env!("CARGO_PKG_VERSION"));
    if let Some(commit) = crate::platform::commit() {
        page.ran("commit", commit);
    }
    let Value::Object(mut options) = serde_json::to_value(choice.filled(machine))? else { return Ok(()) };
    options.extend(choice.own.clone());
    // Stated above, or off.
    let said = |name: &str| matches!(name, "machine" | "udc" | "on");
    let off = |value: &Value| value.is_null() || *value == json!(false) || value.as_f64() == Some(0.0);
    for (name, value) in options.iter().filter(|(name, value)| !said(name) && !off(value)) {
        let value = value.as_str().map_or_else(|| value.to_string(), str::to_owned);
        page.ran(&format!("--{}", name.replace('_', "-")), value);
    }
    Ok(())
}
