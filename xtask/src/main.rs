//! The project's chores, as `cargo xtask COMMAND`.
//!
//! | command | what it does |
//! |---|---|
//! | `run [SCENARIO] [--on qemu\|host] [--out DIR] …` | sets up what is missing, builds, hands over to the rig |
//! | `talk [SCRIPT] [--on qemu\|host] [--out DIR] …` | the same, and commands the drive over the protocol |
//! | `test [--only STEP]… [--list]` | sets up what is missing, runs every check, ends with a table and a count |
//! | `image [--json]` | builds the image and says what is in it |
//! | `timing [--json] [--profile [N]]` | instructions per interrupt against `budgets.toml` |
//! | `live [--out DIR] [--port N] [--no-open]` | builds the live bench and serves it |
//! | `flash [--board NAME] [--log]` | builds a board's image and flashes it with probe-rs |
//! | `twin [SCENARIO] [--out DIR]` | builds that image and executes it against a model of its chip |
//! | `fuzz [TARGET]… [--seconds N]` | coverage-guided fuzzing of the targets in `fuzz/` |
//! | `mutants [--area NAME] [--shard K/N] [--sample N]` | mutation testing, by the program of `mutants/` |
//!
//! Results go to standard output, progress messages to standard error. Exit codes: 0 done; 1 it ran and something failed; 2 it could not run (bad
//! usage, bad input, something missing), with the reason on one line.
//!
//! The modules: [`cli`] is what may be typed, [`setup`] what has to be installed, [`build`] how cargo is called, [`board`] which boards there are,
//! [`run`], [`mod@test`], [`image`], [`timing`], [`live`], [`flash`], [`twin`], [`fuzz`] and [`mutants`] the commands; [`guide`] runs those of the
//! documentation. An image is read by [`elf`], its instructions by [`thumb`]; [`graph`] says which function calls which, [`check`] refuses what an
//! image must not hold, and [`cells`] looks at what the cells did under the interrupts, in the [`emulator`].

#![forbid(unsafe_code)]

mod board;
mod build;
mod cells;
mod check;
mod cli;
mod elf;
mod emulator;
mod fault_injector;
mod flash;
mod fuzz;
mod graph;
mod guide;
mod image;
mod live;
mod mutants;
mod overruns;
mod own_board;
mod preemption;
mod process;
mod publish;
mod python;
mod run;
mod setup;
mod slurm;
mod step;
mod test;
mod thumb;
mod timing;
mod twin;
mod workspace;

use clap::Parser;
use std::process::ExitCode;

fn main() -> ExitCode {
    let result = match cli::Cli::parse().command {
        cli::Command::Run(args) => run::run("run", &args.words),
        cli::Command::Identify(args) => run::run("identify", &args.words),
        cli::Command::Commission(args) => run::run("commission", &args.words),
        cli::Command::Talk(args) => run::run("talk", &args.words),
        cli::Command::Test(args) => test::run(&args),
        cli::Command::Image(args) => image::run(&args),
        cli::Command::Timing(args) => timing::run(&args),
        cli::Command::Flash(args) => flash::run(&args),
        cli::Command::Live(args) => live::run(&args),
        cli::Command::Twin(args) => twin::run(&args),
        cli::Command::Fuzz(args) => fuzz::run(&args),
        cli::Command::Mutants(args) => mutants::run(&args.words),
    };
    match result {
        Ok(code) => ExitCode::from(code),
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::from(2)
        }
    }
}
