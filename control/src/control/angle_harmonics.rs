//! Errors of a position sensor that repeat once and twice with the electrical angle, as a resolver's do: learnt from what the speed tracker leaves of them,
//! and removed.
//!
//! A rotor with little torque ripple for its inertia turns evenly, so an error that repeats once or twice with its angle is the sensor's. The tracker, whose
//! natural frequency is ω₀, follows a part of an error that turns with ω: the remainder E is that of an error D = E (1 − (ω₀/ω)² − 2j ω₀/ω). Over some whole
//! turns of even speed E is the mean of the remainder times 2 e^(−jkθ), and half of D is added to what is known: the error goes away in some of these times
//! whatever noise, lag and acceleration are, and nothing is fed back faster than it was measured.
//!
//! A constant error, the sensor's [zero](AngleZero), leaves nothing to the tracker; it is found on demand.

use super::angle_zero::{AngleZero, WithoutTorque};
use super::speed::SpeedTracker;
use crate::frames::{Angle, SinCos, limit_magnitude};

/// Turns over which the error is measured, as a number of bits: four.
const TURNS_BITS: u32 = 2;
/// Speed from which an error is learnt, over the tracker's natural frequency: below it the tracker follows most of the error.
const FROM: f32 = 0.4;
/// Change of the speed over these turns up to which it counts as even, as a share, and the most by which it may differ from the change over the turns before:
/// a speed that rises evenly leaves nothing that repeats. At 250 r/min a second it is even from 500 r/min on; from 870 r/min on, with a fiftieth for both, 3° of
/// once the angle made the modes hunt in a sweep.
const EVEN: f32 = 0.06;
const STEADY: f32 = 0.02;
/// Share of a measured error that is added to the known one.
const GAIN: f32 = 0.5;
/// Known error that is left alone, as the root of the sum of squares, in rad: 0.1°, which an encoder's counts may look like. It is half of the error,
/// because half is added first.
const LEFT_ALONE_RAD: f32 = 1.745e-3;
/// Largest step of the known value of a part, in rad: less than what counts as a lost angle.
const MOST_STEP_RAD: f32 = 0.02;
/// Largest error that is removed, of each part, in rad.
const MOST_RAD: f32 = 0.1;

/// Amplitudes of the cosine and the sine of a multiple of the angle, in rad.
#[derive(Clone, Copy, Debug)]
struct Part {
    cos: f32,
    sin: f32,
}

impl Part {
    const NONE: Self = Self { cos: 0.0, sin: 0.0 };

    /// The error in a direction, in rad.
    #[inline(always)]
    fn at(self, direction: SinCos) -> f32 {
        self.cos * direction.cos + self.sin * direction.sin
    }

    /// One more sample of the remainder, in rad.
    #[inline(always)]
    fn add(&mut self, left_rad: f32, direction: SinCos) {
        self.cos += left_rad * direction.cos;
        self.sin += left_rad * direction.sin;
    }

    /// The same part seen from an earlier angle, by so many times the angle between them.
    fn turned_back(self, by: SinCos) -> Self {
        Self { cos: self.cos * by.cos + self.sin * by.sin, sin: self.sin * by.cos - self.cos * by.sin }
    }

    /// Learns from the means of the remainder times cosine and sine, half of each, with the tracker's natural frequency `ratio` times that of this part.
    fn learn(&mut self, mean: Self, ratio: f32) {
        let (real, imaginary) = (1.0 - ratio * ratio, 2.0 * ratio);
        let gain = 2.0 * GAIN;
        let step = |change: f32| limit_magnitude(gain * change, MOST_STEP_RAD);
        let cos = self.cos + step(real * mean.cos - imaginary * mean.sin);
        let sin = self.sin + step(real * mean.sin + imaginary * mean.cos);
        *self = Self { cos: limit_magnitude(cos, MOST_RAD), sin: limit_magnitude(sin, MOST_RAD) };
    }
}

/// The known errors of once and twice the angle, and their measurement in progress.
#[derive(Clone, Copy, Debug)]
pub struct AngleHarmonics {
    /// Lead of the observed angles over the sensor's, in s.
    ahead_s: f32,
    known: [Part; 2],
    /// Sums of the remainder times cosine and sine, and their number of samples.
    sums: [Part; 2],
    samples: u32,
    /// Way of the angle since these began: a turn is 2³² over the turns of a measurement.
    way: u32,
    last: Angle,
    /// Electrical speed at their beginning, in rad/s; 0 if that was no valid beginning; and its change over the turns before.
    omega: f32,
    change: f32,
    /// `true` if the known errors are worth removing.
    used: bool,
    /// `true` once these or the zero have been.
    corrects: bool,
    /// The constant error, removed first.
    zero: AngleZero,
}

impl AngleHarmonics {
    /// Nothing known, for a sensor whose angles are brought forward by this time before they are observed, in s.
    pub const fn new(ahead_s: f32) -> Self {
        const NONE: [Part; 2] = [Part::NONE; 2];
        Self {
            ahead_s,
            known: NONE,
            sums: NONE,
            samples: 0,
            way: 0,
            last: Angle::ZERO,
            omega: 0.0,
            change: 0.0,
            used: false,
            corrects: false,
            zero: AngleZero::NONE,
        }
    }

    /// The angle that is added to the sensor's as its zero.
    pub fn zero(&self) -> Angle {
        self.zero.angle()
    }

    /// Learns the zero: [`AngleZero::learn`].
    pub fn learn_zero(&mut self, rest: &WithoutTorque) -> bool {
        self.corrects = true;
        self.zero.learn(rest)
    }

    /// A measured angle without the known errors.
    #[inline(always)]
    pub fn corrected(&self, measured: Angle) -> Angle {
        if self.corrects { self.without(measured) } else { measured }
    }

    #[inline(never)]
    fn without(&self, measured: Angle) -> Angle {
        let measured = measured + self.zero.angle();
        if !self.used {
            return measured;
        }
        let there = measured.sin_cos();
        let error_rad = self.error_rad(there);
        // The errors depend on the true angle, which the first look approximates.
        let back = SinCos { sin: -error_rad, cos: 1.0 - 0.5 * error_rad * error_rad };
        measured - Angle::within_half_turn(self.error_rad(there.turned(back)))
    }

    /// The known error in a direction, in rad.
    #[inline(always)]
    fn error_rad(&self, once: SinCos) -> f32 {
        let [first, second] = self.known;
        first.at(once) + second.at(once.turned(once))
    }

    /// `true` if the speed is not far below that from which errors are learnt: the errors move the tracker's speed, too.
    #[inline(always)]
    pub fn can_observe(tracker: &SpeedTracker) -> bool {
        tracker.omega().abs() > 0.5 * FROM * tracker.natural_rad_s()
    }

    /// Learns nothing for a while: sums that begin anew are no measurement before the next whole turns.
    #[inline(always)]
    pub fn pause(&mut self) {
        self.omega = 0.0;
    }

    /// Takes a control period: the corrected angle, brought forward, its direction, and its difference from what the tracker expected, in rad. Periods may be
    /// left out for a half turn of the angle at most.
    #[inline(never)]
    pub fn observe(&mut self, angle: Angle, direction: SinCos, left_rad: f32, tracker: &SpeedTracker) {
        let [once, twice] = &mut self.sums;
        once.add(left_rad, direction);
        twice.add(left_rad, direction.turned(direction));
        self.samples = self.samples.saturating_add(1);
        let moved = (angle - self.last).signed().unsigned_abs() >> TURNS_BITS;
        self.last = angle;
        let (way, whole) = self.way.overflowing_add(moved);
        self.way = way;
        if whole {
            self.end(tracker);
        }
    }

    /// Both parts as functions of the sensor's own angles.
    #[inline(always)]
    fn sensed(&self, once: Part, twice: Part, omega: f32) -> (Part, Part) {
        if self.ahead_s == 0.0 {
            return (once, twice);
        }
        let ahead = Angle::within_half_turn(omega * self.ahead_s).sin_cos();
        (once.turned_back(ahead), twice.turned_back(ahead.turned(ahead)))
    }

    /// Ends a measurement: the turns are whole.
    #[cold]
    #[inline(never)]
    fn end(&mut self, tracker: &SpeedTracker) {
        let (omega, natural) = (tracker.omega(), tracker.natural_rad_s());
        let change = omega - self.omega;
        let is_steady = (change - self.change).abs() < STEADY * omega.abs();
        let even = is_steady && change.abs() < EVEN * omega.abs();
        self.change = if self.omega == 0.0 { 0.0 } else { change };
        let samples = self.samples;
        let per_sample = 1.0 / samples as f32;
        let [once, twice] =
            self.sums.map(|sum| Part { cos: sum.cos * per_sample, sin: sum.sin * per_sample });
        (self.omega, self.samples, self.sums) = (omega, 0, [Part::NONE; 2]);
        if even && omega.abs() > FROM * natural {
            let (once, twice) = self.sensed(once, twice, omega);
            let ratio = natural / omega;
            // An error that is not removed is all in the remainder.
            if !self.used {
                self.known = [Part::NONE; 2];
            }
            let [first, second] = &mut self.known;
            first.learn(once, ratio);
            second.learn(twice, 0.5 * ratio);
            let squares = self.known.map(|part| part.cos * part.cos + part.sin * part.sin);
            self.used = squares[0] + squares[1] > LEFT_ALONE_RAD * LEFT_ALONE_RAD;
            self.corrects |= self.used;
        }
    }
}

#[cfg(test)]
mod tests {
    extern crate std;

    use super::*;
    use crate::frames::Dq;
    use std::vec::Vec;

    const PERIOD_S: f32 = 1e-4;
    const AHEAD_S: f32 = 5e-4;
    const ERROR_RAD: [(f32, f32); 2] = [(0.052, 0.7), (0.017, -2.0)];

    /// Errors of the corrected angle in rad over the last tenth of so many seconds, at an electrical speed that changes by so many rad/s²; observed
    /// once in 30°, as with the carrier halves of the fewest pulses.
    fn left(omega: f64, slope: f64, seconds: f64, errors: [(f32, f32); 2]) -> Vec<f32> {
        let (mut harmonics, mut tracker) = (AngleHarmonics::new(AHEAD_S), SpeedTracker::new());
        let periods = (seconds / f64::from(PERIOD_S)) as u32;
        let (mut found, mut sector) = (Vec::new(), 0);
        for period in 0..periods {
            let t_s = f64::from(period) * f64::from(PERIOD_S);
            let turns = (omega + 0.5 * slope * t_s) * t_s / core::f64::consts::TAU;
            let truth = Angle((turns.rem_euclid(1.0) * 4_294_967_296.0) as u64 as u32);
            let of = |(order, (rad, phase)): (f32, (f32, f32))| {
                rad * (order * truth.turns() * core::f32::consts::TAU + phase).sin()
            };
            let error_rad: f32 = [1.0, 2.0].into_iter().zip(errors).map(of).sum();
            let angle = harmonics.corrected(truth + Angle::within_half_turn(error_rad));
            let left_rad = (angle - tracker.predicted(PERIOD_S)).signed_radians();
            tracker.step(angle, PERIOD_S);
            let (before, now) = (sector, (u64::from(truth.0) * 12) >> 32);
            sector = now;
            if !AngleHarmonics::can_observe(&tracker) {
                harmonics.pause();
            } else if now != before {
                let ahead = angle + Angle::within_half_turn(tracker.omega() * AHEAD_S);
                harmonics.observe(ahead, ahead.sin_cos(), left_rad, &tracker);
            }
            if period > periods - periods / 10 {
                found.push((angle - truth).signed_radians());
            }
        }
        found
    }

    fn worst(errors: &[f32]) -> f32 {
        errors.iter().fold(0.0, |worst, error| if error.abs() > worst { error.abs() } else { worst })
    }

    #[test]
    fn both_errors_go_at_every_speed_where_they_are_learnt() {
        for omega in [210.0, 400.0, 838.0, 1_257.0, 2_513.0, -300.0, -1_257.0] {
            let seconds = 0.05 + 20.0 * 4.0 * core::f64::consts::TAU / f64::abs(omega);
            let left_rad = worst(&left(omega, 0.0, seconds, ERROR_RAD));
            assert!(left_rad < 1e-3, "{left_rad} rad are left at {omega} rad/s");
        }
    }

    #[test]
    fn a_sensor_without_errors_is_left_alone() {
        for (omega, slope) in
            [(1_257.0, 0.0), (300.0, 100.0), (300.0, 2_000.0), (2_513.0, -1_000.0), (20.0, 0.0)]
        {
            let left_rad = worst(&left(omega, slope, 2.0, [(0.0, 0.0); 2]));
            assert!(left_rad < 1e-6, "{left_rad} rad at {omega} rad/s, {slope} rad/s²");
        }
    }

    #[test]
    fn nothing_is_learnt_where_the_tracker_follows() {
        let left_rad = worst(&left(100.0, 0.0, 3.0, ERROR_RAD));
        assert!(left_rad > 0.04, "{left_rad} rad");
    }

    #[test]
    fn nothing_grows_beyond_what_a_sensor_may_be_off() {
        let left_rad = worst(&left(1_257.0, 0.0, 3.0, [(0.3, 0.0), (0.0, 0.0)]));
        assert!(left_rad < 0.35, "{left_rad} rad");
    }

    /// A tracker that has seen two angles half a radian apart in this time: its speed is theirs.
    fn tracker(period_s: f32, natural_rad_s: f32) -> SpeedTracker {
        let mut tracker = SpeedTracker::with_natural(natural_rad_s);
        for rad in [0.0, 0.5] {
            tracker.step(Angle::within_half_turn(rad), period_s);
        }
        tracker
    }

    /// Four turns of 16 samples with an error of the second part alone, or of the first.
    fn four_turns(harmonics: &mut AngleHarmonics, tracker: &SpeedTracker, second: bool) {
        for sample in 1..=64_u32 {
            let angle = Angle(sample.wrapping_mul(1 << 28));
            let direction = angle.sin_cos();
            let of = if second { direction.turned(direction) } else { direction };
            harmonics.observe(angle, direction, 0.01 * of.cos, tracker);
        }
    }

    #[test]
    fn what_is_measured_across_a_pause_is_not_learnt() {
        let tracker = tracker(0.5e-3, 500.0);
        for second in [false, true] {
            let (mut harmonics, mut paused) = (AngleHarmonics::new(0.0), AngleHarmonics::new(0.0));
            for harmonics in [&mut harmonics, &mut paused] {
                four_turns(harmonics, &tracker, second);
                assert!(!harmonics.used, "it was no beginning");
            }
            paused.pause();
            for harmonics in [&mut harmonics, &mut paused] {
                four_turns(harmonics, &tracker, second);
            }
            assert_eq!((harmonics.used, paused.used), (true, false), "{second}");
            four_turns(&mut paused, &tracker, second);
            assert!(paused.used, "the next whole turns count");
        }
    }

    #[test]
    fn below_its_share_of_the_trackers_frequency_nothing_is_learnt() {
        // 1,000 rad/s: above 0.4 of 2,000, and below 0.4 of 3,000, in rad/s. There it is.
        let omega = tracker(0.5e-3, 0.0).omega();
        let border = (0..1 << 23).map(|bits| f32::from_bits(2_048_f32.to_bits() + bits));
        let border = border.into_iter().find(|natural| FROM * natural == omega).unwrap();
        for (natural_rad_s, learns) in [(2_000.0, true), (border, false), (3_000.0, false)] {
            let (tracker, mut harmonics) = (tracker(0.5e-3, natural_rad_s), AngleHarmonics::new(0.0));
            four_turns(&mut harmonics, &tracker, false);
            four_turns(&mut harmonics, &tracker, false);
            assert_eq!(harmonics.used, learns, "{natural_rad_s} rad/s");
        }
        assert!(!AngleHarmonics::can_observe(&SpeedTracker::with_natural(0.0)), "at rest");
    }

    /// The zero is added with harmonics and without, and stays when they are forgotten.
    #[test]
    fn a_zero_is_added_to_every_angle() {
        let unexplained_v = Dq { d: 100.0, q: 0.0 };
        let rest =
            WithoutTorque { unexplained_v, omega: 500.0, max_omega: 1e3, magnets_wb: 1.0, length_s: 0.1 };
        let tracker = tracker(0.5e-3, 500.0);
        for with_harmonics in [false, true] {
            let mut harmonics = AngleHarmonics::new(0.0);
            assert!(harmonics.learn_zero(&rest));
            let zero_rad = harmonics.zero().signed_radians();
            assert!((zero_rad - 0.08).abs() < 1e-6, "{zero_rad}");
            if with_harmonics {
                four_turns(&mut harmonics, &tracker, false);
                four_turns(&mut harmonics, &tracker, false);
            }
            assert_eq!(harmonics.used, with_harmonics);
            let sensed = Angle::DEG_90 - harmonics.zero();
            let without = AngleHarmonics { zero: AngleZero::NONE, ..harmonics };
            assert_eq!(harmonics.corrected(sensed), without.corrected(Angle::DEG_90));
            harmonics.known = [Part::NONE; 2];
            (harmonics.omega, harmonics.samples, harmonics.sums) = (tracker.omega(), 1, [Part::NONE; 2]);
            harmonics.end(&tracker);
            assert!(!harmonics.used);
            assert_eq!(harmonics.corrected(Angle::ZERO), harmonics.zero());
        }
    }

    #[test]
    fn an_error_as_large_as_what_is_left_alone_is_left_alone() {
        for (cos, used) in [(LEFT_ALONE_RAD, false), (1.001 * LEFT_ALONE_RAD, true)] {
            let tracker = tracker(0.5e-3, 500.0);
            let part = Part { cos, sin: 0.0 };
            let mut harmonics = AngleHarmonics {
                known: [part, Part::NONE],
                used: true,
                corrects: true,
                ..AngleHarmonics::new(0.0)
            };
            (harmonics.omega, harmonics.samples) = (tracker.omega(), 1);
            harmonics.end(&tracker);
            assert_eq!(harmonics.used, used, "{cos} rad");
        }
    }

    #[test]
    fn a_speed_that_changed_by_more_is_not_even() {
        // Where the change is the border itself, as it is computed.
        let periods = (0..4_000_u32).map(|bits| f32::from_bits(0.5e-3_f32.to_bits() + bits));
        let found = periods.into_iter().find_map(|period_s| {
            let after = tracker(period_s, 500.0).omega();
            let before = after - EVEN * after;
            (after - before == EVEN * after).then_some((period_s, before))
        });
        let (period_s, before) = found.unwrap();
        for (omega, even) in [(before, false), (0.5 * (before + tracker(period_s, 500.0).omega()), true)] {
            let mut harmonics = AngleHarmonics::new(0.0);
            (harmonics.omega, harmonics.samples) = (omega, 1);
            harmonics.change = tracker(period_s, 500.0).omega() - omega;
            harmonics.sums[0].cos = 0.01;
            harmonics.end(&tracker(period_s, 500.0));
            assert_eq!(harmonics.used, even, "from {omega} rad/s");
        }
    }

    /// 1,000 rad/s, after a rise by 5 %: as much before is even, and so is a little less or more; a speed that stood, and one that began anew, are not.
    #[test]
    fn a_speed_that_rises_as_before_is_even() {
        let now = tracker(0.5e-3, 500.0);
        let omega = 0.95 * now.omega();
        for (change, even) in
            [(50.0, true), (32.0, true), (68.0, true), (28.0, false), (72.0, false), (0.0, false)]
        {
            let mut harmonics = AngleHarmonics::new(0.0);
            (harmonics.omega, harmonics.samples, harmonics.change) = (omega, 1, change);
            harmonics.sums[0].cos = 0.01;
            harmonics.end(&now);
            assert_eq!((harmonics.used, harmonics.change), (even, now.omega() - omega), "{change} rad/s");
        }
        let mut harmonics = AngleHarmonics { change: 50.0, ..AngleHarmonics::new(0.0) };
        harmonics.samples = 1;
        harmonics.end(&now);
        assert_eq!((harmonics.change, harmonics.used), (0.0, false));
    }
}
