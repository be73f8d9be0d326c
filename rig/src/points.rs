//! `cargo rig points`: operating points by the firmware's own code.

use crate::columns::Columns;
use crate::files;
use crate::machine::Machine;
use crate::shards::{self, Merged, Plan, Shard};
use anyhow::{Context, Result};
use rayon::prelude::*;
use std::path::Path;
use tractive::control::{VoltageLimit, operating_point};

const COLUMNS: [&str; 3] = ["torque_nm", "speed_rpm", "udc_v"];

#[derive(Clone, Copy, Debug)]
struct Wanted {
    torque_nm: f64,
    speed_rpm: f64,
    udc_v: f64,
}

/// The name of a sweep in shards.
pub const POINTS: &str = "points";

/// Reads points, writes points with `id_a,iq_a,region`; of a shard its own ones, into a folder.
pub fn run(input: &Path, output: &Path, machine: &Machine, shard: Option<Shard>) -> Result<()> {
    let wanted = read(input)?;
    let columns = format!("{},id_a,iq_a,region", COLUMNS.join(","));
    if let Some(shard) = shard {
        let folder = format!("{:?} {:?}", machine.folder.parameters, machine.folder.map);
        let configuration = serde_json::json!({
            "machine": format!("{:016x}", shards::hash(folder.as_bytes())),
            "input": format!("{:016x}", shards::hash(&std::fs::read(input)?)),
        });
        let plan = Plan::new(POINTS, configuration, wanted.len(), &columns)?;
        let row = |run: usize| Ok(line(wanted.get(run).context("a point of that number")?, machine));
        return shards::run(&plan, shard, output, row);
    }
    let lines: Vec<String> = wanted.par_iter().map(|point| line(point, machine) + "\n").collect();
    files::write_text(output, &format!("{columns}\n{}", lines.concat()))
}

/// Writes the points of shards that are merged.
pub fn merged(merged: &Merged, out: &Path) -> Result<()> {
    files::write_text(&out.join("points.csv"), &merged.csv())
}

fn line(point: &Wanted, machine: &Machine) -> String {
    let Wanted { torque_nm, speed_rpm, udc_v } = *point;
    let omega = (speed_rpm * core::f64::consts::TAU / 60.0) as f32 * machine.tables.ratings.pole_pairs;
    let limit = VoltageLimit { udc_v: udc_v as f32, modulation_index: 1.0, filled: false };
    let found = operating_point(torque_nm as f32, omega, &limit, machine.tables);
    let region = found.region.name();
    format!("{torque_nm},{speed_rpm},{udc_v},{},{},{region}", found.current.d, found.current.q)
}

fn read(input: &Path) -> Result<Vec<Wanted>> {
    let columns = Columns::read(input, COLUMNS)?;
    let points = columns.rows().map(|[torque, speed, udc]| {
        Ok(Wanted {
            torque_nm: torque.number("a finite number", |_| true)?,
            speed_rpm: speed.number("a finite number", |_| true)?,
            udc_v: udc.number("a finite number above 0", |volts| volts > 0.0)?,
        })
    });
    points.collect()
}
