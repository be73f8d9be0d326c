//! `run zs9-…`: drives a scenario of the ZS9 and writes its files.

use super::figures;
use super::scenario::{self, Scenario};
use super::trace::Recording;
use crate::analysis::Figures;
use crate::files::write_text;
use crate::machine::Machine;
use crate::options::RunOptions;
use crate::report::Page;
use anyhow::Result;
use std::path::Path;

/// The machine whose tables both motors have.
pub const MACHINE: &str = "ipm-zs9";

/// What a run gave.
pub struct Outcome {
    /// The trace.
    pub recording: Recording,
    /// Its figures.
    pub figures: Figures,
    /// What goes into summary.json.
    pub summary: serde_json::Value,
}

/// Drives a scenario.
///
/// # Errors
/// Bad input, or a drive that breaks the bench's rules.
pub fn drive(scenario: &dyn Scenario, options: &RunOptions) -> Result<Outcome> {
    let machine = Machine::load(options.machine.as_deref().unwrap_or(MACHINE))?;
    let recording = scenario::drive(scenario, options, &machine)?;
    let figures = scenario.figures(&recording, options);
    let mut given = serde_json::to_value(options)?;
    if let Some(given) = given.as_object_mut() {
        given.insert("machine".to_owned(), machine.tables.name.into());
        given.insert("dt".to_owned(), options.dt.unwrap_or_else(|| scenario.trace_step_s(options)).into());
        if let serde_json::Value::Object(own) = serde_json::to_value(&options.zs9)? {
            given.extend(own);
        }
        // Options of the first system alone.
        for name in ["down", "brake", "torque_scale", "to", "min_pulse_us"] {
            given.remove(name);
        }
    }
    let summary = serde_json::json!({
        "scenario": scenario.name(),
        "version": env!("CARGO_PKG_VERSION"),
        "machine": machine.tables.name,
        "on": options.on.name(),
        "options": given,
        "figures": figures.values(),
    });
    Ok(Outcome { recording, figures, summary })
}

/// Writes a run's files.
///
/// # Errors
/// Where a file cannot be written.
pub fn write(scenario: &dyn Scenario, options: &RunOptions, outcome: &Outcome, out: &Path) -> Result<()> {
    let Outcome { recording, figures: found, summary } = outcome;
    recording.write_trace(&out.join("trace.csv"))?;
    recording.write_recorder(&out.join("recorder.csv"))?;
    if scenario.edges(options) {
        recording.write_edges(&out.join("edges.csv"))?;
    }
    write_text(&out.join("summary.json"), &(serde_json::to_string_pretty(summary)? + "\n"))?;
    let mut page = Page::new(scenario.name(), scenario.title());
    figures::recorder(&mut page, recording);
    scenario.plots(recording, &mut page);
    let subtitle = format!("tractive {}, run on {}", env!("CARGO_PKG_VERSION"), options.on.name());
    write_text(&out.join("report.html"), &page.finish(&subtitle, found)?)
}
