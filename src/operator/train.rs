//! The limits of a train: the current and the power that it may take from its line and give back, and how fast it can accelerate.

use crate::cell::Words;

/// Limits of line and acceleration; each is none at its value in [`TrainLimits::NONE`].
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct TrainLimits {
    /// Largest line current while motoring, in A; less when the line's voltage sags.
    pub motoring_a: f32,
    /// Largest line current while braking, in A.
    pub braking_a: f32,
    /// Largest line power while motoring, in W.
    pub motoring_w: f32,
    /// Largest line power while braking, in W.
    pub braking_w: f32,
    /// Largest acceleration and deceleration of the rotor on rails with grip, mechanical, in rad/s².
    pub acceleration_rad_s2: f32,
}

impl TrainLimits {
    /// No limits: values that no drive of this kind reaches.
    pub const NONE: Self =
        Self { motoring_a: 1e4, braking_a: 1e4, motoring_w: 1e8, braking_w: 1e8, acceleration_rad_s2: 1e8 };
}

impl Words<5> for TrainLimits {
    fn to_words(self) -> [u32; 5] {
        let Self { motoring_a, braking_a, motoring_w, braking_w, acceleration_rad_s2 } = self;
        [motoring_a, braking_a, motoring_w, braking_w, acceleration_rad_s2].map(f32::to_bits)
    }

    fn from_words(words: [u32; 5]) -> Self {
        let [motoring_a, braking_a, motoring_w, braking_w, acceleration_rad_s2] = words.map(f32::from_bits);
        Self { motoring_a, braking_a, motoring_w, braking_w, acceleration_rad_s2 }
    }
}
