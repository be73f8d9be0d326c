//! Dead-time compensation.
//!
//! While both devices of a leg are off, its current chooses the level: out of the leg (positive) it flows through the lower
//! diode, into the leg through the upper one. So a rising edge comes late by the dead time when the current is positive, a
//! falling one when it is negative, and the other edges come at once. Those that would come late are commanded earlier.

use super::{CarrierHalf, SwitchLimits};
use crate::frames::Abc;

/// Moves the edges of a half so that the legs do what it says when the timer plays it; `currents_a` are the phase currents that are
/// expected in it. Currents below `small_a` may have either sign by their ripple: they count in proportion. Edges at the half's
/// very start belong to the half before and cannot come earlier.
///
/// ```
/// use tractive_control::frames::Abc;
/// use tractive_control::modulation::{CarrierHalf, SwitchLimits, compensate};
/// let devices = SwitchLimits { min_pulse_ticks: 250, dead_time_ticks: 125, shortest_half_ticks: 10_000 };
/// // All three phases rise 5,000 ticks after the start; the current flows out of leg a and into the others.
/// let mut half = CarrierHalf { period_ticks: 10_000, compare_ticks: [5_000; 3], ..CarrierHalf::default() };
/// compensate(&mut half, &Abc { a: 80.0, b: -40.0, c: -40.0 }, 2.0, &devices);
/// // Leg a alone would rise late, by the dead time: its edge is commanded that much earlier.
/// assert_eq!(half.compare_ticks, [4_875, 5_000, 5_000]);
/// ```
pub fn compensate(half: &mut CarrierHalf, currents_a: &Abc, small_a: f32, devices: &SwitchLimits) {
    let dead_ticks = devices.dead_time_ticks as f32;
    let phases = half.compare_ticks.iter_mut().zip(half.start_levels);
    for ((compare, start_level), current) in phases.zip([currents_a.a, currents_a.b, currents_a.c]) {
        let against = if start_level { -current } else { current };
        if *compare < half.period_ticks {
            // What is below 0 the conversion makes 0.
            let late = dead_ticks * if against > small_a { 1.0 } else { against / small_a };
            *compare = compare.saturating_sub((late + 0.5) as u32);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DEVICES: SwitchLimits =
        SwitchLimits { min_pulse_ticks: 250, dead_time_ticks: 125, shortest_half_ticks: 10_000 };

    fn played(start_levels: [bool; 3], currents: [f32; 3]) -> [u32; 3] {
        let compare_ticks = [5_000, 60, u32::MAX];
        let mut half =
            CarrierHalf { period_ticks: 10_000, compare_ticks, start_levels, ..CarrierHalf::default() };
        let [a, b, c] = currents;
        compensate(&mut half, &Abc { a, b, c }, 2.0, &DEVICES);
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
}
