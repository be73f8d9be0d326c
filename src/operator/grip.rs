//! Slip and slide: a rotor that accelerates faster than a train can has lost its grip on the rail.
//!
//! A reference follows the smoothed speed of the rotor in the direction of the torque, upward when motoring, downward when braking, at most at the
//! acceleration limit. The slip is the rotor's lead over it. The torque's share falls at once in proportion to the slip, and further while the slip
//! lasts; once grip is back the share returns along a straight line.

use super::Settings;
use crate::frames::limit;

/// Slip that is ignored, and slip beyond it that removes all torque, as shares of the largest speed.
const FREE: f32 = 0.005;
const SPAN: f32 = 0.02;
/// Time in which slip of the whole span removes all torque lastingly, and in which that torque returns, in s.
const LOSE_S: f32 = 0.3;
const RESTORE_S: f32 = 1.0;
/// Smoothing time constant of the rotor's speed, in s. An angle that is off by ε once or twice a turn moves a speed smoothed over τ by ε/τ to both
/// sides, electrical, whatever the speed.
const SMOOTHED_S: f32 = 0.016;

/// The grip on the rail.
#[derive(Clone, Copy, Debug)]
pub(super) struct Grip {
    /// Direction of the torque.
    along: f32,
    /// The rotor's speed, smoothed, mechanical, in rad/s; `None` before the first slot.
    speed: Option<f32>,
    /// The reference, along the torque, mechanical, in rad/s.
    reference: f32,
    /// Share of the torque that returns slowly.
    held: f32,
    /// Share of the torque.
    share: f32,
}

impl Grip {
    pub(super) const FULL: Self = Self { along: 0.0, speed: None, reference: 0.0, held: 1.0, share: 1.0 };

    /// Share of the demand that the rail can carry.
    pub(super) const fn share(&self) -> f32 {
        self.share
    }

    /// One slot with a torque demand, in N·m, and a mechanical speed, in rad/s.
    #[inline(never)]
    pub(super) fn step(&mut self, torque_nm: f32, speed: f32, settings: &Settings) {
        let Settings { ratings, slot_s, train, .. } = *settings;
        let along = if torque_nm == 0.0 { 0.0 } else { 1.0_f32.copysign(torque_nm) };
        let before = self.speed.unwrap_or(speed);
        let smoothed = before + (speed - before) * (slot_s / (slot_s + SMOOTHED_S));
        self.speed = Some(smoothed);
        let (now, most) = (along * smoothed, self.reference + train.acceleration_rad_s2 * slot_s);
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

    /// A rotor that has coasted at a mechanical speed, in rad/s.
    fn coasting(speed: f32) -> Grip {
        let mut grip = Grip::FULL;
        (0..300).for_each(|_| grip.step(0.0, speed, &settings()));
        grip
    }

    /// That of one which has coasted before, and of one that is enabled at its speed.
    #[test]
    fn a_train_on_its_rails_has_all_of_its_torque() {
        let starts = [coasting, |_| Grip::FULL];
        for ((torque, speed), start) in WAYS.into_iter().flat_map(|way| starts.map(|start| (way, start))) {
            let mut grip = start(speed * 200.0);
            for slot in 0..3_000 {
                grip.step(torque * 800.0, speed * 200.0 + torque * 19.0e-3 * slot as f32, &settings());
                assert_eq!(grip.share(), 1.0);
            }
        }
    }

    #[test]
    fn a_wheel_that_slips_loses_its_torque_and_gets_it_back_along_a_line() {
        for (torque, speed) in WAYS {
            let (mut grip, mut now, mut least) = (coasting(speed * 200.0), speed * 200.0, 1.0_f32);
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

    /// The least share for a torque's direction at a mechanical speed, in rad/s, with an angle that is off this many times a turn, by this many
    /// electrical rad, and that is followed at once. Torque comes some time after the first angle.
    fn least_share(torque: f32, speed: f32, (order, off_rad): (f32, f32)) -> f32 {
        let settings = settings();
        let (mut grip, mut least) = (Grip::FULL, 1.0_f32);
        let error_rad_s = order * settings.ratings.pole_pairs * speed;
        for slot in 0..3_000 {
            let phase = error_rad_s * settings.slot_s * slot as f32;
            let seen = speed + off_rad * error_rad_s / settings.ratings.pole_pairs * phase.cos();
            grip.step(if slot < 200 { 0.0 } else { torque * 800.0 }, seen, &settings);
            least = least.min(grip.share());
        }
        least
    }

    /// An angle error once or twice a turn is not taken for slip at any speed at which a slot sees each half turn of the error.
    #[test]
    fn an_angle_that_is_off_is_no_slip() {
        let off_rad = 3.0_f32.to_radians();
        for (torque, speed) in WAYS {
            for share in [0.02, 0.1, 0.3, 0.6] {
                let speed = speed * share * settings().ratings.max_speed_rad_s;
                let least = [1.0, 2.0].map(|order| least_share(torque, speed, (order, off_rad)));
                assert_eq!(least, [1.0; 2], "{share}");
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

    /// Slip reduces the share at once and goes on reducing it while it lasts; slip below the free limit reduces nothing. Speeds are shares of the
    /// largest.
    #[test]
    fn slip_takes_its_share_at_once_and_more_while_it_lasts() {
        let settings = settings();
        let largest = settings.ratings.max_speed_rad_s;
        for (torque, speed) in WAYS {
            // The rotor jumps ahead by a slip: half of the span beyond the free slip.
            let ahead = |slip: f32| speed * 200.0 + torque * slip * largest;
            let mut grip = Grip::FULL;
            // The speed whose smoothed value is the wanted one.
            let step = |grip: &mut Grip, torque_nm: f32, wanted: f32| {
                let speed = grip.speed.map_or(wanted, |before| {
                    before + (wanted - before) * (1.0 + SMOOTHED_S / settings.slot_s)
                });
                grip.step(torque_nm, speed, &settings);
            };
            // Earlier, higher speed is forgotten: the reference comes down with the rotor.
            for slip in [0.1, 0.0] {
                step(&mut grip, torque * 800.0, ahead(slip));
                assert_eq!(grip.share(), 1.0);
            }
            // Within the slot the reference follows by 0.02 rad/s.
            let followed = 20.0 * 1e-3 / largest;
            step(&mut grip, torque * 800.0, ahead(FREE + 0.5 * SPAN + followed));
            let held = 1.0 - 0.5 * 1e-3 / LOSE_S;
            assert!((grip.share() - (held - 0.5)).abs() < 1e-3, "{}", grip.share());
            // As far ahead as before, the reference nearer.
            step(&mut grip, torque * 800.0, ahead(FREE + 0.5 * SPAN + 2.0 * followed));
            let held = held - 0.5 * 1e-3 / LOSE_S;
            assert!((grip.share() - (held - 0.5)).abs() < 2e-3, "{}", grip.share());
            // Just within the free slip: everything returns except the held part, which returns by a thousandth a slot.
            step(&mut grip, torque * 800.0, ahead(0.99 * FREE));
            assert!((grip.share() - (held + 1e-3 / RESTORE_S)).abs() < 1e-5, "{}", grip.share());
            // The torque's other direction has its own reference: it begins where the rotor is.
            step(&mut grip, -torque * 800.0, ahead(0.5));
            assert!((grip.share() - (held + 2e-3 / RESTORE_S)).abs() < 1e-5, "{}", grip.share());
            // No torque, no direction.
            step(&mut grip, 0.0, ahead(-0.5));
            assert!((grip.share() - (held + 3e-3 / RESTORE_S)).abs() < 1e-5, "{}", grip.share());
        }
    }
}
