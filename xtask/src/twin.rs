//! `cargo xtask twin`: the board's twin, the package in `twin/`, built and run on exactly the image that is flashed.

use crate::board::Board;
use crate::build::{self, System};
use crate::cli::TwinArgs;
use crate::process::{cannot_start, say, succeeds};
use crate::setup::Setup;
use crate::workspace::{cargo, root};
use anyhow::{Context, Result, bail};
use rayon::prelude::*;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// The twin's package: not a default member, as it needs an emulator and, if that is not available compiled, cmake.
pub const PACKAGE: &str = "tractive-twin";
/// The board that it is the twin of.
const BOARD: &str = "nucleo-g474re";
/// The folder of the scenarios' scripts, and the scenario that is run unless told otherwise.
const SCRIPTS: &str = "twin/scripts";
const SCENARIO: &str = "sweep";
/// The scenario with a fault.
const FAULT: &str = "fault";
/// The place for the files unless another is named.
const OUT: &str = "target/tractive/twin";

/// The command.
pub fn run(args: &TwinArgs) -> Result<u8> {
    let mut setup = Setup::default();
    if !setup.emulator() {
        bail!("{}", no_emulator());
    }
    let script = script(args.scenario.as_deref().unwrap_or(Path::new(SCENARIO)), args.system)?;
    let image = image(&mut setup, args.system)?;
    let out = args.out.clone().unwrap_or_else(|| root().join(OUT));
    Ok(u8::from(!succeeds(drive(&image, args.system, &script, &out).arg("--waits"))?))
}

/// The script of a scenario's name, or of a path. The error names those that there are.
fn script(scenario: &Path, system: System) -> Result<PathBuf> {
    if scenario.is_file() {
        return Ok(scenario.to_owned());
    }
    let known = scripts(system)?;
    let names: Vec<_> = known.iter().map(|script| self::scenario(script)).collect();
    match known.iter().find(|script| scenario.as_os_str() == &*self::scenario(script)) {
        Some(file) => Ok(file.clone()),
        None => bail!("{}: neither a script nor one of {}", scenario.display(), names.join(", ")),
    }
}

/// The scenario of a script, by its name.
fn scenario(script: &Path) -> String {
    script.file_stem().unwrap_or_default().to_string_lossy().into_owned()
}

/// The scenarios of a system, by their scripts.
fn scripts(system: System) -> Result<Vec<PathBuf>> {
    let folder = root().join(SCRIPTS).join(twins_name(system));
    let entries = std::fs::read_dir(&folder).with_context(|| folder.display().to_string())?;
    let mut files: Vec<_> = entries.filter_map(|entry| Some(entry.ok()?.path())).collect();
    files.sort();
    Ok(files)
}

/// The step: lints and tests of what no other step checks, then the images through all their scenarios. The inner error is what is missing.
pub fn check(setup: &mut Setup) -> Result<Result<bool, String>> {
    if !setup.emulator() {
        return Ok(Err(no_emulator()));
    }
    let lints = ["--all-targets", "--", "-D", "warnings"];
    let tidy = !setup.component("clippy", "clippy") || succeeds(twin("clippy").args(lints))?;
    let images = [image(setup, System::Traction)?, image(setup, System::Zs9)?];
    if !(tidy && succeeds(&mut twin("build"))? && drive_all(&images)?) {
        return Ok(Ok(false));
    }
    let mut tests = twin("test");
    tests.args(["--", "--include-ignored"]);
    tests.env("TRACTIVE_NUCLEO_IMAGE", &images[0]).env("TRACTIVE_NUCLEO_ZS9_IMAGE", &images[1]);
    Ok(Ok(succeeds(&mut tests)?))
}

/// Drives both images through all their scenarios, as many at a time as there are cores; the results are printed in order. `true` is good.
fn drive_all(images: &[PathBuf; 2]) -> Result<bool> {
    let mut drives = Vec::new();
    for (system, image) in System::ALL.into_iter().zip(images) {
        for script in scripts(system)? {
            let out = root().join(OUT).join(twins_name(system)).join(scenario(&script));
            drives.push((script.clone(), drive(image, system, &script, &out)));
        }
    }
    let told = drives.par_iter_mut().map(|(_, drive)| drive.output().with_context(|| cannot_start(drive)));
    let told: Vec<Output> = told.collect::<Result<_>>()?;
    for ((script, _), Output { stdout, stderr, .. }) in drives.iter().zip(&told) {
        println!("{}:\n{}", script.display(), String::from_utf8_lossy(stdout).trim_end());
        eprint!("{}", String::from_utf8_lossy(stderr));
    }
    Ok(told.iter().all(|told| told.status.success()))
}

/// The image, as `flash` builds it.
fn image(setup: &mut Setup, system: System) -> Result<PathBuf> {
    build::board_image(&setup.toolchain()?, &Board::read(BOARD)?, system, None)
}

/// The system as the twin calls it.
fn twins_name(system: System) -> &'static str {
    match system {
        System::Traction => "pmasynrm",
        System::Zs9 => "zs9",
    }
}

/// The time at which the drivers' ready wire drops in the scenario with a fault, in s.
fn drivers_fail_s(system: System) -> &'static str {
    match system {
        System::Traction => "3.4",
        System::Zs9 => "2.6",
    }
}

/// A command of cargo's on the twin.
fn twin(verb: &str) -> Command {
    let mut command = cargo();
    command.args([verb, "--release", "--package", PACKAGE]);
    command
}

fn drive(image: &Path, system: System, script: &Path, out: &Path) -> Command {
    say("building the twin …");
    let absolute = |path: &Path| std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
    let is = |name: &str| scenario(script) == name;
    let mut command = twin("run");
    command.args(["--quiet", "--"]);
    command.args([absolute(image), absolute(script)]).args(["--system", twins_name(system)]);
    command.arg("--out").arg(absolute(out));
    if is(SCENARIO) {
        command.arg("--host");
    }
    if is(FAULT) {
        command.args(["--drivers-fail", drivers_fail_s(system)]);
    }
    command
}

fn no_emulator() -> String {
    "Unicorn cannot be fetched by pip, and cmake is missing and cannot be installed (Debian: apt-get install cmake)".to_owned()
}
