//! `cargo rig bench`: how fast scenarios are simulated on one thread, and where the time goes.

use crate::options::{Options, RunOptions};
use crate::plant::stopwatch::{self, processor_s};
use crate::report;
use crate::scenario::catalogue::{self, Chosen};
use crate::scenario::traction::TractionOptions;
use crate::scenario::zs9::Zs9Options;
use crate::scenario::{Choice, System};
use crate::trace::Recorded;
use anyhow::Result;
use std::time::Instant;

/// The options of the measurement.
#[derive(Clone, Debug, clap::Args)]
pub struct BenchOptions {
    /// All scenarios unless some are named.
    pub scenarios: Vec<String>,
    /// The options that all runs share.
    #[command(flatten)]
    pub run: RunOptions,
    /// The options that the PMaSynRM drive's scenarios share.
    #[command(flatten)]
    pub traction: TractionOptions,
    /// The options that the ZS9's share.
    #[command(flatten)]
    pub zs9: Zs9Options,
}

/// The time that a scenario took.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Measured {
    /// The scenario.
    pub scenario: String,
    /// Recorded time, in s.
    pub simulated_s: f64,
    /// From the first tick to the last, in s; neither tables nor files are in it.
    pub wall_s: f64,
    /// The processor time of the thread in that time, in s: less than that where other programs want it too.
    pub processor_s: f64,
    /// Simulated seconds in a second of the processor.
    pub ratio: f64,
    /// Steps of the plant's integration.
    pub plant_steps: u64,
    /// Share of the time that they took, in percent; the rest are the firmware's tasks, the gates, sensors and the trace.
    pub plant_percent: f64,
}

/// Drives a scenario on the host, on this thread, with the options' machine and flaws.
pub fn measure(name: &str, options: &BenchOptions) -> Result<Measured> {
    let run = options.run.clone();
    match catalogue::choose([name])? {
        Chosen::Traction(choice) => {
            measured(&Choice { options: Options { run, own: options.traction.clone() }, ..choice })
        }
        Chosen::Zs9(choice) => {
            measured(&Choice { options: Options { run, own: options.zs9.clone() }, ..choice })
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
