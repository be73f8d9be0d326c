//! The known filter of the current sensors, as a delay.
//!
//! A first-order filter with the time constant τ shows a current that turns with ω late by `atan(ωτ)/ω` and too small by `√(1 + (ωτ)²)`. A current
//! that changes slowly within τ is shown as it was τ ago. So the currents are treated as those of an earlier instant: they are taken with the angle
//! of that instant, and all volt-seconds are counted from it.

use crate::time::Clock;

/// The delay of a filter at a given speed.
#[derive(Clone, Copy)]
pub(super) struct CurrentDelay {
    /// The delay, in ticks, and in s.
    pub ticks: u32,
    pub s: f32,
    /// Ratio of a current to its reading.
    pub scale: f32,
}

impl CurrentDelay {
    /// No filter.
    pub const NONE: Self = Self { ticks: 0, s: 0.0, scale: 1.0 };

    /// The delay for a filter's time constant, in ticks, at an electrical speed, in rad/s; both values within 0.2 % for ωτ up to 0.3.
    pub fn of(filter_ticks: u32, omega: f32, clock: &Clock) -> Self {
        if filter_ticks == 0 {
            return Self::NONE;
        }
        let turn = omega * clock.seconds(filter_ticks as i32);
        let squared = turn * turn;
        let ticks = (filter_ticks as f32 * (1.0 - squared * (1.0 / 3.0))) as u32;
        Self { ticks, s: clock.seconds(ticks as i32), scale: 1.0 + squared * (0.5 - 0.125 * squared) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_turning_current_is_late_and_small() {
        let clock = Clock::new(25_000_000, 2_500);
        for omega in [-2_513.0_f32, -500.0, 1_257.0, 2_513.0] {
            let delay = CurrentDelay::of(2_500, omega, &clock);
            let turn = omega * 1e-4;
            assert!((delay.s * omega - turn.atan()).abs() < 2e-3 * turn.abs(), "{omega}: {} s", delay.s);
            assert!((delay.scale - turn.hypot(1.0)).abs() < 1e-4, "{omega}: {}", delay.scale);
        }
        let none = CurrentDelay::of(0, 2_513.0, &clock);
        assert_eq!((none.ticks, none.s, none.scale), (0, 0.0, 1.0));
    }
}
