//! `cargo rig bench`: the speed of the simulation of scenarios on one thread, and where the time goes.

use crate::options::{Options, RunOptions};
use crate::plant::stopwatch::{self, processor_s};
use crate::report;
use crate::scenario::catalogue::{self, Chosen};
use crate::scenario::traction::TractionOptions;
use crate::scenario::zs9::Zs9Options;
use crate::scenario::{Choice, System};
use crate::talk::usual;
use crate::trace::Recorded;
use anyhow::Result;
use clap::{Args, Command, FromArgMatches};
use std::ffi::OsString;
use std::time::Instant;

/// The options of the measurement.
#[derive(Clone, Debug)]
pub struct BenchOptions {
    scenarios: Vec<String>,
    run: RunOptions,
    traction: TractionOptions,
    zs9: Zs9Options,
}

/// The options that every measurement has.
#[derive(Clone, Debug, Args)]
struct Common {
    /// All scenarios unless some are named. If all are of one system, its own options may be given, too.
    scenarios: Vec<String>,
    /// The options that all runs share.
    #[command(flatten)]
    run: RunOptions,
}

/// The systems of the scenarios named in the words: the PMaSynRM drive, the ZS9.
fn systems(words: &[OsString]) -> [bool; 2] {
    let names = words.iter().filter_map(|word| word.to_str());
    let named = names.filter(|word| catalogue::names().any(|(name, _)| name == *word));
    named.fold([false; 2], |[traction, zs9], name| {
        let is_zs9 = name.starts_with("zs9-");
        [traction || !is_zs9, zs9 || is_zs9]
    })
}

impl BenchOptions {
    /// The command line for scenarios of these systems: for a single one with its own options.
    pub fn command(systems: [bool; 2]) -> Command {
        let command = Common::augment_args(Command::new("bench"));
        let command = match systems {
            [true, false] => TractionOptions::augment_args(command),
            [false, true] => Zs9Options::augment_args(command),
            _ => command,
        };
        command.about("Simulated seconds per second of each scenario, on one thread of this machine, and where the time goes")
    }

    /// Reads the words after `bench`.
    pub fn read(words: &[OsString]) -> Result<Self> {
        let systems = systems(words);
        let words = std::iter::once(OsString::from("bench")).chain(words.iter().cloned());
        let matches = Self::command(systems).try_get_matches_from(words)?;
        let Common { scenarios, run } = Common::from_arg_matches(&matches)?;
        let [traction, zs9] = [systems == [true, false], systems == [false, true]];
        Ok(Self {
            scenarios,
            run,
            traction: if traction { TractionOptions::from_arg_matches(&matches)? } else { usual()? },
            zs9: if zs9 { Zs9Options::from_arg_matches(&matches)? } else { usual()? },
        })
    }
}

/// The time that a scenario took.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Measured {
    /// The scenario.
    pub scenario: String,
    /// Recorded time, in s.
    pub simulated_s: f64,
    /// Time from the first tick to the last, in s; neither tables nor files are included.
    pub wall_s: f64,
    /// The processor time of the thread in that time, in s: less than that if other programs use the processor too.
    pub processor_s: f64,
    /// Simulated seconds in a second of the processor.
    pub ratio: f64,
    /// Steps of the plant's integration.
    pub plant_steps: u64,
    /// Share of the time that they took, in percent; the rest is the firmware's tasks, the gates, sensors and the trace.
    pub plant_percent: f64,
}

/// Drives a scenario on the host, on this thread, with the options' machine and flaws.
pub fn measure(name: &str, options: &BenchOptions) -> Result<Measured> {
    let run = options.run.clone();
    match catalogue::choose([name])? {
        Chosen::Traction(choice) => {
            measured(&Choice { options: Options { run, own: options.traction.clone() }, ..*choice })
        }
        Chosen::Zs9(choice) => {
            measured(&Choice { options: Options { run, own: options.zs9.clone() }, ..*choice })
        }
    }
}

fn measured<S: System>(choice: &Choice<S>) -> Result<Measured> {
    let machine = choice.machine()?;
    stopwatch::begin();
    let (began, began_s) = (Instant::now(), processor_s());
    let simulated_s = choice.drive(&machine)?.end_s();
    let (wall_s, processor_s) = (began.elapsed().as_secs_f64(), processor_s() - began_s);
    let (plant_steps, in_plant_s) = stopwatch::taken();
    Ok(Measured {
        scenario: choice.name.to_owned(),
        simulated_s,
        wall_s,
        processor_s,
        ratio: simulated_s / processor_s,
        plant_steps,
        plant_percent: 100.0 * in_plant_s / processor_s,
    })
}

/// The command: measures and prints.
pub fn run(options: &BenchOptions) -> Result<()> {
    let mut scenarios = options.scenarios.clone();
    if scenarios.is_empty() {
        scenarios.extend(catalogue::listed().map(|(name, _)| name.to_owned()));
    }
    let measured = scenarios.iter().map(|name| measure(name, options)).collect::<Result<Vec<_>>>()?;
    if options.run.json {
        crate::say!("{}", serde_json::to_string(&measured)?);
    } else {
        let rows = measured.iter().map(serde_json::to_value).collect::<Result<Vec<_>, _>>()?;
        crate::say!("{}", report::list("bench", &rows));
    }
    Ok(())
}
