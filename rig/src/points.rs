//! `cargo rig points`: operating points computed by the firmware's own code.

use crate::columns::Columns;
use crate::files;
use crate::machine::Machine;
use crate::shards::{self, Merged, Plan, Shard};
use anyhow::{Context, Result};
use csv::StringRecord;
use rayon::prelude::*;
use std::path::Path;
use tractive::control::{OperatingPoint, VoltageLimit, flux_linkage, operating_point};

const COLUMNS: [&str; 3] = ["torque_nm", "speed_rpm", "udc_v"];
const FOUND: [&str; 3] = ["id_a", "iq_a", "region"];

#[derive(Clone, Copy, Debug)]
struct Wanted {
    torque_nm: f64,
    speed_rpm: f64,
    udc_v: f64,
}

/// A file's points, and all of its columns except those that are found anew.
struct Points {
    head: Vec<String>,
    rows: Vec<(Vec<String>, Wanted)>,
}

/// Ratio of current or voltage to its limit up to which that counts as kept: the effect of interpolation beyond the largest speed is smaller.
const KEPT: f32 = 1.05;

/// The name of a sweep in shards.
pub const POINTS: &str = "points";

/// Reads points, writes them with all of their columns and `id_a,iq_a,region` behind these; for a shard only its own, into a folder.
pub fn run(input: &Path, output: &Path, machine: &Machine, shard: Option<Shard>) -> Result<()> {
    let Points { head, rows } = read(input, machine)?;
    let columns = shards::csv_row(&head.iter().map(String::as_str).chain(FOUND).collect::<Vec<_>>())?;
    if let Some(shard) = shard {
        let folder = format!("{:?} {:?}", machine.folder.parameters, machine.folder.map);
        let configuration = serde_json::json!({
            "machine": format!("{:016x}", shards::hash(folder.as_bytes())),
            "input": format!("{:016x}", shards::hash(&std::fs::read(input)?)),
        });
        let plan = Plan::new(POINTS, configuration, rows.len(), &columns)?;
        let row = |run: usize| line(rows.get(run).context("a point of that number")?, machine);
        return shards::run(&plan, shard, output, row);
    }
    let lines = rows.par_iter().map(|row| Ok(line(row, machine)? + "\n")).collect::<Result<Vec<_>>>()?;
    files::write_text(output, &format!("{columns}\n{}", lines.concat()))
}

/// Writes the points of merged shards.
pub fn merged(merged: &Merged, out: &Path) -> Result<()> {
    files::write_text(&out.join("points.csv"), &merged.csv())
}

impl Wanted {
    /// Electrical angular speed, in rad/s.
    fn omega(&self, machine: &Machine) -> f32 {
        (self.speed_rpm * core::f64::consts::TAU / 60.0) as f32 * machine.tables.ratings.pole_pairs
    }

    fn found(&self, machine: &Machine) -> OperatingPoint {
        let limit = VoltageLimit { udc_v: self.udc_v as f32, modulation_index: 1.0, filled: false };
        operating_point(self.torque_nm as f32, self.omega(machine), &limit, machine.tables)
    }

    /// `true` if the result keeps both limits: at some speed, with some link, no current within the largest one does.
    fn is_kept(&self, machine: &Machine) -> bool {
        let (current, omega) = (self.found(machine).current, self.omega(machine));
        let flux = flux_linkage(machine.tables, current);
        let rs = machine.tables.ratings.stator_resistance_ohm;
        let voltage_v = (rs * current.d - omega * flux.q).hypot(rs * current.q + omega * flux.d);
        let most_v = core::f32::consts::FRAC_2_PI * self.udc_v as f32;
        current.length() <= KEPT * machine.tables.ratings.max_current_a && voltage_v <= KEPT * most_v
    }
}

fn line((given, wanted): &(Vec<String>, Wanted), machine: &Machine) -> Result<String> {
    let OperatingPoint { current, region, .. } = wanted.found(machine);
    let found = [current.d.to_string(), current.q.to_string(), region.name().to_owned()];
    shards::csv_row(&[given.as_slice(), &found].concat())
}

fn read(input: &Path, machine: &Machine) -> Result<Points> {
    let columns = Columns::read(input, COLUMNS)?;
    // What an earlier run has found is found anew.
    let stays: Vec<bool> = columns.head().iter().map(|name| !FOUND.contains(&name)).collect();
    let kept = |record: &StringRecord| {
        let fields = record.iter().zip(&stays).filter(|(_, stays)| **stays);
        // A row is a line, whatever a further column holds.
        fields.map(|(field, _)| field.replace(['\r', '\n'], " ")).collect::<Vec<_>>()
    };
    let points = columns.rows().map(|[torque, speed, udc]| {
        let wanted = Wanted {
            torque_nm: torque.number("a finite number", |_| true)?,
            speed_rpm: speed.number("a finite number", |_| true)?,
            udc_v: udc.number("a finite number above 0", |volts| volts > 0.0)?,
        };
        let most_a = machine.tables.ratings.max_current_a;
        let allowed = format!(
            "a speed at which some current within {most_a} A needs no more voltage than {} V of link give",
            wanted.udc_v
        );
        if wanted.is_kept(machine) { Ok(wanted) } else { Err(speed.wrong(&allowed)) }
    });
    let rows = columns.records().map(kept).zip(points).map(|(given, wanted)| Ok((given, wanted?)));
    Ok(Points { head: kept(columns.head()), rows: rows.collect::<Result<_>>()? })
}
