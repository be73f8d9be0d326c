//! The power stage beside the package, `power_stage.toml`, against the machine: whatever the image would refuse, measure wrongly or
//! protect badly is refused here, by key and file. What passes becomes the constants that the image is built with.

use super::dead_time::DeadTime;
use super::{rates, zs9_rates};
use serde::Deserialize;
use std::path::Path;
use tractive::configuration::{LATEST_ANGLE_S, Refused};
use tractive::machine::{Ratings, Tables};
use tractive::thermal::{Derating, DeviceLosses, Element, Magnets, Rise, Sensor, Thermal};
use tractive_tablegen::InputError;

/// Codes of the 12-bit converters.
const CODES: f64 = 4_095.0;
/// Codes of half their range.
const HALF_CODES: f64 = 2_048.0;
/// The most by which a range may exceed what it must hold: beyond, the converter resolves nothing.
const RANGE: f64 = 20.0;
/// The most by which the comparators' current may exceed the machine's trip current: beyond, they protect another machine.
const BREAK: f64 = 2.0;
/// The slowest control that a drive starts with, in Hz.
const SLOWEST_CONTROL_HZ: f64 = 1_000.0;
/// The longest dead time that the ZS9's drive reckons with, in ns.
const ZS9_DEAD_TIME_NS: f64 = 5_000.0;

/// A machine, and the folder that it was read from.
pub struct Machine<'a> {
    /// The folder.
    pub folder: &'a Path,
    /// The tables that the image will hold.
    pub tables: &'a Tables,
    /// Highest frequency of the free carrier, as a share of the switches'.
    pub carrier_share: f32,
}

/// The keys of the file.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Keys {
    control_hz: Option<u32>,
    dead_time_ns: u32,
    min_pulse_ns: Option<u32>,
    current_range_a: f64,
    zero_code: u16,
    zero_tolerance: u16,
    dc_link_range_v: f64,
    break_current_a: f64,
    encoder_counts: Option<u32>,
    encoder_zeros_deg: Vec<f64>,
    precharge_s: f64,
    behind_line_filter: Option<bool>,
    angle_late_us: Option<f64>,
    current_filter_us: Option<f64>,
    device_threshold_v: Option<f64>,
    device_slope_mohm: Option<f64>,
    discharge_s: f64,
    z_source: Option<ZSource>,
    absolute: Option<Absolute>,
    resolver: Option<Resolver>,
    thermal: Option<ThermalKeys>,
}

/// An absolute encoder in the place of one that counts.
#[derive(Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
struct Absolute {
    bits: u32,
    gray: bool,
}

/// A resolver in its place.
#[derive(Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
struct Resolver {
    pole_pairs: u32,
    amplitude_v: f64,
    lag_us: f64,
}

/// The position sensor of a stage.
enum PositionSensor {
    Encoder,
    Absolute(Absolute),
    Resolver(Resolver),
}

/// The keys of temperature sensors and thermal data.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ThermalKeys {
    winding_sensor: SensorKeys,
    heat_sink_sensor: SensorKeys,
    winding: RiseKeys,
    junction: RiseKeys,
    losses: LossKeys,
    winding_derating_c: [f32; 3],
    junction_derating_c: [f32; 3],
    magnets: Option<MagnetKeys>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct SensorKeys {
    ntc: Option<[f32; 2]>,
    series_ohm: f32,
    range_c: [f32; 2],
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RiseKeys {
    k_per_w: f32,
    time_s: f32,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct LossKeys {
    threshold_v: f32,
    slope_ohm: f32,
    switching_share: f32,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct MagnetKeys {
    per_k: f32,
    map_c: f32,
    derating_c: [f32; 2],
}

impl SensorKeys {
    fn sensor(&self) -> Sensor {
        let element =
            self.ntc.map_or(Element::Pt1000, |[at_25_ohm, beta_k]| Element::Ntc { at_25_ohm, beta_k });
        Sensor { element, series_ohm: self.series_ohm, range_c: self.range_c }
    }
}

impl ThermalKeys {
    fn thermal(&self, resistance_ohm: f32) -> Thermal {
        let rise = |keys: &RiseKeys| Rise { k_per_w: keys.k_per_w, time_s: keys.time_s };
        let LossKeys { threshold_v, slope_ohm, switching_share } = self.losses;
        let (
            [winding_from_c, winding_none_c, winding_trip_c],
            [junction_from_c, junction_none_c, junction_trip_c],
        ) = (self.winding_derating_c, self.junction_derating_c);
        Thermal {
            winding_sensor: self.winding_sensor.sensor(),
            heat_sink_sensor: self.heat_sink_sensor.sensor(),
            resistance_ohm,
            winding: rise(&self.winding),
            junction: rise(&self.junction),
            losses: DeviceLosses { threshold_v, slope_ohm, switching_share },
            winding_derating: Derating { from_c: winding_from_c, none_c: winding_none_c },
            winding_trip_c,
            junction_derating: Derating { from_c: junction_from_c, none_c: junction_none_c },
            junction_trip_c,
            magnets: self.magnets.as_ref().map(
                |&MagnetKeys { per_k, map_c, derating_c: [from_c, none_c] }| Magnets {
                    per_k,
                    map_c,
                    derating: Derating { from_c, none_c },
                },
            ),
        }
    }
}

/// The keys that the ZS9's stage has besides.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ZSource {
    inductor_range_a: f64,
    source_range_v: f64,
    link_ref_v: f64,
}

/// The highest control rate at which an absolute encoder's frame, 24 µs, and its rest of 20 µs pass within a period, in Hz.
const ABSOLUTE_HZ: u32 = 22_000;
/// Control rates of twice the frequencies that resolvers are made for, in Hz.
const RESOLVER_HZ: [u32; 2] = [4_000, 20_000];
/// The time behind a sample in which the excitation's level is read, in µs.
const LEVEL_US: f64 = 20.0;
/// V at a converter's pin over half its range.
const HALF_RANGE_V: f64 = 1.65;

/// A key, its value, the least and the most that are allowed, and why.
struct Bound<'a>(&'a str, f64, f64, f64, &'a str);

/// A file that has been read.
struct Stage<'a> {
    file: &'a Path,
    text: &'a str,
    keys: Keys,
}

/// Checks the PMaSynRM's power stage; gives its constant as Rust.
///
/// # Errors
/// The first key that does not suit the board or the machine.
pub fn traction(file: &Path, text: &str, machine: &Machine) -> Result<String, InputError> {
    let stage = Stage::parse(file, text)?;
    let Keys { control_hz, dead_time_ns, min_pulse_ns, z_source, .. } = &stage.keys;
    if z_source.is_some() {
        return Err(stage.refuse("z_source", "is the ZS9's".to_owned()));
    }
    let Some(min_pulse_ns) = *min_pulse_ns else {
        return Err(stage.refuse("min_pulse_ns", "is missing".to_owned()));
    };
    let Some(control_hz) = *control_hz else {
        return Err(stage.refuse("control_hz", "is missing".to_owned()));
    };
    let ratings = &machine.tables.ratings;
    stage.check_control_hz(control_hz, ratings.max_switching_hz)?;
    stage.check_times(stage.longest_dead_time_ns())?;
    let Some(behind) = stage.keys.behind_line_filter else {
        return Err(stage.refuse("behind_line_filter", "is missing".to_owned()));
    };
    let carrier_hz = machine.carrier_share * ratings.max_switching_hz;
    let settings = rates::settings(control_hz, min_pulse_ns, *dead_time_ns, carrier_hz, behind);
    // The longest carrier half of a machine that switches slowly.
    let longest_ticks = settings.devices.shortest_half_ticks.saturating_mul(rates::CARRIER_RANGE);
    if longest_ticks > rates::LONGEST_HALF_TICKS {
        let least_hz = f64::from(settings.clock.ticks_per_s) * f64::from(rates::CARRIER_RANGE)
            / f64::from(2 * (rates::LONGEST_HALF_TICKS - rates::CARRIER_RANGE));
        return Err(machine.refuse(format!(
            "max_switching_hz: {}: must be at least {}: the timers' 16 bits hold no longer carrier half",
            ratings.max_switching_hz,
            shown(least_hz.ceil()),
        )));
    }
    let half_ns =
        1e9 * f64::from(settings.devices.shortest_half_ticks) / f64::from(settings.clock.ticks_per_s);
    stage.check(&[
        Bound(
            "dead_time_ns",
            f64::from(*dead_time_ns),
            1.0,
            (0.25 * half_ns).floor(),
            "up to a quarter of the shortest carrier half",
        ),
        Bound(
            "min_pulse_ns",
            f64::from(min_pulse_ns),
            stage.real_dead_time_ns() + 1.0,
            (0.5 * half_ns).floor(),
            "more than the dead time, up to half of the shortest carrier half",
        ),
    ])?;
    stage.check_known(control_hz, 1e-3 * half_ns, ratings)?;
    stage.check_sensors(machine, f64::from(ratings.trip_dc_over_v), "the machine's trip_dc_over_v", 1)?;
    settings.check(machine.tables).map_err(|refused| stage.refuse_start(machine, &refused))?;
    let thermal = stage.keys.thermal.as_ref().map(|keys| keys.thermal(ratings.stator_resistance_ohm));
    if let Some(Err(refused)) = thermal.map(|thermal| thermal.check()) {
        return Err(stage.refuse("thermal", refused.to_string()));
    }
    stage.constant(control_hz, min_pulse_ns, thermal)
}

/// Checks the ZS9's power stage; gives its constant as Rust.
///
/// # Errors
/// The first key that does not suit the board or the machine.
pub fn zs9(file: &Path, text: &str, machine: &Machine) -> Result<String, InputError> {
    let stage = Stage::parse(file, text)?;
    let Keys { control_hz, min_pulse_ns, z_source, encoder_zeros_deg, .. } = &stage.keys;
    if control_hz.is_some() {
        let problem = format!("the control of two motors has time for {} Hz alone", zs9_rates::CONTROL_HZ);
        return Err(stage.refuse("control_hz", problem));
    }
    if min_pulse_ns.is_some() {
        return Err(stage.refuse("min_pulse_ns", "the modulator of the nine switches has none".to_owned()));
    }
    if stage.keys.behind_line_filter.is_some() {
        return Err(stage.refuse("behind_line_filter", "the Z-source has chokes of its own".to_owned()));
    }
    let keys = &stage.keys;
    let (counts, as_it_is) =
        ("the ZS9's board reads encoders that count", "the control of two motors takes everything as it is");
    for (key, given, problem) in [
        ("absolute", keys.absolute.is_some(), counts),
        ("resolver", keys.resolver.is_some(), counts),
        ("angle_late_us", keys.angle_late_us.is_some(), as_it_is),
        ("current_filter_us", keys.current_filter_us.is_some(), as_it_is),
        ("device_threshold_v", keys.device_threshold_v.is_some(), as_it_is),
        ("device_slope_mohm", keys.device_slope_mohm.is_some(), as_it_is),
    ] {
        if given {
            return Err(stage.refuse(key, problem.to_owned()));
        }
    }
    if stage.keys.thermal.is_some() {
        return Err(stage.refuse("thermal", "the ZS9 knows no temperatures".to_owned()));
    }
    let Some(ZSource { inductor_range_a, source_range_v, link_ref_v }) = *z_source else {
        return Err(stage.refuse("z_source", "is missing".to_owned()));
    };
    stage.check_times(ZS9_DEAD_TIME_NS)?;
    let settings = zs9_rates::settings();
    let operated = settings.operator_ratings(&machine.tables.ratings);
    let capacitor_v = f64::from(settings.limits.capacitor_max_v);
    stage.check_sensors(machine, capacitor_v, "the capacitors' highest voltage", 2)?;
    let inductor_a = f64::from(settings.link.inductor_max_a);
    let source_v = f64::from(operated.dc_link_max_v);
    let [least_v, most_v, _] = tractive::drive::dual::Settings::link_range_v(&operated).map(f64::from);
    stage.check(&[
        stage.current("inductor_range_a", inductor_range_a, inductor_a, "the inductor's highest current"),
        stage.voltage("source_range_v", source_range_v, source_v, "the source's highest voltage"),
        Bound("link_ref_v", link_ref_v, least_v, most_v, "what an operator may ask for with this machine"),
    ])?;
    settings.check(machine.tables).map_err(|refused| stage.refuse_start(machine, &refused))?;
    let zeros: Vec<_> = encoder_zeros_deg.iter().map(|degrees| angle(*degrees)).collect();
    Ok(format!(
        "Zs9Stage {{\n    common: {},\n    encoder_zeros: [{}],\n    \
         inductor_a_per_code: {inductor_range_a:?} / {HALF_CODES:?},\n    \
         source_v_per_code: {source_range_v:?} / {CODES:?},\n    link_ref_v: {link_ref_v:?},\n}}",
        // The modulator of the nine switches has no shortest pulse.
        stage.constant(zs9_rates::CONTROL_HZ, 0, None)?,
        zeros.join(", "),
    ))
}

/// The type of the position sensor that a stage names, as Rust.
///
/// # Errors
/// A sensor that does not suit the control rate or the machine.
pub fn sensor(file: &Path, text: &str, machine: &Machine) -> Result<String, InputError> {
    let stage = Stage::parse(file, text)?;
    let control_hz = stage.keys.control_hz.unwrap_or(rates::CORE_HZ);
    let kind = match stage.sensor()? {
        PositionSensor::Encoder => "Encoder".to_owned(),
        PositionSensor::Absolute(Absolute { bits, gray }) => {
            stage.check(&[
                Bound("bits", f64::from(bits), 8.0, 24.0, "of one turn"),
                Bound("control_hz", f64::from(control_hz), 0.0, f64::from(ABSOLUTE_HZ), "a frame and a rest"),
            ])?;
            format!("Absolute<{bits}, {gray}>")
        }
        PositionSensor::Resolver(Resolver { pole_pairs, amplitude_v, lag_us }) => {
            let period_us = 1e6 / f64::from(control_hz);
            let [least_hz, most_hz] = RESOLVER_HZ.map(f64::from);
            let machine_pairs = f64::from(machine.tables.ratings.pole_pairs);
            stage.check(&[
                Bound(
                    "control_hz",
                    f64::from(control_hz),
                    least_hz,
                    most_hz,
                    "twice the excitation's frequency",
                ),
                Bound("pole_pairs", f64::from(pole_pairs), 1.0, machine_pairs, "the machine's at most"),
                Bound(
                    "amplitude_v",
                    amplitude_v,
                    0.2,
                    0.75 * HALF_RANGE_V,
                    "at the converter's pin, with some room",
                ),
                Bound("lag_us", lag_us, 0.0, 0.5 * period_us - LEVEL_US, "of filter and resolver"),
            ])?;
            let turns = machine_pairs / f64::from(pole_pairs);
            if turns.fract() != 0.0 {
                let problem = format!("{pole_pairs}: must divide the machine's {machine_pairs}");
                return Err(stage.refuse("pole_pairs", problem));
            }
            let amplitude = amplitude_v / HALF_RANGE_V * HALF_CODES;
            let ticks_per_us = 1e-6 * f64::from(rates::clock(control_hz).ticks_per_s);
            let toggle = (0.5 * period_us - lag_us) * ticks_per_us;
            format!("Resolver<{turns}, {amplitude:.0}, {toggle:.0}>")
        }
    };
    Ok(format!("/// The position sensor of the image.\npub type Sensor = {kind};\n"))
}

impl<'a> Stage<'a> {
    /// The sensor that the file names: one, and counts for an encoder alone.
    fn sensor(&self) -> Result<PositionSensor, InputError> {
        let Keys { encoder_counts, absolute, resolver, .. } = self.keys;
        match (encoder_counts, absolute, resolver) {
            (Some(_), None, None) => Ok(PositionSensor::Encoder),
            (None, Some(absolute), None) => Ok(PositionSensor::Absolute(absolute)),
            (None, None, Some(resolver)) => Ok(PositionSensor::Resolver(resolver)),
            (None, None, None) => Err(self.refuse("encoder_counts", "is missing".to_owned())),
            _ => Err(self.refuse("encoder_counts", "one of encoder_counts, absolute, resolver".to_owned())),
        }
    }

    /// Counts in a turn of the shaft; of a resolver so many that none is noticed.
    fn sensor_counts(&self) -> Result<u32, InputError> {
        Ok(match self.sensor()? {
            PositionSensor::Encoder => self.keys.encoder_counts.unwrap_or_default(),
            PositionSensor::Absolute(Absolute { bits, .. }) => 1 << bits.min(24),
            PositionSensor::Resolver(_) => 65_536,
        })
    }

    /// Age of an angle by the way its sensor is read, in s.
    fn sensor_age_s(&self, control_hz: u32) -> Result<f64, InputError> {
        let periods = match self.sensor()? {
            PositionSensor::Encoder => 0.0,
            PositionSensor::Absolute(_) => 1.0,
            PositionSensor::Resolver(_) => 0.5,
        };
        Ok(periods / f64::from(control_hz))
    }

    fn parse(file: &'a Path, text: &'a str) -> Result<Self, InputError> {
        let line = |start: usize| 1 + text[..start].matches('\n').count() as u64;
        let keys = toml::from_str(text).map_err(|error| {
            InputError::new(file, error.span().map(|span| line(span.start)), error.message())
        })?;
        Ok(Self { file, text, keys })
    }

    /// The error of a key, with the line where it stands.
    fn refuse(&self, key: &str, problem: String) -> InputError {
        let is_key =
            |line: &str| line.split(['=', ']']).next().map(|word| word.trim_matches([' ', '['])) == Some(key);
        let line = self.text.lines().position(is_key).map(|index| index as u64 + 1);
        InputError::new(self.file, line, format!("{key}: {problem}"))
    }

    /// The error of a machine or a stage with which the image itself would refuse to start.
    fn refuse_start(&self, machine: &Machine, refused: &Refused) -> InputError {
        let problem = format!("the image would not start: {refused}");
        match refused.name.starts_with("devices.") {
            true => InputError::new(self.file, None, problem),
            false => machine.refuse(problem),
        }
    }

    /// The first key out of its bounds. What is not a number is out of any.
    fn check(&self, bounds: &[Bound]) -> Result<(), InputError> {
        let outside = bounds.iter().find(|Bound(_, value, least, most, _)| !(least..=most).contains(&value));
        let Some(Bound(key, value, least, most, why)) = outside else { return Ok(()) };
        let (least, most) = (shown(*least), shown(*most));
        Err(self.refuse(key, format!("{value}: must be from {least} to {most}: {why}")))
    }

    /// The ages of angle and currents and the drops of devices that the drive makes up for; the shortest carrier half lasts so long, in µs.
    fn check_known(&self, control_hz: u32, half_us: f64, ratings: &Ratings) -> Result<(), InputError> {
        let Keys { angle_late_us, current_filter_us, device_threshold_v, device_slope_mohm, .. } = &self.keys;
        let Some(late_us) = *angle_late_us else {
            return Err(self.refuse("angle_late_us", "is missing".to_owned()));
        };
        let most_us = (1e6 * (f64::from(LATEST_ANGLE_S) - self.sensor_age_s(control_hz)?)).round();
        let fastest_rad_s = f64::from(ratings.max_speed_rad_s * ratings.pole_pairs);
        let most_filter_us = half_us.min(0.3e6 / fastest_rad_s).floor();
        let (filter_us, as_delay) =
            (current_filter_us.unwrap_or_default(), "0.3 rad at the highest speed, up to a carrier half");
        let (threshold_v, slope_mohm) =
            (device_threshold_v.unwrap_or_default(), device_slope_mohm.unwrap_or_default());
        self.check(&[
            Bound("angle_late_us", late_us, -500.0, most_us, "made up for by the speed"),
            Bound("current_filter_us", filter_us, 0.0, most_filter_us, as_delay),
            Bound("device_threshold_v", threshold_v, 0.0, 20.0, "of a device"),
            Bound("device_slope_mohm", slope_mohm, 0.0, 150.0, "of a device"),
        ])
    }

    /// A carrier lasts a control period at least, and both interrupts leave the processor some time.
    fn check_control_hz(&self, control_hz: u32, max_switching_hz: f32) -> Result<(), InputError> {
        let switching_hz = f64::from(max_switching_hz);
        let core_hz = f64::from(rates::CORE_HZ);
        let damping = if self.keys.behind_line_filter == Some(true) { rates::DAMPING_CYCLES } else { 0 };
        let left_hz = rates::LOAD * core_hz - 2.0 * switching_hz * f64::from(rates::PWM_CYCLES);
        self.check(&[Bound(
            "control_hz",
            f64::from(control_hz),
            switching_hz.max(SLOWEST_CONTROL_HZ),
            (left_hz / f64::from(rates::CONTROL_CYCLES + damping)).floor(),
            "the machine's max_switching_hz at least, and what the processor has time for at most",
        )])?;
        match rates::CORE_HZ.is_multiple_of(control_hz) {
            true => Ok(()),
            false => {
                Err(self.refuse("control_hz", format!("{control_hz}: must be a whole part of {core_hz} Hz")))
            }
        }
    }

    /// The longest dead time that the generator makes, in ns.
    fn longest_dead_time_ns(&self) -> f64 {
        (f64::from(DeadTime::LONGEST_CYCLES) * 1e9 / f64::from(rates::CORE_HZ)).floor()
    }

    /// The dead time that the generator makes of what was asked for, in ns.
    fn real_dead_time_ns(&self) -> f64 {
        let cycles =
            DeadTime::at_least(rates::ns_to_cycles(self.keys.dead_time_ns)).map_or(0, DeadTime::cycles);
        (f64::from(cycles) * 1e9 / f64::from(rates::CORE_HZ)).ceil()
    }

    fn check_times(&self, longest_dead_time_ns: f64) -> Result<(), InputError> {
        let Keys { dead_time_ns, precharge_s, discharge_s, .. } = self.keys;
        self.check(&[
            Bound(
                "dead_time_ns",
                f64::from(dead_time_ns),
                1.0,
                longest_dead_time_ns,
                "what the drive can have",
            ),
            Bound("precharge_s", precharge_s, 1e-3, 60.0, "a time constant of a DC link"),
            Bound("discharge_s", discharge_s, 1e-3, 600.0, "a time constant of a DC link"),
        ])
    }

    /// Currents, voltage and encoders, for a drive that trips at `trip_v`.
    fn check_sensors(
        &self,
        machine: &Machine,
        trip_v: f64,
        why_v: &str,
        encoders: usize,
    ) -> Result<(), InputError> {
        let Keys { current_range_a, zero_code, zero_tolerance, dc_link_range_v, break_current_a, .. } =
            self.keys;
        let trip_a = f64::from(machine.tables.ratings.trip_current_a);
        let (zero, tolerance) = (f64::from(zero_code), f64::from(zero_tolerance));
        let a_per_code = current_range_a / HALF_CODES;
        // Codes that are left to either side of a zero that is off.
        let room = zero.min(CODES - zero) - tolerance - 1.0;
        self.check(&[
            Bound("zero_code", zero, 1_024.0, 3_072.0, "near the middle of the converter's range"),
            Bound("zero_tolerance", tolerance, 1.0, 512.0, "what a sensor's offset may be"),
            self.current("current_range_a", current_range_a, trip_a, "the machine's trip_current_a"),
            self.voltage("dc_link_range_v", dc_link_range_v, trip_v, why_v),
            Bound(
                "break_current_a",
                break_current_a,
                trip_a + tolerance * a_per_code,
                BREAK * trip_a,
                &format!(
                    "above the machine's trip_current_a, {}, by a sensor's offset, and at most twice it",
                    shown(trip_a)
                ),
            ),
            Bound(
                "break_current_a",
                break_current_a,
                0.0,
                room * a_per_code,
                "what the converters hold with current_range_a",
            ),
        ])?;
        if let PositionSensor::Encoder = self.sensor()? {
            let counts = f64::from(self.sensor_counts()?);
            self.check(&[Bound("encoder_counts", counts, 4.0, 65_536.0, "what the timer counts")])?;
        }
        let zeros = &self.keys.encoder_zeros_deg;
        if zeros.len() != encoders {
            return Err(
                self.refuse("encoder_zeros_deg", format!("{} angles: must be {encoders}", zeros.len()))
            );
        }
        zeros
            .iter()
            .try_for_each(|zero| self.check(&[Bound("encoder_zeros_deg", *zero, -360.0, 360.0, "an angle")]))
    }

    /// The range of a current's sensor, which has to hold so much to either side of a zero that is off.
    fn current<'b>(&self, key: &'b str, range_a: f64, holds_a: f64, why: &'b str) -> Bound<'b> {
        let (zero, tolerance) = (f64::from(self.keys.zero_code), f64::from(self.keys.zero_tolerance));
        let least = holds_a * HALF_CODES / (zero.min(CODES - zero) - tolerance - 1.0);
        Bound(key, range_a, least, RANGE * holds_a, why)
    }

    /// The range of a voltage divider, which has to hold so much.
    fn voltage<'b>(&self, key: &'b str, range_v: f64, holds_v: f64, why: &'b str) -> Bound<'b> {
        Bound(key, range_v, holds_v * CODES / (CODES - 1.0), RANGE * holds_v, why)
    }

    /// The constant's value as Rust.
    fn constant(
        &self,
        control_hz: u32,
        min_pulse_ns: u32,
        thermal: Option<Thermal>,
    ) -> Result<String, InputError> {
        let Keys { dead_time_ns, current_range_a, zero_code, zero_tolerance, dc_link_range_v, .. } =
            self.keys;
        let Keys { break_current_a, precharge_s, discharge_s, behind_line_filter, .. } = self.keys;
        let encoder_counts = self.sensor_counts()?;
        let behind_line_filter = behind_line_filter == Some(true);
        let angle_late_s =
            1e-6 * self.keys.angle_late_us.unwrap_or_default() + self.sensor_age_s(control_hz)?;
        let current_filter_s = self.keys.current_filter_us.unwrap_or_default() / 1e6;
        let threshold_v = self.keys.device_threshold_v.unwrap_or_default();
        let slope_ohm = 1e-3 * self.keys.device_slope_mohm.unwrap_or_default();
        let zero = angle(self.keys.encoder_zeros_deg.first().copied().unwrap_or_default());
        Ok(format!(
            "PowerStage {{\n    control_hz: {control_hz},\n    dead_time_ns: {dead_time_ns},\n    min_pulse_ns: {min_pulse_ns},\n    \
             current_a_per_code: {current_range_a:?} / {HALF_CODES:?},\n    zero_code: {zero_code},\n    \
             zero_tolerance: {zero_tolerance},\n    udc_v_per_code: {dc_link_range_v:?} / {CODES:?},\n    \
             break_current_a: {break_current_a:?},\n    encoder_counts: {encoder_counts},\n    encoder_zero: {zero},\n    \
             line: LineTimes {{ precharge_s: {precharge_s:?}, discharge_s: {discharge_s:?} }},\n    \
             behind_line_filter: {behind_line_filter},\n    \
             angle_late_s: {angle_late_s:?},\n    current_filter_s: {current_filter_s:?},\n    \
             drops: Drops {{ threshold_v: {threshold_v:?}, slope_ohm: {slope_ohm:?} }},\n    thermal: {thermal:?},\n}}"
        ))
    }
}

impl Machine<'_> {
    fn refuse(&self, problem: String) -> InputError {
        InputError::new(&self.folder.join("machine.toml"), None, problem)
    }
}

/// An angle as Rust.
fn angle(degrees: f64) -> String {
    let turns = (degrees / 360.0).rem_euclid(1.0);
    format!("Angle({})", (turns * 4_294_967_296.0) as u64 as u32)
}

/// A bound with four digits, as whole as it is.
fn shown(bound: f64) -> String {
    let rounded = format!("{bound:.3}");
    rounded.trim_end_matches('0').trim_end_matches('.').to_owned()
}
