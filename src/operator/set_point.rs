//! The speed demand's path. A changing speed is sent in steps, one per message. The reference does not jump from one step to the next: it follows a
//! straight line that takes a little longer than the time between messages, so that it neither pauses between them nor turns back.

use super::Settings;
use crate::frames::limit;

/// Time in which a speed demand goes from standstill to the largest speed, in s: the steepest line.
const RISE_S: f32 = 0.5;
/// Longest time that counts as the one between two messages, in s. A step after a longer one stands alone.
const LONGEST_S: f32 = 0.02;
/// Length of a line as a multiple of the time between messages: if a message comes late, the reference is still moving. The remainder of a line is
/// then a fifth, and after the next one a fifth of that again.
const OVER: f32 = 1.25;

/// The speed's reference on its way, in rad/s.
#[derive(Clone, Copy, Debug)]
pub(super) struct SetPoint {
    speed: f32,
    target: f32,
    /// The line's slope, in rad/s².
    slope: f32,
    /// Time since the target last moved, and time between its last two moves, in s, at most [`LONGEST_S`] each.
    since_s: f32,
    before_s: f32,
}

impl SetPoint {
    /// At rest at a speed.
    pub const fn at(speed: f32) -> Self {
        Self { speed, target: speed, slope: 0.0, since_s: LONGEST_S, before_s: LONGEST_S }
    }

    /// The reference.
    pub const fn speed(&self) -> f32 {
        self.speed
    }

    /// One slot towards a target. It is reached exactly, and never passed.
    pub fn step(&mut self, target: f32, settings: &Settings) {
        let Settings { slot_s, ratings, .. } = *settings;
        self.since_s = limit(self.since_s + slot_s, slot_s, LONGEST_S);
        if target != self.target {
            let steepest = ratings.max_speed_rad_s / RISE_S;
            // The longer of both: messages that come a little early do not make the line too short for one that comes a little late.
            let apart_s = if self.since_s > self.before_s { self.since_s } else { self.before_s };
            let slope = (target - self.speed).abs() / (OVER * apart_s);
            self.slope = limit(slope, 0.0, steepest);
            (self.target, self.since_s, self.before_s) = (target, 0.0, self.since_s);
        }
        let step = self.slope * slot_s;
        self.speed = limit(target, self.speed - step, self.speed + step);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::built_in::zs9::BUILT_IN;

    const SLOT_S: f32 = 1e-3;

    /// Least and largest slope of the reference, in rad/s², while a target moves by 200 rad/s² and messages come at these intervals in slots, over
    /// and over; from the tenth round on.
    fn slopes(gaps: &[usize]) -> (f32, f32) {
        let settings = Settings::rated(&BUILT_IN.ratings, SLOT_S, None);
        let (mut point, mut slot, mut least, mut largest) = (SetPoint::at(0.0), 0, f32::MAX, f32::MIN);
        for round in 0..15 {
            for gap in gaps {
                let target = 200.0 * SLOT_S * (slot as f32);
                for _ in 0..*gap {
                    let before = point.speed();
                    point.step(target, &settings);
                    let slope = (point.speed() - before) / SLOT_S;
                    if round >= 10 {
                        (least, largest) = (least.min(slope), largest.max(slope));
                    }
                    slot += 1;
                }
            }
        }
        (least, largest)
    }

    #[test]
    fn a_target_in_steps_makes_a_straight_line() {
        let (least, largest) = slopes(&[10]);
        assert!(least > 199.5 && largest < 200.5, "{least} to {largest}");
    }

    #[test]
    fn messages_that_come_early_late_or_not_at_all_do_not_stop_it() {
        let (least, largest) = slopes(&[10, 12, 8, 11, 9, 10]);
        assert!(least > 125.0 && largest < 275.0, "{least} to {largest}");
        let (least, largest) = slopes(&[10, 10, 10, 20]);
        assert!(least >= 0.0 && largest < 400.0, "{least} to {largest}");
    }

    #[test]
    fn a_step_is_taken_on_the_steepest_line_or_within_a_little_more_than_the_longest_gap() {
        let settings = Settings::rated(&BUILT_IN.ratings, SLOT_S, None);
        for target in [100.0, -0.5, 3.0] {
            let mut point = SetPoint::at(0.0);
            let steepest = BUILT_IN.ratings.max_speed_rad_s / RISE_S;
            let most_s = (f32::abs(target) / steepest).max(OVER * LONGEST_S) + SLOT_S;
            for _ in 0..(most_s / SLOT_S).ceil() as usize {
                let before = point.speed();
                point.step(target, &settings);
                assert!((point.speed() - before).abs() <= 1.001 * steepest * SLOT_S);
                assert!(point.speed().abs() <= f32::abs(target));
            }
            assert_eq!(point.speed(), target);
        }
    }
}
