//! A flux map written by another tool.

use super::axes::{self, GAP, SHORT};
use super::fitted::fitted;
use super::given::Given;
use super::ratings::Ratings;
use super::reading::{AngleFrom, DAxis, Reading};
use super::rectangle::Rectangle;
use super::samples::{Samples, read};
use super::torque;
use super::write;
use crate::options::{finite, needs};
use anyhow::{Result, anyhow, ensure};
use clap::Args;
use std::path::PathBuf;
use tractive_tablegen::FluxMap;

/// A map, and how it is to be read.
#[derive(Clone, Debug, Args)]
pub struct Import {
    /// The map: a CSV with currents and flux linkages of both axes in named columns, in any order, with their units (`Id [A]`, `psi_q_mWb`,
    /// `Flux Linkage D (Vs)`; A and Wb if none is given); the current's magnitude and angle (`Is`, `gamma [deg]`) may replace both currents. Further
    /// columns are ignored.
    #[arg(value_name = "MAP.csv")]
    pub map: PathBuf,
    /// The meaning of its axes and signs.
    #[command(flatten)]
    pub reading: Reading,
    /// Values are rms if their column does not say peak or rms.
    #[arg(long)]
    pub rms: bool,
    /// Factor of all flux linkages, for a map of one slot, one turn or another length.
    #[arg(long, default_value_t = 1.0, value_parser = finite, allow_negative_numbers = true)]
    pub flux_factor: f64,
    /// The limits of machine and inverter.
    #[command(flatten)]
    pub given: Given,
}

/// Deviation from ψ_d even and ψ_q odd in i_q that counts as measurement error, as a share of the largest flux linkage.
const SYMMETRY: f64 = 0.01;
/// Steps of the grid up to the largest current, and most steps beyond it.
const STEPS: i32 = 25;
const BEYOND: i32 = 2;

impl Import {
    /// Makes the folder.
    pub fn make(&self) -> Result<()> {
        self.given.check()?;
        ensure!(self.flux_factor > 0.0, "--flux-factor {}: must be above 0", self.flux_factor);
        let samples = read(&self.map, self.rms)?;
        let from_d = self.reading.angle_from == AngleFrom::D;
        let polar = "currents given by magnitude and angle, as columns Is and gamma";
        needs(&[("--angle-from d", from_d, polar, samples.is_polar)])?;
        let (map, fit) = self.taken(&samples)?;
        let mut ratings = Ratings::of(&map, &self.given)?;
        let fit_line = fit.as_ref().map_or(String::new(), |fit| format!("# {fit}.\n"));
        let comment = format!("# From {}.\n{fit_line}", self.map.display());
        let contents = ratings.contents(&self.given, &self.told(), write::csv(&map, &comment))?;
        write::folder(&self.given.out, &contents)?;
        let rows = self.reading.of(&samples, self.flux_factor);
        let question =
            torque::question(rows.iter().map(|row| (row.values, row.torque_nm)), self.given.pole_pairs);
        ratings.say(&self.given, &fit.into_iter().chain(question).collect::<Vec<_>>())
    }

    /// The map, and a description of its fit if it had to be fitted.
    ///
    /// # Errors
    /// The reason why it is no machine's; if another reading of axes and signs would make it one, that reading.
    fn taken(&self, samples: &Samples) -> Result<(FluxMap, Option<String>)> {
        self.read_as(&self.reading, samples).map_err(|reason| {
            let other =
                self.reading.others(samples.is_polar).find(|other| self.read_as(other, samples).is_ok());
            match other.as_ref().map(Reading::told).as_deref() {
                None => reason,
                Some("") => anyhow!("{reason:#}; without options for axes and signs it is a machine's"),
                Some(options) => anyhow!("{reason:#}; it is a machine's with{options}"),
            }
        })
    }

    /// The map with axes and signs according to a reading: its own nodes, or, if those are no full grid or too rough for a machine's, a fit.
    fn read_as(&self, reading: &Reading, samples: &Samples) -> Result<(FluxMap, Option<String>)> {
        let rows = reading.of(samples, self.flux_factor);
        let grid = Rectangle::of(&rows, &self.map);
        let short = if grid.is_ok() { SHORT } else { GAP };
        let mut units_a = samples.units_a;
        if reading.d_axis == DAxis::Reluctance {
            units_a.reverse();
        }
        axes::check_ends(&rows, units_a, (self.given.max_current, short), &self.map)?;
        let exact = grid.and_then(|grid| self.exact(&grid)).map(|map| (map, None));
        let (map, fit) = exact.or_else(|reason| {
            let fitted = fitted(&rows, self.given.max_current, |map| self.check(map));
            let (map, left) = fitted.map_err(|why| anyhow!("{reason:#}; a fit of one co-energy: {why:#}"))?;
            Ok::<_, anyhow::Error>((map, Some(left)))
        })?;
        axes::check(&map, &self.map)?;
        Ok((map, fit))
    }

    /// The map of a grid's own nodes.
    fn exact(&self, grid: &Rectangle) -> Result<FluxMap> {
        let half = grid.folded(SYMMETRY, &self.map)?;
        half.check_rising(&self.map)?;
        let map = self.resampled(&half);
        self.check(&map)?;
        Ok(map)
    }

    /// The map on the project's grid, iq of both signs: its own nodes if they are even, otherwise interpolated.
    fn resampled(&self, half: &Rectangle) -> FluxMap {
        let most_a = self.given.max_current;
        let ends = half.ends();
        // An axis that ends at the largest current, or at zero, within rounding, ends there exactly.
        let full = |ends: f64| {
            [most_a, 0.0, -most_a]
                .into_iter()
                .find(|full| (ends - full).abs() <= SHORT * most_a)
                .unwrap_or(ends)
        };
        let (first, last, last_q) = (full(ends.0), full(ends.1), full(ends.2));
        let (id_a, iq_a) = if half.is_even() && (first, last, last_q) == ends {
            (half.id_a.clone(), half.iq_a.clone())
        } else if half.is_even() {
            (even(first, last, half.id_a.len()), even(0.0, last_q, half.iq_a.len()))
        } else {
            let step = most_a / f64::from(STEPS);
            let most = |ends: f64| (STEPS + BEYOND).min((ends / step + 1e-6).floor() as i32);
            let along =
                |from: i32, to: i32| (from..=to).map(|k| write::digits(step * f64::from(k))).collect();
            (along(-most(-first), most(last)), along(0, most(last_q)))
        };
        let (psi_d, psi_q) = half.at(&id_a, &iq_a);
        mirrored(id_a, &iq_a, &psi_d, &psi_q)
    }

    /// Checks that the table generator accepts a map.
    fn check(&self, map: &FluxMap) -> Result<()> {
        let taken = FluxMap::parse(write::csv(map, "").as_bytes(), &self.map);
        // Its line numbers do not refer to the file.
        taken.map(drop).map_err(|error| anyhow!("{}: {}", self.map.display(), error.problem))
    }

    /// The command that makes this folder.
    fn told(&self) -> String {
        let mut text = format!("import {}{}{}", self.map.display(), self.given.told(), self.reading.told());
        if self.rms {
            text += " --rms";
        }
        if self.flux_factor != 1.0 {
            text += &format!(" --flux-factor {}", self.flux_factor);
        }
        text
    }
}

/// This many values from one to another, evenly spaced.
fn even(first: f64, last: f64, count: usize) -> Vec<f64> {
    let step = (last - first) / (count - 1) as f64;
    (0..count).map(|k| write::digits(first + step * k as f64)).collect()
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
