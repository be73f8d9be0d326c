//! The damping of a link behind a line filter.
//!
//! A motoring drive that holds its torque draws less current when the link rises. To the filter's choke L and capacitor C that is a
//! negative resistance `−U²/P`; if their own resistance R is below `P L/(C U²)`, the link swings ever more. So the torque follows the link's
//! swing, by n percent for a percent, which the filter sees as a conductance `(n − 1) P/U²`. A braking drive damps without it. In square
//! wave the voltage follows the link by itself, and so does the torque once the flux has followed; only slow swings remain to be
//! damped.
//!
//! A wide swing, such as a step of the line leaves, meets limits: torque cannot rise above the largest, so only the half of the swing that lies below
//! damps; where the field is weakened, the torque asked for is the largest that the voltage gives. So its middle falls until there is room for both, and in square
//! wave torque follows quickly. Without
//! this law a step of 200 V at full power and 3,000 r/min left swings of 220 V behind 3 mH and 4 mF, and the next one tripped.

use super::Regulated;
use crate::frames::limit;

/// Bandwidth at which the link's slow value follows, in rad/s. A filter of 8 mH and 8 mF swings at 125 rad/s: with 100 it was not damped.
const SLOW_RAD_S: f32 = 20.0;
/// Bandwidth in square wave, as a share of the stator frequency. By trial at 1,900 to 6,000 r/min: with none a filter of 1 mH and 2 mF, whose
/// 700 rad/s are near the stator frequency there, swung by 8 %; without damping, 8 mH and 8 mF tripped.
const SQUARE_SHARE: f32 = 0.12;
/// Swing beyond which it is wide, as a share of the link's voltage.
const CALM: f32 = 0.03;
/// Bandwidth in square wave while the swing is wide, likewise: with that of a narrow one torque comes 60° late at 3,000 r/min, behind 3 mH and 4 mF. In narrow
/// swings, 1 mH and 2 mF would swing by 5 to 18 % with it at 1,950 r/min.
const WIDE_SHARE: f32 = 1.0;
/// Rate at which the amplitude of a swing that is over fades, in rad/s.
const FADES_RAD_S: f32 = 10.0;

/// The link's swing and the link with it.
#[derive(Clone, Copy, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct LinkSwing {
    /// The part that is to be damped, as a share of the link's voltage.
    pub share: f32,
    /// The link with that part of its swing, in V.
    pub udc_v: f32,
    /// Amplitude of a wide swing, less that of the widest narrow one, as a share of the link's voltage; 0: narrow. Below 0: its negative, where the voltage gives
    /// more torque than is asked for, as it does unless the field is weakened.
    pub wide: f32,
}

impl LinkSwing {
    /// Torque by which that of a motoring drive, in N·m, is to be increased: by `gain` percent for a percent of swing, with the total no
    /// less than zero and no more than the largest. While the swing is wide, its middle falls, so that there is room for both sides of the swing.
    pub(super) fn damping_nm(&self, gain: f32, torque_nm: f32, omega: f32, largest_nm: f32) -> f32 {
        if torque_nm * omega <= 0.0 {
            return 0.0;
        }
        let magnitude = torque_nm.abs();
        let most_nm = if self.wide < 0.0 { largest_nm } else { magnitude };
        let middle_nm = limit(most_nm / (1.0 + gain * self.wide.abs()), 0.0, magnitude);
        limit(middle_nm * (1.0 + gain * self.share), 0.0, largest_nm) - magnitude
    }
}

/// The observer of the link's swing.
#[derive(Clone, Copy, Debug)]
pub struct LinkDamper {
    /// In V.
    slow_v: f32,
    /// The last step's share.
    share: f32,
    /// Amplitude of the swing, as a share.
    amplitude: f32,
}

impl LinkDamper {
    /// The observer on a link that has stood at `slow_v`.
    pub const fn at(slow_v: f32) -> Self {
        Self { slow_v, share: 0.0, amplitude: 0.0 }
    }

    /// The swing of the link at `udc_v`, above zero, a time in s after the last step, in a mode that follows so much of a command, with the field weakened or not.
    #[inline(always)]
    pub fn step(
        &mut self,
        udc_v: f32,
        period_s: f32,
        omega: f32,
        (follows, weakened): (Regulated, bool),
    ) -> LinkSwing {
        self.slow_v += SLOW_RAD_S * period_s * (udc_v - self.slow_v);
        let share = udc_v / self.slow_v - 1.0;
        let faded = self.amplitude * (1.0 - FADES_RAD_S * period_s);
        self.amplitude = if share.abs() > faded { share.abs() } else { faded };
        let excess = self.amplitude - CALM;
        let is_wide = excess > 0.0;
        let share = match follows {
            Regulated::Angle if is_wide => self.followed(WIDE_SHARE * omega, period_s, share),
            Regulated::Angle => self.followed(SQUARE_SHARE * omega, period_s, share),
            _ => share,
        };
        let wide = if !is_wide {
            0.0
        } else if weakened {
            excess
        } else {
            -excess
        };
        self.share = share;
        LinkSwing { share, wide, udc_v: self.slow_v * (1.0 + share) }
    }

    /// The share that has followed `share` for a time in s with this bandwidth, in rad/s, of either sign.
    #[inline(always)]
    fn followed(&self, bandwidth: f32, period_s: f32, share: f32) -> f32 {
        self.share + bandwidth.abs() * period_s * (share - self.share)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A swing of a tenth, at 1,257 rad/s: the share follows quickly while it is wide, and slowly when it has faded to 3 %, after 0.12 s.
    #[test]
    fn square_wave_follows_a_wide_swing_quickly_until_it_has_faded() {
        let (mut damper, mut followed) = (LinkDamper::at(1_000.0), [0.0; 2]);
        for (volts, periods) in [(1_020.0, 0), (1_100.0, 1)] {
            damper = LinkDamper::at(1_000.0);
            damper.step(volts, 1e-3, 1_257.0, (Regulated::Angle, true));
            followed[periods] = damper.share / (volts / damper.slow_v - 1.0);
        }
        assert!((followed[0] - 0.151).abs() < 1e-3 && (followed[1] - 1.257).abs() < 1e-3, "{followed:?}");
        let calm =
            (1..).find(|_| damper.step(damper.slow_v, 1e-3, 1_257.0, (Regulated::Angle, true)).wide == 0.0);
        assert!((110..=125).contains(&calm.unwrap()), "{calm:?}");
    }

    /// A step by a tenth: 0.07 beyond a narrow swing, less what the slow value has followed.
    #[test]
    fn room_is_made_whatever_the_torque_in_weakening_alone() {
        for follows in [Regulated::Mean, Regulated::Fundamental, Regulated::Angle] {
            let wide = [true, false].map(|weakened| {
                LinkDamper::at(1_000.0).step(1_100.0, 1e-6, 1_257.0, (follows, weakened)).wide
            });
            assert!((wide[0] - 0.07).abs() < 1e-4 && wide[1] == -wide[0], "{follows:?}: {wide:?}");
        }
    }

    #[test]
    fn torque_makes_room_for_a_wide_swing() {
        let swing = |share| LinkSwing { share, wide: 0.1, udc_v: 1e3 }.damping_nm(3.0, 260.0, 50.0, 260.0);
        assert!(
            (swing(0.0) + 60.0).abs() < 1e-3 && swing(0.1).abs() < 1e-3 && (swing(-0.1) + 120.0).abs() < 1e-3
        );
    }

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
            let swing = LinkSwing { share, udc_v: 1e3, wide: 0.0 };
            let got_nm = swing.damping_nm(2.0, torque_nm, omega, 300.0);
            assert!((got_nm - more_nm).abs() < 1e-4, "{share} {torque_nm} {omega}: {got_nm}");
        }
    }
}
