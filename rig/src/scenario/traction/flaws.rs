//! Flaws that every run of the PMaSynRM drive can have, one by one or all at once.

use crate::machine::Machine;
use crate::options::{Ripple, RunOptions, finite, not_negative, within};
use crate::plant::{DeviceDrops, PlantSettings, ShaftSettings};
use anyhow::Result;
use clap::Args;
use serde::{Serialize, Serializer};
use std::str::FromStr;

/// Percentages of the three phases, written `U,V,W`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Phases(pub [f64; 3]);

impl FromStr for Phases {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let values = list::<3>(text).filter(|values| values.iter().all(|value| value.is_finite()));
        values.map(Self).ok_or_else(|| "must be U,V,W in percent, for instance 2,0,0".to_owned())
    }
}

/// Voltage drops of IGBTs and diodes, written `V,MOHM,V,MOHM`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Drops(pub [f64; 4]);

impl FromStr for Drops {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let good = |values: &[f64; 4]| values.iter().all(|value| value.is_finite() && *value >= 0.0);
        list::<4>(text).filter(good).map(Self).ok_or_else(|| {
            "must be V,MOHM,V,MOHM of IGBT and diode, each at least 0, for instance 2,5,1.5,3".to_owned()
        })
    }
}

impl Drops {
    /// The check that they are within their ranges for a link voltage in V and a machine.
    pub fn check(&self, link_v: f64, machine: &Machine) -> Result<()> {
        let most_mohm = 1e3 * link_v / machine.folder.parameters.max_current_a;
        let Self([igbt_v, igbt_mohm, diode_v, diode_mohm]) = *self;
        within(&[
            ("--device-drop", igbt_v, 0.0, 0.1 * link_v),
            ("--device-drop", igbt_mohm, 0.0, 0.1 * most_mohm),
            ("--device-drop", diode_v, 0.0, 0.1 * link_v),
            ("--device-drop", diode_mohm, 0.0, 0.1 * most_mohm),
        ])
    }

    /// The mean of IGBT and diode.
    fn mean(&self) -> Told {
        let Self([igbt_v, igbt_mohm, diode_v, diode_mohm]) = *self;
        Told([0.5 * (igbt_v + diode_v), 0.5 * (igbt_mohm + diode_mohm)])
    }

    /// The drops as the plant has them.
    pub fn devices(&self) -> DeviceDrops {
        let Self([igbt_v, igbt_mohm, diode_v, diode_mohm]) = *self;
        DeviceDrops { igbt_v, igbt_ohm: 1e-3 * igbt_mohm, diode_v, diode_ohm: 1e-3 * diode_mohm }
    }
}

/// Mean threshold in V and slope in mΩ of IGBT and diode, written `V,MOHM`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Told([f64; 2]);

impl FromStr for Told {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let values = list::<2>(text).filter(|values| values.iter().all(|value| *value >= 0.0));
        values.map(Self).ok_or_else(|| "must be V,MOHM, each at least 0, for instance 1.75,4".to_owned())
    }
}

impl Told {
    /// The check that a power stage's keys may name them, for the option that says them.
    fn check(self, option: &str) -> Result<()> {
        let Self([threshold_v, slope_mohm]) = self;
        within(&[(option, threshold_v, 0.0, 20.0), (option, slope_mohm, 0.0, 150.0)])
    }

    /// The same in mV and hundredths of a mΩ.
    pub fn steps(self) -> (u32, u32) {
        let Self([threshold_v, slope_mohm]) = self;
        ((1e3 * threshold_v).round() as u32, (100.0 * slope_mohm).round() as u32)
    }
}

/// Times of the three phases in µs, written `U,V,W`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Times(pub [f64; 3]);

impl FromStr for Times {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let values = list::<3>(text).filter(|values| values.iter().all(|value| *value >= 0.0));
        values.map(Self).ok_or_else(|| "must be U,V,W in µs, each at least 0, for instance 2,1,0".to_owned())
    }
}

/// Natural frequency and damping ratio of a shaft, written `HZ,DAMPING`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Elastic([f64; 2]);

impl FromStr for Elastic {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let good = |[hz, damping]: &[f64; 2]| *hz > 0.0 && *damping >= 0.0;
        list::<2>(text)
            .filter(good)
            .map(Self)
            .ok_or_else(|| "must be HZ,DAMPING, above 0 and at least 0, for instance 40,0.05".to_owned())
    }
}

/// A given count of numbers between commas; `None` if there are more or fewer.
fn list<const N: usize>(text: &str) -> Option<[f64; N]> {
    let values: Option<Vec<f64>> = text.split(',').map(|value| value.trim().parse().ok()).collect();
    values?.try_into().ok()
}

/// Numbers as they are written on the command line.
fn written(values: &[f64]) -> String {
    values.iter().map(f64::to_string).collect::<Vec<_>>().join(",")
}

impl Serialize for Phases {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(&written(&self.0))
    }
}

impl Serialize for Drops {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(&written(&self.0))
    }
}

impl Serialize for Told {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(&written(&self.0))
    }
}

impl Serialize for Times {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(&written(&self.0))
    }
}

impl Serialize for Elastic {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(&written(&self.0))
    }
}

/// The flaws' options.
#[derive(Clone, Debug, Args, Serialize)]
pub struct FlawOptions {
    /// All flaws of a usual inverter at once, each as large as the guide's page on flaws says; an option that is also given keeps its own value.
    #[arg(long)]
    pub real: bool,
    /// Offset of each current sensor, in percent of the converters' range.
    #[arg(long, value_name = "U,V,W", allow_hyphen_values = true)]
    pub current_offset: Option<Phases>,
    /// Excess of each phase's current reading over the true current, in percent.
    #[arg(long, value_name = "U,V,W", allow_hyphen_values = true)]
    pub current_gains: Option<Phases>,
    /// Phase of --angle-1f-deg, in degrees.
    #[arg(long, default_value_t = 0.0, value_parser = finite, allow_negative_numbers = true, value_name = "DEG")]
    pub angle_1f_phase_deg: f64,
    /// Phase of --angle-2f-deg, in degrees.
    #[arg(long, default_value_t = 0.0, value_parser = finite, allow_negative_numbers = true, value_name = "DEG")]
    pub angle_2f_phase_deg: f64,
    /// Interval after its sample within which the angle is read, in µs; each reading is at another instant.
    #[arg(long, default_value_t = 0.0, value_parser = not_negative, allow_negative_numbers = true, value_name = "US")]
    pub angle_jitter_us: f64,
    /// Effect of the slots: sixth harmonic of the magnets' voltage over the rotor's angle, in percent of that voltage.
    #[arg(long, default_value_t = 0.0, value_parser = finite, allow_negative_numbers = true, value_name = "PERCENT")]
    pub slots: f64,
    /// Excess of the magnets' flux linkage over the map's, in percent of the map's: below 0 hot, above cold.
    #[arg(long, default_value_t = 0.0, value_parser = finite, allow_negative_numbers = true, value_name = "PERCENT")]
    pub magnets: f64,
    /// Threshold and slope of an IGBT, and of a diode.
    #[arg(long, value_name = "V,MOHM,V,MOHM", allow_negative_numbers = true)]
    pub device_drop: Option<Drops>,
    /// The drive knows the mean threshold and slope of --device-drop, as from its power stage's key, and compensates for the drop.
    #[arg(long)]
    pub device_drop_known: bool,
    /// Threshold and slope of the devices that the drive is told, true or not, as from its power stage's keys.
    #[arg(long, value_name = "V,MOHM", allow_negative_numbers = true, conflicts_with = "device_drop_known")]
    pub device_drop_told: Option<Told>,
    /// Time by which each phase's current is sampled before the common instant assumed for all phases, in µs.
    #[arg(long, value_name = "U,V,W", allow_negative_numbers = true)]
    pub adc_skew_us: Option<Times>,
    /// Iron loss as a torque that brakes the rotor, in percent of the iron and mechanical loss that machine.toml names.
    #[arg(long, default_value_t = 0.0, value_parser = not_negative, allow_negative_numbers = true, value_name = "PERCENT")]
    pub iron_loss: f64,
    /// An elastic shaft between the rotor and whatever it turns or is turned by: natural frequency and damping ratio with the far end held.
    #[arg(long, value_name = "HZ,DAMPING", allow_negative_numbers = true)]
    pub shaft: Option<Elastic>,
}

/// The flaws of `--real`, for devices of 900 Hz on 1,500 V, 233 A: a usual IGBT inverter with a resolver.
mod real {
    pub const DEAD_TIME_US: f64 = 5.0;
    pub const ADC_BITS: u32 = 12;
    /// Share of the largest current.
    pub const NOISE_SHARE: f64 = 0.002;
    /// Share of the link's nominal voltage.
    pub const RIPPLE_SHARE: f64 = 0.02;
    pub const RIPPLE_HZ: f64 = 300.0;
    pub const RS_ERROR_PERCENT: f64 = 20.0;
    /// Percent of the converters' range, but no larger share of the largest current than on a drive that trips at 1.31 of it.
    pub const OFFSET_PERCENT: [f64; 3] = [2.0, 0.0, 0.0];
    pub const OFFSET_TRIP: f64 = 1.31;
    pub const GAINS_PERCENT: [f64; 3] = [1.0, -1.0, 0.0];
    pub const UDC_GAIN_PERCENT: f64 = 1.0;
    pub const FILTER_US: f64 = 10.0;
    pub const ANGLE_1F_DEG: f64 = 1.0;
    pub const ANGLE_2F_DEG: f64 = 0.5;
    pub const JITTER_US: f64 = 1.0;
    pub const SLOTS_PERCENT: f64 = 2.0;
    pub const MAGNETS_PERCENT: f64 = -1.0;
    pub const DROP: [f64; 4] = [2.0, 5.0, 1.5, 3.0];
    pub const SKEW_US: [f64; 3] = [2.0, 1.0, 0.0];
    pub const IRON_PERCENT: f64 = 50.0;
    pub const SHAFT: [f64; 2] = [40.0, 0.05];
    /// Link voltage in V, current in A and switching frequency in Hz of the machine that these flaws belong to.
    pub const LINK_V: f64 = 1_500.0;
    pub const CURRENT_A: f64 = 233.345;
    pub const SWITCHING_HZ: f64 = 900.0;
}

/// Longest time by which a phase's current is sampled early, as a share of the fastest carrier.
const MOST_SKEW: f64 = 0.02;
/// Highest natural frequency of a shaft, in Hz: a tenth of a radian of it lasts longer than the plant's steps.
const MOST_SHAFT_HZ: f64 = 400.0;

/// The value that was given, or that of `--real`.
fn or(given: f64, real: f64) -> f64 {
    if given == 0.0 { real } else { given }
}

/// The flaws that have options of their own beside these.
#[derive(Clone, Copy, Debug)]
pub struct Beside {
    /// Excess of the link's reading over its true voltage, in percent.
    pub udc_gain: f64,
    /// Time constant of the current sensors, in µs.
    pub current_filter_us: f64,
    /// Angle errors that occur once and twice per electrical turn, in degrees.
    pub angle_deg: [f64; 2],
}

/// Options with everything that `--real` stands for.
#[derive(Clone, Debug)]
pub struct Filled {
    /// The options of every run.
    pub run: RunOptions,
    /// The options beside the flaws' own.
    pub beside: Beside,
    /// The flaws' own options.
    pub flaws: FlawOptions,
}

/// The inverter whose flaws `--real` stands for.
#[derive(Clone, Copy, Debug)]
pub struct RealInverter {
    /// Voltage that its devices switch, in V.
    pub link_v: f64,
    /// The rate at which they switch it, in Hz.
    pub switching_hz: f64,
}

impl RealInverter {
    /// The two-level inverter that a machine is made for.
    pub const fn of(machine: &Machine) -> Self {
        let parameters = &machine.folder.parameters;
        Self { link_v: parameters.dc_link_nominal_v, switching_hz: parameters.max_switching_hz }
    }

    /// Factor by which times are shorter if the devices switch faster.
    fn shorter(&self) -> f64 {
        (real::SWITCHING_HZ / self.switching_hz).min(1.0)
    }

    /// The options of a run with a machine, with the values of `--real` filled in; values that were given stay.
    pub fn run(&self, given: &RunOptions, machine: &Machine) -> RunOptions {
        let ripple = Ripple { amplitude_v: real::RIPPLE_SHARE * self.link_v, frequency_hz: real::RIPPLE_HZ };
        RunOptions {
            dead_time_us: or(given.dead_time_us, real::DEAD_TIME_US * self.shorter()),
            adc_bits: given.adc_bits.or(Some(real::ADC_BITS)),
            noise_a: or(given.noise_a, real::NOISE_SHARE * machine.folder.parameters.max_current_a),
            udc_ripple: given.udc_ripple.or(Some(ripple)),
            rs_error: or(given.rs_error, real::RS_ERROR_PERCENT),
            ..given.clone()
        }
    }

    /// The device drops of `--real` for a machine.
    pub fn drops(&self, machine: &Machine) -> Drops {
        let volts = self.link_v / real::LINK_V;
        let ohms = volts / (machine.folder.parameters.max_current_a / real::CURRENT_A);
        let [igbt_v, igbt_mohm, diode_v, diode_mohm] = real::DROP;
        Drops([igbt_v * volts, igbt_mohm * ohms, diode_v * volts, diode_mohm * ohms])
    }
}

/// The sensor offset of `--real` for a machine: the drive refuses more than a twentieth of the largest current.
fn real_offset(machine: &Machine) -> Phases {
    let parameters = &machine.folder.parameters;
    let share = (real::OFFSET_TRIP * parameters.max_current_a / parameters.trip_current_a).min(1.0);
    Phases(real::OFFSET_PERCENT.map(|percent| percent * share))
}

impl Filled {
    /// Fills in options that ask for it, for a machine; values that were given stay.
    pub fn of(given: &RunOptions, beside: Beside, flaws: &FlawOptions, machine: &Machine) -> Self {
        let inverter = RealInverter::of(machine);
        let times = inverter.shorter();
        let [once_deg, twice_deg] = beside.angle_deg;
        let [shaft_hz, damping] = real::SHAFT;
        Self {
            run: inverter.run(given, machine),
            beside: Beside {
                udc_gain: or(beside.udc_gain, real::UDC_GAIN_PERCENT),
                current_filter_us: or(beside.current_filter_us, real::FILTER_US * times),
                angle_deg: [or(once_deg, real::ANGLE_1F_DEG), or(twice_deg, real::ANGLE_2F_DEG)],
            },
            flaws: FlawOptions {
                current_offset: flaws.current_offset.or(Some(real_offset(machine))),
                current_gains: flaws.current_gains.or(Some(Phases(real::GAINS_PERCENT))),
                angle_jitter_us: or(flaws.angle_jitter_us, real::JITTER_US * times),
                slots: or(flaws.slots, real::SLOTS_PERCENT),
                magnets: or(flaws.magnets, real::MAGNETS_PERCENT),
                device_drop: flaws.device_drop.or(Some(inverter.drops(machine))),
                adc_skew_us: flaws.adc_skew_us.or(Some(Times(real::SKEW_US.map(|us| us * times)))),
                iron_loss: or(flaws.iron_loss, real::IRON_PERCENT),
                shaft: flaws.shaft.or(Some(Elastic([shaft_hz / times, damping]))),
                ..flaws.clone()
            },
        }
    }
}

impl FlawOptions {
    /// The check that each flaw is within its range. The error names the first option that is not.
    pub fn check(&self, machine: &Machine) -> Result<()> {
        let parameters = &machine.folder.parameters;
        let [offset, gains] = [self.current_offset, self.current_gains].map(Option::unwrap_or_default);
        for phase in 0..3 {
            within(&[
                ("--current-offset", offset.0[phase], -100.0, 100.0),
                ("--current-gains", gains.0[phase], -50.0, 100.0),
            ])?;
        }
        let most_us = 1e6 * MOST_SKEW / parameters.max_switching_hz;
        for early_us in self.adc_skew_us.unwrap_or_default().0 {
            within(&[("--adc-skew-us", early_us, 0.0, most_us)])?;
        }
        if let Some(Elastic([hz, damping])) = self.shaft {
            within(&[("--shaft", hz, 0.1, MOST_SHAFT_HZ), ("--shaft", damping, 0.0, 2.0)])?;
        }
        within(&[
            ("--iron-loss", self.iron_loss, 0.0, 1e3),
            ("--angle-1f-phase-deg", self.angle_1f_phase_deg, -360.0, 360.0),
            ("--angle-2f-phase-deg", self.angle_2f_phase_deg, -360.0, 360.0),
            ("--angle-jitter-us", self.angle_jitter_us, 0.0, 1e4),
            ("--slots", self.slots, -100.0, 100.0),
            ("--magnets", self.magnets, -90.0, 100.0),
        ])?;
        let drops = self.device_drop.unwrap_or_default();
        drops.check(parameters.dc_link_nominal_v, machine)?;
        self.told_drop().check(if self.device_drop_known { "--device-drop" } else { "--device-drop-told" })
    }

    /// The drop that the drive is told of.
    pub fn told_drop(&self) -> Told {
        let known = self.device_drop.filter(|_| self.device_drop_known).map(|drops| drops.mean());
        known.or(self.device_drop_told).unwrap_or_default()
    }

    /// Offsets of the current sensors, as shares of the converters' range.
    pub fn offsets(&self) -> [f64; 3] {
        self.current_offset.unwrap_or_default().0.map(|percent| percent / 100.0)
    }

    /// Mean time by which the three currents are sampled early, in µs.
    pub fn mean_skew_us(&self) -> f64 {
        self.adc_skew_us.unwrap_or_default().0.iter().sum::<f64>() / 3.0
    }

    /// Excess of each phase's current reading over the true current, as shares.
    pub fn gains(&self) -> [f64; 3] {
        self.current_gains.unwrap_or_default().0.map(|percent| percent / 100.0)
    }

    /// Time by which each phase's current is early, in s.
    pub fn skew_s(&self) -> [f64; 3] {
        self.adc_skew_us.unwrap_or_default().0.map(|us| 1e-6 * us)
    }

    /// The deviations of the true machine and its inverter: those of these options together with the others.
    pub fn plant(&self, others: PlantSettings, rotor_kg_m2: f64) -> PlantSettings {
        let shaft = self.shaft.map(|Elastic([hz, damping])| ShaftSettings { hz, damping, rotor_kg_m2 });
        let (slots_share, iron_share) = (self.slots / 100.0, self.iron_loss / 100.0);
        let magnet_scale = 1.0 + self.magnets / 100.0;
        PlantSettings { slots_share, magnet_scale, drops: self.drops(), iron_share, shaft, ..others }
    }

    /// The devices' drops.
    pub fn drops(&self) -> DeviceDrops {
        self.device_drop.unwrap_or_default().devices()
    }
}
