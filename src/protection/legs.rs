//! The power stage's report of its legs: the resulting fault, and the safe state with such legs.

use super::safe::emf_v;
use super::{FailedCheck, Fault, SafeState, safe_state};
use crate::machine::Ratings;

/// The power stage's report of its legs: usually no fault.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct LegFaults {
    /// Devices whose drivers have found a short circuit and block; a bit each, from bit 0 on: uh ul vh vl wh wl.
    pub blocked: u8,
    /// Legs whose output stayed at the lower rail while the upper device should have conducted; a bit each, from u on.
    pub low: u8,
    /// Legs whose output stayed at the upper rail while the lower device should have conducted.
    pub high: u8,
}

impl LegFaults {
    /// The fault, if there is one.
    pub fn check(&self) -> Option<FailedCheck> {
        if self.blocked != 0 {
            return Some((Fault::DriverBlocked, f32::from(self.blocked), 0.0));
        }
        let astray = self.low | self.high;
        (astray != 0).then_some((Fault::LegStuck, f32::from(astray), 0.0))
    }

    /// The safe state with such legs, for an electrical angular speed in rad/s; with sound legs that of [`safe_state`].
    pub fn safe_state(&self, omega: f32, udc_v: f32, ratings: &Ratings) -> SafeState {
        self.in_place_of(safe_state(omega, udc_v, ratings), omega, ratings)
    }

    /// The safe state with such legs, in place of the one for sound legs.
    ///
    /// - A driver that blocks alone has found the other device of its leg conducting. The short circuit at that device's rail is then safe at every
    ///   speed. With the gates off, this leg and the diodes of the others would rectify the EMF into one half-wave of several times the short circuit's
    ///   current; at the other rail the machine would have the whole link across it.
    /// - A leg without both devices makes the short circuit asymmetric: gates off as long as the link withstands the EMF.
    /// - A leg without one of its devices takes part in the short circuit at the rail where it was seen.
    pub fn in_place_of(&self, usual: SafeState, omega: f32, ratings: &Ratings) -> SafeState {
        const UPPER: u8 = 0b01_0101;
        let (upper, lower) = (self.blocked & UPPER, self.blocked >> 1 & UPPER);
        if lower & !upper != 0 {
            return SafeState::UpperShortCircuit;
        }
        if upper & !lower != 0 {
            return SafeState::ShortCircuit;
        }
        let stands_emf = emf_v(omega, ratings) < ratings.trip_dc_over_v;
        match usual {
            SafeState::ShortCircuit if self.blocked != 0 && stands_emf => SafeState::GatesOff,
            SafeState::ShortCircuit if self.high != 0 => SafeState::UpperShortCircuit,
            usual => usual,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::built_in::traction::BUILT_IN;

    /// A link that trips at the EMF itself does not withstand it.
    #[test]
    fn the_link_stands_an_emf_below_its_trip_alone() {
        let legs = LegFaults { blocked: 0b11, ..LegFaults::default() };
        for (more, safe) in [(1.0, SafeState::ShortCircuit), (1.001, SafeState::GatesOff)] {
            let trip_dc_over_v = emf_v(500.0, &BUILT_IN.ratings) * more;
            let ratings = Ratings { trip_dc_over_v, ..BUILT_IN.ratings };
            assert_eq!(legs.in_place_of(SafeState::ShortCircuit, 500.0, &ratings), safe, "{more}");
        }
    }
}
