//! `cargo rig points`: operating points by the firmware's own code.

use crate::machine::Machine;
use crate::trace;
use anyhow::{Context, Result, bail};
use rayon::prelude::*;
use serde::Deserialize;
use std::path::Path;
use tractive::control::{VoltageLimit, operating_point};

const COLUMNS: [&str; 3] = ["torque_nm", "speed_rpm", "udc_v"];

#[derive(Clone, Copy, Debug, Deserialize)]
struct Wanted {
    torque_nm: f64,
    speed_rpm: f64,
    udc_v: f64,
}

/// Reads points, writes points with `id_a,iq_a,region`.
pub fn run(input: &Path, output: &Path, machine: &Machine) -> Result<()> {
    let wanted = read(input)?;
    let pole_pairs = machine.tables.ratings.pole_pairs;
    let lines: Vec<String> = wanted
        .par_iter()
        .map(|point| {
            let omega = (point.speed_rpm * core::f64::consts::TAU / 60.0) as f32 * pole_pairs;
            let limit = VoltageLimit { udc_v: point.udc_v as f32, depth: 1.0, filled: false };
            let found = operating_point(point.torque_nm as f32, omega, &limit, machine.tables);
            format!(
                "{},{},{},{},{},{}\n",
                point.torque_nm,
                point.speed_rpm,
                point.udc_v,
                found.current.d,
                found.current.q,
                found.region.name()
            )
        })
        .collect();
    trace::write_text(output, &format!("{},id_a,iq_a,region\n{}", COLUMNS.join(","), lines.concat()))
}

fn read(input: &Path) -> Result<Vec<Wanted>> {
    let name = input.display();
    let mut reader = csv::ReaderBuilder::new()
        .comment(Some(b'#'))
        .trim(csv::Trim::All)
        .from_path(input)
        .with_context(|| format!("{name}: cannot be read"))?;
    let headers = reader.headers().with_context(|| format!("{name}"))?.clone();
    for column in COLUMNS {
        if !headers.iter().any(|header| header == column) {
            bail!("{name}:1: {headers:?}: the column {column} is missing; must be {}", COLUMNS.join(","));
        }
    }
    let mut points = Vec::new();
    for record in reader.records() {
        let record = record.with_context(|| format!("{name}"))?;
        let line = record.position().map_or(0, csv::Position::line);
        let point: Wanted = record
            .deserialize(Some(&headers))
            .with_context(|| format!("{name}:{line}: must be three numbers"))?;
        for (column, value) in COLUMNS.iter().zip([point.torque_nm, point.speed_rpm, point.udc_v]) {
            if !value.is_finite() || (*column == "udc_v" && value <= 0.0) {
                bail!("{name}:{line}: {column}: {value}: must be finite, and a voltage above 0");
            }
        }
        points.push(point);
    }
    Ok(points)
}
