//! The damping of a link behind a line filter.
//!
//! A motoring drive that holds its torque draws less current when the link rises. To the filter's choke L and capacitor C that is a
//! negative resistance `−U²/P`; if their own resistance R is below `P L/(C U²)`, the link swings ever more. So the torque follows the link's
//! swing, by n percent for a percent, which the filter sees as a conductance `(n − 1) P/U²`. A braking drive damps without it. In square
//! wave the voltage follows the link by itself, and so does the torque once the flux has followed; only slow swings remain to be
//! damped.

use super::Regulated;
use crate::frames::limit;

/// Bandwidth at which the link's slow value follows, in rad/s. A filter of 8 mH and 8 mF swings at 125 rad/s: with 100 it was not damped.
const SLOW_RAD_S: f32 = 20.0;
/// Bandwidth in square wave, as a share of the stator frequency. By trial at 1,900 to 6,000 r/min: with none a filter of 1 mH and 2 mF, whose
/// 700 rad/s are near the stator frequency there, swung by 8 %; without damping, 8 mH and 8 mF tripped.
const SQUARE_SHARE: f32 = 0.12;

/// The link's swing and the link with it.
#[derive(Clone, Copy, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct LinkSwing {
    /// The part that is to be damped, as a share of the link's voltage.
    pub share: f32,
    /// The link with that part of its swing, in V.
    pub udc_v: f32,
}

impl LinkSwing {
    /// Torque by which that of a motoring drive, in N·m, is to be increased: by `gain` percent for a percent of swing, with the total no
    /// less than zero and no more than the largest.
    pub(super) fn damping_nm(&self, gain: f32, torque_nm: f32, omega: f32, largest_nm: f32) -> f32 {
        if torque_nm * omega <= 0.0 {
            return 0.0;
        }
        let magnitude = torque_nm.abs();
        limit(gain * self.share * magnitude, -magnitude, largest_nm - magnitude)
    }
}

/// The observer of the link's swing.
#[derive(Clone, Copy, Debug)]
pub struct LinkDamper {
    /// In V.
    slow_v: f32,
    /// The last step's share.
    share: f32,
}

impl LinkDamper {
    /// The observer on a link that has stood at `slow_v`.
    pub const fn at(slow_v: f32) -> Self {
        Self { slow_v, share: 0.0 }
    }

    /// The swing of the link at `udc_v`, above zero, a time in s after the last step, in a mode that follows so much of a command.
    #[inline(always)]
    pub fn step(&mut self, udc_v: f32, period_s: f32, omega: f32, follows: Regulated) -> LinkSwing {
        self.slow_v += SLOW_RAD_S * period_s * (udc_v - self.slow_v);
        let share = udc_v / self.slow_v - 1.0;
        self.share = if follows == Regulated::Angle {
            self.share + SQUARE_SHARE * omega.abs() * period_s * (share - self.share)
        } else {
            share
        };
        LinkSwing { share: self.share, udc_v: self.slow_v * (1.0 + self.share) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn torque_follows_the_swing_of_a_motoring_drive_within_none_and_the_largest() {
        for (share, torque_nm, omega, more_nm) in [
            (0.01, 200.0, 50.0, 4.0),
            (-0.01, 200.0, 50.0, -4.0),
            (0.01, -200.0, -50.0, 4.0),
            (0.01, -200.0, 50.0, 0.0),
            (0.01, 200.0, 0.0, 0.0),
            (-0.9, 200.0, 50.0, -200.0),
            (0.9, 200.0, 50.0, 100.0),
        ] {
            let swing = LinkSwing { share, udc_v: 1e3 };
            let got_nm = swing.damping_nm(2.0, torque_nm, omega, 300.0);
            assert!((got_nm - more_nm).abs() < 1e-4, "{share} {torque_nm} {omega}: {got_nm}");
        }
    }
}
