//! Building the rig and the image.

use crate::process::must;
use crate::root;
use crate::setup::{self, TARGET};
use anyhow::{Context, Result};
use std::path::{Path, PathBuf};
use std::process::Command;

/// Builds the rig; its program.
pub fn rig() -> Result<PathBuf> {
    must(cargo().args(["build", "--quiet", "--release", "--package", "tractive-rig"]))?;
    Ok(target_folder().join("release/tractive-rig"))
}

/// Builds the firmware's image for a machine; its ELF file.
pub fn image(machine: Option<&str>) -> Result<PathBuf> {
    let toolchain = setup::toolchain()?;
    let mut command = toolchain.cargo("build");
    command.current_dir(root());
    command.args(["--quiet", "--profile", "firmware", "--package", "tractive", "--bin", "tractive"]);
    if let Some(machine) = machine {
        // The build script runs in the repository's root; a path is the user's own.
        let path = Path::new(machine);
        let named = root().join("tables").join(machine).is_dir();
        let meant = if path.is_dir() && !named { path.canonicalize()? } else { path.to_owned() };
        command.env("TRACTIVE_MACHINE", meant);
    }
    must(&mut command).context("the image does not build")?;
    Ok(target_folder().join(TARGET).join("firmware/tractive"))
}

/// Cargo, in the repository's root.
pub fn cargo() -> Command {
    let mut command = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    command.current_dir(root());
    command
}

/// Where cargo puts what it builds.
pub fn target_folder() -> PathBuf {
    match std::env::var_os("CARGO_TARGET_DIR") {
        Some(folder) => root().join(folder),
        None => root().join("target"),
    }
}
