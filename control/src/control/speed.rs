//! Speed from the angle: a second-order tracking loop.

use crate::frames::{Angle, sqrt};

/// Natural frequency of the loop unless another is wanted, in rad/s; critically damped.
const NATURAL_RAD_S: f32 = 500.0;
/// Wanted lag at the machine's largest acceleration, in rad; and the largest natural frequency, over the sampling rate.
const LAG_RAD: f32 = 0.0125;
const SAMPLED: f32 = 0.25;
/// Control periods before the estimate is used.
const SETTLING_STEPS: u32 = 200;

/// The speed and the angle that is followed, and how well.
#[derive(Clone, Copy, Debug)]
pub struct SpeedTracker {
    angle: Angle,
    omega: f32,
    /// Lead of the newest angle over the expected one, in rad.
    ahead_rad: f32,
    /// Number of followed angles, counted until the loop has settled.
    steps: u32,
    natural_rad_s: f32,
    /// `true` if an angle was not followed.
    lost: bool,
}

impl SpeedTracker {
    /// A tracker that has seen no angle.
    pub const fn new() -> Self {
        Self::with_natural(NATURAL_RAD_S)
    }

    /// A tracker with another natural frequency, in rad/s; well below the sampling rate.
    pub const fn with_natural(natural_rad_s: f32) -> Self {
        Self { angle: Angle::ZERO, omega: 0.0, ahead_rad: 0.0, steps: 0, natural_rad_s, lost: false }
    }

    /// Adapts the loop to a rotor with this largest acceleration, in rad/s²: no slower than before.
    pub fn quicken(&mut self, acceleration_rad_s2: f32, period_s: f32) {
        let (wanted, most) = (sqrt(acceleration_rad_s2 * (1.0 / LAG_RAD)), SAMPLED / period_s);
        let natural = if wanted < most { wanted } else { most };
        if natural > self.natural_rad_s {
            self.natural_rad_s = natural;
        }
    }

    /// Largest acceleration, in rad/s², that the loop can follow with this lag, in rad, at this sampling period.
    pub const fn most_acceleration_rad_s2(lag_rad: f32, period_s: f32) -> f32 {
        let most = SAMPLED / period_s;
        lag_rad * most * most
    }

    /// The angle that the next sample should show.
    pub fn predicted(&self, period_s: f32) -> Angle {
        self.angle + Angle::within_half_turn(self.omega * period_s)
    }

    /// Takes the angle measured now; returns the electrical angular speed in rad/s.
    pub fn step(&mut self, measured: Angle, period_s: f32) -> f32 {
        self.follow(measured, measured - self.predicted(period_s), period_s)
    }

    /// The same if the angle's difference from the predicted one is already known.
    #[inline(always)]
    pub fn follow(&mut self, measured: Angle, innovation: Angle, period_s: f32) -> f32 {
        if self.steps < SETTLING_STEPS {
            self.steps += 1;
            if self.steps == 1 {
                self.angle = measured;
                return self.omega;
            }
            if self.steps == 2 {
                // The second sample gives the first idea of the speed, so that a turning machine is caught at once.
                self.omega = (measured - self.angle).signed_radians() / period_s;
                self.angle = measured;
                return self.omega;
            }
        }
        let error = innovation.signed_radians();
        self.ahead_rad = error;
        self.omega += self.natural_rad_s * self.natural_rad_s * period_s * error;
        self.angle =
            measured - innovation + Angle::within_half_turn(2.0 * self.natural_rad_s * period_s * error);
        self.omega
    }

    /// Notes that an angle was not followed.
    pub fn lose(&mut self) {
        self.lost = true;
    }

    /// Starts anew if an angle was lost. Until then the last speed stays.
    pub fn recover(&mut self) {
        if self.lost {
            (self.steps, self.lost) = (0, false);
        }
    }

    /// `true` once an angle has been followed.
    pub fn is_following(&self) -> bool {
        self.steps > 0
    }

    /// Electrical angular speed, in rad/s.
    pub fn omega(&self) -> f32 {
        self.omega
    }

    /// Electrical angular speed of a rotor that accelerates or brakes steadily, in rad/s: its [estimate](Self::omega) lags.
    pub fn leading(&self) -> f32 {
        self.omega + 2.0 * self.natural_rad_s * self.ahead_rad
    }

    /// The followed angle at the newest sample.
    pub fn angle(&self) -> Angle {
        self.angle
    }

    /// Natural frequency of the loop, in rad/s.
    pub fn natural_rad_s(&self) -> f32 {
        self.natural_rad_s
    }

    /// `true` once enough angles have been followed for the speed to be used.
    pub fn is_settled(&self) -> bool {
        self.steps >= SETTLING_STEPS
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A rotor whose speed changes by 1,000 rad/s in a second: the estimate is 4 rad/s behind, and that is known.
    #[test]
    fn a_speed_that_changes_steadily_leads_the_estimate() {
        for acceleration in [1_000.0, -1_000.0_f32] {
            let (period_s, mut tracker, mut angle, mut omega) = (1e-4, SpeedTracker::new(), Angle::ZERO, 0.0);
            for _ in 0..2_000 {
                tracker.step(angle, period_s);
                angle = angle + Angle::within_half_turn((omega + 0.5 * acceleration * period_s) * period_s);
                omega += acceleration * period_s;
            }
            let speed = omega - acceleration * period_s;
            let [behind, left] =
                [tracker.omega(), tracker.leading()].map(|seen| (speed - seen) / acceleration);
            assert!((behind - 4e-3).abs() < 1e-4 && left.abs() < 1e-4, "{behind} {left}");
        }
    }

    /// Rotors from a heavy one to the lightest that a loop of 10 kHz follows: the angle is behind by as much as is wanted, at most by four times that.
    #[test]
    fn a_light_rotor_is_followed_more_quickly() {
        let period_s = 1e-4;
        for (acceleration, lag_rad) in [(2_500.0, 0.01), (25e3, LAG_RAD), (250e3, 0.04)] {
            let (mut tracker, mut angle, mut omega) = (SpeedTracker::new(), Angle::ZERO, 0.0_f32);
            tracker.quicken(acceleration, period_s);
            let mut ahead_rad = 0.0;
            for _ in 0..400 {
                ahead_rad = (angle - tracker.predicted(period_s)).signed_radians();
                tracker.step(angle, period_s);
                angle = angle + Angle::within_half_turn((omega + 0.5 * acceleration * period_s) * period_s);
                omega += acceleration * period_s;
            }
            assert!((ahead_rad / lag_rad - 1.0).abs() < 0.05, "{acceleration}: {ahead_rad}");
            let most = SpeedTracker::most_acceleration_rad_s2(lag_rad, period_s);
            assert!(acceleration < 1.001 * most, "{acceleration} {most}");
        }
    }
}
