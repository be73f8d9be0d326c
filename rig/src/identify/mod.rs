//! `cargo rig identify`: an unknown machine identified by its own drive.

use crate::machine::Machine;
use crate::options::positive;
use crate::scenario::System;
use crate::scenario::traction::{Traction, TractionOptions, identification};
use crate::trace::Recording;
use anyhow::Result;
use clap::Args;
use serde_json::Map;
use std::process::ExitCode;
use tractive::identification::Stage;

/// The options of an identification.
#[derive(Clone, Debug, Args)]
pub struct Identify {
    /// The options of the drive and its bench; `--machine` is the machine that is unknown, `--out` the folder that is made.
    #[command(flatten)]
    pub options: crate::options::Options<TractionOptions>,
    /// Inertia of the free rotor, in kg·m²; default the folder's.
    #[arg(long, value_name = "KG_M2", value_parser = positive, allow_negative_numbers = true)]
    pub inertia: Option<f64>,
}

/// Does what the command says.
pub fn command(identify: &Identify) -> Result<ExitCode> {
    let machine = Machine::load(identify.options.machine.as_deref().unwrap_or(Traction::MACHINE))?;
    Traction::check(&identify.options, &Map::new(), &machine)?;
    let inertia = identify.inertia.unwrap_or(machine.folder.parameters.rotor_inertia_kg_m2);
    let recording = identification::drive(&identify.options, &machine, inertia)?;
    if std::env::var_os("TRACTIVE_DUMP").is_some() {
        dump(&recording);
    }
    Ok(ExitCode::SUCCESS)
}

fn dump(recording: &Recording) {
    let mut t_s = 0.0;
    let mut text = String::new();
    for o in &recording.observations {
        t_s += f64::from(o.length_s);
        text += &format!(
            "{t_s:.6},{},{},{},{},{},{},{}\n",
            o.stage as u8, o.current.d, o.current.q, o.volt_seconds.alpha, o.volt_seconds.beta, o.frame.sin, o.frame.cos
        );
    }
    let _ = std::fs::write("/tmp/observations.csv", text);
    for stage in Stage::ALL {
        let own: Vec<_> = recording.observations.iter().filter(|o| o.stage == stage).collect();
        let peak = own.iter().map(|o| o.current.length()).fold(0.0, f32::max);
        let s: f32 = own.iter().map(|o| o.length_s).sum();
        println!("{stage:?}: {} halves, {s} s, |i| up to {peak}", own.len());
    }
    let peak = recording.rows.iter().map(|r| r.id_a.hypot(r.iq_a)).fold(0.0, f64::max);
    println!("rows {}, peak {peak}, trip {:?}", recording.rows.len(), recording.rows.last().and_then(|r| r.trip));
}
