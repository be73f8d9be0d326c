//! The options of a talk, and its results.

use super::supervisor::Talk;
use super::system::System;
use crate::analysis::Figures;
use crate::options::RunOptions;
use crate::scenario::System as _;
use crate::scenario::traction::{Traction, TractionOptions};
use crate::scenario::zs9::{Zs9, Zs9Options};
use crate::trace::{Recorded, Recording};
use crate::zs9;
use std::path::PathBuf;

/// The options of a talk.
#[derive(Clone, Debug, clap::Args)]
pub struct TalkOptions {
    /// A script; without one commands are read from standard input, one a line.
    pub script: Option<PathBuf>,
    /// The system that is talked to.
    #[arg(long, value_enum, default_value_t)]
    pub system: System,
    /// The machine's and its load's inertia, in kg·m²; default 10, of each of the ZS9's 0.1, for which its speed loops are made.
    #[arg(long, value_parser = crate::options::positive)]
    pub inertia: Option<f64>,
    /// The options that all runs share.
    #[command(flatten)]
    pub run: RunOptions,
    /// The options that only the PMaSynRM drive has.
    #[command(flatten)]
    pub traction: TractionOptions,
    /// The options that only the ZS9 has.
    #[command(flatten)]
    pub zs9: Zs9Options,
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
    /// The talk, as it was said and heard.
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

impl TalkOptions {
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
