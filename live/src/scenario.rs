//! Scenarios of the rig that are run in the page, from their beginning to their end.

use crate::driven::Taken;
use crate::{machine, traction, zs9};
use anyhow::{Context, Result};
use serde_json::{Value, json};
use sha2::{Digest, Sha256};
use tractive_rig::analysis::Figures;
use tractive_rig::scenario::planned;

/// The rest of a scenario.
pub struct Ran {
    /// Its rows and edges.
    pub taken: Taken,
    /// Columns, step, the trace's checksum, and the verdicts.
    pub about: Value,
}

/// Names of those of a system.
pub fn names(system: &str) -> Vec<&'static str> {
    match system {
        "zs9" => planned::ZS9.iter().map(|scenario| scenario.name).collect(),
        _ => planned::TRACTION.iter().map(|scenario| scenario.name).collect(),
    }
}

/// Runs one with the words of its command line, on a machine of the page.
pub fn run(name: &str, words: &[String]) -> Result<Ran> {
    if let Some(scenario) = planned::ZS9.iter().find(|scenario| scenario.name == name) {
        let (recording, figures) = scenario.drive(words, &machine::named)?;
        let rows = &recording.rows;
        let times = rows.iter().map(|row| row.t_s).collect::<Vec<_>>();
        let values = rows.iter().flat_map(|row| zs9::COLUMNS.map(|(_, of)| of(row) as f32)).collect();
        let edges = recording.edges.iter().flat_map(zs9::code).collect();
        let columns = zs9::COLUMNS.map(|(name, _)| name);
        return Ok(ran((&columns, &times), (values, edges), &recording.trace_bytes()?, &figures));
    }
    let scenario = planned::TRACTION.iter().find(|scenario| scenario.name == name);
    let scenario = scenario.with_context(|| format!("there is no scenario `{name}` in the page"))?;
    let (recording, figures) = scenario.drive(words, &machine::named)?;
    let rows = &recording.rows;
    let times = rows.iter().map(|row| row.t_s).collect::<Vec<_>>();
    let values = rows.iter().flat_map(|row| traction::COLUMNS.map(|(_, of)| of(row) as f32)).collect();
    let seconds = |edge: &tractive_rig::trace::Edge| (recording.seconds(edge.tick), *edge);
    let edges = recording.edges.iter().flat_map(|of| traction::edge(&seconds(of))).collect();
    let columns = traction::COLUMNS.map(|(name, _)| name);
    Ok(ran((&columns, &times), (values, edges), &recording.trace_bytes()?, &figures))
}

fn ran(
    (columns, times): (&[&str], &[f64]),
    (rows, edges): (Vec<f32>, Vec<f64>),
    trace: &[u8],
    figures: &Figures,
) -> Ran {
    let sha256: String = Sha256::digest(trace).iter().map(|byte| format!("{byte:02x}")).collect();
    let step_s = times.get(1).zip(times.first()).map_or(1.0, |(next, first)| next - first);
    let about = json!({
        "sha256": sha256,
        "bytes": trace.len(),
        "rows": times.len(),
        "columns": columns,
        "step": step_s,
        "verdicts": figures.values().get("verdicts"),
    });
    Ran { taken: Taken { from_s: times.first().copied(), rows, edges }, about }
}
