//! `cargo xtask`: sets up what is missing, builds, runs, tests.
//!
//! `run` runs a scenario, `test` every test there is, `image` shows what the image is made of. Each sets up what it
//! needs: the target, QEMU, rustfmt and clippy. Exit codes: 0 done, 1 it ran and something failed, 2 bad usage or
//! something is missing that cannot be had here.
#![forbid(unsafe_code)]

mod build;
mod calls;
mod image;
mod process;
mod setup;
mod test;

use anyhow::Result;
use clap::{Parser, Subcommand, ValueEnum};
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

#[derive(Parser)]
#[command(name = "cargo xtask", about = "Sets up, builds, runs and tests tractive")]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Runs a scenario and writes its files and its page.
    Run(Run),
    /// Runs every test: lints, host, loom, image, QEMU.
    Test {
        /// Only these steps.
        #[arg(long)]
        only: Vec<String>,
        /// Lists the steps.
        #[arg(long)]
        list: bool,
    },
    /// Builds the image and shows what it is made of.
    Image {
        /// As JSON.
        #[arg(long)]
        json: bool,
    },
    /// Instructions per interrupt: not available yet.
    Timing {
        /// As JSON.
        #[arg(long)]
        json: bool,
    },
    /// Builds a board's image and flashes it: not available yet.
    Flash {
        /// The board.
        #[arg(long)]
        board: Option<String>,
    },
}

#[derive(clap::Args)]
struct Run {
    /// load-steps, sweep or characteristic.
    #[arg(default_value = "sweep")]
    scenario: String,
    /// Where the drive runs.
    #[arg(long, value_enum, default_value = "qemu")]
    on: On,
    /// Folder for the files; default target/tractive/SCENARIO.
    #[arg(long)]
    out: Option<PathBuf>,
    /// A folder of tables/, or the path of any machine folder.
    #[arg(long)]
    machine: Option<String>,
    /// Further options of the rig, such as --down, --brake, --dt S; `cargo rig run --help` lists them.
    #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
    rest: Vec<OsString>,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum On {
    Qemu,
    Host,
}

/// The repository's root.
fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

fn main() -> ExitCode {
    let outcome = match Cli::parse_from(reordered(std::env::args_os())).command {
        Command::Run(options) => run(&options),
        Command::Test { list: true, .. } => {
            test::list();
            Ok(0)
        }
        Command::Test { only, .. } => test::run(&only),
        Command::Image { json } => image::show(json),
        Command::Timing { .. } | Command::Flash { .. } => {
            eprintln!("not available yet");
            Ok(2)
        }
    };
    match outcome {
        Ok(code) => ExitCode::from(code),
        Err(error) => {
            eprintln!("{error:#}");
            ExitCode::from(2)
        }
    }
}

/// Options that `run` itself knows may stand anywhere; those that it hands on go to the end, so that
/// `run sweep --down --on host` means what it says.
fn reordered(arguments: impl Iterator<Item = OsString>) -> Vec<OsString> {
    const KNOWN: [&str; 3] = ["--on", "--out", "--machine"];
    let mut arguments: Vec<_> = arguments.collect();
    if arguments.get(1).is_none_or(|command| command != "run") {
        return arguments;
    }
    let (mut known, mut rest) = (Vec::new(), Vec::new());
    let mut given = arguments.split_off(2).into_iter().peekable();
    if let Some(scenario) = given.next_if(|first| !first.to_string_lossy().starts_with('-')) {
        known.push(scenario);
    } else if given.peek().is_some_and(|first| first != "--help" && first != "-h") {
        known.push("sweep".into());
    }
    while let Some(argument) = given.next() {
        let text = argument.to_string_lossy().into_owned();
        if KNOWN.contains(&text.as_str()) || text == "--help" || text == "-h" {
            known.push(argument);
            known.extend(if text.starts_with("--o") || text == "--machine" { given.next() } else { None });
        } else if KNOWN.iter().any(|name| text.starts_with(&format!("{name}="))) {
            known.push(argument);
        } else {
            rest.push(argument);
        }
    }
    arguments.extend(known);
    if !rest.is_empty() {
        arguments.push("--".into());
        arguments.extend(rest);
    }
    arguments
}

fn run(options: &Run) -> Result<u8> {
    let on = if options.on == On::Qemu { "qemu" } else { "host" };
    let mut command = std::process::Command::new(build::rig()?);
    command.args(["run", &options.scenario, "--on", on]);
    let out = options.out.clone().unwrap_or_else(|| root().join("target/tractive").join(&options.scenario));
    command.arg("--out").arg(out);
    if let Some(machine) = &options.machine {
        command.args(["--machine", machine]);
    }
    if options.on == On::Qemu {
        let qemu = setup::qemu()?;
        let image = build::image(options.machine.as_deref())?;
        command.arg("--image").arg(image).arg("--qemu").arg(qemu);
    }
    process::exit_code(command.args(&options.rest))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn after(line: &str) -> String {
        let arguments = line.split(' ').map(OsString::from);
        reordered(arguments)
            .iter()
            .map(|text| text.to_string_lossy().into_owned())
            .collect::<Vec<_>>()
            .join(" ")
    }

    #[test]
    fn options_for_the_rig_go_to_the_end() {
        assert_eq!(after("x run sweep --down --on host"), "x run sweep --on host -- --down");
        assert_eq!(after("x run --dt 1e-4 --out=o"), "x run sweep --out=o -- --dt 1e-4");
        assert_eq!(after("x run"), "x run");
        assert_eq!(after("x run sweep --machine m --json"), "x run sweep --machine m -- --json");
        assert_eq!(after("x test --list"), "x test --list");
    }

    #[test]
    fn the_command_line_is_sound() {
        use clap::CommandFactory;
        Cli::command().debug_assert();
    }
}
