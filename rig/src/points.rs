//! `cargo rig points`: operating points by the firmware's own code.

use crate::columns::Columns;
use crate::files;
use crate::machine::Machine;
use anyhow::Result;
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
    files::write_text(output, &format!("{},id_a,iq_a,region\n{}", COLUMNS.join(","), lines.concat()))
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
