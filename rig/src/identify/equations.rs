//! The linear equations of a fit.

use super::boundary::{Boundary, turned};
use super::fit::{BESIDE, Fit};
use crate::coenergy::{Basis, Equations};
use tractive::identification::Stage;

/// Boundaries in a part that is taken relative to its own mean.
const PART: usize = 100;
/// Edges of uncertain sign after which a part ends: their possible error is no longer carried on. More for the turn, whose parts determine the magnets by the
/// turn within them: with 8 the worst of 100 experiments had 0.43 % of the magnets' flux linkage wrong, with 5 0.53 %, by the law of pulses before this one.
const UNSURE_EDGES: f64 = 1.5;
const UNSURE_EDGES_TURNING: f64 = 8.0;
/// Shortest part.
const LEAST_PART: usize = 4;

/// The boundaries used for a solution.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scope {
    /// All with currents: pulses and turn.
    All,
    /// Only those at standstill.
    Pulses,
}

impl Scope {
    /// `true` if a stage's boundaries are used: those at zero current are not, as no edge's sign is certain there.
    fn uses(self, stage: Stage) -> bool {
        match stage {
            Stage::Probe | Stage::Rest | Stage::Done => false,
            Stage::Turn => self == Self::All,
            Stage::Staircase | Stage::AlongD | Stage::AlongQ | Stage::AlongBoth => true,
        }
    }
}

/// The parts that are taken relative to their own mean.
fn parts(all: &[Boundary], scope: Scope) -> Vec<&[Boundary]> {
    let (mut parts, mut from) = (Vec::new(), 0);
    for (k, boundary) in all.iter().enumerate() {
        let turns = boundary.stage == Stage::Turn;
        let most = if turns { UNSURE_EDGES_TURNING } else { UNSURE_EDGES };
        let unsure = boundary.unsure - all[from].unsure > most;
        let used = scope.uses(boundary.stage);
        if !used || k - from >= PART || unsure {
            parts.push(&all[from..k]);
            from = if used { k } else { k + 1 };
        }
    }
    parts.push(&all[from.min(all.len())..]);
    parts.retain(|part| part.len() >= LEAST_PART);
    parts
}

/// The two rows of each boundary, relative to its part's mean. If a fit is known the last unknown is a rotation of the frame.
pub fn equations(boundaries: &[Boundary], basis: &Basis, known: Option<&Fit>, scope: Scope) -> Equations {
    let unknowns = basis.len() + BESIDE + usize::from(known.is_some());
    let mut equations = Equations::new(unknowns);
    for part in parts(boundaries, scope) {
        let mut own: [Vec<Vec<f64>>; 2] = [Vec::new(), Vec::new()];
        for boundary in part {
            let [along_d, along_q] = basis.flux(boundary.current);
            let mut pair = [Vec::with_capacity(unknowns + 1), Vec::with_capacity(unknowns + 1)];
            for (d, q) in along_d.iter().zip(&along_q) {
                let flux = turned(boundary.frame, [*d, *q]);
                pair[0].push(flux[0]);
                pair[1].push(flux[1]);
            }
            let turns = known.map(|fit| turned(boundary.frame, fit.turns(boundary.current)));
            for (axis, row) in pair.into_iter().enumerate() {
                let mut row = row;
                row.extend([boundary.charge[axis], boundary.lacking[axis], boundary.opposed[axis]]);
                row.extend(turns.map(|turns| turns[axis]));
                row.push(boundary.volt_seconds[axis]);
                own[axis].push(row);
            }
        }
        own.into_iter().for_each(|rows| equations.add_from_mean(rows));
    }
    equations.close_samples();
    equations
}

/// Residuals of both rows of each boundary, in the rotor's frame.
pub fn by_boundary(boundaries: &[Boundary], scope: Scope, left: &[f64]) -> Vec<(Stage, [f64; 2])> {
    let mut found = Vec::with_capacity(boundaries.len());
    let mut begins = 0;
    for part in parts(boundaries, scope) {
        for (k, boundary) in part.iter().enumerate() {
            let pair = [left[begins + k], left[begins + part.len() + k]];
            let (sin, cos) = boundary.frame;
            found.push((boundary.stage, turned((-sin, cos), pair)));
        }
        begins += 2 * part.len();
    }
    found
}
