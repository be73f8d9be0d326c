//! The magnets' temperature, from the flux linkage that the drive has learned: magnets lose flux as they warm.
//!
//! The drive reports a single number for it, the error of the flux linkage along itself. It belongs to the magnets alone if hardly any current flows
//! or the gates are off. Errors of other origin (a magnet's tolerance, an error of the link's sensor, which looks the same) show as temperature: 1 %
//! as 10 K.

use super::Load;
use super::derate::Derating;

/// The magnets.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Magnets {
    /// Change of their flux linkage with temperature, as a share per K: −0.001 of neodymium, −0.002 of ferrite.
    pub per_k: f32,
    /// Temperature at which they have the flux linkage of the flux map, in °C.
    pub map_c: f32,
    /// The torque that hot magnets leave; an estimate never trips the drive.
    pub derating: Derating,
}

/// Share of the largest current below which the flux linkage is the magnets'.
const SMALL: f32 = 0.05;
/// Time for which the current must have been small, in s: forty of the means from which the error is learnt.
const SETTLED_S: f32 = 1.0;

/// The estimate, in °C, and the time for which the current has been small, in s.
#[derive(Clone, Copy, Debug)]
pub(super) struct MagnetState {
    celsius: Option<f32>,
    small_s: f32,
}

impl MagnetState {
    pub const UNKNOWN: Self = Self { celsius: None, small_s: 0.0 };

    /// One slot; the estimate is kept while it cannot be renewed.
    pub fn step(&mut self, load: &Load, magnets: &Magnets, slot_s: f32) -> Option<f32> {
        let is_small = load.reference_a < SMALL * load.max_current_a && load.map_error != 0.0;
        self.small_s = if is_small { self.small_s + slot_s } else { 0.0 };
        let celsius = magnets.map_c + load.map_error / magnets.per_k;
        if self.small_s > SETTLED_S && celsius.is_finite() {
            // The count need not go further.
            (self.celsius, self.small_s) = (Some(celsius), 2.0 * SETTLED_S);
        }
        self.celsius
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MAGNETS: Magnets =
        Magnets { per_k: -1e-3, map_c: 20.0, derating: Derating { from_c: 120.0, none_c: 150.0 } };

    fn load(reference_a: f32, map_error: f32) -> Load {
        Load { current_a: 0.0, squares_a2: 0.0, reference_a, udc_v: 1_500.0, map_error, max_current_a: 200.0 }
    }

    #[test]
    fn flux_that_is_missing_without_current_is_warmth() {
        let mut state = MagnetState::UNKNOWN;
        for _ in 0..990 {
            assert_eq!(state.step(&load(5.0, -0.08), &MAGNETS, 1e-3), None);
        }
        for _ in 0..20 {
            state.step(&load(5.0, -0.08), &MAGNETS, 1e-3);
        }
        let celsius = state.celsius.unwrap();
        assert!((celsius - 100.0).abs() < 1e-3, "{celsius}");
        // With a current, or at a speed that reveals nothing, it is kept.
        assert_eq!(state.step(&load(100.0, -0.01), &MAGNETS, 1e-3), Some(celsius));
        assert_eq!(state.step(&load(5.0, 0.0), &MAGNETS, 1e-3), Some(celsius));
    }
}
