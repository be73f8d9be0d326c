//! Scenarios that are driven for their trace and their figures, without pages, for places without files.

use super::traction::{self, Traction};
use super::zs9::{self, Zs9};
use super::{Scenario, System, filled};
use crate::analysis::Figures;
use crate::machine::Machine;
use crate::options::Options;
use anyhow::Result;
use clap::{ArgMatches, Args, Command, FromArgMatches};
use serde::Serialize;
use serde_json::Map;

/// A scenario by name, and the function that drives it as its command line does.
pub struct Planned<S: System> {
    /// The name on the command line.
    pub name: &'static str,
    drive: Drive<S>,
}

/// The run of a scenario by its name, with the words behind it.
type Drive<S> = fn(
    &'static str,
    &[String],
    &dyn Fn(&str) -> Result<Machine>,
) -> Result<(<S as System>::Recording, Figures)>;

impl<S: System> Planned<S> {
    const fn of<T: Scenario<S> + Args + Serialize>(name: &'static str) -> Self {
        Self { name, drive: driven::<S, T> }
    }

    /// Drives it with the words of its command line on one of these machines; returns its recording and its figures.
    pub fn drive(
        &self,
        words: &[String],
        machines: &dyn Fn(&str) -> Result<Machine>,
    ) -> Result<(S::Recording, Figures)> {
        (self.drive)(self.name, words, machines)
    }
}

fn driven<S: System, T: Scenario<S> + Args + Serialize>(
    name: &'static str,
    words: &[String],
    machines: &dyn Fn(&str) -> Result<Machine>,
) -> Result<(S::Recording, Figures)> {
    let (matches, options) = read::<S::Own>(T::augment_args(Command::new(name).no_binary_name(true)), words)?;
    let scenario = T::from_arg_matches(&matches)?;
    let own = serde_json::to_value(&scenario)?;
    let machine = machines(options.machine.as_deref().unwrap_or(S::MACHINE))?;
    S::check(&options, own.as_object().unwrap_or(&Map::new()), &machine)?;
    let options = filled(&scenario, &options, &machine);
    let recording = S::run(name, scenario.plan(&options, &machine), &options, &machine, None)?;
    let figures = scenario.figures(&recording, &options, &machine);
    Ok((recording, figures))
}

/// Reads a command line with the options that all scenarios of a system share: one function for all of them keeps the page small.
#[inline(never)]
fn read<O: Args + Clone>(command: Command, words: &[String]) -> Result<(ArgMatches, Options<O>)> {
    let matches = Options::<O>::augment_args(command).try_get_matches_from(words)?;
    let options = Options::from_arg_matches(&matches)?;
    Ok((matches, options))
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
