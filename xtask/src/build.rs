//! How cargo is called: the image for the board, the rig for this machine.

use std::ffi::OsString;
use std::path::PathBuf;
use std::process::{Command, Stdio};

use anyhow::{Context, Result, bail};
use clap::ValueEnum;

use crate::process;
use crate::setup::Toolchain;
pub use crate::workspace::{TARGET, cargo, root};

/// The feature of the reference images, on the emulated board.
pub const QEMU: &str = "qemu";

/// The boards of real hardware, by their feature `board-NAME`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Board {
    /// ST's NUCLEO-G474RE
    NucleoG474re,
}

impl Board {
    /// The feature of the firmware's crate.
    pub const fn feature(self) -> &'static str {
        match self {
            Self::NucleoG474re => "board-nucleo-g474re",
        }
    }

    /// Where its flash memory begins, and with it the image.
    pub const fn flash_origin(self) -> u32 {
        match self {
            Self::NucleoG474re => 0x0800_0000,
        }
    }

    /// What probe-rs calls the chip.
    pub const fn chip(self) -> &'static str {
        match self {
            Self::NucleoG474re => "STM32G474RETx",
        }
    }
}

/// The systems, each with an image of its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum System {
    /// The PMaSynRM behind a two-level inverter
    #[value(name = "pmasynrm")]
    Traction,
    /// Two motors behind a Z-source nine-switch inverter
    Zs9,
}

impl System {
    /// All of them.
    pub const ALL: [Self; 2] = [Self::Traction, Self::Zs9];

    /// The image's name.
    pub const fn image(self) -> &'static str {
        match self {
            Self::Traction => "tractive",
            Self::Zs9 => "zs9",
        }
    }

    /// The folder of tables/ that the image is built with unless another is named.
    pub const fn machine(self) -> &'static str {
        match self {
            Self::Traction => "pmasynrm-180kw",
            Self::Zs9 => "ipm-zs9",
        }
    }

    /// The variable that names the machine to the build script.
    const fn machine_variable(self) -> &'static str {
        match self {
            Self::Traction => "TRACTIVE_MACHINE",
            Self::Zs9 => "TRACTIVE_ZS9_MACHINE",
        }
    }
}

/// Builds a system's image, with the tables of `machine` if one is named (a name or an absolute path).
pub fn image(toolchain: &Toolchain, system: System, machine: Option<&OsString>) -> Result<PathBuf> {
    firmware(toolchain, system, QEMU, machine)
}

/// The same with a feature of the emulated board.
pub fn image_with(toolchain: &Toolchain, system: System, feature: &str) -> Result<PathBuf> {
    firmware(toolchain, system, feature, None)
}

/// Builds a system's image for a board of real hardware, with the tables of `machine` if one is named.
pub fn board_image(
    toolchain: &Toolchain,
    board: Board,
    system: System,
    machine: Option<&OsString>,
) -> Result<PathBuf> {
    firmware(toolchain, system, board.feature(), machine)
}

fn firmware(
    toolchain: &Toolchain,
    system: System,
    feature: &str,
    machine: Option<&OsString>,
) -> Result<PathBuf> {
    let mut command = on_target(toolchain, "tractive", system.image());
    command.args(["--features", feature]);
    command.envs(machine.map(|machine| (system.machine_variable(), machine)));
    executable(&mut command, system.image(), machine.is_some()).context("the image was not built")
}

/// Builds one of the bench's images: `tractive-bench`, the building blocks, or `cell_stress`.
pub fn bench(toolchain: &Toolchain, name: &str) -> Result<PathBuf> {
    executable(&mut on_target(toolchain, "tractive-bench", name), name, false)
        .context("the bench was not built")
}

/// The build of a package's image with its built-in machines.
fn on_target(toolchain: &Toolchain, package: &str, name: &str) -> Command {
    let args = ["build", "--profile", "firmware", "--target", TARGET, "--package", package, "--bin", name];
    process::say(&format!("building the image `{name}` …"));
    let mut command = toolchain.cargo(&args);
    for system in System::ALL {
        command.env_remove(system.machine_variable());
    }
    command
}

/// Builds the rig's program.
pub fn rig() -> Result<PathBuf> {
    process::say("building the rig …");
    let mut command = cargo();
    command.args(["build", "--release", "--package", "tractive-rig", "--bin", "tractive-rig"]);
    executable(&mut command, "tractive-rig", false).context("the rig was not built")
}

/// Runs a `cargo build` and returns where it says the executable is. `own_data` means that the user's data goes into
/// the build: then what the build script says about it stands alone, without cargo's frame around it.
fn executable(command: &mut Command, name: &str, own_data: bool) -> Result<PathBuf> {
    command.arg("--message-format=json-render-diagnostics").stdin(Stdio::null()).stdout(Stdio::piped());
    command.stderr(if own_data { Stdio::piped() } else { Stdio::inherit() });
    let child = command.spawn().with_context(|| process::cannot_start(command))?;
    let output = child.wait_with_output()?;
    if !output.status.success() {
        let said = String::from_utf8_lossy(&output.stderr);
        match complaint(&said) {
            Some(reason) => bail!("{reason}"),
            None => eprint!("{said}"),
        }
        bail!("cargo failed ({})", output.status);
    }
    let messages = String::from_utf8_lossy(&output.stdout);
    artifact(&messages, name).with_context(|| format!("cargo names no executable `{name}`"))
}

/// The executable of that name in cargo's messages.
fn artifact(messages: &str, name: &str) -> Option<PathBuf> {
    let messages = messages.lines().filter_map(|line| serde_json::from_str::<serde_json::Value>(line).ok());
    messages
        .filter(|message| message["reason"] == "compiler-artifact" && message["target"]["name"] == name)
        .filter_map(|message| message["executable"].as_str().map(PathBuf::from))
        .next_back()
}

/// What a failed build script said, on one line: its standard error, else its `cargo::error`s.
fn complaint(cargo_said: &str) -> Option<String> {
    if !cargo_said.contains("failed to run custom build command") {
        return None;
    }
    let printed = cargo_said.lines().skip_while(|line| line.trim() != "--- stderr").skip(1);
    let printed: Vec<_> = printed.map(str::trim).take_while(|line| !line.is_empty()).collect();
    let declared = cargo_said.lines().filter_map(|line| line.strip_prefix("error: ")?.split_once(": "));
    let declared: Vec<_> = declared.filter(|(from, _)| from.contains('@')).map(|(_, what)| what).collect();
    let said = if printed.is_empty() { declared } else { printed };
    (!said.is_empty()).then(|| said.join("; ").trim_start_matches("error: ").to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_executable_is_the_one_cargo_names() {
        let messages = concat!(
            r#"{"reason":"compiler-artifact","target":{"name":"tractive"},"executable":null}"#,
            "\nnot json\n",
            r#"{"reason":"compiler-artifact","target":{"name":"tractive"},"executable":"/t/firmware/tractive"}"#,
            "\n",
            r#"{"reason":"compiler-artifact","target":{"name":"other"},"executable":"/t/other"}"#,
            "\n",
            r#"{"reason":"build-finished","success":true}"#,
        );
        assert_eq!(artifact(messages, "tractive"), Some(PathBuf::from("/t/firmware/tractive")));
        assert_eq!(artifact(messages, "absent"), None);
    }

    #[test]
    fn the_machines_are_those_of_the_build_script() {
        let script = include_str!("../../build.rs");
        for system in System::ALL {
            assert!(script.contains(&format!(
                "(\"{}\", \"{}\"",
                system.machine_variable(),
                system.machine()
            )));
        }
    }

    #[test]
    fn a_build_scripts_own_words_stand_alone() {
        let said = "   Compiling tractive v0.1.0 (/x)\n\
            error: failed to run custom build command for `tractive v0.1.0 (/x)`\n\nCaused by:\n  \
            process didn't exit successfully: `/x/build-script-build` (exit status: 1)\n  --- stdout\n  \
            cargo:rerun-if-changed=y\n\n  --- stderr\n  flux_map.csv:3: psi_d_wb = `x`, a number is expected\n";
        assert_eq!(complaint(said).unwrap(), "flux_map.csv:3: psi_d_wb = `x`, a number is expected");
        let said = "error: tractive@0.1.0: machine.toml: pole_pairs = 0, at least 1 is expected\n\
            error: failed to run custom build command for `tractive v0.1.0 (/x)`\n";
        assert_eq!(complaint(said).unwrap(), "machine.toml: pole_pairs = 0, at least 1 is expected");
        assert_eq!(complaint("error: could not compile `tractive` (bin) due to 1 previous error"), None);
    }
}
