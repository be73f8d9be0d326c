//! The rig's command line.

use anyhow::{Context, Result};
use clap::parser::ValueSource;
use clap::{CommandFactory, FromArgMatches, Parser, Subcommand, ValueEnum};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;
use tractive::machine::BUILT_IN;
use tractive_rig::analysis::Figures;
use tractive_rig::campaign::{self, command::CampaignOptions};
use tractive_rig::machine::Machine;
use tractive_rig::options::{OF_THE_ZS9, RunOptions, check_own, not_negative, positive};
use tractive_rig::report::{self, Page};
use tractive_rig::scenario::{self, Scenario};
use tractive_rig::trace::Recording;
use tractive_rig::{benchmark, figures, files, nine_switch, pattern, points, say, spectrum, talk, zs9};

#[derive(Parser)]
#[command(name = "tractive-rig", about = "Plays the motor to the drive, and shows what happened", version)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Runs a scenario and writes its files.
    Run {
        /// load-steps, sweep, characteristic, full-step, steady, mode-borders, reversal, restart, link-steps, precharge, chopper,
        /// acknowledge, zs9-load-step, zs9-reverse, zs9-cycle or zs9-steady.
        #[arg(default_value = "sweep")]
        scenario: String,
        #[command(flatten)]
        options: Box<RunOptions>,
    },
    /// Simulated seconds per second of each scenario, on one thread of this machine, and where the time goes.
    Bench {
        /// All of them unless some are named.
        scenarios: Vec<String>,
        #[command(flatten)]
        options: Box<RunOptions>,
    },
    /// Commands the drive over the protocol, by a script or line by line, and logs its telemetry.
    #[command(after_help = talk_help())]
    Talk(Box<talk::TalkOptions>),
    /// Operating points: IN.csv has torque_nm,speed_rpm,udc_v; OUT.csv adds id_a,iq_a,region.
    Points {
        /// Points wanted.
        input: PathBuf,
        /// Points found.
        output: PathBuf,
        /// A folder of tables/, or the path of any machine folder.
        #[arg(long, default_value = "pmasynrm-180kw")]
        machine: String,
    },
    /// The modulator's pulses in steady state.
    Pattern(PatternOptions),
    /// Faults in every mode, at every speed, motoring, braking and coasting, and what came of each.
    Campaign(CampaignOptions),
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
    /// Mode.
    #[arg(long, value_enum)]
    mode: ModeName,
    /// Fundamental, peak phase, in V.
    #[arg(long, value_parser = not_negative, allow_negative_numbers = true)]
    u: f64,
    /// DC link, in V.
    #[arg(long, value_parser = positive, allow_negative_numbers = true)]
    udc: f64,
    /// Stator frequency, in Hz.
    #[arg(long, value_parser = positive, allow_negative_numbers = true)]
    f1: f64,
    /// Fundamental periods.
    #[arg(long, default_value_t = 1, allow_negative_numbers = true)]
    cycles: u32,
    /// The file to write: t_s,leg,level.
    #[arg(long)]
    out: PathBuf,
    /// Dead time, in µs.
    #[arg(long, default_value_t = 0.0, value_parser = not_negative, allow_negative_numbers = true)]
    dead_time_us: f64,
    /// Shortest pulse, in µs.
    #[arg(long, default_value_t = 0.0, value_parser = not_negative, allow_negative_numbers = true)]
    min_pulse_us: f64,
    /// A folder of tables/, or the path of any machine folder.
    #[arg(long, default_value = "pmasynrm-180kw")]
    machine: String,
}

#[derive(Clone, Copy, ValueEnum)]
enum ModeName {
    Async,
    Sync15,
    Sync12,
    Mid7,
    Mid3,
    Square,
}

impl From<ModeName> for tractive::modulation::Mode {
    fn from(name: ModeName) -> Self {
        match name {
            ModeName::Async => Self::Async,
            ModeName::Sync15 => Self::Sync15,
            ModeName::Sync12 => Self::Sync12,
            ModeName::Mid7 => Self::Mid7,
            ModeName::Mid3 => Self::Mid3,
            ModeName::Square => Self::Square,
        }
    }
}

fn main() -> ExitCode {
    let matches = Cli::command().get_matches();
    let cli = Cli::from_arg_matches(&matches).unwrap_or_else(|error| error.exit());
    let given = |name: &str| {
        let own = matches.subcommand().map(|(_, own)| own);
        own.and_then(|own| own.value_source(name)) == Some(ValueSource::CommandLine)
    };
    match command(cli.command, &given) {
        Ok(code) => code,
        Err(error) => {
            // One line: what was wrong, and where.
            eprintln!("{error:#}");
            ExitCode::from(2)
        }
    }
}

fn command(command: Command, given: &dyn Fn(&str) -> bool) -> Result<ExitCode> {
    match command {
        Command::Run { scenario, options } => run(&scenario, &options, given),
        Command::Bench { scenarios, options } => {
            benchmark::run(&scenarios, &options)?;
            Ok(ExitCode::SUCCESS)
        }
        Command::Talk(options) => run_talk(&options),
        Command::Points { input, output, machine } => {
            points::run(&input, &output, &Machine::load(&machine)?)?;
            Ok(ExitCode::SUCCESS)
        }
        Command::NineSwitch { input, output } => {
            nine_switch::run(&input, &output)?;
            Ok(ExitCode::SUCCESS)
        }
        Command::Campaign(options) => campaign::command::run(&options),
        Command::Pattern(options) => {
            let machine = Machine::load(&options.machine)?;
            let wanted = pattern::Wanted {
                mode: options.mode.into(),
                voltage_v: options.u,
                udc_v: options.udc,
                f1_hz: options.f1,
                cycles: options.cycles,
                dead_time_us: options.dead_time_us,
                min_pulse_us: options.min_pulse_us,
                max_switching_hz: machine.tables.ratings.max_switching_hz,
            };
            pattern::write(&wanted, &options.out)?;
            Ok(ExitCode::SUCCESS)
        }
    }
}

fn run(name: &str, options: &RunOptions, given: &dyn Fn(&str) -> bool) -> Result<ExitCode> {
    if let Some(scenario) = zs9::scenario::find(name) {
        check_own(name, &[scenario.own_options(), &OF_THE_ZS9].concat(), given)?;
        return run_zs9(scenario.as_ref(), options);
    }
    let scenario = scenario::find(name)?;
    check_own(name, scenario.own_options(), given)?;
    // The summary shows what was used, not that nothing was said.
    let options = &RunOptions {
        machine: Some(options.machine().to_owned()),
        ..scenario::with_step(scenario.as_ref(), options)
    };
    let machine = Machine::load(options.machine())?;
    let out = out(name, options)?;
    let began = Instant::now();
    let recording = scenario::drive(scenario.as_ref(), options, &machine)?;
    let wall_s = began.elapsed().as_secs_f64();
    let figures = scenario.figures(&recording, options, &machine);
    recording.write_trace(&out.join("trace.csv"))?;
    recording.write_edges(&out.join("edges.csv"))?;
    recording.write_recorder(&out.join("recorder.csv"))?;
    if !recording.slots.is_empty() {
        recording.write_slots(&out.join("operator.csv"))?;
    }
    let summary = summary(scenario.as_ref(), options, &figures, &machine);
    files::write_text(&out.join("summary.json"), &(serde_json::to_string_pretty(&summary)? + "\n"))?;
    files::write_text(&out.join("overview.svg"), &report::overview(&recording)?)?;
    files::write_text(
        &out.join("report.html"),
        &page(scenario.as_ref(), options, &recording, &machine, &figures)?,
    )?;
    if options.json {
        say!("{}", serde_json::to_string(&summary)?);
    } else {
        print(&figures);
        let ratio = recording.rows.last().map_or(0.0, |row| row.t_s) / wall_s;
        say!("simulated {ratio:.1} times as fast as real time ({})", options.on.name());
        say!("report: {}", out.join("report.html").display());
    }
    if let Some(trip) = recording.trip() {
        eprintln!("fault {}: {} (limit {})", trip.fault.name(), trip.value, trip.limit);
    }
    // The bounds are those of the machine that is built in.
    let judged = machine.tables.name == BUILT_IN.name;
    let kept = recording.trip().is_none() && !(judged && figures.fall_short());
    Ok(if kept { ExitCode::SUCCESS } else { ExitCode::from(1) })
}

/// The folder for the files, made.
fn out(name: &str, options: &RunOptions) -> Result<PathBuf> {
    let out = options.out.clone().unwrap_or_else(|| Path::new("target/tractive").join(name));
    std::fs::create_dir_all(&out).with_context(|| format!("--out {}", out.display()))?;
    Ok(out)
}

/// The commands of a script, for the help.
fn talk_help() -> String {
    let commands: Vec<_> = talk::script::COMMANDS.iter().map(|usage| format!("  {usage}")).collect();
    let zs9: Vec<_> = talk::script::ZS9_COMMANDS.iter().map(|usage| format!("  {usage}")).collect();
    let [commands, zs9] = [commands, zs9].map(|lines| lines.join("\n"));
    format!("A line is [SECONDS] COMMAND; # begins a comment:\n{commands}\nWith --system zs9:\n{zs9}")
}

fn run_talk(options: &talk::TalkOptions) -> Result<ExitCode> {
    let outcome = talk::run(options)?;
    let out = out("talk", &options.run)?;
    talk::write(options, &outcome, &out)?;
    if options.run.json {
        say!("{}", serde_json::to_string(outcome.figures.values())?);
    } else {
        print(&outcome.figures);
        say!("report: {}", out.join("report.html").display());
    }
    for failure in &outcome.talk.failures {
        eprintln!("{failure}");
    }
    Ok(if outcome.talk.failures.is_empty() { ExitCode::SUCCESS } else { ExitCode::from(1) })
}

fn run_zs9(scenario: &dyn zs9::scenario::Scenario, options: &RunOptions) -> Result<ExitCode> {
    let out = out(scenario.name(), options)?;
    let began = Instant::now();
    let outcome = zs9::command::drive(scenario, options)?;
    let wall_s = began.elapsed().as_secs_f64();
    zs9::command::write(scenario, options, &outcome, &out)?;
    if options.json {
        say!("{}", serde_json::to_string(&outcome.summary)?);
    } else {
        print(&outcome.figures);
        let ratio = outcome.recording.rows.last().map_or(0.0, |row| row.t_s) / wall_s;
        say!("simulated {ratio:.1} times as fast as real time ({})", options.on.name());
        say!("report: {}", out.join("report.html").display());
    }
    if let Some(trip) = outcome.recording.trip() {
        eprintln!("fault {}: {} (limit {})", trip.fault.name(), trip.value, trip.limit);
        return Ok(ExitCode::from(1));
    }
    Ok(ExitCode::SUCCESS)
}

fn summary(
    scenario: &dyn Scenario,
    options: &RunOptions,
    figures: &Figures,
    machine: &Machine,
) -> serde_json::Value {
    serde_json::json!({
        "scenario": scenario.name(),
        "version": env!("CARGO_PKG_VERSION"),
        "machine": machine.tables.name,
        "on": options.on.name(),
        "options": options,
        "figures": figures.values(),
    })
}

fn page(
    scenario: &dyn Scenario,
    options: &RunOptions,
    recording: &Recording,
    machine: &Machine,
    measured: &Figures,
) -> Result<String> {
    let mut page = Page::new(scenario.name(), scenario.figure());
    page.recorder(recording);
    scenario.plots(recording, &mut page);
    for (title, window) in scenario.spectra(recording) {
        spectrum::draw(&mut page, &title, recording, window, options, machine);
    }
    if scenario.name() == "characteristic" {
        figures::draw(&mut page, recording, machine);
    }
    page.finish(&format!("tractive {}, run on {}", env!("CARGO_PKG_VERSION"), options.on.name()), measured)
}

fn print(figures: &Figures) {
    for (name, value) in figures.values() {
        match value {
            serde_json::Value::Array(rows) => {
                say!("{name}:");
                for row in rows.iter().filter_map(serde_json::Value::as_object) {
                    let cells: Vec<_> =
                        row.iter().map(|(key, value)| format!("{key} {}", report::cell(value))).collect();
                    say!("  {}", cells.join("  "));
                }
            }
            other => say!("{name} {}", report::cell(other)),
        }
    }
}
