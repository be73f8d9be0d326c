//! `cargo xtask run`, `talk`, `identify` and `commission`: set up, build, hand over to the rig.
//!
//! Only the rig reads what was typed: first it is asked what the command needs, then it is given the same arguments again.

use crate::build::{self, System};
use crate::process;
use crate::setup::Setup;
use crate::workspace::folders;
use anyhow::{Context, Result, bail};
use serde::Deserialize;
use std::ffi::{OsStr, OsString};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// The script of a talk that is run when none is named.
const SCRIPT: &str = "rig/scripts/round-trip.talk";
/// The same for the ZS9.
const ZS9_SCRIPT: &str = "rig/scripts/zs9.talk";

/// The needs of the arguments, as the rig reports them.
#[derive(Debug, Default, Deserialize, PartialEq, Eq)]
struct Needs {
    system: String,
    /// The control law: `tractive`, `pi` or `identification`.
    law: String,
    /// The pulse patterns: `paper` or `optimal`.
    patterns: String,
    machine: Option<String>,
    /// `true` if the image is still to be built.
    image: bool,
    /// `true` if the emulator is still to be found.
    emulator: bool,
    /// The script of a talk.
    script: Option<PathBuf>,
    /// The machine folder that a commissioning makes, from which the drive's image is then built.
    tables: Option<PathBuf>,
}

impl Needs {
    fn system(&self) -> System {
        if self.system == "zs9" { System::Zs9 } else { System::Traction }
    }

    /// The script, apart from the arguments: the shipped one if a talk names none.
    fn script(&self, verb: &str) -> Option<PathBuf> {
        let shipped = if self.system() == System::Zs9 { ZS9_SCRIPT } else { SCRIPT };
        (verb == "talk" && self.script.is_none()).then(|| build::root().join(shipped))
    }
}

/// The rig, to be called on behalf of this program: in QEMU unless the arguments say otherwise.
fn rig(program: &Path) -> Command {
    let mut rig = Command::new(program);
    rig.env("TRACTIVE_ON", "qemu").env("TRACTIVE_PROGRAM", "cargo xtask");
    // Short to read where the command is given in the root.
    if std::env::current_dir().is_ok_and(|here| here != build::root()) {
        rig.env("TRACTIVE_OUT", build::root().join("target/tractive"));
    }
    rig
}

/// The command, `run`, `talk`, `identify` or `commission` of the rig; the exit code is the rig's.
pub fn run(verb: &str, words: &[OsString]) -> Result<u8> {
    eprintln!("building the rig, where it is not up to date");
    let program = build::rig()?;
    let mut ask = rig(&program);
    ask.args(["needs", verb]).args(words).stderr(Stdio::inherit());
    let said = ask.output().with_context(|| process::cannot_start(&ask))?;
    // Help or bad usage: the rig has already printed the message.
    let Ok(needs) = serde_json::from_slice::<Needs>(&said.stdout) else {
        print!("{}", String::from_utf8_lossy(&said.stdout));
        return Ok(code(said.status));
    };
    let machine =
        needs.machine.as_deref().map(|machine| machine_for_build(machine, build::root())).transpose()?;
    let mut rig = rig(&program);
    rig.arg(verb).args(words).args(needs.script(verb));
    let mut setup = Setup::default();
    if needs.emulator {
        rig.env("TRACTIVE_QEMU", setup.qemu()?);
    }
    if needs.image {
        eprintln!("building the image, where it is not up to date");
        let (toolchain, machine) = (setup.toolchain()?, machine.as_ref());
        let image = match (needs.law.as_str(), needs.patterns.as_str()) {
            ("identification", _) => build::identify_image(&toolchain, machine)?,
            (_, "optimal") => build::optimal_image(&toolchain, machine)?,
            ("pi", _) => build::pi_image(&toolchain, needs.system(), machine)?,
            _ => build::image(&toolchain, needs.system(), machine)?,
        };
        rig.env("TRACTIVE_IMAGE", image);
    }
    let Some(tables) = needs.tables else {
        return Ok(code(rig.status().with_context(|| process::cannot_start(&rig))?));
    };
    let first = rig.args(["--until", "tables"]).status().with_context(|| process::cannot_start(&rig))?;
    if !first.success() {
        return Ok(code(first));
    }
    eprintln!("building the drive's image with the tables that were made");
    let made = machine_for_build(&tables.to_string_lossy(), build::root())?;
    let image = build::image(&setup.toolchain()?, System::Traction, Some(&made))?;
    last(&program, setup.qemu()?.as_ref(), verb, words, &image)
}

/// The rest of a commissioning, with the drive's image.
fn last(program: &Path, qemu: &OsStr, verb: &str, words: &[OsString], image: &Path) -> Result<u8> {
    let mut rig = rig(program);
    rig.env("TRACTIVE_QEMU", qemu).arg(verb).args(words).args(["--resume", "--drive-image"]).arg(image);
    Ok(code(rig.status().with_context(|| process::cannot_start(&rig))?))
}

fn code(status: std::process::ExitStatus) -> u8 {
    status.code().and_then(|code| u8::try_from(code).ok()).unwrap_or_else(|| {
        eprintln!("error: the rig was stopped ({status})");
        1
    })
}

/// A machine as the build script of the firmware takes it: a folder of tables/ by its name, any other by its absolute path.
pub fn machine_for_build(machine: &str, root: &Path) -> Result<OsString> {
    let is_name = !machine.contains(['/', '\\']) && machine != "." && machine != "..";
    if is_name && root.join("tables").join(machine).is_dir() {
        return Ok(machine.into());
    }
    let path = Path::new(machine);
    if !path.is_dir() {
        bail!("--machine {machine}: neither a folder nor one of tables/: {}", machine_names(root).join(", "));
    }
    let path = std::path::absolute(path).with_context(|| format!("--machine {machine}"))?;
    Ok(path.into_os_string())
}

/// The folders of tables/.
pub fn machine_names(root: &Path) -> Vec<String> {
    folders(&root.join("tables"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_talk_has_the_shipped_script_unless_it_names_one() {
        for (system, script) in [("pmasynrm", SCRIPT), ("zs9", ZS9_SCRIPT)] {
            let needs = Needs { system: system.to_owned(), ..Needs::default() };
            assert_eq!(needs.script("talk"), Some(build::root().join(script)));
            assert!(build::root().join(script).is_file());
            assert_eq!(needs.script("run"), None);
            assert_eq!(Needs { script: Some("-".into()), ..needs }.script("talk"), None);
        }
    }

    #[test]
    fn a_machine_is_a_name_or_a_folder() {
        let root = build::root();
        for name in machine_names(root) {
            assert_eq!(machine_for_build(&name, root).unwrap(), *name);
        }
        let folder = machine_for_build("./src", root).unwrap();
        assert!(Path::new(&folder).is_absolute());
        let message = machine_for_build("no-such-machine", root).unwrap_err().to_string();
        assert!(
            message.starts_with("--machine no-such-machine: neither a folder nor one of tables/"),
            "{message}"
        );
    }
}
