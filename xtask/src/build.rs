//! The calls of cargo: the image for the board, the rig for this machine.

use crate::board::Board;
use crate::process;
use crate::setup::Toolchain;
pub use crate::workspace::{TARGET, cargo, cargo_with, root};
use anyhow::{Context, Result, bail};
use clap::ValueEnum;
use std::ffi::OsString;
use std::fs;
use std::path::PathBuf;
use std::process::{Command, Stdio};

/// The feature of the reference images, on the emulated board.
pub const QEMU: &str = "qemu";

/// The PMaSynRM's image with the optimised pulse patterns.
const OPTIMAL: &str = "optimal";

/// The image that identifies its machine.
const IDENTIFY: &str = "identify";

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

    /// Its image, the folder of tables/ with which the image is built, and the variable that names another machine to the build script.
    const fn names(self) -> [&'static str; 3] {
        match self {
            Self::Traction => ["tractive", "pmasynrm-180kw", "TRACTIVE_MACHINE"],
            Self::Zs9 => ["zs9", "ipm-zs9", "TRACTIVE_ZS9_MACHINE"],
        }
    }

    /// The image's name.
    pub const fn image(self) -> &'static str {
        self.names()[0]
    }

    /// The name of its image with the papers' ordinary control law.
    const fn pi_image(self) -> &'static str {
        match self {
            Self::Traction => "pi",
            Self::Zs9 => "zs9_pi",
        }
    }

    /// The name of a board's image.
    pub fn image_on(self, board: &Board) -> String {
        match self {
            Self::Traction => board.name.clone(),
            Self::Zs9 => format!("{}-zs9", board.name),
        }
    }

    /// The folder of tables/ that the image is built with unless another is named.
    pub const fn machine(self) -> &'static str {
        self.names()[1]
    }

    /// The variable that names the machine to the build script.
    pub const fn machine_variable(self) -> &'static str {
        self.names()[2]
    }
}

/// Builds a system's image, with the tables of `machine` if one is named (a name or an absolute path).
pub fn image(toolchain: &Toolchain, system: System, machine: Option<&OsString>) -> Result<PathBuf> {
    let mut command = on_target(toolchain, "tractive", system.image());
    command.args(["--features", QEMU]);
    firmware(command, system.image(), system, machine)
}

/// Builds a system's image with the papers' ordinary control law, likewise.
pub fn pi_image(toolchain: &Toolchain, system: System, machine: Option<&OsString>) -> Result<PathBuf> {
    let mut command = on_target(toolchain, "tractive", system.pi_image());
    command.args(["--features", QEMU]);
    firmware(command, system.pi_image(), system, machine)
}

/// Builds the image that identifies its machine, likewise.
pub fn identify_image(toolchain: &Toolchain, machine: Option<&OsString>) -> Result<PathBuf> {
    let mut command = on_target(toolchain, "tractive", IDENTIFY);
    command.args(["--features", QEMU]);
    firmware(command, IDENTIFY, System::Traction, machine)
}

/// Builds the PMaSynRM's image with the optimised pulse patterns, likewise.
pub fn optimal_image(toolchain: &Toolchain, machine: Option<&OsString>) -> Result<PathBuf> {
    let mut command = on_target(toolchain, "tractive", OPTIMAL);
    command.args(["--features", "qemu,optimal"]);
    firmware(command, OPTIMAL, System::Traction, machine)
}

/// Builds a system's image for a board of real hardware, with the tables of `machine` if one is named.
pub fn board_image(
    toolchain: &Toolchain,
    board: &Board,
    system: System,
    machine: Option<&OsString>,
) -> Result<PathBuf> {
    let name = system.image_on(board);
    let mut command = on_target(toolchain, &board.package, &name);
    if system == System::Traction && wants_optimal(machine, system)? {
        command.args(["--features", OPTIMAL]);
    }
    firmware(command, &name, system, machine)
}

/// Builds the PMaSynRM's image for a board with another power stage, a file beside the board's package.
pub fn image_of_stage(toolchain: &Toolchain, board: &Board, stage: &str) -> Result<PathBuf> {
    let name = System::Traction.image_on(board);
    let mut command = on_target(toolchain, &board.package, &name);
    command.env("TRACTIVE_POWER_STAGE", stage);
    firmware(command, &name, System::Traction, None)
}

/// `true` for a machine whose `patterns` are "optimal"; the build script judges everything else in its file.
fn wants_optimal(machine: Option<&OsString>, system: System) -> Result<bool> {
    let machine = machine.map_or_else(|| system.machine().into(), OsString::clone);
    let file = root().join("tables").join(machine).join("machine.toml");
    let text = fs::read_to_string(&file).with_context(|| file.display().to_string())?;
    let keys: toml::Table = toml::from_str(&text).with_context(|| file.display().to_string())?;
    Ok(keys.get("patterns").and_then(toml::Value::as_str) == Some(OPTIMAL))
}

/// Builds the image that identifies its machine for a board of real hardware, likewise.
pub fn identify_on(toolchain: &Toolchain, board: &Board, machine: Option<&OsString>) -> Result<PathBuf> {
    let name = format!("{}-{IDENTIFY}", board.name);
    firmware(on_target(toolchain, &board.package, &name), &name, System::Traction, machine)
}

fn firmware(mut command: Command, name: &str, system: System, machine: Option<&OsString>) -> Result<PathBuf> {
    command.envs(machine.map(|machine| (system.machine_variable(), machine)));
    executable(&mut command, name, machine.is_some()).context("the image was not built")
}

/// Builds the system's image with the fault injector.
pub fn fault_injector(toolchain: &Toolchain, system: System) -> Result<PathBuf> {
    let name = match system {
        System::Traction => "fault-injector",
        System::Zs9 => "fault-injector-zs9",
    };
    executable(&mut on_target(toolchain, "tractive-fault-injector", name), name, false)
        .context("the image was not built")
}

/// Builds one of the bench's images: `tractive-bench`, the building blocks, or `cell_stress`.
pub fn bench(toolchain: &Toolchain, name: &str) -> Result<PathBuf> {
    executable(&mut on_target(toolchain, "tractive-bench", name), name, false)
        .context("the bench was not built")
}

/// Builds the reference images with the same set of features at once: each core links one. Afterwards each is there for any caller that asks for it.
pub fn reference_images(toolchain: &Toolchain) -> Result<bool> {
    let [of_traction, of_zs9] = System::ALL.map(|system| [system.image(), system.pi_image()]);
    let mut command = on_target(toolchain, "tractive", IDENTIFY);
    command.args(["--features", QEMU]);
    command.args([of_traction, of_zs9].concat().iter().flat_map(|name| ["--bin", name]));
    process::succeeds(&mut command)
}

/// Builds a board's images, likewise.
pub fn images_of(toolchain: &Toolchain, board: &Board) -> Result<bool> {
    let mut command = on_target(toolchain, &board.package, &format!("{}-{IDENTIFY}", board.name));
    command.args(System::ALL.iter().flat_map(|system| ["--bin".to_owned(), system.image_on(board)]));
    process::succeeds(&mut command)
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
    let mut command = cargo_with("build --release --package tractive-rig --bin tractive-rig");
    executable(&mut command, "tractive-rig", false).context("the rig was not built")
}

/// Runs a `cargo build` and returns the path of the executable as cargo reports it. `own_data` means that the user's data goes into the build: then the
/// build script's message about it stands alone, without cargo's frame around it.
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

/// The message of a failed build script, on one line: its standard error, else its `cargo::error`s.
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
        let boards = Board::all().unwrap().into_iter().map(|board| format!("boards/{}", board.name));
        for package in std::iter::once(String::new()).chain(boards) {
            let script = std::fs::read_to_string(root().join(&package).join("build.rs")).unwrap();
            for system in System::ALL {
                let pair = format!("(\"{}\", \"{}\"", system.machine_variable(), system.machine());
                assert!(script.contains(&pair), "{package}: {pair}");
            }
        }
    }

    #[test]
    fn a_machine_says_whether_its_image_has_the_optimised_patterns() {
        let folder = tempfile::tempdir().unwrap();
        let machine = Some(folder.path().as_os_str().to_owned());
        let wanted = |text: &str| {
            fs::write(folder.path().join("machine.toml"), text).unwrap();
            wants_optimal(machine.as_ref(), System::Traction).unwrap()
        };
        assert!(wanted("patterns = \"optimal\""));
        assert!(!wanted("patterns = \"paper\"") && !wanted(""));
        assert!(!wants_optimal(None, System::Traction).unwrap());
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
