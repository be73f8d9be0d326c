//! The command line.

use crate::board::Board;
use crate::build::System;
use crate::step::Step;
use clap::{Args, Parser, Subcommand};
use std::ffi::OsString;
use std::path::PathBuf;

/// The chores of `tractive`.
#[derive(Debug, Parser)]
#[command(name = "cargo xtask", bin_name = "cargo xtask", version)]
pub struct Cli {
    #[command(subcommand)]
    pub command: Command,
}

#[derive(Debug, Subcommand)]
pub enum Command {
    /// Set up what is missing, build, run a scenario; `run --help` lists them
    #[command(disable_help_flag = true)]
    Run(RunArgs),
    /// Set up what is missing, build, command the drive over the protocol
    #[command(disable_help_flag = true)]
    Talk(RunArgs),
    /// Set up what is missing, build, identify a simulated machine by its own drive
    #[command(disable_help_flag = true)]
    Identify(RunArgs),
    /// Set up what is missing, build, bring a simulated machine to its first torque, step by step
    #[command(disable_help_flag = true)]
    Commission(RunArgs),
    /// Set up what is missing, run every check
    Test(TestArgs),
    /// Build the image and print what is in it
    Image(ImageArgs),
    /// Count instructions per interrupt and compare them with their budgets
    Timing(TimingArgs),
    /// Build a board's image and flash it with probe-rs
    Flash(FlashArgs),
    /// Build the live bench, the drive and its plant in a browser, and serve it
    Live(LiveArgs),
    /// Execute the image that is flashed against a model of its chip, with the simulated motor at the pins
    Twin(TwinArgs),
    /// Coverage-guided fuzzing of the targets in fuzz/
    Fuzz(FuzzArgs),
    /// Mutation testing: changes of the code that no test notices
    #[command(disable_help_flag = true)]
    Mutants(MutantsArgs),
}

#[derive(Args, Debug)]
pub struct FuzzArgs {
    /// The targets [default: all]
    pub target: Vec<String>,
    /// Time of each, in s; as many run at once as there are cores
    #[arg(long, value_name = "N", default_value_t = 60)]
    pub seconds: u32,
    /// From the kept inputs alone, in the order of this seed: with 1 the inputs of the tests' step, for longer [default: at random from all that was
    /// found here]
    #[arg(long, value_name = "N", conflicts_with = "keep")]
    pub seed: Option<u32>,
    /// Add to fuzz/corpus the inputs that reach code that it does not
    #[arg(long)]
    pub keep: bool,
}

#[derive(Args, Debug)]
pub struct MutantsArgs {
    // Those of mutants/, all of them.
    #[arg(hide = true, trailing_var_arg = true, allow_hyphen_values = true)]
    pub words: Vec<OsString>,
}

#[derive(Args, Debug)]
pub struct RunArgs {
    // The rig's, all of them, wherever they stand.
    #[arg(hide = true, trailing_var_arg = true, allow_hyphen_values = true)]
    pub words: Vec<OsString>,
}

#[derive(Args, Debug)]
pub struct TestArgs {
    /// Only this step (may be repeated)
    #[arg(long, value_enum, value_name = "STEP")]
    pub only: Vec<Step>,
    /// List the steps and do nothing else
    #[arg(long)]
    pub list: bool,
}

#[derive(Args, Debug)]
pub struct ImageArgs {
    /// As one JSON object
    #[arg(long)]
    pub json: bool,
}

#[derive(Args, Debug, Default)]
pub struct TimingArgs {
    /// As one JSON object
    #[arg(long)]
    pub json: bool,
    /// Write the numbers into docs/cost.md and sizes.toml
    #[arg(long)]
    pub write: bool,
    /// Measure the image that identifies its machine instead, against its own budgets
    #[arg(long, conflicts_with_all = ["json", "write", "profile"])]
    pub identify: bool,
    /// List the functions where the instructions go: this many for each interrupt
    #[arg(long, value_name = "FUNCTIONS", num_args = 0..=1, default_missing_value = "20", conflicts_with = "json")]
    pub profile: Option<usize>,
}

#[derive(Args, Debug)]
pub struct FlashArgs {
    /// The board: a folder of boards/
    #[arg(long, value_parser = Board::named, default_value = "nucleo-g474re")]
    pub board: Board,
    /// The system whose image it is
    #[arg(long, value_enum, default_value = "pmasynrm")]
    pub system: System,
    /// The image that identifies its machine, in place of the drive's
    #[arg(long, conflicts_with = "system")]
    pub identify: bool,
    /// A folder of tables/, or the path of any machine folder [default: the system's own]
    #[arg(long, value_name = "NAME|PATH")]
    pub machine: Option<String>,
    /// Stay connected and print the firmware's log
    #[arg(long)]
    pub log: bool,
    /// Build the image, and only print how probe-rs would be called
    #[arg(long)]
    pub dry_run: bool,
}

#[derive(Args, Debug)]
pub struct TwinArgs {
    /// A scenario of twin/scripts/ (sweep, load-steps, precharge, chopper, restart, fault), or a script of commands over CAN, as `talk` takes
    /// them [default: sweep]
    pub scenario: Option<PathBuf>,
    /// The system whose image it is
    #[arg(long, value_enum, default_value = "pmasynrm")]
    pub system: System,
    /// Folder for trace, edges, telemetry, frames and page [default: target/tractive/twin]
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
}

#[derive(Args, Debug)]
pub struct LiveArgs {
    /// Folder for the page, which any server of static files can serve [default: target/live/page]
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Port of the server on this machine; 0: any
    #[arg(long, default_value_t = 0)]
    pub port: u16,
    /// Serve, and open no browser
    #[arg(long)]
    pub no_open: bool,
    /// Make the folder, and serve nothing
    #[arg(long, conflicts_with_all = ["port", "no_open"])]
    pub build_only: bool,
    /// Serve the page of the image in QEMU instead, with the options of `rig live` behind `--`
    #[arg(long, conflicts_with_all = ["out", "port", "no_open", "build_only"])]
    pub in_qemu: bool,
    /// Options of `rig live`
    #[arg(last = true, value_name = "OPTIONS", requires = "in_qemu")]
    pub words: Vec<OsString>,
    /// Write the guide's pictures into this folder instead
    #[arg(long, value_name = "DIR", conflicts_with = "build_only")]
    pub screenshots: Option<PathBuf>,
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_definition_is_sound() {
        Cli::command().debug_assert();
    }

    #[test]
    fn every_word_of_run_is_kept() {
        let words = ["--down", "sweep", "--dt", "1e-4", "--on", "host", "--help"];
        let cli = Cli::try_parse_from(["xtask", "run"].into_iter().chain(words)).unwrap();
        let Command::Run(args) = cli.command else { panic!("not run") };
        assert_eq!(args.words, words);
    }

    #[test]
    fn flash_takes_a_board_by_name_and_refuses_others() {
        for words in [&["xtask", "flash"][..], &["xtask", "flash", "--board", "nucleo-g474re"]] {
            let Command::Flash(args) = Cli::try_parse_from(words).unwrap().command else {
                panic!("not flash")
            };
            assert_eq!((args.board.name.as_str(), args.system), ("nucleo-g474re", System::Traction));
        }
        let cli = Cli::try_parse_from(["xtask", "flash", "--system", "zs9", "--dry-run"]).unwrap();
        let Command::Flash(args) = cli.command else { panic!("not flash") };
        assert_eq!((args.system, args.dry_run), (System::Zs9, true));
        let error = Cli::try_parse_from(["xtask", "flash", "--board", "arduino"]).unwrap_err();
        assert_eq!(error.exit_code(), 2);
    }

    #[test]
    fn test_takes_steps_by_name_and_refuses_others() {
        let cli = Cli::try_parse_from(["xtask", "test", "--only", "fmt", "--only", "image-check"]).unwrap();
        let Command::Test(args) = cli.command else { panic!("not test") };
        assert_eq!(args.only, [Step::Fmt, Step::ImageCheck]);
        let error = Cli::try_parse_from(["xtask", "test", "--only", "nonsense"]).unwrap_err();
        assert_eq!(error.exit_code(), 2);
    }
}
