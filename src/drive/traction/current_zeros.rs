//! The zeros of the current sensors, learnt while no current can flow, and subtracted from the readings.
//!
//! With the gates off, and at speeds too low for its diodes to rectify, a machine has no current: the sensors then show their offset. The offset is
//! the mean over the whole rest and is adopted when pulses begin. So drift is followed from one rest to the next, but not under pulses, when no
//! current is known to be zero.

use crate::frames::Abc;
use crate::protection::{FailedCheck, Fault};

/// Control periods without pulses until the current that flowed under pulses is gone.
const SETTLING: u32 = 50;
/// Fewest control periods in a mean, and the most by which it forgets.
const LEAST: u32 = 100;
const MOST: u32 = 5_000;
/// Offset that is ignored, as a share of the largest current: a converter's step or the snubbers' current may look like it.
const LEFT_ALONE_SHARE: f32 = 0.001;
/// Offset that is a fault, as a share of the largest current.
const FAULT_SHARE: f32 = 0.05;

/// The zeros, in A, and the mean of the present rest.
pub(super) struct CurrentZeros {
    zeros: Abc,
    mean: Abc,
    periods: u32,
    /// The offset of the last rest if it was too large, in A; 0 otherwise.
    refused_a: f32,
}

impl CurrentZeros {
    /// The zeros as the board has them.
    pub const fn new() -> Self {
        const NONE: Abc = Abc { a: 0.0, b: 0.0, c: 0.0 };
        Self { zeros: NONE, mean: NONE, periods: 0, refused_a: 0.0 }
    }

    /// The currents that flow when the sensors show these, in A.
    #[inline(always)]
    pub fn without(&self, shown: Abc) -> Abc {
        let Abc { a, b, c } = self.zeros;
        Abc { a: shown.a - a, b: shown.b - b, c: shown.c - c }
    }

    /// A control period in which no current flows, with the sensors' readings, in A.
    pub fn rest(&mut self, shown: Abc) {
        self.periods = self.periods.saturating_add(1);
        let of = self.periods.saturating_sub(SETTLING);
        if of > 0 {
            let share = 1.0 / (if of < MOST { of } else { MOST }) as f32;
            let Abc { a, b, c } = self.mean;
            let towards = |mean: f32, shown: f32| mean + share * (shown - mean);
            self.mean = Abc { a: towards(a, shown.a), b: towards(b, shown.b), c: towards(c, shown.c) };
        }
    }

    /// Current may flow.
    #[inline(always)]
    pub fn flow(&mut self) {
        self.periods = 0;
    }

    /// Pulses begin or go on, in a machine of this largest current, in A. Too large an offset is a fault until a later rest shows none.
    #[inline(always)]
    pub fn begin(&mut self, largest_a: f32) -> Option<FailedCheck> {
        if self.periods == 0 && self.refused_a == 0.0 { None } else { self.take_over(largest_a) }
    }

    #[cold]
    #[inline(never)]
    fn take_over(&mut self, largest_a: f32) -> Option<FailedCheck> {
        let limit_a = FAULT_SHARE * largest_a;
        if core::mem::take(&mut self.periods) >= SETTLING + LEAST {
            let offset_a = self.mean.peak();
            self.refused_a = if offset_a > limit_a { offset_a } else { 0.0 };
            if self.refused_a == 0.0 {
                let least_a = LEFT_ALONE_SHARE * largest_a;
                let known = |mean: f32| if mean.abs() > least_a { mean } else { 0.0 };
                let Abc { a, b, c } = self.mean;
                self.zeros = Abc { a: known(a), b: known(b), c: known(c) };
            }
        }
        (self.refused_a > 0.0).then_some((Fault::CurrentOffset, self.refused_a, limit_a))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LARGEST_A: f32 = 200.0;
    const SHOWN: Abc = Abc { a: 6.0, b: 0.1, c: -3.0 };

    fn rested(periods: u32, shown: Abc) -> CurrentZeros {
        let mut zeros = CurrentZeros::new();
        (0..periods).for_each(|_| zeros.rest(shown));
        zeros
    }

    #[test]
    fn what_is_shown_at_rest_is_taken_off() {
        let mut zeros = rested(SETTLING + LEAST, SHOWN);
        assert_eq!(zeros.without(SHOWN), SHOWN, "not before pulses begin");
        assert_eq!(zeros.begin(LARGEST_A), None);
        let left = zeros.without(SHOWN);
        assert!(left.a.abs() < 1e-4 && left.c.abs() < 1e-4, "{left:?}");
        assert_eq!(left.b, SHOWN.b, "a step of a converter is none");
    }

    #[test]
    fn a_short_rest_and_flowing_current_teach_nothing() {
        let mut zeros = rested(SETTLING + LEAST - 1, SHOWN);
        assert_eq!(zeros.begin(LARGEST_A), None);
        assert_eq!(zeros.without(SHOWN), SHOWN);
        let mut zeros = rested(SETTLING + LEAST, SHOWN);
        zeros.flow();
        assert_eq!(zeros.begin(LARGEST_A), None);
        assert_eq!(zeros.without(SHOWN), SHOWN);
    }

    #[test]
    fn drift_is_followed_at_the_next_rest() {
        let mut zeros = rested(SETTLING + LEAST, SHOWN);
        zeros.begin(LARGEST_A);
        let drifted = Abc { a: 7.0, ..SHOWN };
        (0..SETTLING + LEAST).for_each(|_| zeros.rest(drifted));
        zeros.begin(LARGEST_A);
        assert!(zeros.without(drifted).a.abs() < 1e-4);
    }

    #[test]
    fn an_offset_that_is_too_large_is_a_fault() {
        let mut zeros = rested(SETTLING + LEAST, Abc { a: 0.0, b: -10.5, c: 0.0 });
        let (fault, value, limit) = zeros.begin(LARGEST_A).unwrap();
        assert_eq!((fault, limit), (Fault::CurrentOffset, 10.0));
        assert!((value - 10.5).abs() < 1e-4, "{value}");
        // An acknowledge and pulses at once, or after a short rest, change nothing; a rest without an offset does.
        assert!(zeros.begin(LARGEST_A).is_some());
        assert_eq!(zeros.without(SHOWN), SHOWN);
        (0..SETTLING).for_each(|_| zeros.rest(SHOWN));
        assert!(zeros.begin(LARGEST_A).is_some());
        (0..SETTLING + LEAST).for_each(|_| zeros.rest(SHOWN));
        assert_eq!(zeros.begin(LARGEST_A), None);
    }

    #[test]
    fn what_is_not_a_number_is_no_zero() {
        let mut zeros = rested(SETTLING + LEAST, Abc { a: f32::NAN, ..SHOWN });
        zeros.begin(LARGEST_A);
        assert_eq!(zeros.without(SHOWN).a, SHOWN.a);
    }
}
