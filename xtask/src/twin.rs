//! `cargo xtask twin`: the board's twin, which is a workspace of its own in `twin/`, built and run on the very image that is flashed.

use crate::board::Board;
use crate::build::{self, System};
use crate::cli::TwinArgs;
use crate::process::{say, succeeds};
use crate::setup::Setup;
use crate::workspace::{cargo, root};
use anyhow::{Result, bail};
use std::path::{Path, PathBuf};
use std::process::Command;

/// The board that it is the twin of.
const BOARD: &str = "nucleo-g474re";
/// The script that is run unless told otherwise.
const SCRIPT: &str = "twin/scripts/drive.talk";

/// The command.
pub fn run(args: &TwinArgs) -> Result<u8> {
    let mut setup = Setup::default();
    if !setup.cmake() {
        bail!("{}", no_cmake());
    }
    let script = args.script.clone().unwrap_or_else(|| root().join(SCRIPT));
    let image = image(&mut setup)?;
    let out = args.out.clone().unwrap_or_else(|| root().join("target/tractive/twin"));
    Ok(u8::from(!succeeds(&mut drive(&image, &script, &out))?))
}

/// The step: format, lints and tests of what no other step sees, then the image through its script. The inner error is what is missing.
pub fn check(setup: &mut Setup) -> Result<Result<bool, String>> {
    if !setup.cmake() {
        return Ok(Err(no_cmake()));
    }
    let tidy = !setup.component("fmt", "rustfmt") || succeeds(twin().args(["fmt", "--check"]))?;
    let image = image(setup)?;
    let tests = || {
        succeeds(
            twin()
                .args(["test", "--release", "--", "--include-ignored"])
                .env("TRACTIVE_NUCLEO_IMAGE", &image),
        )
    };
    let out = root().join("target/tractive/twin");
    let script = root().join(SCRIPT);
    Ok(Ok(tidy && succeeds(&mut drive(&image, &script, &out))? && tests()?))
}

/// The image, as `flash` builds it.
fn image(setup: &mut Setup) -> Result<PathBuf> {
    build::board_image(&setup.toolchain()?, &Board::read(BOARD)?, System::Traction, None)
}

/// Cargo in the twin's workspace.
fn twin() -> Command {
    let mut command = cargo();
    command.current_dir(root().join("twin"));
    command
}

fn drive(image: &Path, script: &Path, out: &Path) -> Command {
    say("building the twin …");
    let absolute = |path: &Path| std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
    let mut command = twin();
    command.args(["run", "--quiet", "--release", "--"]);
    command.args([absolute(image), absolute(script)]).arg("--out").arg(absolute(out));
    command
}

fn no_cmake() -> String {
    "cmake is missing, and cannot be installed (Debian: apt-get install cmake)".to_owned()
}
