//! Slip and slide: a rotor that accelerates faster than a train can has lost its rail.
//!
//! A reference follows the rotor's speed along the torque, motoring upward, braking downward, at most at the acceleration limit. What the rotor is
//! ahead of it is slip. The torque's share falls at once in proportion to the slip, and further while it lasts; with grip it comes back along a
//! straight line.

use super::Settings;
use crate::frames::limit;

/// Slip that is left alone, and slip beyond it that takes all torque away, as shares of the largest speed.
const FREE: f32 = 0.005;
const SPAN: f32 = 0.02;
/// Time in which slip of the whole span takes all torque away for good, and in which it comes back, in s.
const LOSE_S: f32 = 0.3;
const RESTORE_S: f32 = 1.0;

/// The grip on the rail.
#[derive(Clone, Copy, Debug)]
pub(super) struct Grip {
    /// Direction of the torque.
    along: f32,
    /// The reference, along the torque, mechanical, in rad/s.
    reference: f32,
    /// Share of the torque that comes back slowly.
    held: f32,
    /// Share of the torque.
    share: f32,
}

impl Grip {
    pub(super) const FULL: Self = Self { along: 0.0, reference: 0.0, held: 1.0, share: 1.0 };

    /// Share of the demand that the rail bears.
    pub(super) const fn share(&self) -> f32 {
        self.share
    }

    /// One slot at a torque demand, in N·m, and a mechanical speed, in rad/s.
    #[inline(never)]
    pub(super) fn step(&mut self, torque_nm: f32, speed: f32, settings: &Settings) {
        let Settings { ratings, slot_s, train, .. } = *settings;
        let along = if torque_nm == 0.0 { 0.0 } else { 1.0_f32.copysign(torque_nm) };
        let (now, most) = (along * speed, self.reference + train.acceleration_rad_s2 * slot_s);
        self.reference = if along != self.along || now < most { now } else { most };
        self.along = along;
        let slip = now - self.reference - FREE * ratings.max_speed_rad_s;
        let lost = if slip > 0.0 { slip / (SPAN * ratings.max_speed_rad_s) } else { 0.0 };
        let change = if lost > 0.0 { -lost * slot_s / LOSE_S } else { slot_s / RESTORE_S };
        self.held = limit(self.held + change, 0.0, 1.0);
        self.share = limit(self.held - lost, 0.0, 1.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::built_in::traction::BUILT_IN;
    use crate::operator::TrainLimits;

    fn settings() -> Settings<'static> {
        let train = TrainLimits { acceleration_rad_s2: 20.0, ..TrainLimits::NONE };
        Settings { train, ..Settings::rated(&BUILT_IN.ratings, 1e-3, None) }
    }

    /// Motoring forward and backward, braking forward and backward: torque and speed's directions.
    const WAYS: [(f32, f32); 4] = [(1.0, 1.0), (-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0)];

    #[test]
    fn a_train_on_its_rails_has_all_of_its_torque() {
        for (torque, speed) in WAYS {
            let mut grip = Grip::FULL;
            for slot in 0..3_000 {
                grip.step(torque * 800.0, speed * 200.0 + torque * 19.0e-3 * slot as f32, &settings());
                assert_eq!(grip.share(), 1.0);
            }
        }
    }

    #[test]
    fn a_wheel_that_slips_loses_its_torque_and_gets_it_back_along_a_line() {
        for (torque, speed) in WAYS {
            let (mut grip, mut now, mut least) = (Grip::FULL, speed * 200.0, 1.0_f32);
            for _ in 0..200 {
                // 200 rad/s², as without any rail.
                now += torque * 0.2;
                grip.step(torque * 800.0, now, &settings());
                least = least.min(grip.share());
            }
            assert_eq!(least, 0.0, "{torque} {speed}");
            let mut before = grip.share();
            let mut slots = 0;
            while grip.share() < 1.0 {
                now -= torque * if slots < 100 { 0.4 } else { 0.0 };
                grip.step(torque * 800.0, now, &settings());
                assert!(slots < 100 || grip.share() <= before + 1.1e-3, "no jump");
                before = grip.share();
                slots += 1;
                assert!(slots < 1_300, "{}", grip.share());
            }
        }
    }

    #[test]
    fn without_a_limit_nothing_is_taken_away() {
        let free = Settings { train: TrainLimits::NONE, ..settings() };
        let mut grip = Grip::FULL;
        for slot in 0..500 {
            grip.step(800.0, 2.0 * slot as f32, &free);
            assert_eq!(grip.share(), 1.0);
        }
    }

    /// Slip takes its share at once and goes on taking while it lasts; below the free slip nothing is taken. Speeds are shares of the largest.
    #[test]
    fn slip_takes_its_share_at_once_and_more_while_it_lasts() {
        let settings = settings();
        let largest = settings.ratings.max_speed_rad_s;
        for (torque, speed) in WAYS {
            // The rotor jumps ahead by a slip: half of the span beyond what is free.
            let ahead = |slip: f32| speed * 200.0 + torque * slip * largest;
            let mut grip = Grip::FULL;
            // What was faster before is forgotten: the reference comes down with the rotor.
            for slip in [0.1, 0.0] {
                grip.step(torque * 800.0, ahead(slip), &settings);
                assert_eq!(grip.share(), 1.0);
            }
            // Within the slot the reference follows by 0.02 rad/s.
            let followed = 20.0 * 1e-3 / largest;
            grip.step(torque * 800.0, ahead(FREE + 0.5 * SPAN + followed), &settings);
            let held = 1.0 - 0.5 * 1e-3 / LOSE_S;
            assert!((grip.share() - (held - 0.5)).abs() < 1e-3, "{}", grip.share());
            // As far ahead as before, the reference nearer.
            grip.step(torque * 800.0, ahead(FREE + 0.5 * SPAN + 2.0 * followed), &settings);
            let held = held - 0.5 * 1e-3 / LOSE_S;
            assert!((grip.share() - (held - 0.5)).abs() < 2e-3, "{}", grip.share());
            // Just free: all of it comes back but what is held, and that by a thousandth a slot.
            grip.step(torque * 800.0, ahead(0.99 * FREE), &settings);
            assert!((grip.share() - (held + 1e-3 / RESTORE_S)).abs() < 1e-5, "{}", grip.share());
            // The torque's other direction has its own reference: it begins where the rotor is.
            grip.step(-torque * 800.0, ahead(0.5), &settings);
            assert!((grip.share() - (held + 2e-3 / RESTORE_S)).abs() < 1e-5, "{}", grip.share());
            // No torque, no direction.
            grip.step(0.0, ahead(-0.5), &settings);
            assert!((grip.share() - (held + 3e-3 / RESTORE_S)).abs() < 1e-5, "{}", grip.share());
        }
    }
}
