//! The command lines of the verbs that talk to a drive: each has only its system's options.

use super::system::System;
use crate::options::RunOptions;
use crate::scenario::System as _;
use crate::scenario::traction::{Traction, TractionOptions};
use crate::scenario::zs9::{Zs9, Zs9Options};
use anyhow::{Result, anyhow};
use clap::error::{ContextKind, ErrorKind};
use clap::{Args, Command, FromArgMatches, ValueEnum};
use std::ffi::OsString;

/// The options of a drive that is talked to.
#[derive(Clone, Debug)]
pub struct DriveOptions {
    /// The system that is talked to.
    pub system: System,
    /// The machine's and its load's inertia, in kg·m², if it was named.
    inertia: Option<f64>,
    /// The options that all runs share.
    pub run: RunOptions,
    /// The options that only the PMaSynRM drive has.
    pub traction: TractionOptions,
    /// The options that only the ZS9 has.
    pub zs9: Zs9Options,
}

impl DriveOptions {
    /// The machine's name, or its folder.
    pub fn machine_name(&self) -> &str {
        let usual = match self.system {
            System::Pmasynrm => Traction::MACHINE,
            System::Zs9 => Zs9::MACHINE,
        };
        self.run.machine.as_deref().unwrap_or(usual)
    }

    /// The inertia, in kg·m².
    pub fn inertia(&self) -> f64 {
        self.inertia.unwrap_or(self.system.inertia_kg_m2())
    }
}

/// The options that every talk has, whatever its system.
#[derive(Clone, Debug, Args)]
struct Shared {
    /// The system that is talked to.
    #[arg(long, value_enum, default_value_t)]
    system: System,
    /// The machine's and its load's inertia, in kg·m²; default 10, for each of the ZS9's 0.1, for which its speed loops are made.
    #[arg(long, value_parser = crate::options::positive)]
    inertia: Option<f64>,
    /// The options that all runs share.
    #[command(flatten)]
    run: RunOptions,
}

/// The system that the words name, or the usual one; an invalid name is left to the command line itself.
fn named(words: &[OsString]) -> System {
    let value = |k: usize, word: &OsString| match word.to_str()?.strip_prefix("--system")? {
        "" => words.get(k + 1)?.to_str().map(str::to_owned),
        joined => joined.strip_prefix('=').map(str::to_owned),
    };
    let mut names = words.iter().enumerate().filter_map(|(k, word)| value(k, word));
    names.next_back().and_then(|name| System::from_str(&name, false).ok()).unwrap_or_default()
}

/// The command line of a verb for a system, with the verb's own options.
pub fn command<C: Args>(verb: &'static str, system: System) -> Command {
    let command = Shared::augment_args(C::augment_args(Command::new(verb)));
    match system {
        System::Pmasynrm => TractionOptions::augment_args(command),
        System::Zs9 => Zs9Options::augment_args(command),
    }
}

/// Reads the words behind a verb. The error is clap's own if it says more than a line, or is help that was asked for.
pub fn read<C: Args>(
    verb: &'static str,
    words: &[OsString],
    dressed: impl FnOnce(Command, System) -> Command,
) -> Result<(C, DriveOptions)> {
    let system = named(words);
    let command = dressed(command::<C>(verb, system), system);
    let words = std::iter::once(OsString::from(verb)).chain(words.iter().cloned());
    let matches = command.try_get_matches_from(words).map_err(|error| {
        match (error.kind(), error.get(ContextKind::InvalidArg)) {
            (ErrorKind::UnknownArgument, Some(argument)) => {
                anyhow!("{argument}: {verb} --system {} does not have this option", system.name())
            }
            _ => error.into(),
        }
    })?;
    let Shared { system, inertia, run } = Shared::from_arg_matches(&matches)?;
    let (traction, zs9) = match system {
        System::Pmasynrm => (TractionOptions::from_arg_matches(&matches)?, usual()?),
        System::Zs9 => (usual()?, Zs9Options::from_arg_matches(&matches)?),
    };
    Ok((C::from_arg_matches(&matches)?, DriveOptions { system, inertia, run, traction, zs9 }))
}

/// The options when none is named.
pub fn usual<O: Args>() -> Result<O> {
    let command = O::augment_args(Command::new("usual").no_binary_name(true));
    Ok(O::from_arg_matches(&command.try_get_matches_from([""; 0])?)?)
}
