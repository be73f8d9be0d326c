//! The torque demand's path: limited in its rate (slew) and in how fast the rate changes (jerk). This shaping is for passengers and couplings; the
//! drive's own slew limit after it is for the inverter.

use super::Settings;
use crate::frames::{limit, sqrt};

/// Slew and jerk.
#[derive(Clone, Copy, Debug)]
pub struct Rates {
    /// Length of a step, in s.
    pub step_s: f32,
    /// Largest rate, in N·m/s.
    pub slew_nm_s: f32,
    /// Largest change of the rate, in N·m/s².
    pub jerk_nm_s2: f32,
}

impl Rates {
    /// The rates of the settings.
    #[inline]
    pub(super) const fn of(settings: &Settings) -> Self {
        let Settings { slot_s, slew_nm_s, jerk_nm_s2, .. } = *settings;
        Self { step_s: slot_s, slew_nm_s, jerk_nm_s2 }
    }
}

/// The demand on its way to the target.
#[derive(Clone, Copy, Debug, Default)]
pub struct Ramp {
    torque_nm: f32,
    rate_nm_s: f32,
}

impl Ramp {
    /// At rest at zero.
    pub const fn new() -> Self {
        Self { torque_nm: 0.0, rate_nm_s: 0.0 }
    }

    /// At rest at a torque, in N·m.
    pub const fn at(torque_nm: f32) -> Self {
        Self { torque_nm, rate_nm_s: 0.0 }
    }

    /// The present torque, in N·m.
    pub const fn torque_nm(&self) -> f32 {
        self.torque_nm
    }

    /// One step towards a target, in N·m, which is reached exactly and never passed. The jerk limits how a rate grows, and how it ends before a target
    /// that stays: torque never leads away from its target, and stops where the target has come to meet it.
    #[inline(never)]
    pub fn step(&mut self, target_nm: f32, rates: &Rates) -> f32 {
        let Rates { step_s, slew_nm_s, jerk_nm_s2 } = *rates;
        let change = jerk_nm_s2 * step_s;
        let error = target_nm - self.torque_nm;
        // The largest rate from which whole steps of the jerk lead to rest within the remaining error: r²/2j + r·dt/2 = |error|.
        let able = change * (sqrt(0.25 + 2.0 * error.abs() / (change * step_s)) - 0.5);
        let rate = if able < slew_nm_s { able } else { slew_nm_s };
        let wanted = if error < 0.0 { -rate } else { rate };
        let before_nm_s = if self.rate_nm_s * error < 0.0 { 0.0 } else { self.rate_nm_s };
        self.rate_nm_s = limit(wanted, before_nm_s - change, before_nm_s + change);
        self.torque_nm += self.rate_nm_s * step_s;
        if (target_nm - self.torque_nm) * error <= 0.0 {
            *self = Self::at(target_nm);
        }
        self.torque_nm
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const RATES: Rates = Rates { step_s: 1e-3, slew_nm_s: 9_880.0, jerk_nm_s2: 197_600.0 };
    /// Change of the rate in a step, and the torque that a step at that rate adds.
    const CHANGE_NM_S: f32 = RATES.jerk_nm_s2 * RATES.step_s;
    const STEP_NM: f32 = CHANGE_NM_S * RATES.step_s;

    /// A step towards 100 N·m from this far below it, at a rate; both in changes of the rate. Returns the torque and the rate after it.
    fn stepped(below: f32, rate: f32) -> (f32, f32) {
        let mut ramp = Ramp { torque_nm: 100.0 - below * STEP_NM, rate_nm_s: rate * CHANGE_NM_S };
        let torque_nm = ramp.step(100.0, &RATES);
        assert_eq!(torque_nm, ramp.torque_nm());
        (torque_nm, ramp.rate_nm_s / CHANGE_NM_S)
    }

    /// Already on the target, or where the step would pass it, at whatever rate.
    #[test]
    fn a_ramp_ends_on_its_target() {
        for (below, rate) in [
            (0.0, 0.0),
            (0.0, 1.5),
            (0.0, -1.5),
            (0.5, 2.3),
            (1.9, 3.8),
            (-0.5, -2.3),
            (2.1, 3.5),
            (0.5, 50.0),
        ] {
            assert_eq!(stepped(below, rate), (100.0, 0.0), "{below} {rate}");
        }
    }

    /// A rate that leads away ends at once, and the way back begins as from rest.
    #[test]
    fn a_ramp_never_leads_away_from_its_target() {
        for (below, away) in [(50.0, -20.0), (-50.0, 20.0), (50.0, -1e-3)] {
            assert_eq!(stepped(below, away), stepped(below, 0.0), "{below} {away}");
            let (_, after) = stepped(below, away);
            assert!((after - 1_f32.copysign(below)).abs() < 1e-3, "{after}");
        }
        let (_, after) = stepped(50.0, 2.0);
        assert!((after - 3.0).abs() < 1e-3, "one that leads there goes on: {after}");
    }
}
