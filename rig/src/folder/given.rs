//! The limits of machine and inverter that a user gives for every new folder.

use crate::options::finite;
use anyhow::{Result, ensure};
use clap::Args;
use core::f64::consts::{FRAC_2_PI, TAU};
use std::path::PathBuf;
use tractive_tablegen::TWO_LEVEL_SHARE;

/// The limits, and the place of the folder.
#[derive(Clone, Debug, Args)]
pub struct Given {
    /// Pole pairs.
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..=100))]
    pub pole_pairs: u32,
    /// Stator resistance of a phase, in ohm.
    #[arg(long, value_name = "OHM", value_parser = finite, allow_negative_numbers = true)]
    pub rs: f64,
    /// Largest phase current, peak, in A.
    #[arg(long, value_name = "A", value_parser = finite, allow_negative_numbers = true)]
    pub max_current: f64,
    /// Nominal DC-link voltage, in V.
    #[arg(long, value_name = "V", value_parser = finite, allow_negative_numbers = true, required_unless_present = "zs9_source")]
    pub udc: Option<f64>,
    /// Lowest DC-link voltage in normal operation, in V; default 0.8 of the nominal one.
    #[arg(long, value_name = "V", value_parser = finite, allow_negative_numbers = true)]
    pub udc_min: Option<f64>,
    /// Highest DC-link voltage in normal operation, in V; default 1.2 of the nominal one.
    #[arg(long, value_name = "V", value_parser = finite, allow_negative_numbers = true)]
    pub udc_max: Option<f64>,
    /// Voltage of a Z-source nine-switch inverter's source, in V, instead of a link's: shoot-through raises the capacitors' voltage to 4/3 of it, 3/2 at most.
    #[arg(long, value_name = "V", value_parser = finite, allow_negative_numbers = true, conflicts_with_all = ["udc", "udc_min", "udc_max"])]
    pub zs9_source: Option<f64>,
    /// Largest speed, in r/min.
    #[arg(long, value_name = "N", value_parser = finite, allow_negative_numbers = true)]
    pub max_speed_rpm: f64,
    /// Highest switching frequency of a device, in Hz.
    #[arg(long, value_name = "HZ", value_parser = finite, allow_negative_numbers = true)]
    pub max_switching_hz: f64,
    /// Inertia of the rotor and what it drives, in kg·m²; without it full torque reaches the largest speed in a second.
    #[arg(long, value_name = "KG_M2", value_parser = finite, allow_negative_numbers = true)]
    pub inertia: Option<f64>,
    /// Name of the machine; default that of the folder.
    #[arg(long)]
    pub name: Option<String>,
    /// The folder to make. An existing one may contain a machine's two files, which are replaced, and nothing else.
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    /// Print the ratings as JSON.
    #[arg(long)]
    pub json: bool,
}

/// Voltages of a nine-switch inverter's capacitors over the source's: without shoot-through, and at a duty of 0.2 and of 0.25.
const CAPACITORS: [f64; 3] = [1.0, 4.0 / 3.0, 1.5];

/// A value's option, the value, the least and the most that are allowed, and the unit.
pub struct Range(pub &'static str, pub f64, pub f64, pub f64, pub &'static str);

/// Least number that counts as above 0.
pub const ABOVE_ZERO: f64 = 1e-9;

/// Checks that values are within their ranges.
///
/// # Errors
/// The first value that is not, by its option.
pub fn check(ranges: &[Range]) -> Result<()> {
    for Range(option, value, least, most, unit) in ranges {
        let from = if *least == ABOVE_ZERO { "above 0,".to_owned() } else { format!("from {least}") };
        let unit = if unit.is_empty() { String::new() } else { format!(" {unit}") };
        ensure!((least..=most).contains(&value), "{option} {value}: must be {from} up to {most}{unit}");
    }
    Ok(())
}

impl Given {
    /// Lowest, nominal and highest voltage of the link of a two-level inverter, in V.
    pub fn link_v(&self) -> [f64; 3] {
        match (self.zs9_source, self.udc) {
            (Some(source_v), _) => CAPACITORS.map(|share| share * source_v * TWO_LEVEL_SHARE),
            (None, udc) => {
                let udc = udc.unwrap_or_default();
                [self.udc_min.unwrap_or(0.8 * udc), udc, self.udc_max.unwrap_or(1.2 * udc)]
            }
        }
    }

    /// The highest voltage that the diodes may charge to without a trip, in V: the link's, or that of a nine-switch inverter's capacitors.
    pub fn highest_v(&self) -> f64 {
        self.zs9_source.map_or(self.link_v()[2], |source_v| CAPACITORS[2] * source_v)
    }

    /// The option that gives the voltage, as it was given.
    pub fn voltage_option(&self) -> String {
        match self.zs9_source {
            Some(source_v) => format!("--zs9-source {source_v}"),
            None => format!("--udc {}", self.udc.unwrap_or_default()),
        }
    }

    /// The largest fundamental of a phase that the nominal link gives, peak, in V: that of square wave.
    pub fn voltage_v(&self) -> f64 {
        FRAC_2_PI * self.link_v()[1]
    }

    /// Electrical angular speed, in rad/s, of a speed in r/min.
    pub fn omega(&self, speed_rpm: f64) -> f64 {
        speed_rpm * f64::from(self.pole_pairs) * TAU / 60.0
    }

    /// The name: the given one, or the folder's.
    pub fn name(&self) -> String {
        let folder = || self.out.file_name().map(|name| name.to_string_lossy().into_owned());
        self.name.clone().or_else(folder).unwrap_or_else(|| "machine".to_owned())
    }

    /// Checks all of them, each by itself and together.
    ///
    /// # Errors
    /// The first option that makes no sense.
    pub fn check(&self) -> Result<()> {
        let [least_v, nominal_v, most_v] = self.link_v();
        check(&[
            Range("--rs", self.rs, 0.0, 1e3, "ohm"),
            Range("--max-current", self.max_current, ABOVE_ZERO, 1e5, "A"),
            Range("--zs9-source", self.zs9_source.unwrap_or(1.0), ABOVE_ZERO, 1e5, "V"),
            Range("--udc", nominal_v, ABOVE_ZERO, 1e5, "V"),
            Range("--udc-min", least_v, ABOVE_ZERO, nominal_v, "V, the nominal one"),
            Range("--udc-max", most_v, nominal_v, 3.0 * nominal_v, "V, three times the nominal one"),
            Range("--max-speed-rpm", self.max_speed_rpm, ABOVE_ZERO, 1e6, "r/min"),
            Range("--max-switching-hz", self.max_switching_hz, 50.0, 100e3, "Hz"),
            Range("--inertia", self.inertia.unwrap_or(1.0), ABOVE_ZERO, 1e7, "kg·m²"),
        ])?;
        let most_ohm = 0.5 * nominal_v / self.max_current;
        ensure!(
            self.rs <= most_ohm,
            "--rs {}: must be at most {most_ohm}: --max-current {} drops no more than half of the voltage of {} across it",
            self.rs,
            self.max_current,
            self.voltage_option()
        );
        let stator_hz = self.max_speed_rpm / 60.0 * f64::from(self.pole_pairs);
        ensure!(
            self.max_switching_hz >= stator_hz,
            "--max-switching-hz {}: must be at least {stator_hz:.0}, the stator frequency at --max-speed-rpm {}",
            self.max_switching_hz,
            self.max_speed_rpm
        );
        ensure!(!self.name().trim().is_empty(), "--name: must not be empty");
        Ok(())
    }

    /// The options as they were given, except the folder.
    pub fn told(&self) -> String {
        let Self { pole_pairs, rs, max_current, max_speed_rpm, max_switching_hz, .. } = self;
        let optional = [("udc-min", self.udc_min), ("udc-max", self.udc_max), ("inertia", self.inertia)];
        let said = optional.iter().filter_map(|(name, value)| Some(format!(" --{name} {}", (*value)?)));
        let name = self.name.as_ref().map_or(String::new(), |name| format!(" --name {name:?}"));
        format!(
            " --pole-pairs {pole_pairs} --rs {rs} --max-current {max_current} {} --max-speed-rpm {max_speed_rpm} --max-switching-hz {max_switching_hz}{}{name}",
            self.voltage_option(),
            said.collect::<String>()
        )
    }
}
