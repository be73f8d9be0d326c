//! The torque that a pattern's ripple flux makes.

use super::Waveform;
use std::f64::consts::{FRAC_PI_2, FRAC_PI_3};

/// The direction in which ripple flux makes torque, ahead of the fundamental's voltage, in rad: −46° to −47° at the reference machine's largest
/// torque on its MTPA curve, at any speed, by its flux map's incremental inductances.
const AHEAD_RAD: f64 = -0.81;
/// The weight of the torque's peaks relative to the distortion: it increases the distortion by 1.4 % at most.
const WEIGHT: f64 = 0.4;
/// Number of the torque's harmonics that count, six a turn each, and of instants in a sixth of a turn.
const HARMONICS: usize = 20;
const INSTANTS: usize = 64;
/// The exponent of the mean, which is close to the largest value, but smooth.
const EXPONENT: i32 = 8;

/// The waves of the torque's harmonics at the instants.
pub(super) struct TorqueRipple {
    /// Cosine and sine of `6 k θ` by k and instant, times those of the direction.
    waves: Vec<[(f64, f64); INSTANTS]>,
}

impl TorqueRipple {
    /// In the reference machine's direction.
    pub(super) fn new() -> Self {
        Self::ahead(AHEAD_RAD)
    }

    /// In a direction ahead of the fundamental's voltage, in rad.
    pub(super) fn ahead(ahead_rad: f64) -> Self {
        let direction = ahead_rad - FRAC_PI_2;
        let (across, along) = (libm::cos(direction), libm::sin(direction));
        let wave = |k: usize, instant: usize| {
            let angle = 6.0 * k as f64 * FRAC_PI_3 * instant as f64 / INSTANTS as f64;
            (across * libm::cos(angle), along * libm::sin(angle))
        };
        let waves = (1..=HARMONICS).map(|k| std::array::from_fn(|instant| wave(k, instant)));
        Self { waves: waves.collect() }
    }

    /// The square of the mean, with the exponent, of the ripple flux in that direction, in shares of six-step's fundamental squared, weighted.
    ///
    /// In the frame of the fundamental, harmonics 6k + 1 turn forward and 6k − 1 backward at 6k times its frequency.
    pub(super) fn squared(&self, wave: &Waveform) -> f64 {
        let mut torque = [0.0; INSTANTS];
        for ((below, above), waves) in wave.flux_harmonics().zip(&self.waves) {
            for (torque, (across, along)) in torque.iter_mut().zip(waves) {
                *torque += (above + below) * across + (above - below) * along;
            }
        }
        let mean = torque.iter().map(|torque| torque.powi(EXPONENT)).sum::<f64>() / INSTANTS as f64;
        WEIGHT * libm::pow(mean, 2.0 / f64::from(EXPONENT))
    }
}

#[cfg(test)]
mod tests;
