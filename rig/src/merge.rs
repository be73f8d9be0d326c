//! `cargo rig merge`: the whole of a campaign in shards.

use crate::campaign::{command, healthy, random};
use crate::files::make_folder;
use crate::points;
use crate::shards;
use anyhow::{Result, bail};
use clap::Args;
use std::path::PathBuf;
use std::process::ExitCode;

/// The options of `merge`.
#[derive(Args, Clone, Debug)]
pub struct MergeOptions {
    /// The folders with the files shard-K-of-N.csv, all of them.
    #[arg(value_name = "DIR", required = true)]
    pub folders: Vec<PathBuf>,
    /// Folder for the files of the whole.
    #[arg(long, default_value = "target/tractive/merged")]
    pub out: PathBuf,
    /// Print the totals as JSON.
    #[arg(long)]
    pub json: bool,
}

/// Merges. Exit code 1 if the whole campaign would have had it; an error if something is missing, occurs twice, or belongs to another campaign.
pub fn run(options: &MergeOptions) -> Result<ExitCode> {
    let merged = shards::merge(&options.folders)?;
    let out = &options.out;
    make_folder(out)?;
    let good = match merged.plan.campaign.as_str() {
        command::FAULTS => command::merged(&merged, out, options.json)?,
        healthy::command::HEALTHY => healthy::command::merged(&merged, out, options.json)?,
        random::command::RANDOM => random::command::merged(&merged, out)?,
        points::POINTS => {
            points::merged(&merged, out)?;
            true
        }
        other => bail!("no campaign is named {other}"),
    };
    Ok(if good { ExitCode::SUCCESS } else { ExitCode::from(1) })
}
