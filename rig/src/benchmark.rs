//! `cargo rig bench`: how fast scenarios are simulated on one thread, and where the time goes.

use crate::machine::Machine;
use crate::options::RunOptions;
use crate::plant::stopwatch::{self, processor_s};
use crate::{scenario, zs9};
use anyhow::Result;
use std::time::Instant;

/// Drives a scenario; the recorded time, in s.
type Drive = Box<dyn FnOnce(&RunOptions, &Machine) -> Result<f64>>;

/// What a scenario took.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Measured {
    /// The scenario.
    pub scenario: String,
    /// Recorded time, in s.
    pub simulated_s: f64,
    /// From the first tick to the last, in s; neither tables nor files are in it.
    pub wall_s: f64,
    /// What the thread had of a processor in that time, in s: less than that where other programs want it too.
    pub processor_s: f64,
    /// Simulated seconds in a second of the processor.
    pub ratio: f64,
    /// Steps of the plant's integration.
    pub plant_steps: u64,
    /// Share of the time that they took, in percent; the rest are the firmware's tasks, the gates, sensors and the trace.
    pub plant_percent: f64,
}

/// Every scenario but those that are short on purpose.
pub fn names() -> Vec<String> {
    let own = scenario::all();
    let dual = zs9::scenario::all();
    let names = own.iter().map(|scenario| scenario.name()).chain(dual.iter().map(|scenario| scenario.name()));
    names.filter(|name| !name.ends_with("timing")).map(str::to_owned).collect()
}

/// Drives a scenario on the host, on this thread, with the options' machine and flaws.
///
/// # Errors
/// An unknown scenario, bad input, or a drive that breaks the bench's rules.
pub fn measure(name: &str, options: &RunOptions) -> Result<Measured> {
    stopwatch::begin();
    let (drive, tables): (Drive, Machine) = match zs9::scenario::find(name) {
        Some(scenario) => {
            let machine = Machine::load(options.machine.as_deref().unwrap_or(zs9::command::MACHINE))?;
            let drive: Drive = Box::new(move |options, machine| {
                let recording = zs9::scenario::drive(scenario.as_ref(), options, machine)?;
                Ok(recording.rows.last().map_or(0.0, |row| row.t_s))
            });
            (drive, machine)
        }
        None => {
            let scenario = scenario::find(name)?;
            let drive: Drive = Box::new(move |options, machine| {
                let recording = scenario::drive(scenario.as_ref(), options, machine)?;
                Ok(recording.rows.last().map_or(0.0, |row| row.t_s))
            });
            (drive, Machine::load(options.machine())?)
        }
    };
    let (began, began_s) = (Instant::now(), processor_s());
    let simulated_s = drive(options, &tables)?;
    let (wall_s, processor_s) = (began.elapsed().as_secs_f64(), processor_s() - began_s);
    let (plant_steps, in_plant_s) = stopwatch::taken();
    Ok(Measured {
        scenario: name.to_owned(),
        simulated_s,
        wall_s,
        processor_s,
        ratio: simulated_s / processor_s,
        plant_steps,
        plant_percent: 100.0 * in_plant_s / processor_s,
    })
}

/// The command: measures and prints.
///
/// # Errors
/// As [`measure`].
pub fn run(scenarios: &[String], options: &RunOptions) -> Result<()> {
    let scenarios = if scenarios.is_empty() { names() } else { scenarios.to_vec() };
    if !options.json {
        crate::say!(
            "{:<16} {:>12} {:>8} {:>12} {:>8} {:>12} {:>8}",
            "scenario",
            "simulated s",
            "wall s",
            "processor s",
            "ratio",
            "plant steps",
            "plant %"
        );
    }
    let mut all = Vec::new();
    for name in &scenarios {
        let measured = measure(name, options)?;
        if options.json {
            all.push(measured);
        } else {
            crate::say!(
                "{:<16} {:>12.2} {:>8.3} {:>12.3} {:>8.1} {:>12} {:>8.1}",
                measured.scenario,
                measured.simulated_s,
                measured.wall_s,
                measured.processor_s,
                measured.ratio,
                measured.plant_steps,
                measured.plant_percent
            );
        }
    }
    if options.json {
        crate::say!("{}", serde_json::to_string(&all)?);
    }
    Ok(())
}
