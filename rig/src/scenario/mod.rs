//! Scenarios, the frame of both systems: a plan to drive and figures to report. The scenarios of each system are in the modules below.

pub mod catalogue;
pub mod command;
pub mod live;
pub mod planned;
pub mod traction;
pub mod zs9;

use crate::analysis::Figures;
use crate::machine::Machine;
use crate::options::{Options, RunOptions};
use crate::report::{NO_FIGURE, Page};
use crate::run::Supervisor;
use crate::trace::Recorded;
use anyhow::Result;
use clap::{Args, Command};
use serde::Serialize;
use serde_json::{Map, Value};
use tractive::protection::{Fault, Trip};

/// A drive with its plant: what differs between the two.
pub trait System: Sized + 'static {
    /// Its name in reports.
    const NAME: &'static str;
    /// The machine folder that it has by default: the paper's.
    const MACHINE: &'static str;
    /// Options that its scenarios share, besides [`RunOptions`].
    type Own: Args + Serialize + Clone;
    /// A scenario's inputs.
    type Plan;
    /// The recording that a run leaves.
    type Recording: Recorded;

    /// Step of the trace unless options or scenario set another, in s.
    fn trace_step_s(own: &Self::Own) -> f64;
    /// Voltage of the DC source unless the options set another, in V.
    fn source_v(machine: &Machine) -> f64 {
        machine.folder.parameters.dc_link_nominal_v
    }
    /// Shortest pulse unless the options set another, in µs; `None` if the modulator has none.
    fn min_pulse_us(_machine: &Machine) -> Option<f64> {
        None
    }
    /// A scenario's command line for this system: without those options of all runs that do not apply to it.
    fn tailored(command: Command) -> Command {
        command
    }
    /// The options after each one that stands for others has been expanded.
    fn filled(options: &Options<Self::Own>, _machine: &Machine) -> Options<Self::Own> {
        options.clone()
    }
    /// Checks that options are within their ranges; `scenario` holds those of the scenario itself, by name.
    fn check(options: &Options<Self::Own>, scenario: &Map<String, Value>, machine: &Machine) -> Result<()>;
    /// Drives a plan, on the host or in QEMU; with a supervisor over the protocol until it ends the run.
    fn run(
        name: &str,
        plan: Self::Plan,
        options: &Options<Self::Own>,
        machine: &Machine,
        supervisor: Option<&mut dyn Supervisor>,
    ) -> Result<Self::Recording>;
    /// Figures of a scenario that has none of its own.
    fn figures(recording: &Self::Recording) -> Figures;
    /// Draws what every scenario shows, after its own plots: the flight recorder's records of a fault and a line behind a filter, if there are
    /// any; marks what happened.
    fn draw_common(recording: &Self::Recording, page: &mut Page);
    /// One picture of the whole run, if the system has one.
    fn overview(_recording: &Self::Recording) -> Result<Option<String>> {
        Ok(None)
    }
}

/// A scenario; its fields are its own options.
pub trait Scenario<S: System> {
    /// The plan that is driven.
    fn plan(&self, options: &Options<S::Own>, machine: &Machine) -> S::Plan;
    /// The figures to report.
    fn figures(&self, recording: &S::Recording, _: &Options<S::Own>, _machine: &Machine) -> Figures {
        S::figures(recording)
    }
    /// Step of the trace unless the options set another, in s.
    fn trace_step_s(&self, own: &S::Own) -> f64 {
        S::trace_step_s(own)
    }
    /// The fault that the scenario is about, if any: a run falls short without it, not with it.
    fn fault(&self) -> Option<Fault> {
        None
    }
    /// The plots to draw.
    fn plots(&self, recording: &S::Recording, options: &Options<S::Own>, machine: &Machine, page: &mut Page);
}

/// A scenario that was chosen, with its options.
pub struct Choice<S: System> {
    /// The name on the command line.
    pub name: &'static str,
    /// The paper's figure that it answers, and what it is.
    pub figure: &'static str,
    /// The plan that is driven.
    pub scenario: Box<dyn Scenario<S>>,
    /// The scenario's own options by name, as they were given.
    pub own: Map<String, Value>,
    /// All others.
    pub options: Options<S::Own>,
}

impl<S: System> Choice<S> {
    /// The machine's name, or its folder.
    pub fn machine_name(&self) -> &str {
        self.options.machine.as_deref().unwrap_or(S::MACHINE)
    }

    /// The machine.
    pub fn machine(&self) -> Result<Machine> {
        Machine::load(self.machine_name())
    }

    /// Drives it.
    pub fn drive(&self, machine: &Machine) -> Result<S::Recording> {
        S::check(&self.options, &self.own, machine)?;
        drive(self.name, self.scenario.as_ref(), &self.options, machine)
    }

    /// The figures to report.
    pub fn figures(&self, recording: &S::Recording, machine: &Machine) -> Figures {
        let mut figures = self.scenario.figures(recording, &self.filled(machine), machine);
        if machine.tables.ratings.least_id_a().is_some() {
            figures.set("lowest_id_a", recording.lowest_id_a());
        }
        figures
    }

    /// The first fault of a run, except the one that the scenario is about.
    pub fn trip(&self, recording: &S::Recording) -> Option<Trip> {
        recording.trip().filter(|trip| self.scenario.fault() != Some(trip.fault))
    }

    /// The options, with the scenario's step of the trace, the source's voltage and the shortest pulse filled in if none was given.
    pub fn filled(&self, machine: &Machine) -> Options<S::Own> {
        filled(self.scenario.as_ref(), &self.options, machine)
    }

    /// The paper's figure that a run of this machine answers, and what it is; a run of another machine answers none.
    pub fn title(&self, machine: &Machine) -> String {
        if machine.is(S::MACHINE) {
            return self.figure.to_owned();
        }
        let what = self.figure.split_once(": ").map_or(self.figure, |(_, what)| what);
        // The paper's speed; every machine has its own.
        let what = what.strip_suffix(" at 200 r/min").unwrap_or(what);
        format!("{NO_FIGURE}: {what}")
    }
}

fn filled<S: System, T: Scenario<S> + ?Sized>(
    scenario: &T,
    options: &Options<S::Own>,
    machine: &Machine,
) -> Options<S::Own> {
    let dt = Some(options.dt.unwrap_or_else(|| scenario.trace_step_s(&options.own)));
    let min_pulse_us = options.min_pulse_us.or_else(|| S::min_pulse_us(machine));
    let udc = Some(options.udc.unwrap_or_else(|| S::source_v(machine)));
    let Options { run, own } = S::filled(options, machine);
    Options { run: RunOptions { dt, min_pulse_us, udc, ..run }, own }
}

/// Drives a scenario with options that are within their ranges.
pub fn drive<S: System>(
    name: &str,
    scenario: &dyn Scenario<S>,
    options: &Options<S::Own>,
    machine: &Machine,
) -> Result<S::Recording> {
    let options = filled(scenario, options, machine);
    S::run(name, scenario.plan(&options, machine), &options, machine, None)
}
