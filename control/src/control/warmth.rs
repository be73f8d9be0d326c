//! The warmth of the machine, told to the control law by whoever measures its temperatures.

use crate::frames::limit;

/// Steps of 1 of a resistance's ratio.
const PER_RATIO: f32 = 16_384.0;

/// The resistance of the winding at its temperature, in half a word of a mailbox.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Warmth(u16);

impl Warmth {
    /// The rated value: nothing is known of temperatures.
    pub const NONE: Self = Self(0);

    /// The warmth for a stator resistance over its rating, 0.01 to 2.99. NaN counts as rated.
    pub fn new(resistance_ratio: f32) -> Self {
        let steps = (limit(resistance_ratio, 0.01, 2.99) - 1.0) * PER_RATIO;
        Self((steps + 0.5_f32.copysign(steps)) as i16 as u16)
    }

    /// The word.
    pub const fn word(self) -> u16 {
        let Self(word) = self;
        word
    }

    /// The warmth of a word.
    pub const fn from_word(word: u16) -> Self {
        Self(word)
    }

    /// Stator resistance over its rating.
    pub fn resistance_ratio(self) -> f32 {
        let Self(word) = self;
        1.0 + f32::from(word as i16) * (1.0 / PER_RATIO)
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
    /// The map's own torque and flux linkage.
    pub const NONE: Self = Self { torque: 1.0, flux: 1.0 };
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_word_holds_a_ratio_within_a_step_and_nonsense_is_none() {
        for ratio in [1.0, 1.47, 0.76, 1.98, 0.1, 2.9] {
            let warmth = Warmth::from_word(Warmth::new(ratio).word());
            assert!((warmth.resistance_ratio() - ratio).abs() < 0.501 / PER_RATIO, "{warmth:?}");
        }
        for (ratio, held) in [(1e9, 2.99), (-1e9, 0.01)] {
            assert!((Warmth::new(ratio).resistance_ratio() - held).abs() < 0.501 / PER_RATIO, "{ratio}");
        }
        assert_eq!(Warmth::new(1.0), Warmth::NONE);
        assert_eq!(Warmth::new(f32::NAN), Warmth::NONE);
        assert_eq!(Warmth::NONE.resistance_ratio(), 1.0);
    }
}
