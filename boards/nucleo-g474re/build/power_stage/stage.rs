//! A file that has been read, its checks, and its constant.

use super::super::dead_time::DeadTime;
use super::super::rates;
use super::keys::{Absolute, Biss, Keys, PositionSensor};
use std::path::Path;
use tractive::configuration::{LATEST_ANGLE_S, Refused};
use tractive::machine::{Ratings, Tables};
use tractive::thermal::Thermal;
use tractive_tablegen::InputError;

/// Codes of the 12-bit converters.
pub const CODES: f64 = 4_095.0;

/// Codes of half their range.
pub const HALF_CODES: f64 = 2_048.0;

/// The most by which a range may exceed what it must hold: beyond, the converter resolves nothing.
const RANGE: f64 = 20.0;

/// The most by which the comparators' current may exceed the machine's trip current: beyond, they protect another machine.
const BREAK: f64 = 2.0;

/// The slowest control, in Hz: after a pause of 1 ms a converter's result may be wrong (errata sheet, 2.7.9).
const SLOWEST_CONTROL_HZ: f64 = 1_100.0;

/// A machine, and the folder that it was read from.
pub struct Machine<'a> {
    /// The folder.
    pub folder: &'a Path,
    /// The tables that the image will hold.
    pub tables: &'a Tables,
    /// Highest frequency of the free carrier, as a share of the switches'.
    pub carrier_share: f32,
}

impl Machine<'_> {
    pub fn refuse(&self, problem: String) -> InputError {
        InputError::new(&self.folder.join("machine.toml"), None, problem)
    }
}

/// A key, its value, the least and the most that are allowed, and why.
pub struct Bound<'a>(pub &'a str, pub f64, pub f64, pub f64, pub &'a str);

/// A file that has been read.
pub struct Stage<'a> {
    file: &'a Path,
    text: &'a str,
    pub keys: Keys,
}

impl<'a> Stage<'a> {
    /// The sensor that the file names: one, and counts for an encoder alone.
    pub fn sensor(&self) -> Result<PositionSensor, InputError> {
        let Keys { encoder_counts, absolute, biss, resolver, .. } = self.keys;
        let named = [
            encoder_counts.map(|_| PositionSensor::Encoder),
            absolute.map(PositionSensor::Absolute),
            biss.map(PositionSensor::Biss),
            resolver.map(PositionSensor::Resolver),
        ];
        let mut named = named.into_iter().flatten();
        match (named.next(), named.next()) {
            (Some(sensor), None) => Ok(sensor),
            (None, _) => Err(self.refuse("encoder_counts", "is missing".to_owned())),
            _ => {
                let problem = "one of encoder_counts, absolute, biss, resolver".to_owned();
                Err(self.refuse("encoder_counts", problem))
            }
        }
    }

    /// Counts in a turn of the shaft; of a resolver so many that none is noticed.
    pub fn sensor_counts(&self) -> Result<u32, InputError> {
        Ok(match self.sensor()? {
            PositionSensor::Encoder => self.keys.encoder_counts.unwrap_or_default(),
            PositionSensor::Absolute(Absolute { bits, .. }) | PositionSensor::Biss(Biss { bits, .. }) => {
                1 << bits.min(24)
            }
            PositionSensor::Resolver(_) => 65_536,
        })
    }

    /// Age of an angle by the way its sensor is read, in s.
    pub fn sensor_age_s(&self, control_hz: u32) -> Result<f64, InputError> {
        let periods = match self.sensor()? {
            PositionSensor::Encoder => 0.0,
            PositionSensor::Absolute(_) | PositionSensor::Biss(_) => 1.0,
            PositionSensor::Resolver(_) => 0.5,
        };
        Ok(periods / f64::from(control_hz))
    }

    pub fn parse(file: &'a Path, text: &'a str) -> Result<Self, InputError> {
        let line = |start: usize| 1 + text[..start].matches('\n').count() as u64;
        let keys = toml::from_str(text).map_err(|error| {
            InputError::new(file, error.span().map(|span| line(span.start)), error.message())
        })?;
        Ok(Self { file, text, keys })
    }

    /// The error of a key, with the line where it stands.
    pub fn refuse(&self, key: &str, problem: String) -> InputError {
        let is_key =
            |line: &str| line.split(['=', ']']).next().map(|word| word.trim_matches([' ', '['])) == Some(key);
        let line = self.text.lines().position(is_key).map(|index| index as u64 + 1);
        InputError::new(self.file, line, format!("{key}: {problem}"))
    }

    /// The error of a machine or a stage with which the image itself would refuse to start.
    pub fn refuse_start(&self, machine: &Machine, refused: &Refused) -> InputError {
        let problem = format!("the image would not start: {refused}");
        match refused.name.starts_with("devices.") {
            true => InputError::new(self.file, None, problem),
            false => machine.refuse(problem),
        }
    }

    /// The first key out of its bounds. What is not a number is out of any.
    pub fn check(&self, bounds: &[Bound]) -> Result<(), InputError> {
        let outside = bounds.iter().find(|Bound(_, value, least, most, _)| !(least..=most).contains(&value));
        let Some(Bound(key, value, least, most, why)) = outside else { return Ok(()) };
        let (least, most) = (shown(*least), shown(*most));
        Err(self.refuse(key, format!("{value}: must be from {least} to {most}: {why}")))
    }

    /// The ages of angle and currents and the drops of devices that the drive makes up for; the shortest carrier half lasts so long, in µs.
    pub fn check_known(&self, control_hz: u32, half_us: f64, ratings: &Ratings) -> Result<(), InputError> {
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
    pub fn check_control_hz(&self, control_hz: u32, max_switching_hz: f32) -> Result<(), InputError> {
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
    pub fn longest_dead_time_ns(&self) -> f64 {
        (f64::from(DeadTime::LONGEST_CYCLES) * 1e9 / f64::from(rates::CORE_HZ)).floor()
    }

    /// The dead time that the generator makes of what was asked for, in ns.
    pub fn real_dead_time_ns(&self) -> f64 {
        let cycles =
            DeadTime::at_least(rates::ns_to_cycles(self.keys.dead_time_ns)).map_or(0, DeadTime::cycles);
        (f64::from(cycles) * 1e9 / f64::from(rates::CORE_HZ)).ceil()
    }

    pub fn check_times(&self, longest_dead_time_ns: f64) -> Result<(), InputError> {
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
    pub fn check_sensors(
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
            let levels = f64::from(self.keys.encoder_index_ab.unwrap_or_default());
            self.check(&[
                Bound("encoder_counts", counts, 4.0, 65_536.0, "what the timer counts"),
                Bound("encoder_index_ab", levels, 0.0, 3.0, "two bits"),
            ])?;
        } else if self.keys.encoder_index_ab.is_some() {
            return Err(self.refuse("encoder_index_ab", "this sensor has no index".to_owned()));
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
    pub fn current<'b>(&self, key: &'b str, range_a: f64, holds_a: f64, why: &'b str) -> Bound<'b> {
        let (zero, tolerance) = (f64::from(self.keys.zero_code), f64::from(self.keys.zero_tolerance));
        let least = holds_a * HALF_CODES / (zero.min(CODES - zero) - tolerance - 1.0);
        Bound(key, range_a, least, RANGE * holds_a, why)
    }

    /// The range of a voltage divider, which has to hold so much.
    pub fn voltage<'b>(&self, key: &'b str, range_v: f64, holds_v: f64, why: &'b str) -> Bound<'b> {
        Bound(key, range_v, holds_v * CODES / (CODES - 1.0), RANGE * holds_v, why)
    }

    /// The constant's value as Rust.
    pub fn constant(
        &self,
        control_hz: u32,
        min_pulse_ns: u32,
        thermal: Option<Thermal>,
    ) -> Result<String, InputError> {
        let Keys { dead_time_ns, current_range_a, zero_code, zero_tolerance, dc_link_range_v, .. } =
            self.keys;
        let Keys { break_current_a, precharge_s, discharge_s, behind_line_filter, .. } = self.keys;
        let encoder_counts = self.sensor_counts()?;
        let encoder_index_ab = self.keys.encoder_index_ab.unwrap_or_default();
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
             break_current_a: {break_current_a:?},\n    encoder_counts: {encoder_counts},\n    \
             encoder_index_ab: {encoder_index_ab},\n    encoder_zero: {zero},\n    \
             line: LineTimes {{ precharge_s: {precharge_s:?}, discharge_s: {discharge_s:?} }},\n    \
             behind_line_filter: {behind_line_filter},\n    \
             angle_late_s: {angle_late_s:?},\n    current_filter_s: {current_filter_s:?},\n    \
             drops: Drops {{ threshold_v: {threshold_v:?}, slope_ohm: {slope_ohm:?} }},\n    thermal: {thermal:?},\n}}"
        ))
    }
}

/// An angle as Rust.
pub fn angle(degrees: f64) -> String {
    let turns = (degrees / 360.0).rem_euclid(1.0);
    format!("Angle({})", (turns * 4_294_967_296.0) as u64 as u32)
}

/// A bound with four digits, as whole as it is.
pub fn shown(bound: f64) -> String {
    let rounded = format!("{bound:.3}");
    rounded.trim_end_matches('0').trim_end_matches('.').to_owned()
}
