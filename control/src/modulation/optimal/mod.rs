//! The optimised patterns: pulses of least distortion, whose edges stand at angles from a table.
//!
//! A pattern is quarter-wave symmetric: each phase changes its level at 0, at each of its angles, and at their mirror images about 90°; the second half
//! wave is the first one inverted. Its carrier halves all have the same angle, and no more than one edge of a phase. A mode is a
//! branch of optima that lie continuously beside each other over the modulation index.
//!
//! In steady state the flux runs along the pattern's own path, which control knows at each boundary ([`ripple`]). If the flux is off
//! this path, control asks for a mean voltage other than the fundamental; the next edges then move by the difference in volt-seconds, as far as
//! their phases allow and the shortest pulse is kept. The remainder is seen again at the next boundary.

mod flux;
mod meeting;
mod pulses;
mod table;

pub use flux::ripple;
pub(super) use meeting::last_half;
pub(super) use pulses::half;
pub(super) use table::*;

use crate::frames::limit;
use core::f32::consts::FRAC_PI_2;

/// A branch of optimised patterns.
#[derive(Debug)]
pub struct Branch {
    /// `true` if a phase's level is the upper one just after angle 0.
    starts_high: bool,
    /// Carrier halves in 30°.
    pub halves: u32,
    /// The half, counted from 0° and again every 60°, at whose beginning the flux lies next to its fundamental.
    calm: u32,
    /// The place among the branches with as many pulses, from the smallest modulation index up: tells the shape of its flux path.
    place: u32,
    /// Angles in a quarter turn: a turn has twice as many pulses and one.
    pub angles: usize,
    /// Modulation index of the first and last node.
    pub first: f32,
    pub last: f32,
    inverse_step: f32,
    /// Ripple as a share of the fundamental flux: at six-step, per missing share, and per missing share squared.
    pub ripple: [f32; 3],
    /// The rms value of the ripple along the flux, likewise: at six-step, and per missing share.
    along: [f32; 2],
    /// The angles in rad, node by node.
    nodes: &'static [f32],
}

/// A pattern: the angles of a branch at a modulation index.
#[derive(Clone, Copy)]
struct Pattern<'a> {
    branch: &'a Branch,
    /// The angles of the nodes on either side.
    below: &'a [f32],
    above: &'a [f32],
    /// Place between them, 0 ..= 1.
    part: f32,
}

impl Branch {
    /// The modulation index within the branch's window.
    pub fn within(&self, index: f32) -> f32 {
        limit(index, self.first, self.last)
    }

    /// The pattern at a modulation index; beyond the window, the pattern at its end.
    fn pattern(&self, index: f32) -> Pattern<'_> {
        let place = (self.within(index) - self.first) * self.inverse_step;
        let node = place as usize;
        let row = |node: usize| self.nodes.get(node * self.angles..).unwrap_or(&[]);
        let below = row(node);
        let above = row(node + 1);
        let above = if above.is_empty() { below } else { above };
        Pattern { branch: self, below, above, part: place - node as f32 }
    }

    /// The rms value of the ripple along the flux as a share of the fundamental flux, for a fundamental of so much of six-step.
    pub fn along(&self, index: f32) -> f32 {
        let [least, linear] = self.along;
        least + linear * (1.0 - self.within(index))
    }

    /// `true` for a half at whose beginning the pattern may take over from a free carrier.
    pub fn is_calm(&self, half: u32) -> bool {
        half % (2 * self.halves) == self.calm
    }

    /// Carrier halves in a quarter turn.
    fn quarter(&self) -> u32 {
        3 * self.halves
    }

    /// The angle of a carrier half, in rad.
    fn half_rad(&self) -> f32 {
        FRAC_PI_2 / self.quarter() as f32
    }
}

impl Pattern<'_> {
    /// The angles in rad, ascending.
    fn angles(&self) -> impl Iterator<Item = f32> {
        let pairs = self.below.iter().zip(self.above).take(self.branch.angles);
        pairs.map(|(below, above)| below + self.part * (above - below))
    }
}
