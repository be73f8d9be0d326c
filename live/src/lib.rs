//! The live bench: the drives' own code on their plants, in a browser.
//!
//! [`Bench`] is the object that the page's worker holds; it speaks in numbers, names and JSON. All simulation is the rig's
//! ([`tractive_rig::scenario::traction::Live`], [`tractive_rig::scenario::zs9::Live`]); none is done here.
#![forbid(unsafe_code)]

mod driven;
mod machine;
mod scenario;
mod told;
mod traction;
mod zs9;

use anyhow::{Result, bail};
use clap::{Args, FromArgMatches};
use driven::{Driven, Taken};
use serde_json::Value;
use tractive_rig::machine::Machine;
use tractive_rig::options::Options;
use tractive_rig::scenario::live::{Start, Wanted};
use wasm_bindgen::prelude::*;

/// A drive on its bench.
#[wasm_bindgen]
pub struct Bench {
    machine: Machine,
    drive: Box<dyn Driven>,
    step_s: f64,
    taken: Taken,
}

#[wasm_bindgen]
impl Bench {
    /// A system with a machine, switched on at a speed in r/min, with words as on the rig's command line and rows of a step in s.
    #[wasm_bindgen(constructor)]
    pub fn new(
        system: &str,
        machine: &str,
        words: Vec<String>,
        speed_rpm: f64,
        step_s: f64,
    ) -> Result<Bench, JsError> {
        let start = Start { speed_rpm, step_s };
        bench(system, machine, &words, start).map_err(told)
    }

    /// The machine's limits and curves, and the faults that can be injected, as JSON.
    pub fn properties(&self) -> String {
        let mut properties = tractive_rig::curves::properties(&self.machine);
        properties["faults"] = self.drive.faults().into();
        properties["step"] = self.step_s.into();
        properties.to_string()
    }

    /// The names of a row's columns.
    pub fn columns(&self) -> Vec<String> {
        self.drive.columns()
    }

    /// Lets so much time pass, in s; returns the time since it was switched on, in s.
    pub fn run(&mut self, seconds: f64) -> Result<f64, JsError> {
        self.drive.run(seconds).map_err(told)?;
        Ok(self.drive.time_s())
    }

    /// Takes the rows and edges since the last time; time of the first row, in s, NaN where there is none.
    pub fn take(&mut self) -> f64 {
        self.taken = Taken::default();
        self.drive.take(&mut self.taken);
        self.taken.from_s.unwrap_or(f64::NAN)
    }

    /// The rows that were taken, one behind the other.
    pub fn rows(&mut self) -> Vec<f32> {
        std::mem::take(&mut self.taken.rows)
    }

    /// The gates' edges that were taken: time in s; gate, and 16 more where it goes on.
    pub fn edges(&mut self) -> Vec<f64> {
        std::mem::take(&mut self.taken.edges)
    }

    /// The operator's and the drive's status, as JSON.
    pub fn state(&self) -> String {
        self.drive.state().to_string()
    }

    /// The link charged and the drive enabled (`on`), the gates off meanwhile (`coast`), the link emptied (`discharge`).
    pub fn want(&mut self, on: bool, coast: bool, discharge: bool) {
        self.drive.want(Wanted { on, coast, discharge });
    }

    /// Sets something of motor 0 or 1, by its name.
    pub fn set(&mut self, name: &str, motor: usize, values: Vec<f64>) -> Result<(), JsError> {
        self.drive.set(name, motor, &values).map_err(told)
    }

    /// The fault is acknowledged.
    pub fn acknowledge(&mut self) {
        self.drive.acknowledge();
    }

    /// Something goes wrong, by its name in the fault campaign.
    pub fn inject(&mut self, name: &str) -> Result<(), JsError> {
        self.drive.inject(name).map_err(told)
    }

    /// Mends all that was injected.
    pub fn mend(&mut self) {
        self.drive.mend();
    }

    /// The bound that the pulses set to the current of motor 0 or 1. If they repeat, lines of its spectrum: a frequency in Hz, a current in A, and so
    /// on; else, for the ZS9, the current in A, row by row.
    pub fn bound(&self, motor: usize) -> Vec<f64> {
        self.drive.bound(motor)
    }
}

fn bench(system: &str, machine: &str, words: &[String], start: Start) -> Result<Bench> {
    let machine = machine::named(machine)?;
    let drive: Box<dyn Driven> = match system {
        "pmasynrm" => Box::new(traction::Traction::new(options(words)?, machine.clone(), start)?),
        "zs9" => Box::new(zs9::Zs9::new(&options(words)?, &machine, start)?),
        _ => bail!("there is no system `{system}`"),
    };
    Ok(Bench { machine, drive, step_s: start.step_s, taken: Taken::default() })
}

/// Names of the scenarios of a system that run in the page.
#[wasm_bindgen]
pub fn scenarios(system: &str) -> Vec<String> {
    scenario::names(system).into_iter().map(str::to_owned).collect()
}

/// A scenario that has run on its ordinary bench.
#[wasm_bindgen]
pub struct Ran {
    taken: Taken,
    about: Value,
}

#[wasm_bindgen]
impl Ran {
    /// Runs it, with words as on the rig's command line.
    #[wasm_bindgen(constructor)]
    pub fn new(name: &str, words: Vec<String>) -> Result<Ran, JsError> {
        let scenario::Ran { taken, about } = scenario::run(name, &words).map_err(told)?;
        Ok(Ran { taken, about })
    }

    /// SHA-256 and length of its trace.csv, columns and step of its rows, and its verdicts, as JSON.
    pub fn about(&self) -> String {
        self.about.to_string()
    }

    /// Its rows.
    pub fn rows(&mut self) -> Vec<f32> {
        std::mem::take(&mut self.taken.rows)
    }

    /// Its edges.
    pub fn edges(&mut self) -> Vec<f64> {
        std::mem::take(&mut self.taken.edges)
    }
}

/// Options as on the rig's command line.
fn options<O: Args>(words: &[String]) -> Result<Options<O>> {
    let command = Options::<O>::augment_args(clap::Command::new("live").no_binary_name(true));
    Ok(Options::from_arg_matches(&command.try_get_matches_from(words)?)?)
}

/// An error in the page's words.
fn told(error: anyhow::Error) -> JsError {
    JsError::new(&format!("{error:#}"))
}
