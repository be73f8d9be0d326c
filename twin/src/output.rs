//! The files that a run leaves behind: trace, edges, telemetry, frames.

use crate::machine::Machine;
use crate::time::seconds;
use anyhow::{Context, Result};
use std::path::Path;
use tractive_rig::talk::System;
use tractive_rig::trace::GATES;

/// Writes them into a folder, which is made where it is not there. The error names the file.
pub fn write(machine: &Machine, out: &Path) -> Result<()> {
    std::fs::create_dir_all(out).with_context(|| out.display().to_string())?;
    let world = &machine.world;
    let mut trace = csv::Writer::from_path(out.join("trace.csv"))?;
    for row in &world.rows {
        trace.serialize(row)?;
    }
    trace.flush()?;
    let mut edges = csv::Writer::from_path(out.join("edges.csv"))?;
    edges.write_record(["t_s", "gate", "on"])?;
    for edge in &world.edges {
        let on = u8::from(edge.on).to_string();
        edges.write_record([format!("{:.9}", seconds(edge.at)).as_str(), GATES[edge.gate], &on])?;
    }
    edges.flush()?;
    let mut telemetry = csv::Writer::from_path(out.join("telemetry.csv"))?;
    telemetry.write_record(System::Pmasynrm.columns())?;
    for row in &world.talk.rows {
        telemetry.write_record(row)?;
    }
    telemetry.flush()?;
    let frames = out.join("frames.log");
    std::fs::write(&frames, &world.talk.frames).with_context(|| frames.display().to_string())
}
