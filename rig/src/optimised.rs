//! `cargo rig patterns`: the optimised pulse patterns, made anew.

use crate::{files, say};
use anyhow::{Result, anyhow};
use std::path::PathBuf;
use tractive_tablegen::patterns::{Followed, Waveform, angle_table, follow_all};

/// The command's options.
#[derive(Clone, Debug, clap::Args)]
pub struct PatternsOptions {
    /// The file of the modulator's angles to write, control/src/modulation/optimal/table.rs.
    #[arg(long)]
    write: Option<PathBuf>,
}

/// Makes the patterns, prints a line for each branch, and writes the angles if asked to.
pub fn run(options: &PatternsOptions) -> Result<()> {
    let branches = follow_all().map_err(|problem| anyhow!(problem))?;
    say!("branch   pulses  modulation index: weighted distortion in %");
    for followed in &branches {
        say!("{}", line(followed));
    }
    match &options.write {
        Some(file) => files::write_text(file, &angle_table(&branches)),
        None => Ok(()),
    }
}

/// First node, last node, and those between at every tenth of six-step.
fn line(followed: &Followed) -> String {
    let branch = &followed.branch;
    let last = followed.nodes.len().saturating_sub(1);
    let told = followed.nodes.iter().enumerate().filter(|(place, (index, _))| {
        *place == 0 || *place == last || (index * 100.0).round() as u32 % 10 == 0
    });
    let values = told.map(|(_, (index, angles))| {
        let wave = Waveform { first: branch.first(), angles_rad: angles };
        format!("{index:.2}: {:.2}", 100.0 * wave.weighted_distortion())
    });
    format!("{:<8} {:>6}  {}", branch.name, branch.pulses, values.collect::<Vec<_>>().join("  "))
}
