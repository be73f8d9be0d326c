//! The warmth of the machine, as whoever measures its temperatures tells it to the control law.

use crate::frames::limit_magnitude;

/// Bits of the word that are the magnets' share; the others are the resistance's ratio.
const SHARE_BITS: u32 = 9;
/// Steps of 1 of a resistance's ratio and of the magnets' share.
const PER_RATIO: f32 = 64.0;
const PER_SHARE: f32 = 1_024.0;
/// The resistance of the winding and the flux linkage of the magnets at their temperatures, in half a word of a mailbox.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Warmth(u16);

impl Warmth {
    /// Both as rated: nothing is known of temperatures.
    pub const NONE: Self = Self(0);

    /// Of the stator resistance over its rating, 0.01 to 1.98, and of what the magnets have more flux linkage than by the map, as a share of theirs
    /// within ±0.25. What is not a number counts as rated.
    pub fn new(resistance_ratio: f32, magnet_share: f32) -> Self {
        let steps = |value: f32, most: f32| {
            let rounded = value + 0.5_f32.copysign(value);
            limit_magnitude(rounded, most) as i16
        };
        let ratio = steps((resistance_ratio - 1.0) * PER_RATIO, 63.0);
        let share = steps(magnet_share * PER_SHARE, 255.0);
        Self((ratio << SHARE_BITS) as u16 | (share as u16 & ((1 << SHARE_BITS) - 1)))
    }

    /// The word.
    pub const fn word(self) -> u16 {
        let Self(word) = self;
        word
    }

    /// Of a word.
    pub const fn from_word(word: u16) -> Self {
        Self(word)
    }

    /// Stator resistance over its rating.
    pub fn resistance_ratio(self) -> f32 {
        let Self(word) = self;
        1.0 + f32::from(word as i16 >> SHARE_BITS) * (1.0 / PER_RATIO)
    }

    /// The magnets' flux linkage over the map's, less 1.
    pub fn magnet_share(self) -> f32 {
        let Self(word) = self;
        let above = 16 - SHARE_BITS;
        f32::from((word << above) as i16 >> above) * (1.0 / PER_SHARE)
    }
}

/// Torque and flux linkage of a machine over those of the map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scales {
    /// Torque.
    pub torque: f32,
    /// Flux linkage.
    pub flux: f32,
}

impl Scales {
    /// As by the map.
    pub const NONE: Self = Self { torque: 1.0, flux: 1.0 };
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_word_holds_both_within_a_step_and_nonsense_is_none() {
        for (ratio, share) in [(1.0, 0.0), (1.47, -0.12), (0.76, 0.04), (1.98, -0.2), (0.1, 0.2)] {
            let warmth = Warmth::from_word(Warmth::new(ratio, share).word());
            assert!((warmth.resistance_ratio() - ratio).abs() < 0.501 / PER_RATIO, "{warmth:?}");
            assert!((warmth.magnet_share() - share).abs() < 0.501 / PER_SHARE, "{warmth:?}");
        }
        let most = Warmth::new(1e9, -1e9);
        assert_eq!((most.resistance_ratio(), most.magnet_share()), (1.0 + 63.0 / 64.0, -255.0 / 1_024.0));
        assert_eq!(Warmth::new(1.0, 0.0), Warmth::NONE);
        assert_eq!(Warmth::new(f32::NAN, f32::NAN), Warmth::NONE);
        assert_eq!((Warmth::NONE.resistance_ratio(), Warmth::NONE.magnet_share()), (1.0, 0.0));
    }
}
