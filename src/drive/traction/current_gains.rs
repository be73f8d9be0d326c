//! The differences between the gains of the three current sensors, learnt from the sum of their readings.
//!
//! The three currents of a machine without a neutral wire add up to zero. Sensors that show (1 + g) times their current add up to Σ g i, which is 3/2
//! times the product of the current's vector and that of the gains; a gain common to all three does not contribute and cannot be found from it. The
//! vector of the gains follows the sum by normalised least mean squares, `g += μ Σ i/(|i|² + i₀²)`: an error decays with a time constant of some 15
//! ms, and more slowly if the current is below i₀. The sensors' offsets must have been subtracted before.

use crate::frames::{Abc, AlphaBeta, limit_magnitude};

/// μ: two thirds of the share of a sum that one control period removes.
const RATE: f32 = 0.02;
/// Current i₀ below which the sum tells little, as a share of the largest.
const FROM: f32 = 0.2;
/// Largest component of the vector along either axis, and the size that is ignored, since a converter's steps may look like it.
const MOST: f32 = 0.05;
const LEFT_ALONE: f32 = 0.001;

/// The gains' vector, and the resulting scales of the currents.
pub(super) struct CurrentGains {
    gains: AlphaBeta,
    /// Ratio of each current to its sensor's reading.
    scales: Abc,
}

impl CurrentGains {
    /// All three gains alike.
    pub const fn new() -> Self {
        Self { gains: AlphaBeta { alpha: 0.0, beta: 0.0 }, scales: Abc { a: 1.0, b: 1.0, c: 1.0 } }
    }

    /// The currents that flow when sensors without offsets show these, in A.
    #[inline(always)]
    pub fn without(&self, shown: Abc) -> Abc {
        let Abc { a, b, c } = self.scales;
        Abc { a: shown.a * a, b: shown.b * b, c: shown.c * c }
    }

    /// Learns in a control period from these currents, in A, corrected by the gains known so far, in a machine of this largest current, in A.
    /// The last argument is a ratio of current to reading that all three share; the scales include it.
    #[inline(never)]
    pub fn learn(&mut self, currents_a: Abc, largest_a: f32, over_shown: f32) {
        let (current, from_a) = (currents_a.clarke(), FROM * largest_a);
        let sum_a = currents_a.a + currents_a.b + currents_a.c;
        let more = current * (RATE * sum_a / (current.squared() + from_a * from_a));
        let within = |gain: f32| limit_magnitude(gain, MOST);
        self.gains = AlphaBeta {
            alpha: within(self.gains.alpha + more.alpha),
            beta: within(self.gains.beta + more.beta),
        };
        let Abc { a, b, c } = self.gains.abc();
        let scale = |gain: f32| if gain.abs() > LEFT_ALONE { over_shown * (1.0 - gain) } else { over_shown };
        self.scales = Abc { a: scale(a), b: scale(b), c: scale(c) };
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frames::Angle;

    const LARGEST_A: f32 = 200.0;

    /// The largest difference of two currents' scales after this many control periods with a current, in A, that turns once in 100 of them, seen by
    /// sensors of these gains and, in the first, an offset in A.
    fn left(periods: u32, current_a: f32, gains: [f32; 3], offset_a: f32) -> f32 {
        let mut learnt = CurrentGains::new();
        let show = |period: u32| {
            let there = Angle::from_turns(period as f32 * 0.01).sin_cos();
            let Abc { a, b, c } =
                AlphaBeta { alpha: current_a * there.cos, beta: current_a * there.sin }.abc();
            let [first, second, third] = gains;
            Abc { a: a * (1.0 + first) + offset_a, b: b * (1.0 + second), c: c * (1.0 + third) }
        };
        for period in 0..periods {
            learnt.learn(learnt.without(show(period)), LARGEST_A, 1.0);
        }
        let Abc { a, b, c } = learnt.scales;
        let [a, b, c] = [a * (1.0 + gains[0]), b * (1.0 + gains[1]), c * (1.0 + gains[2])];
        (a - b).abs().max((b - c).abs()).max((c - a).abs())
    }

    #[test]
    fn differences_of_gains_go() {
        for gains in [[0.02, -0.02, 0.0], [0.0, 0.03, 0.0], [-0.01, 0.01, 0.03]] {
            for (periods, current_a) in [(800, LARGEST_A), (3_200, -0.5 * LARGEST_A)] {
                let found = left(periods, current_a, gains, 0.0);
                assert!(found < 2e-3, "{gains:?}, {current_a} A: {found}");
            }
        }
    }

    #[test]
    fn what_is_common_to_all_is_left() {
        let mut learnt = CurrentGains::new();
        let there = Abc { a: 200.0, b: -100.0, c: -100.0 };
        (0..1_000).for_each(|_| learnt.learn(learnt.without(there), LARGEST_A, 1.0));
        assert_eq!(learnt.without(there), there);
    }

    #[test]
    fn an_offset_that_is_left_makes_no_gain_of_its_own() {
        let found = left(2_000, LARGEST_A, [0.0; 3], 1e-3 * LARGEST_A);
        assert!(found < 2e-3, "{found}");
    }

    #[test]
    fn nothing_grows_beyond_what_a_sensor_may_be_off() {
        let mut learnt = CurrentGains::new();
        (0..10_000).for_each(|_| learnt.learn(Abc { a: 100.0, b: 0.0, c: 0.0 }, LARGEST_A, 1.0));
        let Abc { a, b, c } = learnt.scales;
        assert!(a >= 0.95 && b <= 1.05 && c <= 1.05, "{a} {b} {c}");
    }
}
