//! `cargo rig nine-switch`: the nine-switch modulator's own gates for one carrier period.

use crate::columns::{Columns, Field};
use crate::files;
use anyhow::Result;
use rayon::prelude::*;
use std::path::Path;
use tractive::frames::Angle;
use tractive::nine_switch::{GATES, MotorVoltage, Period, Refused, Request, Scheme, step};

const COLUMNS: [&str; 6] = ["scheme", "theta1_deg", "m1", "theta2_deg", "m2", "d_sh"];
/// Motor 1 is the upper one.
const ADDED: &str = "feasible,m1_applied,m2_applied";

/// Reads requests, writes them with the gates' levels and toggle instants (T = 1), and what the motors get.
pub fn run(input: &Path, output: &Path) -> Result<()> {
    let columns = Columns::read(input, COLUMNS)?;
    let rows = columns.rows().collect::<Vec<_>>();
    let lines = rows.par_iter().map(line).collect::<Result<Vec<String>>>()?;
    let gates = GATES.map(|gate| format!("{gate}_init,{gate}_edges"));
    let header = format!("{},{},{ADDED}\n", COLUMNS.join(","), gates.join(","));
    files::write_text(output, &(header + &lines.concat()))
}

fn line(fields: &[Field; 6]) -> Result<String> {
    let mut cells: Vec<String> = fields.iter().map(|field| field.text().to_owned()).collect();
    let period = period(fields)?;
    for gate in &period.gates {
        cells.push(u8::from(gate.starts_on()).to_string());
        cells.push(gate.toggles().map(|instant| instant.to_string()).collect::<Vec<_>>().join(";"));
    }
    let applied = period.applied;
    cells.push(u8::from(applied.feasible()).to_string());
    cells.push(applied.upper_index.to_string());
    cells.push(applied.lower_index.to_string());
    Ok(cells.join(",") + "\n")
}

fn period(fields: &[Field; 6]) -> Result<Period> {
    let [scheme, theta1, m1, theta2, m2, d_sh] = fields;
    let request = Request {
        scheme: find(scheme)?,
        upper: MotorVoltage { angle: angle(theta1)?, modulation_index: number(m1, INDEX)? },
        lower: MotorVoltage { angle: angle(theta2)?, modulation_index: number(m2, INDEX)? },
        shoot_through: number(d_sh, DUTY)?,
    };
    // Values out of range are left for the modulator to report.
    step(&request).map_err(|refused| match refused {
        Refused::UpperIndex => m1.wrong(INDEX),
        Refused::LowerIndex => m2.wrong(INDEX),
        Refused::ShootThrough => d_sh.wrong(DUTY),
    })
}

const INDEX: &str = "a finite number, 0 or more (single precision)";
const DUTY: &str = "a number from 0 to 1";

fn find(field: &Field) -> Result<Scheme> {
    let found = Scheme::ALL.into_iter().find(|scheme| scheme.name() == field.text());
    found.ok_or_else(|| field.wrong(&Scheme::ALL.map(Scheme::name).join(", ")))
}

fn number(field: &Field, allowed: &str) -> Result<f32> {
    Ok(field.number(allowed, |_| true)? as f32)
}

/// Any number of turns, in double precision until it is reduced to a fraction of one.
fn angle(field: &Field) -> Result<Angle> {
    let turns = field.number("a finite number", |_| true)? / 360.0;
    Ok(Angle((turns.rem_euclid(1.0) * 4_294_967_296.0).round() as u64 as u32))
}
