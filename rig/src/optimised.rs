//! `cargo rig patterns`: the optimised pulse patterns, made anew.

use crate::scenario::catalogue;
use crate::{files, say};
use anyhow::{Context as _, Result, anyhow};
use std::path::PathBuf;
use tractive_tablegen::patterns::{Followed, Waveform, angle_table, follow_all};

/// The command's options.
#[derive(Clone, Debug, clap::Args)]
pub struct PatternsOptions {
    /// The file of the modulator's angles to write, control/src/modulation/optimal/table.rs.
    #[arg(long)]
    write: Option<PathBuf>,
    /// Measures them: current distortion and torque ripple beside those of the paper's modes, in steady state at full torque.
    #[arg(long)]
    points: bool,
}

/// Operating points of the reference machine at which both are measured: speed in r/min, torque in N·m.
const POINTS: [(f64, f64); 9] = [
    (700.0, 1235.0),
    (1000.0, 1235.0),
    (1200.0, 1235.0),
    (1400.0, 1235.0),
    (1600.0, 1235.0),
    (1700.0, 1235.0),
    (1850.0, 1235.0),
    (1905.0, 1235.0),
    (2700.0, 871.4),
];

/// One point as driven.
#[derive(Clone, Debug)]
pub struct Point {
    /// Mode at its end.
    pub mode: String,
    /// Distortion of the current, in percent.
    pub thd_percent: f64,
    /// Excess over the distortion of the mode's own pulses, in percent of that.
    pub thd_excess_percent: f64,
    /// Torque, peak to peak, in N·m.
    pub ripple_nm: f64,
    /// Excess over the ripple of the mode's own pulses, in percent of that.
    pub ripple_excess_percent: f64,
    /// Phase current, in A, rms.
    pub current_a: f64,
    /// Turn-ons of a device in any 100 ms.
    pub turn_ons: f64,
}

/// Drives a point to its steady state on the host.
///
/// # Errors
/// As the scenario's; or that it gave no figures.
pub fn measured(speed_rpm: f64, torque_nm: f64, patterns: &str) -> Result<Point> {
    let line = format!("steady --speed {speed_rpm} --torque {torque_nm} --patterns {patterns} --on host");
    let chosen = catalogue::of_traction(&line)?;
    let machine = chosen.machine()?;
    let recording = chosen.drive(&machine)?;
    let figures = serde_json::to_value(chosen.figures(&recording, &machine).values())?;
    let number = |path: &str| {
        figures
            .pointer(path)
            .and_then(serde_json::Value::as_f64)
            .with_context(|| format!("{line}: no {path}"))
    };
    let mode = figures.pointer("/distortion/0/mode").and_then(serde_json::Value::as_str);
    Ok(Point {
        mode: mode.with_context(|| format!("{line}: no mode"))?.to_owned(),
        thd_percent: number("/distortion/0/thd_percent")?,
        thd_excess_percent: number("/distortion/0/thd_excess_percent")?,
        ripple_nm: number("/distortion/0/ripple_peak_to_peak_nm")?,
        ripple_excess_percent: number("/distortion/0/ripple_peak_to_peak_excess_percent")?,
        current_a: number("/point/0/current_rms_a")?,
        turn_ons: number("/most_turn_ons_in_100_ms")?,
    })
}

/// Makes the patterns, prints a line for each branch, and writes the angles if requested.
pub fn run(options: &PatternsOptions) -> Result<()> {
    let branches = follow_all().map_err(|problem| anyhow!(problem))?;
    say!("branch   pulses  modulation index: weighted distortion in %");
    for followed in &branches {
        say!("{}", line(followed));
    }
    if options.points {
        say!(
            "\n| r/min | N·m | paper's: mode, THD %, torque p-p N·m, A rms | optimal | |\n|---:|---:|---|---|---|"
        );
        for (speed_rpm, torque_nm) in POINTS {
            let [paper, optimal] =
                ["paper", "optimal"].map(|patterns| measured(speed_rpm, torque_nm, patterns));
            let told = |point: &Point| {
                let Point { mode, thd_percent, ripple_nm, current_a, .. } = point;
                format!("{mode}, {thd_percent:.2}, {ripple_nm:.0}, {current_a:.1}")
            };
            let (paper, optimal) = (paper?, optimal?);
            let own =
                format!("{:+.1} %, {:+.1} %", optimal.thd_excess_percent, optimal.ripple_excess_percent);
            say!("| {speed_rpm} | {torque_nm} | {} | {} | {own} |", told(&paper), told(&optimal));
        }
    }
    match &options.write {
        Some(file) => files::write_text(file, &angle_table(&branches)),
        None => Ok(()),
    }
}

/// First node, last node, and the nodes between at every tenth of six-step.
fn line(followed: &Followed) -> String {
    let branch = &followed.branch;
    let last = followed.nodes.len().saturating_sub(1);
    let told = followed.nodes.iter().enumerate().filter(|(place, (index, _))| {
        *place == 0 || *place == last || ((index * 100.0).round() as u32).is_multiple_of(10)
    });
    let values = told.map(|(_, (index, angles))| {
        let wave = Waveform { first: branch.first(), angles_rad: angles };
        format!("{index:.2}: {:.2}", 100.0 * wave.weighted_distortion())
    });
    format!("{:<8} {:>6}  {}", branch.name, branch.pulses, values.collect::<Vec<_>>().join("  "))
}
