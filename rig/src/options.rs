//! Options that all runs share.

use crate::bench::Flaws;
use crate::law::LawName;
use crate::machine::Machine;
use crate::plant::PlantSettings;
use crate::run::Emulator;
use clap::{Args, ValueEnum};
use serde::Serialize;
use std::path::PathBuf;
use std::str::FromStr;
use tractive::named;

named! {
    /// The place where the drive runs.
    #[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum, Serialize)]
    #[serde(rename_all = "lowercase")]
    pub enum On {
        /// The image, in QEMU.
        Qemu => "qemu",
        /// The same code, on the host.
        Host => "host",
    }
}

/// A DC-link ripple, written `V@HZ`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Ripple {
    /// Amplitude, in V.
    pub amplitude_v: f64,
    /// Frequency, in Hz.
    pub frequency_hz: f64,
}

impl FromStr for Ripple {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let parse = || {
            let (volts, hertz) = text.split_once('@')?;
            let ripple = Self { amplitude_v: volts.parse().ok()?, frequency_hz: hertz.parse().ok()? };
            (ripple.amplitude_v >= 0.0 && ripple.frequency_hz > 0.0).then_some(ripple)
        };
        parse().ok_or_else(|| "must be V@HZ, for instance 30@300".to_owned())
    }
}

/// A number that `good` accepts; the error says what is allowed.
pub fn number(text: &str, allowed: &str, good: impl Fn(f64) -> bool) -> Result<f64, String> {
    let value = text.parse::<f64>().ok().filter(|value| value.is_finite() && good(*value));
    value.ok_or_else(|| format!("must be {allowed}"))
}

/// A finite number that is not negative.
pub fn not_negative(text: &str) -> Result<f64, String> {
    number(text, "a number of at least 0", |value| value >= 0.0)
}

/// A finite number above zero.
pub fn positive(text: &str) -> Result<f64, String> {
    number(text, "a number above 0", |value| value > 0.0)
}

/// Any finite number.
pub fn finite(text: &str) -> Result<f64, String> {
    number(text, "a finite number", |_| true)
}

fn seed(text: &str) -> Result<u64, String> {
    text.parse().map_err(|_| format!("must be a whole number from 0 to {}", u64::MAX))
}

/// Options of every run.
#[derive(Clone, Debug, Args, Serialize)]
pub struct RunOptions {
    /// The place where the drive runs; `cargo xtask` means qemu unless told otherwise.
    #[arg(long, value_enum, env = "TRACTIVE_ON", hide_env = true, default_value = "host")]
    pub on: On,
    /// The control law.
    #[arg(long, value_enum, default_value = "tractive")]
    pub law: LawName,
    /// Folder for the files; default target/tractive/SCENARIO.
    #[serde(skip)]
    #[arg(long)]
    pub out: Option<PathBuf>,
    /// A folder of tables/, or the path of any machine folder; default the system's own.
    #[arg(long)]
    pub machine: Option<String>,
    /// Step of trace.csv, in s; default as the scenario needs.
    #[arg(long, value_parser = positive, allow_negative_numbers = true)]
    pub dt: Option<f64>,
    /// Seed of the noise.
    #[arg(long, default_value_t = 1, value_parser = seed, allow_negative_numbers = true)]
    pub seed: u64,
    /// Print the summary as JSON.
    #[serde(skip)]
    #[arg(long)]
    pub json: bool,
    /// DC-link voltage, in V; default the machine's nominal one.
    #[arg(long, value_parser = positive, allow_negative_numbers = true)]
    pub udc: Option<f64>,
    /// Dead time, in µs.
    #[arg(long, default_value_t = 0.0, value_parser = not_negative, allow_negative_numbers = true)]
    pub dead_time_us: f64,
    /// Shortest pulse, in µs; default 10, or, for a machine whose devices switch faster than 900 Hz, the same share of a carrier.
    #[arg(long, value_parser = not_negative, allow_negative_numbers = true)]
    pub min_pulse_us: Option<f64>,
    /// Resolution of the current converters, in bits.
    #[arg(long, value_parser = clap::value_parser!(u32).range(4..=24), allow_negative_numbers = true)]
    pub adc_bits: Option<u32>,
    /// Current noise, rms, in A.
    #[arg(long, default_value_t = 0.0, value_parser = not_negative, allow_negative_numbers = true)]
    pub noise_a: f64,
    /// DC-link ripple, V@HZ.
    #[arg(long)]
    pub udc_ripple: Option<Ripple>,
    /// Excess of the machine's true flux over the map, in percent.
    #[arg(long, default_value_t = 0.0, value_parser = finite, allow_negative_numbers = true)]
    pub map_error: f64,
    /// Excess of the machine's true stator resistance over the rating, in percent.
    #[arg(long, default_value_t = 0.0, value_parser = finite, allow_negative_numbers = true)]
    pub rs_error: f64,
    /// Error of the angle sensor, electrical, in degrees.
    #[arg(long, default_value_t = 0.0, value_parser = finite, allow_negative_numbers = true)]
    pub angle_error: f64,
    /// The firmware's image (for --on qemu).
    #[serde(skip)]
    #[arg(long, env = "TRACTIVE_IMAGE")]
    pub image: Option<PathBuf>,
    /// The emulator (for --on qemu).
    #[serde(skip)]
    #[arg(long, env = "TRACTIVE_QEMU", default_value = "qemu-system-arm")]
    pub qemu: PathBuf,
    /// A further argument for the emulator (may be repeated).
    #[serde(skip)]
    #[arg(long, value_name = "ARG", allow_hyphen_values = true, hide = true)]
    pub qemu_arg: Vec<String>,
    /// With --on qemu: a file for what every interrupt was about, in their order.
    #[serde(skip)]
    #[arg(long, value_name = "FILE", hide = true)]
    pub calls: Option<PathBuf>,
}

/// Options of a run, with those that only one system has.
#[derive(Clone, Debug, Args, Serialize)]
pub struct Options<O: Args> {
    /// The options that all scenarios have.
    #[serde(flatten)]
    #[command(flatten)]
    pub run: RunOptions,
    /// The options that the system has.
    #[serde(flatten)]
    #[command(flatten)]
    pub own: O,
}

impl<O: Args> std::ops::Deref for Options<O> {
    type Target = RunOptions;

    fn deref(&self) -> &RunOptions {
        &self.run
    }
}

/// Shortest pulse unless the options say another, in µs, of devices that switch up to 900 Hz.
pub const USUAL_MIN_PULSE_US: f64 = 10.0;

/// The same for devices of any highest switching frequency, in Hz: at most the same share of a carrier.
pub fn usual_min_pulse_us(max_switching_hz: f64) -> f64 {
    USUAL_MIN_PULSE_US * (900.0 / max_switching_hz).min(1.0)
}

/// Options by name, each with its value, least and most. The error names the first that is out of its range.
pub fn within(ranges: &[(&str, f64, f64, f64)]) -> anyhow::Result<()> {
    for (name, value, low, high) in ranges {
        anyhow::ensure!(
            (low..=high).contains(&value),
            "{name} {value:?}: must be from {low} to {high} for this machine"
        );
    }
    Ok(())
}

/// Options by name, each with whether it is given, what it has no effect without, and whether that is there. The error names the first that goes alone.
pub fn needs(pairs: &[(&str, bool, &str, bool)]) -> anyhow::Result<()> {
    for (name, given, other, has_other) in pairs {
        anyhow::ensure!(!given || *has_other, "{name} has no effect without {other}");
    }
    Ok(())
}

impl RunOptions {
    /// Shortest pulse, in µs, for devices of this highest switching frequency, in Hz.
    pub fn min_pulse_us(&self, max_switching_hz: f64) -> f64 {
        self.min_pulse_us.unwrap_or_else(|| usual_min_pulse_us(max_switching_hz))
    }

    /// `true` if inverter, sensors and machine are as control assumes.
    pub fn is_ideal(&self) -> bool {
        let flaws = [self.dead_time_us, self.noise_a, self.map_error, self.rs_error, self.angle_error];
        flaws.iter().all(|flaw| *flaw == 0.0) && self.adc_bits.is_none() && self.udc_ripple.is_none()
    }

    /// Checks that the flaws make sense with this machine and source, of either system. The error names the first option that is out of its range.
    pub fn check_flaws(&self, machine: &Machine, source_v: f64) -> anyhow::Result<()> {
        let ripple = self.udc_ripple.unwrap_or(Ripple { amplitude_v: 0.0, frequency_hz: 1.0 });
        within(&[
            ("--noise-a", self.noise_a, 0.0, 10.0 * machine.folder.parameters.trip_current_a),
            ("--udc-ripple", ripple.amplitude_v, 0.0, source_v),
            ("--udc-ripple", ripple.frequency_hz, 0.0, 1e5),
            ("--map-error", self.map_error, -90.0, 900.0),
            ("--rs-error", self.rs_error, -100.0, 1e4),
            ("--angle-error", self.angle_error, -360.0, 360.0),
        ])
    }

    /// The emulator with the given image; a patient one waits for as long as somebody types.
    pub fn emulator(&self, patient: bool) -> anyhow::Result<Emulator> {
        let Some(image) = self.image.clone() else {
            anyhow::bail!("--on qemu needs --image; `cargo xtask run` builds it and hands it over");
        };
        Ok(Emulator {
            program: self.qemu.clone(),
            image,
            arguments: self.qemu_arg.clone(),
            calls: self.calls.clone(),
            patient,
        })
    }

    /// The place where it runs, and the law. In a page both have their usual values: anything else would double its size.
    ///
    /// # Errors
    /// Says what a page does not include.
    pub fn choice(&self) -> anyhow::Result<(On, LawName)> {
        if !cfg!(target_family = "wasm") {
            return Ok((self.on, self.law));
        }
        anyhow::ensure!(
            (self.on, self.law) == (On::Host, LawName::Tractive),
            "--on {}, --law {}: not in a page",
            self.on.name(),
            self.law.name()
        );
        Ok((On::Host, LawName::Tractive))
    }

    /// The deviations of the true machine from its folder.
    pub fn plant(&self) -> PlantSettings {
        PlantSettings {
            flux_scale: 1.0 + self.map_error / 100.0,
            resistance_scale: 1.0 + self.rs_error / 100.0,
            ..PlantSettings::default()
        }
    }

    /// The sensors' imperfections; the converters' range is the trip level plus a quarter.
    pub fn flaws(&self, trip_current_a: f64) -> Flaws {
        Flaws {
            adc_bits: self.adc_bits,
            adc_full_scale_a: 1.25 * trip_current_a,
            noise_a: self.noise_a,
            udc_ripple: self.udc_ripple.map(|ripple| (ripple.amplitude_v, ripple.frequency_hz)),
            angle_error_deg: self.angle_error,
            seed: self.seed,
            ..Flaws::NONE
        }
    }
}
