//! A speed and where it will be when a torque that is taken back now is gone.

use super::MotorLimits;
use crate::frames::limit;
use crate::machine::Ratings;

/// Time constant of the mean from which the acceleration is taken, in s: a ramp is ahead of it by its acceleration times this time.
const SMOOTH_S: f32 = 0.05;
/// Delay from a speed to the torque that follows from it, in s: two slots, and a carrier half.
const FOLLOWS_S: f32 = 3e-3;
/// Share of the speed limit, below that limit, over which torque that raises the speed fades.
const SPEED_SPAN: f32 = 0.05;

/// A mechanical speed's mean, in rad/s; not a number while it is not known.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ahead(f32);

impl Ahead {
    pub(super) const UNKNOWN: Self = Self(f32::NAN);

    /// One slot.
    pub(super) fn step(&mut self, speed: f32, slot_s: f32) {
        let Self(mean) = self;
        *mean = if mean.is_nan() { speed } else { *mean + slot_s / (slot_s + SMOOTH_S) * (speed - *mean) };
    }

    /// The speed so many seconds, and the delay to the torque, after the slot.
    pub(super) fn speed(self, speed: f32, ahead_s: f32) -> f32 {
        speed + (FOLLOWS_S + ahead_s) / SMOOTH_S * (speed - self.0)
    }

    /// The share of motoring torque that a speed limit leaves: none at the limit, and little enough before it that this torque, in N·m, is gone by then,
    /// as fast as the drive takes it back.
    pub(super) fn left_share(
        self,
        speed: f32,
        torque_nm: f32,
        limits: &MotorLimits,
        ratings: &Ratings,
    ) -> f32 {
        let gone_s = 0.5 * torque_nm.abs() / ratings.torque_slew_nm_s;
        let later = self.speed(speed, gone_s) * 1_f32.copysign(speed);
        let fastest = if later > speed.abs() { later } else { speed.abs() };
        limit((limits.speed_rad_s - fastest) / (SPEED_SPAN * limits.speed_rad_s), 0.0, 1.0)
    }
}

/// A torque within its limits at a mechanical speed, in N·m, if such a share of motoring is left. At rest it is motoring in either direction.
pub(super) fn limited_nm(
    torque_nm: f32,
    speed: f32,
    share: f32,
    limits: &MotorLimits,
    ratings: &Ratings,
) -> f32 {
    let motoring_nm = share * limits.motoring_nm;
    let stands = speed.abs() < ratings.standing_rad_s() && limits.braking_nm < motoring_nm;
    let braking_nm = if stands { motoring_nm } else { limits.braking_nm };
    if speed < 0.0 {
        limit(torque_nm, -motoring_nm, braking_nm)
    } else {
        limit(torque_nm, -braking_nm, motoring_nm)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::built_in::traction::BUILT_IN;

    const RATINGS: Ratings = Ratings { torque_slew_nm_s: 10_000.0, ..BUILT_IN.ratings };
    const LIMITS: MotorLimits = MotorLimits { motoring_nm: 600.0, braking_nm: 400.0, speed_rad_s: 100.0 };

    /// After half a second of an even rise the speed is as far ahead of its mean as it gains in 50 ms.
    #[test]
    fn a_speed_that_rises_evenly_is_looked_ahead_of() {
        let mut ahead = Ahead::UNKNOWN;
        for slot in 0..1_000 {
            ahead.step(0.15 * slot as f32, 1e-3);
            if slot == 0 {
                assert_eq!(ahead.speed(0.0, 1.0), 0.0, "nothing is known of a rise");
            }
        }
        let speed = 0.15 * 999.0;
        for (ahead_s, gained) in [(0.0, 0.45), (0.01, 1.95)] {
            assert!((ahead.speed(speed, ahead_s) - speed - gained).abs() < 2e-2 * gained);
        }
    }

    /// Linear over the last twentieth; earlier if the speed rises and the torque takes time to go; never later.
    #[test]
    fn motoring_fades_before_the_speed_limit() {
        let steady = |speed: f32| Ahead(speed);
        for (speed, left) in [(0.0, 1.0), (95.0, 1.0), (97.5, 0.5), (100.0, 0.0), (120.0, 0.0)] {
            for speed in [speed, -speed] {
                let found = steady(speed).left_share(speed, 500.0, &LIMITS, &RATINGS);
                assert!((found - left).abs() < 1e-5, "{speed}: {found}");
            }
        }
        // 500 N·m are gone in 50 ms, in whose mean the speed gains 25 + 3 ms of 100 rad/s².
        for sign in [1.0, -1.0] {
            let (speed, mean) = (sign * 94.0, sign * (94.0 - 5.0));
            let left = Ahead(mean).left_share(speed, 500.0, &LIMITS, &RATINGS);
            assert!((left - (100.0 - 94.0 - 2.8) / 5.0).abs() < 1e-3, "{left}");
            let falls = Ahead(sign * 99.0).left_share(sign * 98.0, 500.0, &LIMITS, &RATINGS);
            assert!((falls - 0.4).abs() < 1e-3, "a speed that falls leaves what it leaves: {falls}");
        }
    }

    #[test]
    fn a_rotor_at_rest_starts_either_way_as_a_motor() {
        let standing = RATINGS.standing_rad_s();
        for (torque_nm, share, wanted_nm) in [
            (900.0, 0.9, 600.0),
            (-900.0, 0.9, -600.0),
            (-900.0, 1.0, -400.0),
            (-900.0, 1.1, -400.0),
            (900.0, -0.9, 600.0),
            (900.0, -1.1, 400.0),
            (-900.0, -1.1, -600.0),
        ] {
            let found_nm = limited_nm(torque_nm, share * standing, 1.0, &LIMITS, &RATINGS);
            assert_eq!(found_nm, wanted_nm, "{torque_nm} {share}");
        }
        let brakes = MotorLimits { motoring_nm: 100.0, ..LIMITS };
        assert_eq!(limited_nm(-900.0, 0.9 * standing, 1.0, &brakes, &RATINGS), -400.0, "braking may be more");
        assert_eq!(limited_nm(900.0, 0.9 * standing, 1.0, &brakes, &RATINGS), 100.0);
    }
}
