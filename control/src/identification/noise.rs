//! The noise of the current sensors, as it shows before the first pulse: the changes of current that tell something are those above it.

use crate::frames::{Dq, sqrt};

/// Noise at rest, by the changes of current from one boundary to the next.
#[derive(Clone, Copy, Debug)]
pub struct Noise {
    /// Squares of the changes, summed, in A², and their number.
    squares: f32,
    count: f32,
    /// Change of current that counts as noise, in A; and square by which noise is made up for in the squares of changes that are learnt from, in A².
    change_a: f32,
    made_up: f32,
}

/// Largest noise with which the experiment goes on, as a share of the bound: root mean square of a phase's reading. With more, the rotor of the 180 kW
/// machine turns away, or its current leaves the bound.
pub const PROBED_NOISE_SHARE: f32 = 0.0057;

/// Least change of current that counts as noise, as a share of the bound; and as a multiple of the root mean square of the changes: of independent
/// ones, one in twelve thousand is larger.
const LEAST_SHARE: f32 = 0.01;
const TIMES: f32 = 3.06;
/// Square of a change without current over that of a phase's noise: two axes, each with two thirds of its variance, at two boundaries.
const SQUARES: f32 = 8.0 / 3.0;
/// Share of the changes' mean square by which noise is made up for along d. A third of it is what noise adds to the square of a change along an axis. An inductance
/// that is too small lets the current drift, one that is too large brings it back: three times as much. With once as much, one of four experiments of the
/// 180 kW machine with 0.5 % of noise failed; with this, none of sixteen.
const MADE_UP: f32 = 1.5;

impl Noise {
    /// Nothing has been seen.
    pub const UNKNOWN: Self = Self { squares: 0.0, count: 0.0, change_a: 0.0, made_up: 0.0 };

    /// Takes a change of current without voltage, in A, for a bound in A.
    pub fn shows(&mut self, change: Dq, bound_a: f32) {
        self.squares += change.squared();
        self.count += 1.0;
        let (least_a, shown_a) = (LEAST_SHARE * bound_a, TIMES * sqrt(self.square()));
        self.made_up = MADE_UP * self.square();
        self.change_a = if shown_a > least_a { shown_a } else { least_a };
    }

    /// Change of current that counts as noise, in A.
    pub fn change_a(&self) -> f32 {
        self.change_a
    }

    /// Square of a change, in A², by which noise is made up for in the squares of changes that are learnt from.
    pub fn made_up(&self) -> f32 {
        self.made_up
    }

    /// Noise of a phase's reading, root mean square, in A.
    pub fn phase_a(&self) -> f32 {
        sqrt(self.square() / SQUARES)
    }

    /// `true` if it is more than the experiment can do with.
    pub fn is_too_much(&self, bound_a: f32) -> bool {
        self.phase_a() > PROBED_NOISE_SHARE * bound_a
    }

    /// Mean square of the changes, in A²; none before the first.
    fn square(&self) -> f32 {
        self.squares / (self.count + f32::MIN_POSITIVE)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn readings_without_noise_leave_the_least_change_and_noise_raises_it() {
        let bound_a = 100.0;
        let mut noise = Noise::UNKNOWN;
        assert!(!noise.is_too_much(bound_a) && noise.made_up() == 0.0);
        (0..36).for_each(|_| noise.shows(Dq { d: 0.0, q: 0.0 }, bound_a));
        assert!((noise.change_a() - 1.0).abs() < 1e-6 && noise.made_up() == 0.0);
        // Changes whose squares are those of 1 A in each phase: more than 0.6 A.
        let side = sqrt(0.5 * SQUARES);
        let mut noise = Noise::UNKNOWN;
        (0..36).for_each(|_| noise.shows(Dq { d: side, q: -side }, bound_a));
        assert!((noise.phase_a() - 1.0).abs() < 1e-4 && noise.is_too_much(bound_a));
        assert!(!noise.is_too_much(2.0 * bound_a) && noise.change_a() > 4.9);
    }
}
