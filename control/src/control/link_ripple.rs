//! The ripple of a link, observed so that a voltage can be made for the link that will be there.
//!
//! A command acts one to two carrier halves after its sample: 1.2 ms with three pulses a turn. A rectifier's 300 Hz reverse meanwhile, and the
//! 33 to 100 Hz of a single-phase line move by up to 70 % of their amplitude. So one sinusoid is followed, `ẋ = jωx`, beside the mean, by a
//! Luenberger observer whose frequency is adapted by the part left unexplained in quadrature (a frequency-locked loop). A
//! constant link changes nothing, to the bit.

use crate::frames::{Angle, limit};

/// Bandwidth of the mean, in rad/s: 33 Hz are 207.
const MEAN_RAD_S: f32 = 25.0;
/// Bandwidth of the sinusoid, in rad/s: if the link steps, a tenth of the step counts as ripple at 100 Hz for some 30 ms.
const RIPPLE_RAD_S: f32 = 60.0;
/// Rate of the frequency's adaption, in 1/s; from 100 Hz it finds 33 and 300 Hz within a tenth of a second.
const ADAPTION_PER_S: f32 = 60.0;
/// Initial frequency and the range it is kept within, in rad/s: 20 to 700 Hz.
const FIRST_RAD_S: f32 = 628.3;
const SLOWEST_RAD_S: f32 = 125.7;
const FASTEST_RAD_S: f32 = 4_398.0;
/// Amplitude squared, as a share of the mean's square, below which the frequency is adapted less and less: an amplitude of a thousandth.
const SMALL: f32 = 1e-6;
/// Distance from the expected value, as a share of the mean, at which the observer starts anew.
const LOST: f32 = 0.25;

/// The observer.
#[derive(Clone, Copy, Debug)]
pub struct LinkRipple {
    /// In V.
    mean_v: f32,
    /// The sinusoid, and the one a quarter of a period after it, in V.
    direct_v: f32,
    quarter_v: f32,
    /// Its angular frequency, in rad/s.
    omega: f32,
}

impl LinkRipple {
    /// The observer on a link that has stood at `udc_v`.
    pub const fn at(udc_v: f32) -> Self {
        Self { mean_v: udc_v, direct_v: 0.0, quarter_v: 0.0, omega: FIRST_RAD_S }
    }

    /// A sample of the link, in V, a time in s after the last one.
    #[inline(never)]
    pub fn step(&mut self, udc_v: f32, passed_s: f32) {
        let turn = Angle::from_radians(self.omega * passed_s).sin_cos();
        let direct_v = self.direct_v * turn.cos - self.quarter_v * turn.sin;
        let quarter_v = self.direct_v * turn.sin + self.quarter_v * turn.cos;
        let error_v = udc_v - self.mean_v - direct_v;
        let is_near = error_v.abs() < LOST * self.mean_v;
        if !is_near {
            *self = Self::at(udc_v);
            return;
        }
        let squared = direct_v * direct_v + quarter_v * quarter_v + SMALL * self.mean_v * self.mean_v;
        let behind = error_v * quarter_v / squared;
        let omega = self.omega * (1.0 - ADAPTION_PER_S * passed_s * behind);
        self.omega = limit(omega, SLOWEST_RAD_S, FASTEST_RAD_S);
        self.mean_v += MEAN_RAD_S * passed_s * error_v;
        self.direct_v = direct_v + RIPPLE_RAD_S * passed_s * error_v;
        self.quarter_v = quarter_v;
    }

    /// Rise of the link above its value `first_s` after the last sample, at each of these times after that sample, in V. The first is short compared with the
    /// ripple's period.
    #[inline(never)]
    pub fn change<const N: usize>(&self, first_s: f32, times_s: [f32; N]) -> [f32; N] {
        let first_v = self.direct_v - self.omega * first_s * self.quarter_v;
        times_s.map(|time_s| {
            let turn = Angle::from_radians(self.omega * time_s).sin_cos();
            self.direct_v * turn.cos - self.quarter_v * turn.sin - first_v
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PERIOD_S: f32 = 1e-4;

    fn link_v(amplitude_v: f32, hz: f32, time_s: f32) -> f32 {
        let turns = hz * time_s;
        1_500.0 + amplitude_v * Angle::from_turns(turns - (turns as i32) as f32).sin_cos().sin
    }

    /// Over half a second, with a sample every one or two periods, in the last tenth: the largest error of the change over 1.25 ms, and the largest such
    /// change, in V.
    fn errors_v(amplitude_v: f32, hz: f32) -> (f32, f32) {
        let mut ripple = LinkRipple::at(1_500.0);
        let (mut time_s, mut error_v, mut change_v) = (0.0_f32, 0.0_f32, 0.0_f32);
        for sample in 0..3_300 {
            let passed_s = if sample % 2 == 0 { PERIOD_S } else { 2.0 * PERIOD_S };
            time_s += passed_s;
            ripple.step(link_v(amplitude_v, hz, time_s), passed_s);
            if time_s > 0.4 {
                let [expected_v] = ripple.change(0.0, [1.25e-3]);
                let true_v = link_v(amplitude_v, hz, time_s + 1.25e-3) - link_v(amplitude_v, hz, time_s);
                error_v = f32::max(error_v, (expected_v - true_v).abs());
                change_v = f32::max(change_v, true_v.abs());
            }
        }
        (error_v, change_v)
    }

    #[test]
    fn ripple_of_any_line_is_expected() {
        for (amplitude_v, hz) in [(100.0, 33.0), (100.0, 50.0), (100.0, 100.0), (30.0, 300.0), (30.0, 600.0)]
        {
            let (error_v, change_v) = errors_v(amplitude_v, hz);
            assert!(error_v < 0.03 * amplitude_v, "{hz} Hz: {error_v} V of {change_v} V");
            assert!(change_v > 0.2 * amplitude_v, "{hz} Hz: {change_v} V");
        }
    }

    #[test]
    fn a_link_that_stands_still_is_expected_to_stay_to_the_bit() {
        let mut ripple = LinkRipple::at(0.0);
        for _ in 0..10_000 {
            ripple.step(1_512.3, PERIOD_S);
            assert_eq!(ripple.change(PERIOD_S, [0.6e-3, 1.25e-3]), [0.0, 0.0]);
        }
    }

    #[test]
    fn a_step_is_taken_for_little_ripple_and_not_for_long() {
        let mut ripple = LinkRipple::at(1_500.0);
        let mut largest_v = [0.0_f32; 2];
        for sample in 0..2_000 {
            ripple.step(1_650.0, PERIOD_S);
            let [expected_v] = ripple.change(0.0, [1.25e-3]);
            let later = &mut largest_v[usize::from(sample > 1_000)];
            *later = f32::max(*later, expected_v.abs());
        }
        assert!(largest_v[0] < 20.0 && largest_v[1] < 1.5, "{largest_v:?} V of 150 V");
    }

    #[test]
    fn what_is_no_number_does_not_stay() {
        let mut ripple = LinkRipple::at(1_500.0);
        for udc_v in [f32::NAN, f32::INFINITY, 0.0, 1_500.0] {
            ripple.step(udc_v, PERIOD_S);
        }
        assert_eq!(ripple.change(0.0, [1e-3]), [0.0]);
    }

    #[test]
    fn a_quarter_off_all_begins_anew() {
        for (udc_v, anew) in [(1_250.0, true), (750.0, true), (1_249.0, false), (751.0, false)] {
            let mut ripple = LinkRipple::at(1_000.0);
            ripple.step(udc_v, PERIOD_S);
            assert_eq!(ripple.mean_v == udc_v, anew, "{udc_v} V");
            assert_eq!(ripple.change(0.0, [1e-3]) == [0.0], anew, "{udc_v} V");
        }
    }
}
