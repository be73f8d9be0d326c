//! The rig's command line.

use anyhow::Result;
use clap::{CommandFactory, Parser, Subcommand};
use std::ffi::OsString;
use std::path::PathBuf;
use std::process::ExitCode;
use tractive_rig::benchmark::{self, BenchOptions};
use tractive_rig::campaign::{self, options::CampaignOptions};
use tractive_rig::commission;
use tractive_rig::compare::{self, CompareOptions};
use tractive_rig::dbc::{self, DbcOptions};
use tractive_rig::folder::{self, MachineCommand};
#[cfg(unix)]
use tractive_rig::live::LiveOptions;
use tractive_rig::machine::Machine;
use tractive_rig::merge::{self, MergeOptions};
use tractive_rig::needs::Needs;
use tractive_rig::scenario::command::folder;
use tractive_rig::shards::Shard;
use tractive_rig::{gallery, identify, nine_switch, optimised, pattern, points, report, say, scenario, talk};

#[derive(Parser)]
#[command(name = "tractive-rig", about = "Plays the motor to the drive, and shows what happened", version)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Runs a scenario and writes its files; `run --help` lists the scenarios.
    #[command(disable_help_flag = true, override_usage = "tractive-rig run [SCENARIO] [OPTIONS]")]
    Run {
        // Each scenario has a command line of its own.
        #[arg(hide = true, trailing_var_arg = true, allow_hyphen_values = true)]
        words: Vec<OsString>,
    },
    /// The needs of `run`, `talk`, `live`, `identify` or `commission` for these words, as JSON, for whoever makes them ready.
    #[command(hide = true, disable_help_flag = true)]
    Needs {
        #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
        words: Vec<OsString>,
    },
    /// Completions of this program's commands for a shell, on the standard output.
    Completions {
        /// The shell.
        shell: clap_complete::Shell,
    },
    /// Simulated seconds per second of each scenario, on one thread of this machine, and where the time goes.
    #[command(disable_help_flag = true, override_usage = "tractive-rig bench [SCENARIO…] [OPTIONS]")]
    Bench {
        // Scenarios of one system alone bring its options.
        #[arg(hide = true, trailing_var_arg = true, allow_hyphen_values = true)]
        words: Vec<OsString>,
    },
    /// Commands the drive over the protocol, by a script or line by line, and logs its telemetry.
    #[command(disable_help_flag = true, override_usage = "tractive-rig talk [SCRIPT] [OPTIONS]")]
    Talk {
        // Each system has a command line of its own.
        #[arg(hide = true, trailing_var_arg = true, allow_hyphen_values = true)]
        words: Vec<OsString>,
    },
    /// Serves the live page of a drive that runs elsewhere: the image in QEMU, or a drive on a CAN bus.
    #[cfg(unix)]
    #[command(disable_help_flag = true, override_usage = "tractive-rig live [OPTIONS]")]
    Live {
        #[arg(hide = true, trailing_var_arg = true, allow_hyphen_values = true)]
        words: Vec<OsString>,
    },
    /// Operating points: IN.csv has torque_nm,speed_rpm,udc_v; OUT.csv has all of its columns, and behind them id_a,iq_a,region.
    Points {
        /// Points wanted.
        input: PathBuf,
        /// Points found; with --shard a folder.
        output: PathBuf,
        /// A folder of tables/, or the path of any machine folder.
        #[arg(long, default_value = "pmasynrm-180kw")]
        machine: String,
        /// Shard K of N, from 0: its points alone, into the file shard-K-of-N.csv of the folder OUTPUT.
        #[arg(long, value_name = "K/N")]
        shard: Option<Shard>,
    },
    /// Merges a campaign or a sweep over operating points whose shards are all in a folder: writes the files that one run would have written.
    Merge(MergeOptions),
    /// Machine folders: from nameplate values, from a map of another tool, and as a page.
    #[command(subcommand)]
    Machine(Box<MachineCommand>),
    /// Identifies an unknown machine, simulated, by its own drive: its resistance, its flux map, its inertia, and a machine folder made from them.
    Identify(Box<identify::Identify>),
    /// Brings an unknown machine to its first torque, step by step: wiring, identification, tables, a little torque; and writes a record of it.
    Commission(Box<commission::Commission>),
    /// The protocol's description for CAN tools, a DBC file: signals in the steps that follow from a machine's ratings.
    Dbc(DbcOptions),
    /// The modulator's pulses in steady state.
    Pattern(PatternOptions),
    /// Recomputes the optimised pulse patterns: each branch's window and weighted distortion.
    Patterns(optimised::PatternsOptions),
    /// Faults in every mode, at every speed, motoring, braking and coasting, and the outcome of each.
    Campaign(CampaignOptions),
    /// The papers' figures as this project makes them, an SVG each, named by paper and number.
    Figures(gallery::FigureOptions),
    /// Both control laws in the same runs, the project's own and the ordinary one: the results of each.
    Compare(CompareOptions),
    /// The nine-switch modulator's gates for one carrier period (T = 1): IN.csv has scheme,theta1_deg,m1,theta2_deg,m2,d_sh;
    /// OUT.csv adds for each gate UH ... WL its level just after t = 0 (X_init) and its toggle instants (X_edges, with ; between),
    /// feasible (1 or 0; then the gates are those of what fits), m1_applied and m2_applied.
    NineSwitch {
        /// Requests: scheme s, rs, rthd, zvo, rthd-central or rthd-slide; angles in degrees; m = 2|V|/U_in; d_sh from 0 to 1.
        input: PathBuf,
        /// Gates.
        output: PathBuf,
    },
}

#[derive(clap::Args)]
struct PatternOptions {
    #[command(flatten)]
    wanted: pattern::Wanted,
    /// Mode.
    #[arg(long, value_parser = pattern::names())]
    mode: String,
    /// The file to write: t_s,leg,level.
    #[arg(long)]
    out: PathBuf,
    /// A folder of tables/, or the path of any machine folder.
    #[arg(long, default_value = "pmasynrm-180kw")]
    machine: String,
}

fn main() -> ExitCode {
    match command(Cli::parse().command) {
        Ok(code) => code,
        Err(error) => {
            if let Some(usage) = error.downcast_ref::<clap::Error>() {
                usage.exit();
            }
            // One line: the error, and its place.
            eprintln!("{error:#}");
            ExitCode::from(2)
        }
    }
}

fn done(result: Result<()>) -> Result<ExitCode> {
    result.map(|()| ExitCode::SUCCESS)
}

fn command(command: Command) -> Result<ExitCode> {
    match command {
        Command::Run { words } => scenario::command::run(words),
        Command::Needs { words } => needs(words),
        Command::Completions { shell } => {
            let mut program = Cli::command()
                .mut_subcommand("run", |_| scenario::catalogue::completed())
                .mut_subcommand("talk", |_| talk::TalkOptions::command(talk::System::default()))
                .mut_subcommand("bench", |_| BenchOptions::command([true, false]));
            let mut text = Vec::new();
            clap_complete::generate(shell, &mut program, "tractive-rig", &mut text);
            say!("{}", String::from_utf8(text)?.trim_end());
            Ok(ExitCode::SUCCESS)
        }
        Command::Bench { words } => done(benchmark::run(&BenchOptions::read(&words)?)),
        Command::Talk { words } => run_talk(&talk::TalkOptions::read(&words)?),
        #[cfg(unix)]
        Command::Live { words } => done(tractive_rig::live::run(&LiveOptions::read(&words)?)),
        Command::Points { input, output, machine, shard } => {
            done(points::run(&input, &output, &Machine::load(&machine)?, shard))
        }
        Command::Merge(options) => merge::run(&options),
        Command::Figures(options) => done(gallery::run(&options)),
        Command::Machine(command) => done(folder::run(&command)),
        Command::Identify(options) => identify::command(&options),
        Command::Commission(options) => commission::command(&options),
        Command::Dbc(options) => done(dbc::run(&options)),
        Command::NineSwitch { input, output } => done(nine_switch::run(&input, &output)),
        Command::Campaign(options) if !options.merge.is_empty() => {
            merge::run(&MergeOptions { folders: options.merge, out: options.out, json: options.json })
        }
        Command::Campaign(options) => campaign::command::run(&options),
        Command::Compare(options) => compare::run(&options),
        Command::Patterns(options) => done(optimised::run(&options)),
        Command::Pattern(options) => {
            let machine = Machine::load(&options.machine)?;
            let max_switching_hz = machine.tables.ratings.max_switching_hz;
            let wanted = pattern::Wanted { max_switching_hz, ..options.wanted }.with_mode(&options.mode);
            done(pattern::write(&wanted, &options.out))
        }
    }
}

/// Prints what is needed for the words, without doing anything.
fn needs(words: Vec<OsString>) -> Result<ExitCode> {
    let needs = match Cli::try_parse_from(std::iter::once("tractive-rig".into()).chain(words))?.command {
        Command::Run { words } => Needs::of_run(words)?,
        Command::Talk { words } => Needs::of_talk(&talk::TalkOptions::read(&words)?),
        #[cfg(unix)]
        Command::Live { words } => Needs::of_drive(&LiveOptions::read(&words)?.drive),
        Command::Identify(options) => Needs::of_identify(&options),
        Command::Commission(options) => Needs::of_commission(&options),
        _ => anyhow::bail!("needs: must be followed by run, talk, live, identify or commission"),
    };
    say!("{}", serde_json::to_string(&needs)?);
    Ok(ExitCode::SUCCESS)
}

fn run_talk(options: &talk::TalkOptions) -> Result<ExitCode> {
    let outcome = talk::run(options)?;
    let out = folder("talk", &options.run)?;
    talk::write(options, &outcome, &out)?;
    if options.run.json {
        say!("{}", serde_json::to_string(outcome.figures.values())?);
    } else {
        say!("{}\n", report::text(&outcome.figures));
        say!("report: {}", out.join("report.html").display());
    }
    for failure in &outcome.talk.failures {
        eprintln!("{failure}");
    }
    Ok(if outcome.talk.failures.is_empty() { ExitCode::SUCCESS } else { ExitCode::from(1) })
}
