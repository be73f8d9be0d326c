//! The zero of a position sensor, found while the machine turns without torque.
//!
//! Without a current the voltage is the magnets' alone, and lies a quarter turn ahead of the d axis. Seen from a frame that leads the rotor by δ it has a
//! component along d, ω ψ sin δ, which nothing else explains. An integral takes δ out: 63 % in a quarter of a second, whatever the magnets' flux linkage is.

use crate::frames::{Angle, Dq, limit_magnitude};

/// Share of an error that is taken out, per second.
const RATE: f32 = 4.0;
/// Speed from which the voltage shows the error, as a share of the largest: dead time and devices take voltages that do not grow with the speed.
const FROM: f32 = 0.05;

/// The correction of a position sensor's zero: an angle that is added to its own.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct AngleZero(Angle);

/// A time in which no torque is asked for.
#[derive(Clone, Copy, Debug)]
pub struct WithoutTorque {
    /// Voltage that nothing explains, rotor frame, in V: [`ControlLaw::unexplained_v`](super::ControlLaw::unexplained_v).
    pub unexplained_v: Dq,
    /// Electrical angular speed, in rad/s.
    pub omega: f32,
    /// The largest, in rad/s.
    pub max_omega: f32,
    /// Flux linkage of the magnets, in Wb.
    pub magnets_wb: f32,
    /// In s.
    pub length_s: f32,
}

impl AngleZero {
    /// The sensor's own zero.
    pub const NONE: Self = Self(Angle::ZERO);

    /// The angle to add to the sensor's.
    #[inline(always)]
    pub const fn angle(self) -> Angle {
        let Self(angle) = self;
        angle
    }

    /// Learns from a time in which no torque was asked for; `false` if the machine turns too slowly to show anything, or has no magnets to show it.
    #[inline(never)]
    pub fn learn(&mut self, rest: &WithoutTorque) -> bool {
        let WithoutTorque { unexplained_v, omega, max_omega, magnets_wb, length_s } = *rest;
        let shows = omega.abs() > FROM * max_omega && magnets_wb > 0.0;
        if shows {
            // A quarter turn at most: beyond, the sine falls again, and its sign stays right.
            let sine = limit_magnitude(unexplained_v.d / (omega * magnets_wb), 1.0);
            let Self(angle) = self;
            *angle = *angle + Angle::within_half_turn(RATE * length_s * sine);
        }
        shows
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MAX_OMEGA: f32 = 1_000.0;

    /// The errors that are left of one, in rad, after these times in s, at a speed in rad/s, of magnets of so many times the rated flux linkage.
    fn left<const N: usize>(error_rad: f32, omega: f32, magnets: f32, times_s: [f32; N]) -> [f32; N] {
        times_s.map(|time_s| {
            let mut zero = AngleZero::NONE;
            let length_s = 1e-3;
            for _ in 0..(time_s / length_s) as u32 {
                let lead = error_rad + zero.angle().signed_radians();
                let unexplained_v = Dq { d: -omega * magnets * lead.sin(), q: 0.0 };
                let rest =
                    WithoutTorque { unexplained_v, omega, max_omega: MAX_OMEGA, magnets_wb: 1.0, length_s };
                zero.learn(&rest);
            }
            error_rad + zero.angle().signed_radians()
        })
    }

    #[test]
    fn an_error_goes_away_whatever_direction_magnets_and_size() {
        for (error_rad, omega, magnets) in
            [(0.2, 300.0, 1.0), (-0.2, 300.0, 0.8), (0.2, -300.0, 1.2), (2.8, 300.0, 1.0)]
        {
            let [ended] = left(error_rad, omega, magnets, [4.0]);
            assert!(ended.abs() < 1e-4, "{error_rad} {omega} {magnets}: {ended}");
        }
        let [quarter] = left(0.1, 300.0, 1.0, [0.25]);
        assert!((quarter / 0.1 - 0.368).abs() < 0.01, "{quarter}");
    }

    #[test]
    fn a_slow_machine_shows_nothing() {
        for (omega, shown) in [(49.0, false), (51.0, true), (-51.0, true), (-49.0, false), (0.0, false)] {
            let unexplained_v = Dq { d: 10.0, q: 0.0 };
            let rest =
                WithoutTorque { unexplained_v, omega, max_omega: MAX_OMEGA, magnets_wb: 1.0, length_s: 1e-3 };
            let mut zero = AngleZero::NONE;
            assert_eq!((zero.learn(&rest), zero != AngleZero::NONE), (shown, shown), "{omega}");
        }
    }

    /// A tenth of the EMF along d is a tenth of a radian: 250 rad/s and 0.4 Wb are 100 V.
    #[test]
    fn the_error_is_what_is_unexplained_over_the_emf() {
        let unexplained_v = Dq { d: 10.0, q: 50.0 };
        let rest = WithoutTorque {
            unexplained_v,
            omega: 250.0,
            max_omega: MAX_OMEGA,
            magnets_wb: 0.4,
            length_s: 0.01,
        };
        let mut zero = AngleZero::NONE;
        zero.learn(&rest);
        assert!((zero.angle().signed_radians() / (0.1 * RATE * 0.01) - 1.0).abs() < 1e-4, "{zero:?}");
    }

    /// Voltages that are no numbers, or without magnets, move nothing out of bounds.
    #[test]
    fn no_step_is_beyond_the_rate() {
        for (d, magnets_wb) in [(f32::NAN, 1.0), (f32::INFINITY, 1.0), (1.0, 0.0), (0.0, 0.0)] {
            let rest = WithoutTorque {
                unexplained_v: Dq { d, q: 0.0 },
                omega: 500.0,
                max_omega: MAX_OMEGA,
                magnets_wb,
                length_s: 1e-3,
            };
            let mut zero = AngleZero::NONE;
            let shown = zero.learn(&rest);
            assert!(zero.angle().signed_radians().abs() < 1.1 * RATE * 1e-3, "{d} {magnets_wb}");
            assert!(magnets_wb > 0.0 || !shown && zero == AngleZero::NONE, "{d} {magnets_wb}");
        }
    }
}
