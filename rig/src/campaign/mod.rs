//! The fault campaign: everything that can go wrong, in every mode, at every speed, motoring, braking and coasting; how the drive
//! responded, and whether that is good enough.
//!
//! A case is one run of a drive's own tasks on its bench: it settles, the fault occurs, and if the drive has not stopped by then,
//! another torque is demanded, so that nothing stays hidden. [`judge`] decides what is good enough; [`crate::ablation`] switches one
//! protection off to see which cases are lost.

mod action;
pub mod command;
pub mod drawn;
pub mod dual;
mod fault;
pub mod healthy;
pub mod judge;
pub mod options;
mod outcome;
pub mod random;
pub mod report;
pub mod traction;

pub use action::Action;
pub use outcome::Outcome;

use crate::ablation::Ablation;
use crate::machine::Machine;
use crate::scenario::traction::PatternsName;
use anyhow::{Context, Result};
use rayon::prelude::*;

/// One case of either system.
#[derive(Clone, Debug)]
pub enum Case {
    /// Of the PMaSynRM drive.
    Traction(Box<traction::Case>),
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
    /// `None` if the two-level drive's machine is the user's own.
    dual: Option<dual::Drive>,
}

impl Campaign {
    /// Both drives.
    pub fn new(without: Option<Ablation>) -> Result<Self> {
        Ok(Self { traction: traction::Drive::new(without)?, dual: Some(dual::Drive::new(without)?) })
    }

    /// The two-level drive alone, of any machine.
    pub fn of(machine: Machine, without: Option<Ablation>) -> Result<Self> {
        Ok(Self { traction: traction::Drive::of(machine, without)?, dual: None })
    }

    /// The same with other pulse patterns.
    pub fn with(self, patterns: PatternsName) -> Self {
        Self { traction: self.traction.with(patterns), ..self }
    }

    /// See [`traction::Drive::most_rpm`].
    pub fn most_rpm(&self) -> Option<f64> {
        self.traction.most_rpm()
    }

    /// Every case; the fast ones are each fault in each mode at least once.
    pub fn cases(&self, fast: bool) -> Vec<Case> {
        let traction = self.traction.cases(fast).into_iter().map(|case| Case::Traction(Box::new(case)));
        let dual = self.dual.iter().flat_map(|_| dual::cases(fast));
        traction.chain(dual.map(Case::Dual)).collect()
    }

    /// Runs one case.
    pub fn run(&self, case: &Case) -> Result<Outcome> {
        match case {
            Case::Traction(case) => self.traction.run(case),
            Case::Dual(case) => self.dual.as_ref().context("no case of this machine")?.run(case),
        }
    }

    /// Runs many cases on all cores, keeping their order; `after_each` is called after every one.
    pub fn run_all(&self, cases: &[Case], after_each: impl Fn() + Sync) -> Result<Vec<Outcome>> {
        let run = |case: &Case| {
            let outcome = self.run(case).with_context(|| case.name());
            after_each();
            outcome
        };
        cases.par_iter().map(run).collect()
    }
}
