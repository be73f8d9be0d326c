//! What a talk is asked for, and what it came to.

use super::supervisor::Talk;
use super::system::System;
use crate::analysis::Figures;
use crate::options::RunOptions;
use crate::trace::Recording;
use crate::zs9;
use std::path::PathBuf;
use tractive::protection::Trip;

/// What is wanted.
#[derive(Clone, Debug, clap::Args)]
pub struct TalkOptions {
    /// A script; without one commands are read from standard input, one a line.
    pub script: Option<PathBuf>,
    /// Who is talked to.
    #[arg(long, value_enum, default_value_t)]
    pub system: System,
    /// The machine's and its load's inertia, in kg·m²; default 10, of each of the ZS9's 0.1, for which its speed loops are made.
    #[arg(long, value_parser = crate::options::positive)]
    pub inertia: Option<f64>,
    /// What all runs share.
    #[command(flatten)]
    pub run: RunOptions,
}

/// What really happened, by system.
pub enum Recorded {
    /// Of the PMaSynRM drive.
    Pmasynrm(Recording),
    /// Of the ZS9.
    Zs9(zs9::trace::Recording),
}

impl Recorded {
    pub(super) fn trip(&self) -> Option<Trip> {
        match self {
            Self::Pmasynrm(recording) => recording.trip(),
            Self::Zs9(recording) => recording.trip(),
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
    /// What was said and heard.
    pub talk: Talk,
    /// Who was talked to.
    pub system: System,
    /// What really happened.
    pub recording: Recorded,
    /// The figures.
    pub figures: Figures,
}

impl TalkOptions {
    /// The inertia, in kg·m².
    pub fn inertia(&self) -> f64 {
        self.inertia.unwrap_or(self.system.inertia_kg_m2())
    }
}
