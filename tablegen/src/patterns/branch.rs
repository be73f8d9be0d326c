//! The branches: continuous lines of local optima over the modulation index.

use super::local::Problem;
use super::torque::TorqueRipple;
use super::waveform::Waveform;
use std::f64::consts::FRAC_PI_2;

/// Step of the modulation index from node to node.
pub const STEP: f64 = 0.01;
/// Starts at the anchor.
const STARTS: u32 = 200;
/// Shortest pulse, in s, with some margin so that control can move its edges.
const SHORTEST_S: f64 = 12e-6;

/// A branch that the drive uses.
#[derive(Clone, Copy, Debug)]
pub struct Branch {
    /// Its mode's name.
    pub name: &'static str,
    /// Pulses a turn, odd.
    pub pulses: usize,
    /// `true` if a phase's level is the upper one just after angle 0.
    pub starts_high: bool,
    /// Carrier halves in 30°: each has no more than one edge of a phase.
    pub halves: u32,
    /// Modulation index at which it is the best of the optima found from many starts, in steps of a hundredth.
    pub anchor: u32,
    /// First and last modulation index, in hundredths.
    pub window: (u32, u32),
    /// Carrier half, counted from 0°, at whose beginning the flux is closest to its fundamental: there the pattern takes over from a free carrier.
    pub calm: u32,
    /// Index among the branches with the same number of pulses, from the smallest modulation index up.
    pub place: u32,
    /// Highest stator frequency at which it is used, in Hz: it turns the shortest pulse into an angle.
    pub highest_hz: f64,
}

/// The branches, from many pulses to few and from a small modulation index to a large one.
#[rustfmt::skip]
pub const BRANCHES: [Branch; 16] = [
    Branch { name: "opp15", pulses: 15, starts_high: false, halves: 6, anchor: 50, window: (10, 58), calm: 1, place: 0, highest_hz: 60.0 },
    Branch { name: "opp13a", pulses: 13, starts_high: false, halves: 5, anchor: 50, window: (10, 64), calm: 1, place: 0, highest_hz: 69.2 },
    Branch { name: "opp13b", pulses: 13, starts_high: true, halves: 5, anchor: 70, window: (62, 79), calm: 5, place: 1, highest_hz: 69.2 },
    Branch { name: "opp11", pulses: 11, starts_high: false, halves: 4, anchor: 60, window: (10, 73), calm: 3, place: 0, highest_hz: 81.8 },
    Branch { name: "opp9a", pulses: 9, starts_high: true, halves: 4, anchor: 40, window: (10, 55), calm: 3, place: 0, highest_hz: 100.0 },
    Branch { name: "opp9b", pulses: 9, starts_high: false, halves: 4, anchor: 65, window: (50, 82), calm: 3, place: 1, highest_hz: 100.0 },
    Branch { name: "opp7a", pulses: 7, starts_high: true, halves: 3, anchor: 50, window: (10, 70), calm: 1, place: 0, highest_hz: 128.6 },
    Branch { name: "opp7b", pulses: 7, starts_high: false, halves: 3, anchor: 75, window: (62, 89), calm: 3, place: 1, highest_hz: 128.6 },
    Branch { name: "opp7c", pulses: 7, starts_high: true, halves: 3, anchor: 90, window: (86, 96), calm: 2, place: 2, highest_hz: 128.6 },
    Branch { name: "opp7d", pulses: 7, starts_high: false, halves: 6, anchor: 96, window: (94, 97), calm: 6, place: 3, highest_hz: 128.6 },
    Branch { name: "opp7e", pulses: 7, starts_high: false, halves: 5, anchor: 97, window: (95, 97), calm: 5, place: 4, highest_hz: 128.6 },
    Branch { name: "opp5a", pulses: 5, starts_high: true, halves: 2, anchor: 60, window: (10, 84), calm: 1, place: 0, highest_hz: 180.0 },
    Branch { name: "opp5b", pulses: 5, starts_high: false, halves: 2, anchor: 85, window: (76, 94), calm: 2, place: 1, highest_hz: 180.0 },
    Branch { name: "opp5c", pulses: 5, starts_high: true, halves: 2, anchor: 95, window: (91, 97), calm: 2, place: 2, highest_hz: 180.0 },
    Branch { name: "opp3a", pulses: 3, starts_high: true, halves: 1, anchor: 80, window: (10, 95), calm: 1, place: 0, highest_hz: 300.0 },
    Branch { name: "opp3b", pulses: 3, starts_high: false, halves: 1, anchor: 95, window: (90, 98), calm: 1, place: 1, highest_hz: 300.0 },
];

/// A branch with its angles.
#[derive(Clone, Debug)]
pub struct Followed {
    /// The branch.
    pub branch: Branch,
    /// The modulation index of each node, and its angles in rad.
    pub nodes: Vec<(f64, Vec<f64>)>,
}

impl Branch {
    /// The level just after angle 0: 1 or −1.
    pub fn first(&self) -> f64 {
        if self.starts_high { 1.0 } else { -1.0 }
    }

    /// The shortest pulse, in rad.
    pub fn shortest_rad(&self) -> f64 {
        SHORTEST_S * self.highest_hz * std::f64::consts::TAU
    }

    /// The branch from one end of its window to the other.
    ///
    /// # Errors
    /// If it has no optimum.
    pub fn followed(&self) -> Result<Followed, String> {
        let lost = |at: u32| format!("{}: no optimum at modulation index {:.2}", self.name, index(at));
        let start = self.best_at_anchor().ok_or_else(|| lost(self.anchor))?;
        let bounds = self.bounds(&start).ok_or_else(|| lost(self.anchor))?;
        let ripple = TorqueRipple::new();
        let torque = |wave: &Waveform| ripple.squared(wave);
        let follow = |steps: &mut dyn Iterator<Item = u32>| {
            let mut last = start.clone();
            let mut nodes = Vec::new();
            for at in steps {
                let problem = self.problem(at, &bounds);
                last = problem.optimum(&last).ok_or_else(|| lost(at))?;
                let calmer = Problem { beside: Some(&torque), ..problem }.calmest(&last);
                let calmer = calmer.ok_or_else(|| lost(at))?;
                nodes.push((index(at), calmer));
            }
            Ok::<_, String>(nodes)
        };
        let mut nodes = follow(&mut (self.window.0..self.anchor).rev())?;
        nodes.reverse();
        nodes.extend(follow(&mut (self.anchor..=self.window.1))?);
        Ok(Followed { branch: *self, nodes })
    }

    /// The problem at a modulation index in hundredths.
    fn problem<'a>(&self, at: u32, bounds: &'a [(f64, f64)]) -> Problem<'a> {
        Problem {
            first: self.first(),
            index: index(at),
            shortest_rad: self.shortest_rad(),
            bounds,
            beside: None,
        }
    }

    /// The best optimum at the anchor whose edges the carrier halves can hold.
    fn best_at_anchor(&self) -> Option<Vec<f64>> {
        let count = self.pulses / 2;
        let shortest = self.shortest_rad();
        let anywhere = vec![(shortest, FRAC_PI_2 - 0.5 * shortest); count];
        let problem = self.problem(self.anchor, &anywhere);
        let optima = (1..=STARTS).filter_map(|start| problem.optimum(&spread(start, count)));
        let held = optima.filter(|angles| self.bounds(angles).is_some());
        let cost =
            |angles: &Vec<f64>| Waveform { first: self.first(), angles_rad: angles }.weighted_distortion();
        held.min_by(|a, b| cost(a).total_cmp(&cost(b)))
    }

    /// The carrier half in which each angle lies, reduced by half the shortest pulse at both ends; `None` if two edges of a phase lie in one half.
    fn bounds(&self, angles: &[f64]) -> Option<Vec<(f64, f64)>> {
        let width = FRAC_PI_2 / f64::from(3 * self.halves);
        let room = 0.5 * self.shortest_rad();
        let cells: Vec<_> = angles.iter().map(|angle| (angle / width).floor()).collect();
        let bounds: Vec<_> =
            cells.iter().map(|cell| (cell * width + room, (cell + 1.0) * width - room)).collect();
        // The edge at angle 0 is one, too; outside its own half every edge is far enough from it.
        let first = angles[0] >= 2.0 * room;
        let single = cells.windows(2).all(|pair| pair[0] < pair[1]);
        (first && single).then_some(bounds)
    }
}

/// A modulation index in hundredths.
fn index(hundredths: u32) -> f64 {
    f64::from(hundredths) * STEP
}

/// Ascending angles between 0 and 90° of start number `start`, spread evenly in `count` dimensions by an additive recurrence.
fn spread(start: u32, count: usize) -> Vec<f64> {
    // The positive root of x^(count + 1) = x + 1.
    let root = (0..64).fold(1.5, |root: f64, _| libm::pow(1.0 + root, 1.0 / (count as f64 + 1.0)));
    let place = |k: usize| (0.5 + f64::from(start) * libm::pow(root, -(k as f64 + 1.0))).fract();
    let mut angles: Vec<_> = (0..count).map(|k| FRAC_PI_2 * place(k)).collect();
    angles.sort_by(f64::total_cmp);
    angles
}

#[cfg(test)]
mod second_axis;
#[cfg(test)]
mod tests;
