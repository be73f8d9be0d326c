//! Scenarios that are driven for their trace alone, without figures or pages, where there are no files.

use super::traction::{self, Traction};
use super::zs9::{self, Zs9};
use super::{Scenario, System, filled};
use crate::machine::Machine;
use crate::options::Options;
use anyhow::Result;
use clap::{Args, Command};

/// A scenario by name, and what drives it as its command line without options of its own does.
pub struct Planned<S: System> {
    /// The name on the command line.
    pub name: &'static str,
    drive: Drive<S>,
}

/// The run of a scenario by its name.
type Drive<S> = fn(&'static str, &Options<<S as System>::Own>, &Machine) -> Result<<S as System>::Recording>;

impl<S: System> Planned<S> {
    const fn of<T: Scenario<S> + Args>(name: &'static str) -> Self {
        Self { name, drive: driven::<S, T> }
    }

    /// Drives it.
    pub fn drive(&self, options: &Options<S::Own>, machine: &Machine) -> Result<S::Recording> {
        (self.drive)(self.name, options, machine)
    }
}

fn driven<S: System, T: Scenario<S> + Args>(
    name: &'static str,
    options: &Options<S::Own>,
    machine: &Machine,
) -> Result<S::Recording> {
    let command = T::augment_args(Command::new(name).no_binary_name(true));
    let scenario = T::from_arg_matches(&command.try_get_matches_from([""; 0])?)?;
    let options = filled(&scenario, options, machine);
    S::check(&options, &serde_json::Map::new(), machine)?;
    S::run(name, scenario.plan(&options, machine), &options, machine, None)
}

/// Those of the PMaSynRM drive.
pub const TRACTION: [Planned<Traction>; 9] = [
    Planned::of::<traction::Sweep>("sweep"),
    Planned::of::<traction::load_steps::LoadSteps>("load-steps"),
    Planned::of::<traction::full_step::FullStep>("full-step"),
    Planned::of::<traction::reversal::Reversal>("reversal"),
    Planned::of::<traction::restart::Restart>("restart"),
    Planned::of::<traction::link_steps::LinkSteps>("link-steps"),
    Planned::of::<traction::chopper::Chopper>("chopper"),
    Planned::of::<traction::precharge::Precharge>("precharge"),
    Planned::of::<traction::acknowledge::Acknowledge>("acknowledge"),
];

/// Those of the ZS9.
pub const ZS9: [Planned<Zs9>; 3] = [
    Planned::of::<zs9::load_step::LoadStep>("zs9-load-step"),
    Planned::of::<zs9::reverse::Reverse>("zs9-reverse"),
    Planned::of::<zs9::cycle::Cycle>("zs9-cycle"),
];
