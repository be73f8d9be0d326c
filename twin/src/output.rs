//! The files that a run leaves behind, through the rig's own writers: trace, edges, the operator's words, telemetry, frames, page.

use crate::run::{Settings, motor};
use crate::time::{SECOND, seconds};
use crate::world::World;
use crate::world::side::Side;
use anyhow::{Context, Result};
use std::ffi::OsString;
use std::path::Path;
use tractive::modulation::Mode;
use tractive_rig::talk::{Happened, Lines, Outcome, Talk, TalkOptions, figures};
use tractive_rig::trace::{self, Recording, Row, Switch};
use tractive_rig::{talk, zs9};

/// Writes them into a folder, which is made where it is not there. The error names the file. The talk and the recording are taken out of
/// the world.
pub fn write(world: &mut World, settings: &Settings, out: &Path) -> Result<()> {
    std::fs::create_dir_all(out).with_context(|| out.display().to_string())?;
    let system = settings.system;
    let options =
        TalkOptions::read(&[settings.name.as_str(), "--system", system.name()].map(OsString::from))?;
    let over = Talk::new(
        system,
        Lines::Script(Default::default()),
        settings.inertia_kg_m2,
        &motor(system)?.tables.ratings,
    );
    let talk = std::mem::replace(&mut world.talk, over);
    let recording = recording(world);
    let figures = figures(&talk, &recording);
    let outcome = Outcome { talk, system, recording, figures, on: "twin" };
    talk::write(&options, &outcome, out)?;
    outcome.recording.common().write_events(out)
}

/// The recording of what happened at the pins, and what was told.
fn recording(world: &mut World) -> Happened {
    let edges = std::mem::take(&mut world.edges);
    match &mut world.side {
        Side::Traction(side) => {
            let rows = std::mem::take(&mut side.rows);
            let edge =
                |edge: &crate::world::Edge| trace::Edge { tick: edge.at, gate: edge.gate as u8, on: edge.on };
            Happened::Pmasynrm(Recording {
                written: None,
                switches: switches(&rows),
                rows,
                slots: std::mem::take(&mut side.slots),
                link: None,
                edges: edges.iter().map(edge).collect(),
                lead: 0,
                tick_s: 1.0 / SECOND as f64,
                recorded: Vec::new(),
                observations: Vec::new(),
                found: None,
                beside: Vec::new(),
            })
        }
        Side::Zs9(side) => {
            let edge = |edge: &crate::world::Edge| zs9::trace::Edge {
                t_s: seconds(edge.at),
                gate: edge.gate as u8,
                on: edge.on,
            };
            Happened::Zs9(zs9::trace::Recording {
                rows: std::mem::take(&mut side.rows),
                keeps_edges: true,
                edges: edges.iter().map(edge).collect(),
                recorded: Vec::new(),
                written: None,
            })
        }
    }
}

/// The changes of mode, as they were told.
fn switches(rows: &[Row]) -> Vec<Switch> {
    let mut from = Mode::Off;
    let mut switches = Vec::new();
    for row in rows {
        if row.mode != from {
            let (t_s, to, speed_rpm) = (row.t_s, row.mode, row.speed_rpm);
            switches.push(Switch { t_s, from, to, pulse_angle_deg: None, speed_rpm });
            from = to;
        }
    }
    switches
}
