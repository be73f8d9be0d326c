//! The fault campaign: everything that can go wrong, in every mode, at every speed, motoring, braking and coasting; what the drive
//! made of it, and whether that is good enough.
//!
//! A case is one run of a drive's own tasks on its bench: it settles, the fault comes, and if the drive has not stopped by then,
//! another torque is wanted, so that nothing stays hidden. [`judge`] says what is good enough, [`without`] switches one
//! protection off to see which cases are lost.

pub mod command;
pub mod dual;
pub mod healthy;
pub mod judge;
pub mod report;
pub mod traction;
pub mod without;

use anyhow::{Context, Result};
use judge::Verdict;
use rayon::prelude::*;
use serde::Serialize;
use without::Without;

/// What the drive does when the fault comes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Action {
    /// Torque along the speed.
    Motoring,
    /// Torque against the speed.
    Braking,
    /// Pulses, and no torque.
    Coasting,
}

impl Action {
    /// All three.
    pub const ALL: [Self; 3] = [Self::Motoring, Self::Braking, Self::Coasting];

    /// The name in tables.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Motoring => "motoring",
            Self::Braking => "braking",
            Self::Coasting => "coasting",
        }
    }

    /// Sign of the torque.
    pub const fn sign(self) -> f64 {
        match self {
            Self::Motoring => 1.0,
            Self::Braking => -1.0,
            Self::Coasting => 0.0,
        }
    }
}

/// One line of the table.
#[derive(Clone, Debug, Serialize)]
pub struct Outcome {
    /// `pmasynrm` or `zs9`.
    pub system: &'static str,
    /// What went wrong.
    pub fault: String,
    /// Mode of the pulses when it did; the ZS9's scheme.
    pub mode: String,
    /// Speed then, in r/min.
    pub speed_rpm: f64,
    /// What the drive did.
    pub action: Action,
    /// How it ended.
    pub verdict: Verdict,
    /// The fault that the drive named; empty if none.
    pub named: String,
    /// The safe state that it chose; empty if none.
    pub safe_state: String,
    /// Carrier periods from the fault's first effect until the gates were safe.
    pub carrier_periods: Option<f64>,
    /// The same time, in ms.
    pub time_ms: Option<f64>,
    /// From the fault itself, in ms: a sensor that is stuck shows where the current goes elsewhere.
    pub since_fault_ms: Option<f64>,
    /// Largest phase current from the fault until the gates were safe, in A.
    pub current_until_a: f64,
    /// And after that.
    pub current_after_a: f64,
    /// What is allowed: 1.5 times the trip level.
    pub current_limit_a: f64,
    /// Largest DC voltage until the gates were safe, in V; the ZS9's link outside shoot-through.
    pub udc_until_v: f64,
    /// And after that.
    pub udc_after_v: f64,
    /// What is allowed after that: what the stored energies and the supply force.
    pub udc_limit_v: f64,
    /// The ZS9's largest capacitor voltage until the gates were safe, in V.
    pub uc_until_v: Option<f64>,
    /// And after that.
    pub uc_after_v: Option<f64>,
    /// What is allowed.
    pub uc_limit_v: Option<f64>,
    /// Mean torque less demand where the drive went on, in N·m: the worst of both demands, and for the ZS9 of both motors.
    pub torque_error_nm: f64,
    /// Why it is uncaught; empty otherwise.
    pub why: String,
}

/// One case of either system.
#[derive(Clone, Debug)]
pub enum Case {
    /// Of the PMaSynRM drive.
    Traction(traction::Case),
    /// Of the ZS9.
    Dual(dual::Case),
}

impl Case {
    /// `system fault mode speed action`, which a filter searches.
    pub fn name(&self) -> String {
        match self {
            Self::Traction(case) => case.name(),
            Self::Dual(case) => case.name(),
        }
    }
}

/// The machines of both systems, with one protection off or none.
pub struct Campaign {
    traction: traction::Drive,
    dual: dual::Drive,
}

impl Campaign {
    /// Both drives.
    ///
    /// # Errors
    /// Machine folders that are not there.
    pub fn new(without: Option<Without>) -> Result<Self> {
        Ok(Self { traction: traction::Drive::new(without)?, dual: dual::Drive::new(without)? })
    }

    /// Runs one case.
    ///
    /// # Errors
    /// A drive that breaks its bench's rules.
    pub fn run(&self, case: &Case) -> Result<Outcome> {
        match case {
            Case::Traction(case) => self.traction.run(case),
            Case::Dual(case) => self.dual.run(case),
        }
    }

    /// Runs many, on all cores, in their order; `after_each` is told of every one that is done.
    ///
    /// # Errors
    /// The first drive that breaks its bench's rules.
    pub fn run_all(&self, cases: &[Case], after_each: impl Fn() + Sync) -> Result<Vec<Outcome>> {
        let run = |case: &Case| {
            let outcome = self.run(case).with_context(|| case.name());
            after_each();
            outcome
        };
        cases.par_iter().map(run).collect()
    }
}

/// Every case; of the fast ones each fault in each mode once at least.
pub fn cases(fast: bool) -> Vec<Case> {
    let traction = traction::cases(fast).into_iter().map(Case::Traction);
    traction.chain(dual::cases(fast).into_iter().map(Case::Dual)).collect()
}
