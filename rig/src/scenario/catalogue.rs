//! Every scenario by name, and the command line of each.
//!
//! A command line is read twice: first by a parser that knows the options of all scenarios, only to find the scenario's name
//! among their values; then by the scenario's own parser, which knows nothing else.

use super::traction::{
    Traction, acknowledge::Acknowledge, borders_timing::BordersTiming, characteristic::Characteristic,
    chopper::Chopper, full_step::FullStep, gaps::Gaps, line_limits::LineLimits, link_steps::LinkSteps,
    load_steps::LoadSteps, mode_borders::ModeBorders, precharge::Precharge, restart::Restart,
    reversal::Reversal, start::Start, steady::Steady, sweep::Sweep, timing::Timing, wheel::Wheel,
};
use super::zs9::{self, Zs9, cycle::Cycle, load_step::LoadStep, reverse::Reverse};
use super::{Choice, Scenario, System};
use crate::options::{Options, RunOptions};
use anyhow::{Result, anyhow, bail};
use clap::error::{ContextKind, ErrorKind};
use clap::{Arg, ArgAction, ArgMatches, Args, Command, FromArgMatches};
use serde::Serialize;
use serde_json::{Map, Value};
use std::ffi::OsString;

/// The scenario that runs if none is named.
pub const DEFAULT: &str = "sweep";

/// A scenario of either system that was chosen.
pub enum Chosen {
    /// Of the PMaSynRM drive.
    Traction(Box<Choice<Traction>>),
    /// Of the ZS9.
    Zs9(Box<Choice<Zs9>>),
}

/// A scenario's own part of the command line, read.
type Own<S> = (Box<dyn Scenario<S>>, Map<String, Value>);

/// A scenario: its name, the paper's figure that it answers or a note that there is none, and its options.
pub struct Entry<S: System> {
    name: &'static str,
    figure: &'static str,
    arguments: fn(Command) -> Command,
    read: fn(&ArgMatches) -> Result<Own<S>, clap::Error>,
}

impl<S: System> Entry<S> {
    const fn of<T: Scenario<S> + Args + Serialize + 'static>(
        name: &'static str,
        figure: &'static str,
    ) -> Self {
        let read = |matches: &ArgMatches| -> Result<Own<S>, clap::Error> {
            let scenario = T::from_arg_matches(matches)?;
            let own = match serde_json::to_value(&scenario) {
                Ok(Value::Object(own)) => own,
                _ => Map::new(),
            };
            Ok((Box::new(scenario), own))
        };
        Self { name, figure, arguments: T::augment_args, read }
    }

    /// Its command line.
    fn command(&self) -> Command {
        let command = Command::new("run").arg(scenario_argument());
        let command = (self.arguments)(S::tailored(Options::<S::Own>::augment_args(command)));
        command.about(self.figure).long_about(None)
    }

    /// Its command line under its own name.
    fn named(&self) -> Command {
        let command = S::tailored(Options::<S::Own>::augment_args(Command::new(self.name)));
        let command = (self.arguments)(command);
        command.about(self.figure).long_about(None)
    }

    fn choose(&self, matches: &ArgMatches) -> Result<Choice<S>, clap::Error> {
        let (scenario, own) = (self.read)(matches)?;
        let options = Options::from_arg_matches(matches)?;
        Ok(Choice { name: self.name, figure: self.figure, scenario, own, options })
    }
}

/// The PMaSynRM drive's.
const TRACTION: [Entry<Traction>; 18] = [
    Entry::of::<LoadSteps>("load-steps", "figure 8: load steps at 200 r/min"),
    Entry::of::<Sweep>("sweep", "figure 9: sweep at full torque, and its changes of pulse pattern"),
    Entry::of::<Characteristic>(
        "characteristic",
        "figure 10: torque accuracy and efficiency at the characteristic points",
    ),
    Entry::of::<FullStep>("full-step", "no figure: full torque in one step, and back"),
    Entry::of::<Steady>("steady", "no figure: current, torque and spectrum of one operating point"),
    Entry::of::<ModeBorders>(
        "mode-borders",
        "no figure: changes of pulse pattern at constant speed, by torque alone",
    ),
    Entry::of::<Reversal>("reversal", "no figure: power reversed, released and applied again at speed"),
    Entry::of::<Restart>("restart", "no figure: a coasting machine caught in each mode"),
    Entry::of::<LinkSteps>("link-steps", "no figure: a DC link that steps under full torque"),
    Entry::of::<Precharge>("precharge", "no figure: from power-up to running and back to an empty link"),
    Entry::of::<Chopper>("chopper", "no figure: full braking into a link that cannot take the energy"),
    Entry::of::<Gaps>("gaps", "no figure: a line that is lost for 20 to 500 ms, motoring and braking"),
    Entry::of::<LineLimits>("line-limits", "no figure: line current and line power at their limits"),
    Entry::of::<Wheel>("wheel", "no figure: a wheel that loses its grip, motoring and braking"),
    Entry::of::<Start>("start", "no figure: a start without an angle, found at standstill"),
    Entry::of::<Acknowledge>("acknowledge", "no figure: a gate driver fails, and the fault is acknowledged"),
    Entry::of::<Timing>("timing", "no figure: every mode in half a second, for `cargo xtask timing`"),
    Entry::of::<BordersTiming>(
        "borders-timing",
        "no figure: modes that change again and again, for `cargo xtask test`",
    ),
];

/// The ZS9's.
const ZS9: [Entry<Zs9>; 5] = [
    Entry::of::<LoadStep>("zs9-load-step", "figures 14 to 19: motor 2's load steps, motor 1 goes on"),
    Entry::of::<Reverse>("zs9-reverse", "figures 20 to 23: motor 2 reverses, motor 1 goes on"),
    Entry::of::<Cycle>(
        "zs9-cycle",
        "figures 24 to 36: the whole cycle, full torque, constant power, cruise, brake",
    ),
    Entry::of::<zs9::steady::Steady>(
        "zs9-steady",
        "no figure: harmonics of both motors' currents by scheme; the sequences of figures 2 to 9",
    ),
    Entry::of::<zs9::timing::Timing>(
        "zs9-timing",
        "no figure: motoring, weakening and braking in a tenth of a second, for `cargo xtask timing`",
    ),
];

/// The names of all scenarios, and what they are.
pub fn names() -> impl Iterator<Item = (&'static str, &'static str)> {
    let traction = TRACTION.iter().map(|entry| (entry.name, entry.figure));
    traction.chain(ZS9.iter().map(|entry| (entry.name, entry.figure)))
}

/// All scenarios except those kept short on purpose for counting instructions.
pub fn listed() -> impl Iterator<Item = (&'static str, &'static str)> {
    names().filter(|(name, _)| !name.ends_with("timing"))
}

/// `run` with each scenario as a command of its own, for a shell's completions.
pub fn completed() -> Command {
    let scenarios = TRACTION.iter().map(Entry::named).chain(ZS9.iter().map(Entry::named));
    Command::new("run").about("Runs a scenario and writes its files").subcommands(scenarios)
}

fn scenario_argument() -> Arg {
    Arg::new("scenario").value_name("SCENARIO").default_value(DEFAULT).help("What to run")
}

/// The name among the words, or the default; `None` if there is no name and help is asked for.
fn name(words: &[OsString]) -> Option<String> {
    let help = Arg::new("help").long("help").short('h').action(ArgAction::SetTrue);
    let all = TRACTION.iter().map(Entry::command).chain(ZS9.iter().map(Entry::command));
    let mut any = Command::new("any").disable_help_flag(true).ignore_errors(true).arg(help);
    for command in all {
        for argument in command.get_arguments() {
            if any.get_arguments().all(|known| known.get_id() != argument.get_id()) {
                let required_not = argument.clone().required(false);
                any = any.arg(required_not);
            }
        }
    }
    let matches = any.get_matches_from(std::iter::once(&OsString::from("any")).chain(words));
    let named = matches.value_source("scenario") == Some(clap::parser::ValueSource::CommandLine);
    let is_help = matches.try_get_one::<bool>("help").ok().flatten() == Some(&true);
    if is_help && !named {
        return None;
    }
    // Words after an invalid value are not read: the scenario's own command line reports the error.
    Some(matches.get_one::<String>("scenario").map_or(DEFAULT, String::as_str).to_owned())
}

/// The help of all scenarios.
fn help() -> clap::Error {
    let list: Vec<_> = listed().map(|(name, figure)| format!("  {name:<16} {figure}")).collect();
    let list = format!("Scenarios:\n{}\n\n`run SCENARIO --help` lists the options of each.", list.join("\n"));
    let command = Command::new("run").bin_name(program()).arg(scenario_argument());
    let command = RunOptions::augment_args(command).after_help(list);
    let command = command.about("Runs a scenario and writes its files").long_about(None);
    let asked = command.try_get_matches_from(["run", "--help"]);
    asked.expect_err("help is no match")
}

/// Name of this program in its usage; a program that calls it for others sets it.
fn program() -> String {
    std::env::var("TRACTIVE_PROGRAM").unwrap_or("cargo rig".to_owned()) + " run"
}

/// Reads the words after `run`. The error is clap's own if it says more than a line or is help that was asked for.
pub fn choose<W: Into<OsString>>(words: impl IntoIterator<Item = W>) -> Result<Chosen> {
    let words: Vec<_> = words.into_iter().map(Into::into).collect();
    let Some(name) = name(&words) else { return Err(help().into()) };
    if let Some(entry) = TRACTION.iter().find(|entry| entry.name == name) {
        return Ok(Chosen::Traction(Box::new(entry.choose(&matches(entry.command(), &name, &words)?)?)));
    }
    if let Some(entry) = ZS9.iter().find(|entry| entry.name == name) {
        return Ok(Chosen::Zs9(Box::new(entry.choose(&matches(entry.command(), &name, &words)?)?)));
    }
    let names: Vec<_> = listed().map(|(name, _)| name).collect();
    bail!("scenario {name}: must be one of {}", names.join(", "))
}

fn matches(command: Command, name: &str, words: &[OsString]) -> Result<ArgMatches> {
    let words = std::iter::once(OsString::from("run")).chain(words.iter().cloned());
    command.bin_name(program()).try_get_matches_from(words).map_err(|error| {
        match (error.kind(), error.get(ContextKind::InvalidArg)) {
            (ErrorKind::UnknownArgument, Some(argument)) => {
                anyhow!("{argument}: scenario {name} does not have this option")
            }
            _ => error.into(),
        }
    })
}

/// A scenario of the PMaSynRM drive, by the words behind `run`. One of the other system is an error.
pub fn of_traction(line: &str) -> Result<Choice<Traction>> {
    match choose(line.split_whitespace())? {
        Chosen::Traction(choice) => Ok(*choice),
        Chosen::Zs9(choice) => bail!("{} is a scenario of the ZS9", choice.name),
    }
}

/// A scenario of the ZS9, by the words behind `run`. One of the other system is an error.
pub fn of_zs9(line: &str) -> Result<Choice<Zs9>> {
    match choose(line.split_whitespace())? {
        Chosen::Zs9(choice) => Ok(*choice),
        Chosen::Traction(choice) => bail!("{} is a scenario of the PMaSynRM drive", choice.name),
    }
}
