//! A campaign as an array of shards in a real Slurm on this machine, one of them killed in the middle: `deploy/test-slurm.sh`.

use crate::build;
use crate::setup::Setup;
use crate::workspace::root;
use anyhow::{Context, Result};
use std::process::Command;

/// The script's exit code if there is no Slurm, or no permission to run it.
const CANNOT: i32 = 3;

/// Runs it. The inner error is what is missing.
pub fn check(setup: &mut Setup) -> Result<Result<bool, String>> {
    if !setup.slurm() {
        return Ok(Err(
            "slurm is missing, and cannot be installed (Debian: apt-get install slurm-wlm)".to_owned()
        ));
    }
    let script = root().join("deploy/test-slurm.sh");
    let mut command = Command::new(&script);
    command.arg(build::rig()?).arg(root().join("target/tractive/slurm"));
    let status = command.status().with_context(|| format!("cannot start {}", script.display()))?;
    match status.code() {
        Some(CANNOT) => Ok(Err("slurmd needs root".to_owned())),
        _ => Ok(Ok(status.success())),
    }
}
