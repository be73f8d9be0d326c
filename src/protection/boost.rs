//! The boost of the Z-source against the voltages that are measured.

use super::{FailedCheck, Fault};

/// Averaging time, in s: several periods of the network's own swing.
const MEAN_S: f32 = 0.02;
/// Largest mean of `(1 − D) U_dc − (1 − 2 D) U_C`, which a sound network keeps near zero, over the source's voltage. Healthy runs of the rig, with all
/// flaws of `--real`, stay within 0.007.
const MOST_SHARE: f32 = 0.03;

/// The watch over the sensors of capacitor and source. At the mean, no voltage is left on an inductor: in the shoot-through `D` it lies on a capacitor,
/// otherwise between capacitor and source. A capacitor that reads 5 % too low beyond what its least duty hides, or a source too high, breaks this
/// balance; so does a duty that rises because a sensor is frozen. These are the errors that overcharge the capacitors. A capacitor that reads too high is no proof: so does one that was
/// charged before, behind a source that takes nothing back.
#[derive(Clone, Copy, Debug)]
pub struct BoostWatch {
    mean_v: f32,
}

impl BoostWatch {
    /// Nothing seen yet.
    pub const REST: Self = Self { mean_v: 0.0 };

    /// One control period with the least duty that its pulses had; returns the capacitor's voltage and the one that the duty makes of the source's, if they
    /// cannot be the same.
    #[inline]
    pub fn step(&mut self, source_v: f32, capacitor_v: f32, duty: f32, period_s: f32) -> Option<FailedCheck> {
        let missing_v = (1.0 - duty) * source_v - (1.0 - 2.0 * duty) * capacitor_v;
        self.mean_v += period_s / MEAN_S * (missing_v - self.mean_v);
        let implausible = self.mean_v > MOST_SHARE * source_v;
        implausible
            .then(|| (Fault::LinkImplausible, capacitor_v, (1.0 - duty) / (1.0 - 2.0 * duty) * source_v))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The period in which the watch trips, of the first second; capacitor's and source's readings are off by such factors.
    fn trips_after([capacitor, source]: [f32; 2], duty: f32) -> Option<usize> {
        let boosted_v = (1.0 - duty) / (1.0 - 2.0 * duty) * 400.0;
        let mut watch = BoostWatch::REST;
        (0..10_000).find(|_| watch.step(source * 400.0, capacitor * boosted_v, duty, 1e-4).is_some())
    }

    #[test]
    fn a_sound_network_small_errors_and_charged_capacitors_pass() {
        for duty in [0.0, 1.0 / 6.0, 0.3] {
            for gains in [[1.0, 1.0], [0.99, 1.0], [1.0, 1.01], [0.985, 1.005], [1.4, 1.0], [1.0, 0.7]] {
                assert_eq!(trips_after(gains, duty), None, "{gains:?} {duty}");
            }
        }
    }

    /// An error of a tenth within 20 ms, a dead sensor within a millisecond.
    #[test]
    fn a_sensor_that_is_off_is_found() {
        for duty in [0.0, 1.0 / 6.0, 0.3] {
            for gains in [[0.9, 1.0], [1.0, 1.1], [0.95, 1.05]] {
                assert!(trips_after(gains, duty).is_some_and(|period| period < 200), "{gains:?} {duty}");
            }
        }
        assert!(trips_after([0.0, 1.0], 1.0 / 6.0).is_some_and(|period| period < 10));
        let mut watch = BoostWatch { mean_v: 100.0 };
        let (fault, found_v, wanted_v) = watch.step(400.0, 500.0, 1.0 / 6.0, 1e-4).unwrap();
        assert_eq!((fault, found_v), (Fault::LinkImplausible, 500.0));
        assert!((wanted_v - 500.0).abs() < 1e-3);
    }

    /// A swing of the network at 190 Hz with a tenth of the source's voltage is none of its sensors'.
    #[test]
    fn a_swing_passes() {
        let mut watch = BoostWatch::REST;
        for period in 0..10_000 {
            let swing_v = 40.0 * (core::f32::consts::TAU * 190.0 * 1e-4 * period as f32).sin();
            assert_eq!(watch.step(400.0, 500.0 + swing_v, 1.0 / 6.0, 1e-4), None, "{period}");
        }
    }
}
