//! The options of a commissioning.

use crate::identify::Identify;
use clap::Args;
use std::path::PathBuf;

/// The options of a commissioning.
#[derive(Clone, Debug, Args)]
pub struct Commission {
    /// The drive and its bench; of `--machine` only its nameplate is known, `--out` is the machine folder that is made.
    #[command(flatten)]
    pub identify: Identify,
    /// Go on from step to step without asking.
    #[arg(long)]
    pub yes: bool,
    /// End after this step: wiring, identification, tables.
    #[arg(long, value_name = "STEP", value_parser = ["wiring", "identification", "tables"])]
    pub until: Option<String>,
    /// Go on where the record ends; steps that have passed are not repeated.
    #[arg(long)]
    pub resume: bool,
    /// With --on qemu: the drive's image with the tables that were made, for the first torque.
    #[arg(long, value_name = "FILE")]
    pub drive_image: Option<PathBuf>,
    /// The record to write; default the machine folder's name with -commissioning.toml.
    #[arg(long, value_name = "FILE.toml")]
    pub record: Option<PathBuf>,
}
