//! The possible meanings of a map's axes and signs.

use super::header::QUANTITIES;
use super::samples::{Sample, Samples};
use clap::{Args, ValueEnum};

/// The direction of a map's d axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum DAxis {
    /// Along the magnets' flux, or for a machine without magnets along the larger reluctance.
    Magnet,
    /// Along the least reluctance, with the magnets along −q: as SynRM and PMaSynRM are often described.
    Reluctance,
}

/// The axis from which the angle of a polar map is measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum AngleFrom {
    /// From q towards −d, as a phase advance.
    Q,
    /// From d towards q.
    D,
}

/// The meaning of a map's axes and signs.
#[derive(Clone, Debug, PartialEq, Eq, Args)]
pub struct Reading {
    /// Direction of the map's d axis.
    #[arg(long, value_enum, default_value = "magnet")]
    pub d_axis: DAxis,
    /// The map's axis from which the angle is measured, if currents are given as magnitude and angle.
    #[arg(long, value_enum, default_value = "q")]
    pub angle_from: AngleFrom,
    /// Quantities that the map counts with the opposite sign.
    #[arg(long, value_delimiter = ',', value_parser = QUANTITIES, value_name = "QUANTITY,…")]
    pub negate: Vec<String>,
}

/// Every possible meaning of a map's signs, except mirror images, which are the same machine: a quantity counted with the opposite sign, a rotation of the axes
/// by half a turn, an exchange of motor and generator. Each lists the quantities that change their sign, the fewest first.
const MAGNET_SIGNS: [&[&str]; 8] = [
    &[],
    &["id"],
    &["iq"],
    &["psi_d"],
    &["id", "psi_d"],
    &["id", "iq"],
    &["iq", "psi_d"],
    &["id", "iq", "psi_d"],
];
const RELUCTANCE_SIGNS: [&[&str]; 8] = [
    &[],
    &["iq"],
    &["id"],
    &["psi_q"],
    &["iq", "psi_q"],
    &["id", "iq"],
    &["id", "psi_q"],
    &["id", "iq", "psi_q"],
];

impl Reading {
    /// The rows in the project's frame.
    pub fn of(&self, samples: &Samples, flux_factor: f64) -> Vec<Sample> {
        let turned = |sample: &Sample| Sample {
            values: self.turned(sample.values, samples.is_polar, flux_factor),
            ..*sample
        };
        samples.rows.iter().map(turned).collect()
    }

    fn turned(&self, mut values: [f64; 4], is_polar: bool, flux: f64) -> [f64; 4] {
        if is_polar && self.angle_from == AngleFrom::D {
            values = [values[1], -values[0], values[2], values[3]];
        }
        for (value, quantity) in values.iter_mut().zip(QUANTITIES) {
            if self.negate.iter().any(|name| name == quantity) {
                *value *= -1.0;
            }
        }
        let [id, iq, psi_d, psi_q] = values;
        match self.d_axis {
            DAxis::Magnet => [id, iq, flux * psi_d, flux * psi_q],
            // The magnets lie along −q, and d is a quarter of a turn ahead of it.
            DAxis::Reluctance => [-iq, id, -flux * psi_q, flux * psi_d],
        }
        // Adding zero turns −0 into 0.
        .map(|value| value + 0.0)
    }

    /// The other possible meanings of a map.
    pub fn others(&self, is_polar: bool) -> impl Iterator<Item = Self> + '_ {
        let angles: &[AngleFrom] = if is_polar { &[AngleFrom::Q, AngleFrom::D] } else { &[AngleFrom::Q] };
        let axes = [(DAxis::Magnet, MAGNET_SIGNS), (DAxis::Reluctance, RELUCTANCE_SIGNS)];
        let all = axes.into_iter().flat_map(move |(d_axis, signs)| {
            signs.into_iter().flat_map(move |negate| {
                let negate: Vec<_> = negate.iter().map(|name| (*name).to_owned()).collect();
                angles.iter().map(move |angle_from| Self {
                    d_axis,
                    angle_from: *angle_from,
                    negate: negate.clone(),
                })
            })
        });
        all.filter(move |other| other != self)
    }

    /// The options of this reading, each after a blank; none if all are the usual ones.
    pub fn told(&self) -> String {
        let mut text = String::new();
        if self.d_axis == DAxis::Reluctance {
            text += " --d-axis reluctance";
        }
        if self.angle_from == AngleFrom::D {
            text += " --angle-from d";
        }
        if !self.negate.is_empty() {
            text += &format!(" --negate {}", self.negate.join(","));
        }
        text
    }
}
