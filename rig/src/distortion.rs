//! Distortion of the current and ripple of the torque in steady state.

use crate::analysis;
use crate::trace::Recording;
use core::f64::consts::TAU;
use serde::Serialize;
use tractive_tablegen::MachineFolder;

/// Evenly sampled phase current and torque over whole fundamental periods.
pub struct Samples {
    /// Angle of the fundamental at each sample, in rad, from any origin.
    pub angle: Vec<f64>,
    /// Phase current, in A.
    pub current_a: Vec<f64>,
    /// Torque, in N·m.
    pub torque_nm: Vec<f64>,
}

/// The distortion of the samples.
#[derive(Clone, Debug)]
pub struct Distortion {
    /// Everything but the fundamental, rms over rms of the fundamental, in percent.
    pub thd_percent: f64,
    /// Torque ripple, rms, in N·m.
    pub torque_rms_nm: f64,
    /// Torque ripple, peak to peak, in N·m.
    pub torque_peak_to_peak_nm: f64,
    /// Harmonics of the current by order, in percent of the fundamental.
    shares: Vec<(u32, f64)>,
}

/// A harmonic of the phase current.
#[derive(Clone, Debug, Serialize)]
pub struct Harmonic {
    /// Order.
    pub order: u32,
    /// Amplitude, in percent of the fundamental.
    pub percent_of_fundamental: f64,
}

/// Orders that are reported.
const ORDERS: [u32; 10] = [5, 7, 8, 10, 11, 13, 14, 16, 17, 19];

impl Samples {
    /// Amplitude of the current's fundamental in A, and the current without it. The fundamental is fitted by least squares: whole turns are seldom a
    /// whole number of samples, and the remainder after a mere projection would then count as distortion.
    pub fn without_fundamental(&self) -> (f64, Vec<f64>) {
        let terms = || self.angle.iter().map(|angle| angle.sin_cos()).zip(&self.current_a);
        let (mut ss, mut sc, mut cc, mut s, mut c) = (0.0, 0.0, 0.0, 0.0, 0.0);
        for ((sin, cos), current) in terms() {
            (ss, sc, cc) = (ss + sin * sin, sc + sin * cos, cc + cos * cos);
            (s, c) = (s + sin * current, c + cos * current);
        }
        let determinant = ss * cc - sc * sc;
        let (a, b) = ((s * cc - c * sc) / determinant, (c * ss - s * sc) / determinant);
        (a.hypot(b), terms().map(|((sin, cos), current)| current - a * sin - b * cos).collect())
    }
}

impl Distortion {
    /// Analyses samples.
    pub fn of(samples: &Samples) -> Self {
        let count = samples.current_a.len().max(1) as f64;
        let (fundamental_a, rest) = samples.without_fundamental();
        let amplitude = |order: u32| {
            let terms = samples.angle.iter().zip(&rest);
            let (cos, sin) = terms.fold((0.0, 0.0), |(cos, sin), (angle, current)| {
                let phase = f64::from(order) * angle;
                (cos + current * phase.cos(), sin + current * phase.sin())
            });
            2.0 * cos.hypot(sin) / count
        };
        let rest_square = rest.iter().map(|current| current * current).sum::<f64>() / count;
        let fundamental_square = 0.5 * fundamental_a * fundamental_a;
        let mean_torque = samples.torque_nm.iter().sum::<f64>() / count;
        let torque_square =
            samples.torque_nm.iter().map(|torque| (torque - mean_torque).powi(2)).sum::<f64>();
        let low = samples.torque_nm.iter().copied().fold(f64::INFINITY, f64::min);
        let high = samples.torque_nm.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        Self {
            thd_percent: (rest_square / fundamental_square).sqrt() * 100.0,
            torque_rms_nm: (torque_square / count).sqrt(),
            torque_peak_to_peak_nm: high - low,
            shares: ORDERS.iter().map(|order| (*order, 100.0 * amplitude(*order) / fundamental_a)).collect(),
        }
    }

    /// A harmonic in percent of the fundamental; 0 for orders that are not analysed.
    pub fn share_percent(&self, order: u32) -> f64 {
        self.shares.iter().find(|(own, _)| *own == order).map_or(0.0, |(_, percent)| *percent)
    }

    /// The harmonics, for reports.
    pub fn harmonics(&self) -> Vec<Harmonic> {
        self.shares
            .iter()
            .map(|(order, percent)| Harmonic { order: *order, percent_of_fundamental: *percent })
            .collect()
    }
}

/// Made from a window of a recording at constant speed, shortened to whole turns of the stator field.
pub fn of_recording(
    recording: &Recording,
    (from_s, to_s): (f64, f64),
    machine: &MachineFolder,
) -> Distortion {
    Distortion::of(&samples(recording, (from_s, to_s), machine))
}

/// Samples of a window of a recording at constant speed, shortened to whole turns of the stator field.
pub fn samples(recording: &Recording, within: (f64, f64), machine: &MachineFolder) -> Samples {
    let pole_pairs = machine.parameters.pole_pairs;
    let rows = analysis::whole_turns(recording, within, pole_pairs);
    let f1_hz = rows.last().map_or(0.0, |row| row.speed_rpm.abs() * f64::from(pole_pairs) / 60.0);
    Samples {
        angle: rows.iter().map(|row| TAU * f1_hz * row.t_s).collect(),
        current_a: rows.iter().map(|row| row.ia_a).collect(),
        torque_nm: rows.iter().map(|row| row.te_nm).collect(),
    }
}
