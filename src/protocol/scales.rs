//! Scales: the size of a signal's step, a power of ten that follows from the machine's ratings.

use super::commands::{LINK_V, TORQUE_NM};
use super::parameters::RPM_PER_RAD_S;
use super::telemetry::{CURRENT_A, FREQUENCY_HZ, SPEED_RPM};
use crate::machine::Ratings;
use core::f32::consts::TAU;
use tractive_control::named;

named! {
    /// A physical quantity whose signals' steps follow from the machine; the number is the position of its exponent among the bits of [`Scales`].
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    #[cfg_attr(feature = "defmt", derive(defmt::Format))]
    #[repr(u8)]
    pub enum Quantity {
        /// Torque.
        Torque = 0 => "torque",
        /// Current.
        Current = 4 => "current",
        /// Voltage.
        Voltage = 8 => "voltage",
        /// Speed and frequency.
        Speed = 12 => "speed",
        /// Signals with the same steps on every machine.
        Fixed = 16 => "fixed",
    }
}

impl Quantity {
    /// The quantities whose steps follow from the machine.
    pub const SCALED: [Self; 4] = [Self::Torque, Self::Current, Self::Voltage, Self::Speed];
}

/// Bits of an exponent, in two's complement.
const BITS: u32 = 4;
const NIBBLE: u32 = 0xF;
/// The limits of the exponents.
const EXPONENTS: [i32; 2] = [-4, 4];

/// The factor of each exponent by its bits: 0 to 7, then −8 to −1.
const WORTH: [f32; 16] =
    [1.0, 10.0, 100.0, 1e3, 1e4, 1e5, 1e6, 1e7, 1e-8, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 0.1];

const fn worth(exponent: i32) -> f32 {
    WORTH[(exponent as u32 & NIBBLE) as usize]
}

/// Fewest steps in a rating.
const FEWEST_STEPS: f32 = 500.0;

/// Range that must be representable, as a multiple of the rated torque.
const TORQUE_MARGIN: f32 = 1.5;

/// Range that must be representable, as a multiple of the ZS9's highest capacitor voltage.
const CAPACITOR_MARGIN: f32 = 1.5;

/// 0 for the usual step. A tenth of it, and so on, while a rating has less than 500 steps; then ten times it, and so on, while the largest value to
/// be sent, as a share of the usual range, lies beyond that range.
const fn exponent(rated_steps: f32, most: f32) -> i32 {
    let [lowest, highest] = EXPONENTS;
    let mut exponent = 0;
    while exponent > lowest && rated_steps < FEWEST_STEPS * worth(exponent) {
        exponent -= 1;
    }
    while exponent < highest && most > worth(exponent) {
        exponent += 1;
    }
    exponent
}

/// The size of a step of every quantity, as powers of ten of the usual one: four bits each.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Scales(u32);

impl Scales {
    /// The usual steps of every quantity.
    pub const USUAL: Self = Self(0);

    /// The scales of a machine.
    pub const fn of(ratings: &Ratings) -> Self {
        Self::up_to(ratings, ratings.trip_dc_over_v)
    }

    /// The scales of two machines on a ZS9, from its operator's ratings. The capacitor voltage at which the drive trips belongs to the power stage,
    /// of which a host knows nothing: so the highest voltage in normal operation is the measure.
    pub const fn of_zs9(ratings: &Ratings) -> Self {
        Self::up_to(ratings, CAPACITOR_MARGIN * ratings.dc_link_max_v)
    }

    /// The scales with voltages up to this one, in V.
    const fn up_to(ratings: &Ratings, most_v: f32) -> Self {
        let rpm = RPM_PER_RAD_S * ratings.max_speed_rad_s;
        let trip_rpm = RPM_PER_RAD_S * ratings.trip_speed_rad_s / SPEED_RPM[1];
        let trip_hz = ratings.pole_pairs * ratings.trip_speed_rad_s / TAU / FREQUENCY_HZ[1];
        let torque_nm = ratings.max_torque_nm;
        Self::USUAL
            .with(Quantity::Torque, exponent(torque_nm / 0.1, TORQUE_MARGIN * torque_nm / TORQUE_NM[1]))
            .with(
                Quantity::Current,
                exponent(ratings.max_current_a / 0.1, ratings.trip_current_a / CURRENT_A[1]),
            )
            .with(Quantity::Voltage, exponent(ratings.dc_link_nominal_v / 0.1, most_v / LINK_V[1]))
            .with(Quantity::Speed, exponent(rpm / 0.5, if trip_rpm > trip_hz { trip_rpm } else { trip_hz }))
    }

    const fn with(self, quantity: Quantity, exponent: i32) -> Self {
        Self(self.0 | (exponent as u32 & NIBBLE) << (quantity as u32))
    }

    /// The exponent of a quantity.
    pub const fn exponent(self, quantity: Quantity) -> i32 {
        let unused = u32::BITS - BITS;
        ((self.bits(quantity) << unused) as i32) >> unused
    }

    /// The number of usual steps in one step of a quantity.
    pub const fn worth(self, quantity: Quantity) -> f32 {
        worth(self.bits(quantity) as i32)
    }

    const fn bits(self, quantity: Quantity) -> u32 {
        self.0 >> (quantity as u32) & NIBBLE
    }

    /// The bits of these quantities.
    pub(super) const fn mask(quantities: &[Quantity]) -> u32 {
        let mut mask = 0;
        let mut index = 0;
        while index < quantities.len() {
            mask |= NIBBLE << (quantities[index] as u32);
            index += 1;
        }
        mask
    }

    /// The four bits by which a message gives the exponents of the quantities under its mask: their exclusive or.
    pub(super) const fn code(self, mask: u32) -> u32 {
        let exponents = self.0 & mask;
        let folded = exponents ^ exponents >> (2 * BITS);
        (folded ^ folded >> BITS) & NIBBLE
    }

    /// A value converted to the usual scales.
    #[inline]
    pub(super) const fn to_usual(self, quantity: Quantity, value: f32) -> f32 {
        value * worth(-(self.bits(quantity) as i32))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::protocol::{COMMAND, LIMITS, Payload};

    /// Scales with these exponents of [`Quantity::SCALED`].
    fn scales(exponents: [i32; 4]) -> Scales {
        let each = Quantity::SCALED.into_iter().zip(exponents);
        each.fold(Scales::USUAL, |scales, (quantity, exponent)| scales.with(quantity, exponent))
    }

    #[test]
    fn exponents_come_back_each_its_own() {
        for exponent in EXPONENTS[0]..=EXPONENTS[1] {
            let exponents = [exponent, -exponent.abs(), 4, -4];
            let scales = scales(exponents);
            for (quantity, exponent) in Quantity::SCALED.into_iter().zip(exponents) {
                assert_eq!(scales.exponent(quantity), exponent);
                let worth = 10_f32.powi(exponent);
                assert!((scales.worth(quantity) / worth - 1.0).abs() < 1e-6);
                assert!((scales.to_usual(quantity, 3.0) * worth / 3.0 - 1.0).abs() < 1e-6);
            }
            assert_eq!(scales.worth(Quantity::Fixed), 1.0);
            assert_eq!(scales.to_usual(Quantity::Fixed, 3.0), 3.0);
        }
    }

    #[test]
    fn a_rating_has_five_hundred_steps_and_what_is_most_has_room() {
        let most = [(1.0, 0), (1.01, 1), (10.0, 1), (10.1, 2), (1e4, 4), (1e9, 4)];
        assert!(most.into_iter().all(|(most, exponent)| super::exponent(1e3, most) == exponent));
        let rated = [(500.0, 0), (499.0, -1), (50.0, -1), (49.0, -2), (0.05, -4), (1e-9, -4)];
        assert!(rated.into_iter().all(|(rated, exponent)| super::exponent(rated, 0.0) == exponent));
        // Range takes precedence over resolution.
        assert_eq!(super::exponent(1.0, 0.005), -2);
    }

    #[test]
    fn a_mark_is_the_exclusive_or_of_exponents() {
        let [torque, current, voltage, speed] = [1, -3, 2, -4];
        let scales = scales([torque, current, voltage, speed]);
        let code = |quantities: &[Quantity]| scales.code(Scales::mask(quantities)) as i32;
        let [t, c, v, s] = Quantity::SCALED;
        assert_eq!(
            [code(&[t]), code(&[c]), code(&[v]), code(&[s])],
            [torque, current & 15, voltage, speed & 15]
        );
        assert_eq!(code(&[t, s]), (torque ^ speed) & 15);
        assert_eq!(code(&[s, t, v]), (torque ^ speed ^ voltage) & 15);
        assert_eq!(code(&Quantity::SCALED), (torque ^ current ^ voltage ^ speed) & 15);
        assert_eq!(code(&[]), 0);
    }

    #[test]
    fn a_message_names_the_quantities_and_the_signal_of_its_mark() {
        let scales = scales([-1, 0, 0, 2]);
        let told =
            |message: &super::super::Message| message.quantities().map(Quantity::name).collect::<Vec<_>>();
        assert_eq!(told(&COMMAND), ["torque"]);
        assert_eq!(told(&LIMITS), ["torque", "speed"]);
        for (message, start, code) in [(COMMAND, 36, 15), (LIMITS, 12, 15 ^ 2)] {
            assert_eq!(message.mark_signal(Scales::USUAL), None);
            let signal = message.mark_signal(scales).unwrap();
            assert_eq!(
                (signal.start, signal.bits, signal.min, signal.max),
                (start, 4, code as f32, code as f32)
            );
            assert_eq!(signal.raw(message.mark(Payload(0), scales)), code);
            let content = Payload(0x1234_0000_0000_0000);
            let marked = message.mark(content, scales);
            assert_ne!(marked, content);
            assert_eq!(
                (message.mark(marked, scales), message.mark(content, Scales::USUAL)),
                (content, content)
            );
        }
    }

    #[test]
    fn every_quantity_has_its_name() {
        let names = Quantity::SCALED.map(Quantity::name);
        assert_eq!((names, Quantity::Fixed.name()), (["torque", "current", "voltage", "speed"], "fixed"));
    }

    extern crate std;
    use std::vec::Vec;
}
