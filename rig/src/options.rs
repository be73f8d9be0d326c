//! Options that all runs share.

use crate::bench::Flaws;
use crate::inject::Injection;
use crate::inject::zs9::Kind;
use crate::machine::Machine;
use crate::run::{CLOCK, Emulator};
use clap::{Args, ValueEnum};
use serde::Serialize;
use std::path::PathBuf;
use std::str::FromStr;
use tractive::nine_switch::Scheme;

/// Where the drive runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum On {
    /// The image, in QEMU.
    Qemu,
    /// The same code, on the host.
    Host,
}

impl On {
    /// As on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Qemu => "qemu",
            Self::Host => "host",
        }
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

/// A finite number that is not negative.
pub fn not_negative(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value.is_finite() && value >= 0.0 => Ok(value),
        _ => Err("must be a number of at least 0".to_owned()),
    }
}

/// A finite number above zero.
pub fn positive(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value.is_finite() && value > 0.0 => Ok(value),
        _ => Err("must be a number above 0".to_owned()),
    }
}

/// Any finite number.
pub fn finite(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value.is_finite() => Ok(value),
        _ => Err("must be a finite number".to_owned()),
    }
}

/// Options that are for some scenarios only, by the names of their fields.
pub const OWN: [&str; 14] = [
    "down",
    "brake",
    "torque_scale",
    "to",
    "speed",
    "torque",
    "fault_at",
    "freeze_at",
    "offset_at",
    "operated",
    "step",
    "no_reverse",
    "edges",
    "cruise",
];
/// Options that all of the ZS9's scenarios know, and no others.
pub const OF_THE_ZS9: [&str; 4] = ["carrier_hz", "uin", "scheme", "inject"];

/// Refuses an option that was given to a scenario that does not know it: it would change nothing.
///
/// # Errors
/// The first such option, by name.
pub fn check_own(scenario: &str, knows: &[&str], given: impl Fn(&str) -> bool) -> anyhow::Result<()> {
    for name in OWN.into_iter().chain(OF_THE_ZS9) {
        anyhow::ensure!(
            knows.contains(&name) || !given(name),
            "--{}: scenario {scenario} does not have this option",
            name.replace('_', "-")
        );
    }
    Ok(())
}

/// Options of a run.
#[derive(Clone, Debug, Args, Serialize)]
pub struct RunOptions {
    /// Where the drive runs.
    #[arg(long, value_enum, default_value = "host")]
    pub on: On,
    /// Folder for the files; default target/tractive/SCENARIO.
    #[serde(skip)]
    #[arg(long)]
    pub out: Option<PathBuf>,
    /// A folder of tables/, or the path of any machine folder; default pmasynrm-180kw, of the ZS9's scenarios ipm-zs9.
    #[arg(long)]
    pub machine: Option<String>,
    /// Step of trace.csv, in s; default 50e-6, of steady 5e-6, of the ZS9's scenarios one carrier period, of zs9-cycle 1e-3.
    #[arg(long, value_parser = positive, allow_negative_numbers = true)]
    pub dt: Option<f64>,
    /// Seed of the noise.
    #[arg(long, default_value_t = 1, allow_negative_numbers = true)]
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
    /// Leave the dead time uncompensated: neither the pulses are corrected nor is the sixth harmonic of the voltage followed.
    #[arg(long)]
    pub uncompensated: bool,
    /// Shortest pulse, in µs.
    #[arg(long, default_value_t = 10.0, value_parser = not_negative, allow_negative_numbers = true)]
    pub min_pulse_us: f64,
    /// Resolution of the current converters, in bits.
    #[arg(long, value_parser = clap::value_parser!(u32).range(4..=24), allow_negative_numbers = true)]
    pub adc_bits: Option<u32>,
    /// Current noise, rms, in A.
    #[arg(long, default_value_t = 0.0, value_parser = not_negative, allow_negative_numbers = true)]
    pub noise_a: f64,
    /// DC-link ripple, V@HZ.
    #[arg(long)]
    pub udc_ripple: Option<Ripple>,
    /// By how much the machine's true flux exceeds the map, in percent.
    #[arg(long, default_value_t = 0.0, value_parser = finite, allow_negative_numbers = true)]
    pub map_error: f64,
    /// By how much the machine's true stator resistance exceeds the rating, in percent.
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
    /// By how much the PWM timer starts later, in µs.
    #[arg(long, default_value_t = 0.0, value_parser = not_negative, allow_negative_numbers = true, hide = true)]
    pub pwm_delay_us: f64,
    /// timing: the demand is not finite from this time on, in s.
    #[arg(long, value_parser = not_negative, allow_negative_numbers = true, hide = true)]
    pub fault_at: Option<f64>,
    /// timing: control is told the same currents again and again from this time on, in s.
    #[arg(long, value_parser = not_negative, allow_negative_numbers = true, hide = true)]
    pub freeze_at: Option<f64>,
    /// timing: a current sensor reads too much from this time on, in s.
    #[arg(long, value_parser = not_negative, allow_negative_numbers = true, hide = true)]
    pub offset_at: Option<f64>,
    /// timing: the operator commands the drive, and the speeds come later by what that takes.
    #[arg(long, hide = true)]
    pub operated: bool,
    /// sweep: add the way back.
    #[arg(long)]
    pub down: bool,
    /// sweep, timing: brake instead of pulling.
    #[arg(long)]
    pub brake: bool,
    /// sweep, timing: share of the full torque.
    #[arg(long, default_value_t = 1.0, value_parser = finite, allow_negative_numbers = true)]
    pub torque_scale: f64,
    /// full-step, steady, mode-borders, reversal, chopper, acknowledge: speed, in r/min.
    #[arg(long, value_parser = finite, allow_negative_numbers = true)]
    pub speed: Option<f64>,
    /// steady: torque, in N·m.
    #[arg(long, value_parser = finite, allow_negative_numbers = true)]
    pub torque: Option<f64>,
    /// sweep, timing: last speed, in r/min.
    #[arg(long, default_value_t = 2000.0, value_parser = finite, allow_negative_numbers = true)]
    pub to: f64,
    /// What only the ZS9's scenarios know.
    #[serde(skip)]
    #[command(flatten)]
    pub zs9: Zs9Options,
}

/// Options of the ZS9's scenarios.
#[derive(Clone, Debug, Args, Serialize)]
pub struct Zs9Options {
    /// zs9-load-step: by how much motor 2's load steps, in N·m, −500 to 500.
    #[arg(long, default_value_t = 40.0, value_parser = load_step, allow_negative_numbers = true)]
    pub step: f64,
    /// zs9-reverse: motor 2 keeps its direction, for comparison.
    #[arg(long)]
    pub no_reverse: bool,
    /// zs9-cycle: how long it cruises, in s, up to 3600.
    #[arg(long, default_value_t = 20.0, value_parser = cruise, allow_negative_numbers = true)]
    pub cruise: f64,
    /// zs9-cycle: write edges.csv.
    #[serde(skip)]
    #[arg(long)]
    pub edges: bool,
    /// ZS9: carrier frequency, in Hz, 10000 or 20000.
    #[arg(long, default_value_t = 10_000, value_parser = carrier_hz, allow_negative_numbers = true)]
    pub carrier_hz: u32,
    /// ZS9: link voltage outside shoot-through, in V: 667 is a shoot-through duty of 0.2, 800 of 0.25.
    #[arg(long, default_value_t = 667.0, value_parser = positive, allow_negative_numbers = true)]
    pub uin: f64,
    /// ZS9: where the zero vectors lie: s, rs, rthd, zvo, rthd-central or rthd-slide.
    #[serde(serialize_with = "scheme_name")]
    #[arg(long, default_value = "rthd", value_parser = scheme)]
    pub scheme: Scheme,
    /// ZS9: something that goes wrong, NAME@SECONDS: source-short, source-low, source-high, sensor-lost-1, sensor-lost-2,
    /// sensor-frozen-1, sensor-frozen-2, sensor-jump-2, overcurrent, not-finite, leg-stuck-on, leg-stuck-off.
    #[arg(long)]
    pub inject: Option<Injection<Kind>>,
}

fn scheme(text: &str) -> Result<Scheme, String> {
    let found = Scheme::ALL.into_iter().find(|scheme| scheme.name() == text);
    found.ok_or_else(|| format!("must be one of {}", Scheme::ALL.map(Scheme::name).join(", ")))
}

fn scheme_name<S: serde::Serializer>(scheme: &Scheme, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(scheme.name())
}

fn load_step(text: &str) -> Result<f64, String> {
    match finite(text) {
        Ok(step) if step.abs() <= 500.0 => Ok(step),
        _ => Err("must be a number from -500 to 500".to_owned()),
    }
}

fn cruise(text: &str) -> Result<f64, String> {
    match positive(text) {
        Ok(seconds) if seconds <= 3600.0 => Ok(seconds),
        _ => Err("must be a number above 0, at most 3600".to_owned()),
    }
}

fn carrier_hz(text: &str) -> Result<u32, String> {
    match text.parse() {
        Ok(hz @ (10_000 | 20_000)) => Ok(hz),
        _ => Err("must be 10000 or 20000".to_owned()),
    }
}

/// Options by name, each with its value, least and most.
fn within(ranges: &[(&str, f64, f64, f64)]) -> anyhow::Result<()> {
    for (name, value, low, high) in ranges {
        anyhow::ensure!(
            (low..=high).contains(&value),
            "{name} {value:?}: must be from {low} to {high} for this machine"
        );
    }
    Ok(())
}

impl RunOptions {
    /// Whether inverter, sensors and machine are as control believes them to be.
    pub fn is_ideal(&self) -> bool {
        let flaws = [self.dead_time_us, self.noise_a, self.map_error, self.rs_error, self.angle_error];
        flaws.iter().all(|flaw| *flaw == 0.0) && self.adc_bits.is_none() && self.udc_ripple.is_none()
    }

    /// Whether a run with these options and this machine makes sense, and ends.
    ///
    /// # Errors
    /// The first option that is out of its range, by name.
    pub fn check(&self, machine: &Machine) -> anyhow::Result<()> {
        let parameters = &machine.folder.parameters;
        let (fastest_rpm, most_nm) = (3.0 * parameters.max_speed_rpm, 10.0 * parameters.max_torque_nm);
        let udc_v = self.udc.unwrap_or(parameters.dc_link_nominal_v);
        within(&[
            ("--dt", self.dt_s(), f64::from(CLOCK.ticks_per_s).recip(), 0.1),
            ("--udc", udc_v, 0.0, 10.0 * parameters.dc_link_max_v),
            ("--torque-scale", self.torque_scale, -10.0, 10.0),
            ("--speed", self.speed.unwrap_or(0.0), -fastest_rpm, fastest_rpm),
            ("--torque", self.torque.unwrap_or(0.0), -most_nm, most_nm),
            ("--to", self.to, -fastest_rpm, fastest_rpm),
        ])?;
        self.check_flaws(machine, udc_v)
    }

    /// Whether the flaws make sense with this machine and source, of either system.
    ///
    /// # Errors
    /// The first option that is out of its range, by name.
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

    /// The emulator with the image that was handed over.
    ///
    /// # Errors
    /// Without an image.
    pub fn emulator(&self) -> anyhow::Result<Emulator> {
        let Some(image) = self.image.clone() else {
            anyhow::bail!("--on qemu needs --image; `cargo xtask run` builds it and hands it over");
        };
        Ok(Emulator {
            program: self.qemu.clone(),
            image,
            arguments: self.qemu_arg.clone(),
            calls: self.calls.clone(),
            patient: false,
        })
    }

    /// The machine, or the first system's.
    pub fn machine(&self) -> &str {
        self.machine.as_deref().unwrap_or("pmasynrm-180kw")
    }

    /// Step of the trace, in s, or the first system's.
    pub fn dt_s(&self) -> f64 {
        self.dt.unwrap_or(50e-6)
    }

    /// The sensors' imperfections; the converters' range is the trip level and a quarter more.
    pub fn flaws(&self, trip_current_a: f64) -> Flaws {
        Flaws {
            adc_bits: self.adc_bits,
            adc_full_scale_a: 1.25 * trip_current_a,
            noise_a: self.noise_a,
            udc_ripple: self.udc_ripple.map(|ripple| (ripple.amplitude_v, ripple.frequency_hz)),
            angle_error_deg: self.angle_error,
            freeze_at_s: self.freeze_at,
            seed: self.seed,
        }
    }
}
