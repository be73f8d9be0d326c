//! The options of a talk, and its results.

use super::script;
use super::supervisor::Talk;
use super::system::System;
use super::words::{self, DriveOptions};
use crate::analysis::Figures;
use crate::trace::{Recorded, Recording};
use crate::zs9;
use anyhow::Result;
use clap::Command;
use std::ffi::OsString;
use std::ops::Deref;
use std::path::PathBuf;

/// The options of a talk.
#[derive(Clone, Debug)]
pub struct TalkOptions {
    /// A script; without one commands are read from standard input.
    pub script: Option<PathBuf>,
    /// The drive that is talked to.
    pub drive: DriveOptions,
}

/// The option of a talk alone.
#[derive(Clone, Debug, clap::Args)]
struct Script {
    /// A script; without one commands are read from standard input, one a line.
    script: Option<PathBuf>,
}

impl Deref for TalkOptions {
    type Target = DriveOptions;

    fn deref(&self) -> &DriveOptions {
        &self.drive
    }
}

impl TalkOptions {
    /// Reads the words behind `talk`.
    pub fn read(words: &[OsString]) -> Result<Self> {
        let (Script { script }, drive) = words::read("talk", words, dressed)?;
        Ok(Self { script, drive })
    }

    /// The command line, of a system.
    pub fn command(system: System) -> Command {
        dressed(words::command::<Script>("talk", system), system)
    }
}

/// The command line with the commands of a script, for the help.
fn dressed(command: Command, system: System) -> Command {
    let list = |commands: &[script::Command]| {
        commands.iter().map(|(usage, _)| format!("  {usage}")).collect::<Vec<_>>().join("\n")
    };
    let commands = match system {
        System::Pmasynrm => list(&script::COMMANDS),
        System::Zs9 => {
            format!("{}\nor, of two motors:\n{}", list(&script::COMMANDS), list(&script::ZS9_COMMANDS))
        }
    };
    let other = match system {
        System::Pmasynrm => "\n\n`--system zs9 --help` lists what the ZS9 takes.",
        System::Zs9 => "",
    };
    command
        .about("Commands the drive over the protocol, by a script or line by line, and logs its telemetry")
        .after_help(format!("A line is [SECONDS] COMMAND; # begins a comment:\n{commands}{other}"))
}

/// The recording of what really happened, by system.
pub enum Happened {
    /// Of the PMaSynRM drive.
    Pmasynrm(Recording),
    /// Of the ZS9.
    Zs9(zs9::trace::Recording),
}

impl Happened {
    /// The part that both systems have.
    pub fn common(&self) -> &dyn Recorded {
        match self {
            Self::Pmasynrm(recording) => recording,
            Self::Zs9(recording) => recording,
        }
    }

    /// Times, and the speeds then.
    pub(super) fn speeds_rpm(&self) -> Vec<(f64, [f64; 2])> {
        match self {
            Self::Pmasynrm(recording) => {
                recording.rows.iter().map(|row| (row.t_s, [row.speed_rpm, 0.0])).collect()
            }
            Self::Zs9(recording) => {
                let of = |row: &zs9::trace::Row| row.motors.each_ref().map(|motor| motor.speed_rpm);
                recording.rows.iter().map(|row| (row.t_s, of(row))).collect()
            }
        }
    }
}

/// A run that is over.
pub struct Outcome {
    /// The talk, as sent and received.
    pub talk: Talk,
    /// The system that was talked to.
    pub system: System,
    /// The recording of what really happened.
    pub recording: Happened,
    /// The figures.
    pub figures: Figures,
    /// The name of the place where the drive ran.
    pub on: &'static str,
}
