//! The watch for measurements that no longer move.
//!
//! A healthy current may repeat to the last bit as long as nothing changes it by a converter's step: near standstill a coarse converter shows the
//! same value for seconds. So repeated currents are suspicious only once they should have changed, because the rotor has turned them, or because the
//! commanded voltage is no longer the one that belonged to them.

use super::{FailedCheck, Fault};
use crate::control::Measurements;
use crate::frames::{Abc, AlphaBeta, Angle};
use crate::machine::Ratings;

/// Control periods for which a measurement may repeat to the last bit.
const FROZEN_PERIODS: u32 = 20;
/// Share of the largest current above which a current that never changes is suspicious.
const FROZEN_CURRENT_SHARE: f32 = 0.05;
/// Change of a repeated current that the rotor's turn must have caused, as a share of the largest current: more than a step of a converter of 8 bits.
const TURNED_SHARE: f32 = 0.02;
/// Change of the flux linkage that the voltage must have caused with a repeated current, as a share of the machine's own at its largest torque: a
/// quarter, which is above what the dead time's error near a current of zero feigns in the runs of the tests.
const PUSHED_SHARE: f32 = 0.25;
/// The turn of the rotor, by its last known speed, from which an unmoving angle is suspicious, in electrical rad.
const FROZEN_TURN_RAD: f32 = 0.2;
/// The time for which that speed is believed, in s: a sensor that stands still is found above 10 rad/s, and a rotor that stops within a count of its
/// encoder is not mistaken for one. A voltage counts for the same time.
const BELIEVED_S: f32 = 0.02;

/// The watch for measurements that no longer move.
#[derive(Clone, Copy, Debug)]
pub struct FrozenWatch {
    /// Currents and angle of the last period.
    last: Option<(Abc, Angle)>,
    /// Last commanded voltage, stationary frame, in V.
    commanded_v: AlphaBeta,
    currents: Repeated,
    angle_for: u32,
    /// Electrical speed when the angle last moved, fading, in rad/s: the tracker soon believes a sensor that stands still.
    moving: f32,
    turned_rad: f32,
}

/// The history since the currents began to repeat.
#[derive(Clone, Copy, Debug)]
struct Repeated {
    periods: u32,
    /// Voltage commanded when they last changed, in V; this field and those below count from the first period of repeated currents on.
    from_v: AlphaBeta,
    /// Turn of the rotor since then, in electrical rad.
    turned_rad: f32,
    /// The flux linkage that the change of the voltage since then has added, fading, in V·s.
    pushed_wb: AlphaBeta,
}

impl Repeated {
    const fn since(from_v: AlphaBeta) -> Self {
        Self { periods: 0, from_v, turned_rad: 0.0, pushed_wb: AlphaBeta { alpha: 0.0, beta: 0.0 } }
    }

    /// One more period of the same currents.
    fn step(&mut self, commanded_v: AlphaBeta, omega: f32, period_s: f32) {
        if self.periods == 0 {
            *self = Self::since(commanded_v);
        }
        self.periods += 1;
        self.turned_rad += omega * period_s;
        let pushed = (commanded_v - self.from_v) * period_s;
        self.pushed_wb = self.pushed_wb * (1.0 - period_s / BELIEVED_S) + pushed;
    }

    /// `true` if a peak current of `peak_a` should have changed.
    #[cold]
    #[inline(never)]
    fn is_suspicious(&self, peak_a: f32, ratings: &Ratings) -> bool {
        let largest_a = ratings.max_current_a;
        // Flux linkage and current at the largest torque, at right angles.
        let flux_wb = ratings.max_torque_nm / (1.5 * ratings.pole_pairs * largest_a);
        let limit_wb = PUSHED_SHARE * flux_wb;
        self.turned_rad.abs() * peak_a > TURNED_SHARE * largest_a
            || self.pushed_wb.squared() > limit_wb * limit_wb
    }
}

impl FrozenWatch {
    /// A watch that has seen nothing yet.
    pub const fn new() -> Self {
        const NONE: AlphaBeta = AlphaBeta { alpha: 0.0, beta: 0.0 };
        Self {
            last: None,
            commanded_v: NONE,
            currents: Repeated::since(NONE),
            angle_for: 0,
            moving: 0.0,
            turned_rad: 0.0,
        }
    }

    /// The turn that the rotor should have made while its angle stood still, and the turn that is a fault, in electrical rad.
    pub fn turned_rad(&self) -> (f32, f32) {
        (self.turned_rad, FROZEN_TURN_RAD)
    }

    /// `true` if the angle was the same in the last two periods.
    pub fn angle_stands(&self) -> bool {
        self.angle_for > 0
    }

    /// Takes the voltage that control has commanded, stationary frame, in V.
    pub fn command(&mut self, voltage_v: AlphaBeta) {
        self.commanded_v = voltage_v;
    }

    /// One control period; `omega` is the electrical speed, in rad/s. To be called while pulses are made.
    #[inline(always)]
    pub fn check(
        &mut self,
        measured: &Measurements,
        omega: f32,
        period_s: f32,
        ratings: &Ratings,
    ) -> Option<FailedCheck> {
        let (currents_a, angle) = self.last.replace((measured.currents_a, measured.angle))?;
        let peak_a = || measured.currents_a.peak();
        if currents_a == measured.currents_a && peak_a() > FROZEN_CURRENT_SHARE * ratings.max_current_a {
            self.currents.step(self.commanded_v, omega, period_s);
        } else {
            self.currents.periods = 0;
        }
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
        let periods = if frozen_angle { self.angle_for } else { self.currents.periods };
        let repeated = self.currents.periods >= FROZEN_PERIODS;
        if frozen_angle || (repeated && self.currents.is_suspicious(peak_a(), ratings)) {
            return Some((Fault::Frozen, periods as f32, FROZEN_PERIODS as f32));
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::built_in::traction::BUILT_IN;
    use crate::frames::{Abc, Angle};

    /// A turn, a push and a rotor within the permitted limits are not frozen.
    #[test]
    fn at_its_borders_nothing_is_frozen() {
        let (ratings, none) = (&BUILT_IN.ratings, AlphaBeta { alpha: 0.0, beta: 0.0 });
        let flux_wb = ratings.max_torque_nm / (1.5 * ratings.pole_pairs * ratings.max_current_a);
        for (more, found) in [(1.0, false), (1.001, true)] {
            let turned = Repeated { turned_rad: TURNED_SHARE * more, ..Repeated::since(none) };
            assert_eq!(turned.is_suspicious(ratings.max_current_a, ratings), found);
            let pushed_wb = AlphaBeta { alpha: PUSHED_SHARE * flux_wb * more, beta: 0.0 };
            let pushed = Repeated { pushed_wb, ..Repeated::since(none) };
            assert_eq!(pushed.is_suspicious(0.0, ratings), found);
            let mut watch = FrozenWatch::new();
            let measured = Measurements { currents_a: Abc::default(), udc_v: 1_500.0, angle: Angle::ZERO };
            watch.last = Some((measured.currents_a, measured.angle));
            watch.turned_rad = FROZEN_TURN_RAD * more;
            assert_eq!(watch.check(&measured, 0.0, 1e-4, ratings).is_some(), found);
        }
    }

    /// An additional volt adds up and fades: it reaches 63 % of its final value in the time for which it counts.
    #[test]
    fn a_push_counts_for_as_long_as_it_is_believed() {
        let [none, more] = [0.0, 1.0].map(|alpha| AlphaBeta { alpha, beta: 0.0 });
        let mut repeated = Repeated { periods: 1, ..Repeated::since(none) };
        for (periods, wb) in [(200, 0.632 * BELIEVED_S), (1_800, BELIEVED_S)] {
            (0..periods).for_each(|_| repeated.step(more, 0.0, 1e-4));
            let pushed_wb = repeated.pushed_wb.alpha;
            assert!((pushed_wb / wb - 1.0).abs() < 5e-3, "{pushed_wb} V·s, not {wb}");
        }
    }
}
