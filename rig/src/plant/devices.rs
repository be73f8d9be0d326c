//! Conducting IGBTs and diodes: a threshold and a slope each.

use super::Leg;

/// The voltage drops of conducting devices.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DeviceDrops {
    /// Threshold of an IGBT, in V.
    pub igbt_v: f64,
    /// Its slope, in ohm.
    pub igbt_ohm: f64,
    /// Threshold of a diode, in V.
    pub diode_v: f64,
    /// Its slope, in ohm.
    pub diode_ohm: f64,
}

impl DeviceDrops {
    /// Ideal devices.
    pub const NONE: Self = Self { igbt_v: 0.0, igbt_ohm: 0.0, diode_v: 0.0, diode_ohm: 0.0 };

    /// `true` unless the devices are ideal.
    pub fn is_some(&self) -> bool {
        *self != Self::NONE
    }

    /// Voltage by which a leg's output is below its rail at a current out of it in A, negative if above, in V: the conducting device drops voltage in
    /// the current's direction. `sign` is the current's, continuous near zero, −1 ..= 1.
    pub fn drop_v(&self, leg: Leg, current_a: f64, sign: f64) -> f64 {
        let by_igbt = match leg {
            Leg::Upper => current_a > 0.0,
            Leg::Lower => current_a < 0.0,
            Leg::Open => false,
        };
        let (threshold_v, slope_ohm) =
            if by_igbt { (self.igbt_v, self.igbt_ohm) } else { (self.diode_v, self.diode_ohm) };
        threshold_v * sign + slope_ohm * current_a
    }
}
