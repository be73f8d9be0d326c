//! The watch for measurements that no longer move.

use super::{Fault, Violation};
use crate::control::Measurements;
use crate::frames::{Abc, Angle};
use crate::machine::Ratings;

/// Control periods for which a measurement may repeat to the last bit.
const FROZEN_PERIODS: u32 = 20;
/// Share of the largest current above which a current that never changes is suspicious.
const FROZEN_CURRENT_SHARE: f32 = 0.05;
/// What the rotor must have turned, by its last known speed, before an unmoving angle is suspicious, in electrical rad.
const FROZEN_TURN_RAD: f32 = 0.2;
/// How long that speed is believed, in s: a sensor that stands still is found above 10 rad/s, and a rotor that stops within a count
/// of its encoder is not taken for one.
const BELIEVED_S: f32 = 0.02;

/// Looks for measurements that no longer move.
#[derive(Clone, Copy, Debug)]
pub struct FrozenWatch {
    /// Currents and angle of the last period.
    last: Option<(Abc, Angle)>,
    currents_for: u32,
    angle_for: u32,
    /// Electrical speed while the angle last moved, fading, in rad/s: the tracker soon believes a sensor that stands still.
    moving: f32,
    turned_rad: f32,
}

impl FrozenWatch {
    /// Nothing seen yet.
    pub const fn new() -> Self {
        Self { last: None, currents_for: 0, angle_for: 0, moving: 0.0, turned_rad: 0.0 }
    }

    /// What the rotor should have turned while its angle stood still, and how much of that is a fault, in electrical rad.
    pub fn turned_rad(&self) -> (f32, f32) {
        (self.turned_rad, FROZEN_TURN_RAD)
    }

    /// Whether the angle was the same in the last two periods.
    pub fn angle_stands(&self) -> bool {
        self.angle_for > 0
    }

    /// One control period; `omega` is the electrical speed, in rad/s. Call it while pulses are made.
    pub fn check(
        &mut self,
        measured: &Measurements,
        omega: f32,
        period_s: f32,
        ratings: &Ratings,
    ) -> Option<Violation> {
        let (currents_a, angle) = self.last.replace((measured.currents_a, measured.angle))?;
        let flowing = || measured.currents_a.peak() > FROZEN_CURRENT_SHARE * ratings.max_current_a;
        let same_currents = currents_a == measured.currents_a;
        self.currents_for = if same_currents && flowing() { self.currents_for + 1 } else { 0 };
        if angle == measured.angle {
            self.angle_for += 1;
            self.turned_rad += self.moving * period_s;
            self.moving -= self.moving * (period_s / BELIEVED_S);
        } else {
            self.angle_for = 0;
            self.moving = omega.abs();
            self.turned_rad = 0.0;
        }
        let frozen_angle = self.turned_rad > FROZEN_TURN_RAD;
        let periods = if frozen_angle { self.angle_for } else { self.currents_for };
        if frozen_angle || self.currents_for >= FROZEN_PERIODS {
            return Some((Fault::Frozen, periods as f32, FROZEN_PERIODS as f32));
        }
        None
    }
}

impl Default for FrozenWatch {
    fn default() -> Self {
        Self::new()
    }
}
