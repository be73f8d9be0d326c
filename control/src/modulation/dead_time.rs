//! Dead-time compensation.
//!
//! While both devices of a leg are off, the leg's current chooses the level: out of the leg (positive) it flows through the lower diode, into the leg through
//! the upper one. So a rising edge is late by the dead time when the current is positive, a falling one when it is negative; the other edges come at once.
//! Edges that would be late are commanded earlier.
//!
//! The thresholds of IGBT and diode take voltage in the same direction all the time. Since the current delays one edge in each carrier, that edge also makes
//! up for the volt-seconds that the thresholds take in the carrier.

use super::CarrierHalf;
use crate::frames::Abc;

/// Delay of an edge by a current.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EdgeDelay {
    /// The part that does not depend on the current, in ticks: the dead time, and the devices' thresholds.
    pub ticks: f32,
    /// The part for each ampere, in ticks: the slope of the devices.
    pub ticks_per_a: f32,
}

impl EdgeDelay {
    /// The delay of a dead time alone.
    pub const fn of_dead_time(ticks: u32) -> Self {
        Self { ticks: ticks as f32, ticks_per_a: 0.0 }
    }

    /// Adds devices that take these shares of the link's voltage, at any current and for each ampere, in carrier halves of this length.
    pub const fn with_drops(self, threshold_share: f32, share_per_a: f32, period_ticks: u32) -> Self {
        let carrier = 2.0 * period_ticks as f32;
        Self {
            ticks: self.ticks + threshold_share * carrier,
            ticks_per_a: self.ticks_per_a + share_per_a * carrier,
        }
    }
}

/// Moves the edges of a half so that the legs do as it says when the timer plays it; `currents_a` are the phase currents
/// expected in it. Currents below `small_a` may have either sign because of their ripple: they count in proportion. Edges at the half's
/// very start belong to the half before and cannot come earlier.
///
/// ```
/// use tractive_control::frames::Abc;
/// use tractive_control::modulation::{CarrierHalf, EdgeDelay, compensate};
/// // All three phases rise 5,000 ticks after the start; the current flows out of leg a and into the others.
/// let mut half = CarrierHalf { period_ticks: 10_000, compare_ticks: [5_000; 3], ..CarrierHalf::default() };
/// compensate(&mut half, &Abc { a: 80.0, b: -40.0, c: -40.0 }, 2.0, EdgeDelay::of_dead_time(125));
/// // Leg a alone would rise late, by the dead time: its edge is commanded that much earlier.
/// assert_eq!(half.compare_ticks, [4_875, 5_000, 5_000]);
/// ```
pub fn compensate(half: &mut CarrierHalf, currents_a: &Abc, small_a: f32, delay: EdgeDelay) {
    let phases = half.compare_ticks.iter_mut().zip(half.start_levels);
    for ((compare, start_level), current) in phases.zip([currents_a.a, currents_a.b, currents_a.c]) {
        let against = if start_level { -current } else { current };
        if *compare < half.period_ticks {
            // The conversion makes 0 of what is below 0.
            let share = if against > small_a { 1.0 } else { against / small_a };
            let late = (delay.ticks + delay.ticks_per_a * against) * share;
            *compare = compare.saturating_sub((late + 0.5) as u32);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DELAY: EdgeDelay = EdgeDelay::of_dead_time(125);

    fn played(start_levels: [bool; 3], currents: [f32; 3]) -> [u32; 3] {
        let compare_ticks = [5_000, 60, u32::MAX];
        let mut half =
            CarrierHalf { period_ticks: 10_000, compare_ticks, start_levels, ..CarrierHalf::default() };
        let [a, b, c] = currents;
        compensate(&mut half, &Abc { a, b, c }, 2.0, DELAY);
        half.compare_ticks
    }

    #[test]
    fn edges_that_the_current_delays_are_commanded_earlier() {
        assert_eq!(played([false; 3], [10.0, 10.0, 10.0]), [4_875, 0, u32::MAX]);
        assert_eq!(played([false; 3], [-10.0, -10.0, -10.0]), [5_000, 60, u32::MAX]);
        assert_eq!(played([true; 3], [10.0, 10.0, 10.0]), [5_000, 60, u32::MAX]);
        assert_eq!(played([true; 3], [-10.0, -10.0, -10.0]), [4_875, 0, u32::MAX]);
        assert_eq!(played([false; 3], [1.0, 0.0, 0.0]), [4_937, 60, u32::MAX]);
    }

    /// 1.5 V and 4 mΩ on 1,500 V: of 80 A they take 1.82 V, in a carrier of 20,000 ticks 24.3 ticks of the link's voltage, whichever of the leg's edges is late.
    #[test]
    fn what_devices_take_of_a_carrier_its_late_edge_gives_back() {
        let delay = DELAY.with_drops(1e-3, 4e-3 / 1_500.0, 10_000);
        for (start_level, current_a, earlier) in
            [(false, 80.0, 149), (true, -80.0, 149), (false, -80.0, 0), (true, 80.0, 0)]
        {
            let mut half = CarrierHalf {
                period_ticks: 10_000,
                compare_ticks: [5_000; 3],
                start_levels: [start_level; 3],
                ..CarrierHalf::default()
            };
            compensate(&mut half, &Abc { a: current_a, b: 0.0, c: 0.0 }, 2.0, delay);
            assert_eq!(half.compare_ticks[0], 5_000 - earlier, "{start_level} {current_a} A");
        }
    }
}
