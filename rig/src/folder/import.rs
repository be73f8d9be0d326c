//! A flux map as another tool writes it.

use super::given::Given;
use super::header::QUANTITIES;
use super::ratings::Ratings;
use super::rectangle::Rectangle;
use super::samples::{Sample, read};
use super::write;
use crate::options::finite;
use anyhow::{Result, ensure};
use clap::{Args, ValueEnum};
use std::path::PathBuf;
use tractive_tablegen::FluxMap;

/// The direction of a map's d axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum DAxis {
    /// Along the magnets' flux, or of a machine without magnets along the larger reluctance.
    Magnet,
    /// Along the least reluctance, with the magnets along −q: as SynRM and PMaSynRM are often described.
    Reluctance,
}

impl DAxis {
    const fn name(self) -> &'static str {
        match self {
            Self::Magnet => "magnet",
            Self::Reluctance => "reluctance",
        }
    }
}

/// A map, and how it is to be read.
#[derive(Clone, Debug, Args)]
pub struct Import {
    /// The map: a CSV with currents and flux linkages of both axes in named columns, in any order, with their units (`Id [A]`, `psi_q_mWb`,
    /// `Flux Linkage D (Vs)`; A and Wb where none is said), every node of a grid once. Further columns are left out.
    #[arg(value_name = "MAP.csv")]
    pub map: PathBuf,
    /// Direction of the map's d axis.
    #[arg(long, value_enum, default_value = "magnet")]
    pub d_axis: DAxis,
    /// Quantities that the map counts the other way round.
    #[arg(long, value_delimiter = ',', value_parser = QUANTITIES, value_name = "QUANTITY,…")]
    pub negate: Vec<String>,
    /// Values are rms where their column does not say peak or rms.
    #[arg(long)]
    pub rms: bool,
    /// Factor of all flux linkages, for a map of one slot, one turn or another length.
    #[arg(long, default_value_t = 1.0, value_parser = finite, allow_negative_numbers = true)]
    pub flux_factor: f64,
    /// The limits of machine and inverter.
    #[command(flatten)]
    pub given: Given,
}

/// Deviation from ψ_d even and ψ_q odd in i_q that is measurement, as a share of the largest flux linkage.
const SYMMETRY: f64 = 0.01;
/// Steps of the grid up to the largest current, and beyond it at most.
const STEPS: i32 = 25;
const BEYOND: i32 = 2;

impl Import {
    /// Makes the folder.
    pub fn make(&self) -> Result<()> {
        self.given.check()?;
        ensure!(self.flux_factor > 0.0, "--flux-factor {}: must be above 0", self.flux_factor);
        let mut samples = read(&self.map, self.rms)?;
        samples.iter_mut().for_each(|sample| self.turn(sample));
        let rectangle = Rectangle::of(&samples, &self.map)?;
        let half = rectangle.folded(SYMMETRY, &self.map)?;
        half.check_rising(&self.map)?;
        let map = self.resampled(&half)?;
        let mut ratings = Ratings::of(&map, &self.given)?;
        let comment = format!("# From {}.\n", self.map.display());
        let contents = ratings.contents(&self.given, &self.told(), write::csv(&map, &comment))?;
        write::folder(&self.given.out, &contents)?;
        ratings.say(&self.given)
    }

    /// Into the project's frame.
    fn turn(&self, sample: &mut Sample) {
        for name in &self.negate {
            if let Some(place) = QUANTITIES.iter().position(|quantity| quantity == name) {
                sample.values[place] *= -1.0;
            }
        }
        let [id, iq, psi_d, psi_q] = sample.values;
        let flux = self.flux_factor;
        sample.values = match self.d_axis {
            DAxis::Magnet => [id, iq, flux * psi_d, flux * psi_q],
            // −q is where the magnets are, and d a quarter of a turn ahead of it.
            DAxis::Reluctance => [-iq, id, -flux * psi_q, flux * psi_d],
        }
        // There is one zero.
        .map(|value| value + 0.0);
    }

    /// The map on the project's grid, iq of both signs: its own nodes where they are even, otherwise between them.
    fn resampled(&self, half: &Rectangle) -> Result<FluxMap> {
        let most_a = self.given.max_current;
        let (first, last, last_q) = half.ends();
        ensure!(
            first < 0.0,
            "{}: id: begins at {first}: must go below 0, with d along the magnets (--d-axis, --negate)",
            self.map.display()
        );
        let reach = |ends: f64, what: &str| {
            ensure!(
                ends >= most_a * (1.0 - 1e-9),
                "--max-current {most_a}: must be at most {}: {} ends there along {what}",
                write::digits(ends),
                self.map.display()
            );
            Ok(())
        };
        reach(-first, "−d")?;
        reach(last_q, "q")?;
        ensure!(
            last >= 0.0,
            "{}: id: ends at {last}: must reach 0, with d along the magnets (--d-axis, --negate)",
            self.map.display()
        );
        let (id_a, iq_a) = if half.is_even() {
            (half.id_a.clone(), half.iq_a.clone())
        } else {
            let step = most_a / f64::from(STEPS);
            let most = |ends: f64| (STEPS + BEYOND).min((ends / step + 1e-6).floor() as i32);
            let along =
                |from: i32, to: i32| (from..=to).map(|k| write::digits(step * f64::from(k))).collect();
            let (d, q): (Vec<f64>, Vec<f64>) = (along(-most(-first), most(last)), along(0, most(last_q)));
            (d, q)
        };
        let (psi_d, psi_q) = half.at(&id_a, &iq_a);
        Ok(mirrored(id_a, &iq_a, &psi_d, &psi_q))
    }

    /// The command that makes this folder.
    fn told(&self) -> String {
        let mut text = format!("import {}{}", self.map.display(), self.given.told());
        if self.d_axis != DAxis::Magnet {
            text += &format!(" --d-axis {}", self.d_axis.name());
        }
        if !self.negate.is_empty() {
            text += &format!(" --negate {}", self.negate.join(","));
        }
        if self.rms {
            text += " --rms";
        }
        if self.flux_factor != 1.0 {
            text += &format!(" --flux-factor {}", self.flux_factor);
        }
        text
    }
}

/// Both signs of iq from its half: ψ_d even, ψ_q odd.
fn mirrored(id_a: Vec<f64>, iq_a: &[f64], psi_d: &[f64], psi_q: &[f64]) -> FluxMap {
    let columns = iq_a.len();
    let whole = |values: &[f64], sign: f64| {
        let of_row = |row: &[f64]| {
            let negative = row[1..].iter().rev().map(|value| sign * value).collect::<Vec<_>>();
            negative.into_iter().chain(row.iter().copied()).map(write::digits).collect::<Vec<_>>()
        };
        values.chunks(columns).flat_map(of_row).collect()
    };
    let negative = iq_a[1..].iter().rev().map(|value| -value);
    FluxMap {
        psi_d_wb: whole(psi_d, 1.0),
        psi_q_wb: whole(psi_q, -1.0),
        id_a,
        iq_a: negative.chain(iq_a.iter().copied()).collect(),
    }
}
