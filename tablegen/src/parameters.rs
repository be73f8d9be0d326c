//! `machine.toml`: ratings, limits, losses.

use crate::InputError;
use std::collections::BTreeMap;
use std::f64::consts::TAU;
use std::fmt::Display;
use std::path::Path;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// The keys of `machine.toml`, and what may stand at each: a range, and what it is without the key.
macro_rules! parameters {
    (required { $($(#[$of_must:meta])* $must:ident: $within:expr;)* }
     optional { $($(#[$of_may:meta])* $may:ident: $range:expr, $default:expr;)* }) => {
        /// The keys of `machine.toml`, with defaults filled in. SI units; currents and voltages of phases are peak values.
        #[derive(Clone, Debug, PartialEq)]
        pub struct Parameters {
            /// Name of the machine.
            pub name: String,
            /// Pole pairs.
            pub pole_pairs: u32,
            $($(#[$of_must])* pub $must: f64,)*
            $($(#[$of_may])* pub $may: f64,)*
            /// Pulse patterns above the free carrier; default the paper's.
            pub patterns: Patterns,
            lines: BTreeMap<String, u64>,
        }

        const REQUIRED: &[&str] = &["name", "pole_pairs", $(stringify!($must)),*];
        const OPTIONAL: &[&str] = &[$(stringify!($may),)* "patterns"];

        impl Keys<'_> {
            fn parameters(&self) -> Result<Parameters, InputError> {
                let (name, pole_pairs) = (self.name()?, self.pole_pairs()?);
                $(let $must = self.number(stringify!($must), $within, 0.0)?;)*
                $(let $may = self.number(stringify!($may), $range, $default)?;)*
                let patterns = self.patterns()?;
                let lines = self.values.iter().map(|(key, value)| (key.clone(), value.line)).collect();
                Ok(Parameters { name, pole_pairs, $($must,)* $($may,)* patterns, lines })
            }
        }
    };
}

/// The pulse patterns above the free carrier.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Patterns {
    /// The paper's modes.
    #[default]
    Paper,
    /// Optimised patterns of 15 to 3 pulses.
    Optimal,
}

parameters! {
    required {
        /// Stator resistance of a phase, in ohm.
        stator_resistance_ohm: 0.0..=1e3;
        /// Largest torque, in N·m.
        max_torque_nm: ABOVE_ZERO..=1e7;
        /// Largest mechanical power, in W.
        max_power_w: ABOVE_ZERO..=1e9;
        /// Largest current, peak, in A.
        max_current_a: ABOVE_ZERO..=1e5;
        /// Largest speed, in r/min.
        max_speed_rpm: ABOVE_ZERO..=1e6;
        /// Rated torque, in N·m.
        rated_torque_nm: ABOVE_ZERO..=1e7;
        /// Rated speed, in r/min.
        rated_speed_rpm: ABOVE_ZERO..=1e6;
        /// Lowest DC-link voltage in normal operation, in V.
        dc_link_min_v: ABOVE_ZERO..=1e5;
        /// Nominal DC-link voltage, in V.
        dc_link_nominal_v: ABOVE_ZERO..=1e5;
        /// Highest DC-link voltage in normal operation, in V.
        dc_link_max_v: ABOVE_ZERO..=1e5;
        /// Highest switching frequency of a device, in Hz.
        max_switching_hz: 50.0..=100e3;
    }
    optional {
        /// Least direct-axis current, negative, in A: the magnets' demagnetisation limit; default −`max_current_a`, which limits nothing.
        min_id_a: -1e5..=0.0, -max_current_a;
        /// Phase current that trips the drive, in A; default 1.3 × `max_current_a`.
        trip_current_a: ABOVE_ZERO..=1e6, 1.3 * max_current_a;
        /// DC-link voltage above which the drive trips, in V; default 1.15 × `dc_link_max_v`.
        trip_dc_over_v: ABOVE_ZERO..=1e6, 1.15 * dc_link_max_v;
        /// DC-link voltage below which the drive trips, in V; default 0.85 × `dc_link_min_v`.
        trip_dc_under_v: 0.0..=1e6, 0.85 * dc_link_min_v;
        /// Speed above which the drive trips, in r/min; default 1.1 × `max_speed_rpm`.
        trip_speed_rpm: ABOVE_ZERO..=1e7, 1.1 * max_speed_rpm;
        /// Slew rate of the torque demand, in N·m/s; default `max_torque_nm` in 0.1 s.
        torque_slew_nm_per_s: ABOVE_ZERO..=1e9, 10.0 * max_torque_nm;
        /// Inertia of the rotor and what it drives, in kg·m²; by default `max_torque_nm` takes it to `max_speed_rpm` in one second.
        rotor_inertia_kg_m2: ABOVE_ZERO..=1e7, max_torque_nm / (max_speed_rpm * TAU / 60.0);
        /// Iron and mechanical loss at rated speed, in W; default 0.
        loss_rated_w: 0.0..=1e8, 0.0;
        /// Share of that loss that grows with the square of speed, 0 ..= 1; the rest is linear. Default 0.6.
        loss_quadratic_fraction: 0.0..=1.0, 0.6;
        /// Share of that loss that is known to be the iron's, which the drive makes up for in its torque, 0 ..= 1; default 0.
        iron_loss_share: 0.0..=1.0, 0.0;
        /// Voltage of a nine-switch inverter's source, in V; default that of `dc_link_min_v`.
        zs9_source_v: ABOVE_ZERO..=1e5, dc_link_min_v / TWO_LEVEL_SHARE;
        /// Voltage of its link outside shoot-through until somebody asks for another, in V; default that of `dc_link_nominal_v`.
        zs9_link_v: ABOVE_ZERO..=1e5, 2.0 * dc_link_nominal_v / TWO_LEVEL_SHARE - zs9_source_v;
        /// Inductance of each inductor of its network, in H; default as much for both motors' `max_power_w` at the source's voltage as the paper's.
        zs9_inductance_h: ABOVE_ZERO..=0.1, 78.6e-6 * zs9_source_v * zs9_source_v / (2.0 * max_power_w);
        /// Resistance of each, in ohm; default 20 Ω a henry.
        zs9_resistance_ohm: 0.0..=1.0, 20.0 * zs9_inductance_h;
        /// Capacitance of each capacitor of its network, in F; default as `zs9_inductance_h`.
        zs9_capacitance_f: ABOVE_ZERO..=0.1, 3.18e-3 * 2.0 * max_power_w / (zs9_source_v * zs9_source_v);
    }
}

/// Two values with their names, of which the low one may not be above the high one.
struct Order {
    low: (&'static str, f64),
    high: (&'static str, f64),
    may_be_equal: bool,
}

impl Parameters {
    /// Iron and mechanical loss at a speed, in W: `P = P_rated (f (n/n_rated)² + (1 − f) n/n_rated)`.
    pub fn speed_loss_w(&self, speed_rpm: f64) -> f64 {
        let relative = speed_rpm.abs() / self.rated_speed_rpm;
        let quadratic = self.loss_quadratic_fraction;
        self.loss_rated_w * (quadratic * relative * relative + (1.0 - quadratic) * relative)
    }

    /// The demagnetisation limit, in A: i_d is never below; −∞ where there is none.
    pub fn least_id_a(&self) -> f64 {
        if self.min_id_a > -self.max_current_a { self.min_id_a } else { f64::NEG_INFINITY }
    }

    /// Reads and checks the file.
    ///
    /// # Errors
    /// Names the line, the key, its value and what is allowed.
    pub fn read(file: &Path) -> Result<Self, InputError> {
        let refuse = |error: &dyn Display| InputError::new(file, None, format!("cannot be read: {error}"));
        let bytes = crate::read_bounded(file).map_err(|error| refuse(&error))?;
        let text = String::from_utf8(bytes).map_err(|error| refuse(&error))?;
        Self::parse(&text, file)
    }

    /// The same from a given text; errors name `file`.
    pub(crate) fn parse(text: &str, file: &Path) -> Result<Self, InputError> {
        let table = DeTable::parse(text).map_err(|error| {
            let line = error.span().map(|span| line_at(text, span.start));
            InputError::new(file, line, format!("not TOML: {}", error.message()))
        })?;
        let keys = Keys::new(file, text, table.into_inner())?;
        let parameters = keys.parameters()?;
        parameters.check(file)?;
        Ok(parameters)
    }

    /// `true` if the file has this key.
    pub fn names(&self, key: &str) -> bool {
        self.line_of(key).is_some()
    }

    /// The line of a key, if the file has it.
    pub fn line_of(&self, key: &str) -> Option<u64> {
        self.lines.get(key).copied()
    }

    /// Checks for limits that contradict each other.
    fn check(&self, file: &Path) -> Result<(), InputError> {
        for Order { low: (low_name, low), high: (high_name, high), may_be_equal } in
            self.limits().into_iter().chain(self.margins())
        {
            if low > high || (low == high && !may_be_equal) {
                let relation = if may_be_equal { "at most" } else { "below" };
                let line = self.line_of(low_name).or_else(|| self.line_of(high_name));
                let problem = format!("{low_name}: {low}: must be {relation} {high_name}, {high}");
                return Err(InputError::new(file, line, problem));
            }
        }
        self.check_least_id(file)?;
        self.check_switching(file)
    }

    /// Rejects a demagnetisation limit below what the current limit allows anyway: it would limit nothing.
    fn check_least_id(&self, file: &Path) -> Result<(), InputError> {
        if self.min_id_a >= -self.max_current_a {
            return Ok(());
        }
        let problem = format!(
            "min_id_a: {}: must be from {}, −max_current_a, to 0",
            self.min_id_a, -self.max_current_a
        );
        Err(InputError::new(file, self.line_of("min_id_a"), problem))
    }

    /// The order of limits: a trip level lies beyond its limit.
    fn limits(&self) -> [Order; 9] {
        let at_most = |low, high| Order { low, high, may_be_equal: true };
        let below = |low, high| Order { low, high, may_be_equal: false };
        let least = ("dc_link_min_v", self.dc_link_min_v);
        let nominal = ("dc_link_nominal_v", self.dc_link_nominal_v);
        let most = ("dc_link_max_v", self.dc_link_max_v);
        let (current_a, speed_rpm) = (self.max_current_a, self.max_speed_rpm);
        [
            at_most(("rated_torque_nm", self.rated_torque_nm), ("max_torque_nm", self.max_torque_nm)),
            at_most(("rated_speed_rpm", self.rated_speed_rpm), ("max_speed_rpm", speed_rpm)),
            at_most(least, nominal),
            at_most(nominal, most),
            below(most, ("trip_dc_over_v", self.trip_dc_over_v)),
            below(("trip_dc_under_v", self.trip_dc_under_v), least),
            below(("max_current_a", current_a), ("trip_current_a", self.trip_current_a)),
            below(("max_speed_rpm", speed_rpm), ("trip_speed_rpm", self.trip_speed_rpm)),
            at_most(("zs9_source_v", self.zs9_source_v), ("zs9_link_v", self.zs9_link_v)),
        ]
    }

    /// The orders for values that would be too large, or too small, relative to the other ratings.
    fn margins(&self) -> [Order; 10] {
        let power_w = |torque_nm: f64, speed_rpm: f64| torque_nm * speed_rpm * TAU / 60.0;
        let rated_power_w = power_w(self.rated_torque_nm, self.rated_speed_rpm);
        let full_power_w = power_w(self.max_torque_nm, self.max_speed_rpm);
        let resistive_v = self.stator_resistance_ohm * self.max_current_a;
        let spin_up_s = self.rotor_inertia_kg_m2 * self.max_speed_rpm * TAU / 60.0 / self.max_torque_nm;
        let (power, slew) =
            (("max_power_w", self.max_power_w), ("torque_slew_nm_per_s", self.torque_slew_nm_per_s));
        let least_nm_s = ("max_torque_nm in 100 s", 0.01 * self.max_torque_nm);
        let half_v = ("half of dc_link_nominal_v", 0.5 * self.dc_link_nominal_v);
        [
            // 1 % because ratings are rounded.
            (
                ("power of rated_torque_nm at rated_speed_rpm", rated_power_w),
                ("max_power_w", self.max_power_w * 1.01),
            ),
            (power, ("power of max_torque_nm at max_speed_rpm", full_power_w * 1.01)),
            // A trip level far above its limit protects nothing.
            (("trip_current_a", self.trip_current_a), ("4 × max_current_a", 4.0 * self.max_current_a)),
            (("trip_dc_over_v", self.trip_dc_over_v), ("3 × dc_link_max_v", 3.0 * self.dc_link_max_v)),
            (("trip_speed_rpm", self.trip_speed_rpm), ("3 × max_speed_rpm", 3.0 * self.max_speed_rpm)),
            (("drop of max_current_a across stator_resistance_ohm", resistive_v), half_v),
            (slew, ("max_torque_nm in 1 ms", 1e3 * self.max_torque_nm)),
            (least_nm_s, slew),
            (("loss_rated_w", self.loss_rated_w), power),
            (
                ("seconds at max_torque_nm to max_speed_rpm with rotor_inertia_kg_m2", spin_up_s),
                ("ten minutes", 600.0),
            ),
        ]
        .map(|(low, high)| Order { low, high, may_be_equal: true })
    }

    /// Checks that the devices may switch at least as often as the stator's voltage turns: square wave turns each on once a turn.
    fn check_switching(&self, file: &Path) -> Result<(), InputError> {
        let least_hz = self.max_speed_rpm / 60.0 * f64::from(self.pole_pairs);
        if self.max_switching_hz >= least_hz {
            return Ok(());
        }
        let problem = format!(
            "max_switching_hz: {}: must be at least {least_hz:.0}, the stator frequency at max_speed_rpm {}",
            self.max_switching_hz, self.max_speed_rpm
        );
        Err(InputError::new(file, self.line_of("max_switching_hz"), problem))
    }
}

/// The file's keys with their lines.
struct Keys<'a> {
    file: &'a Path,
    values: BTreeMap<String, Value<'a>>,
}

/// A key's value, as parsed and as written.
struct Value<'a> {
    parsed: DeValue<'a>,
    written: &'a str,
    line: u64,
}

impl<'a> Keys<'a> {
    fn new(file: &'a Path, text: &'a str, table: DeTable<'a>) -> Result<Self, InputError> {
        let mut values = BTreeMap::new();
        for (key, value) in table {
            let line = line_at(text, Spanned::span(&key).start);
            let name = key.into_inner().into_owned();
            if !REQUIRED.contains(&name.as_str()) && !OPTIONAL.contains(&name.as_str()) {
                return Err(InputError::new(file, Some(line), unknown(&name)));
            }
            let written = &text[value.span()];
            values.insert(name, Value { parsed: value.into_inner(), written, line });
        }
        match REQUIRED.iter().find(|key| !values.contains_key(**key)) {
            Some(key) => Err(InputError::new(file, None, format!("{key}: missing: must be given"))),
            None => Ok(Self { file, values }),
        }
    }

    fn refuse(&self, key: &str, allowed: &str) -> InputError {
        let (line, written) =
            self.values.get(key).map_or((None, ""), |value| (Some(value.line), value.written));
        InputError::new(self.file, line, format!("{key}: {written}: must be {allowed}"))
    }

    /// A number in a range; `default` where the key is absent.
    fn number(
        &self,
        key: &str,
        range: std::ops::RangeInclusive<f64>,
        default: f64,
    ) -> Result<f64, InputError> {
        let Some(value) = self.values.get(key) else {
            return Ok(default);
        };
        let number = match &value.parsed {
            DeValue::Float(number) => number.as_str().replace('_', "").parse().ok(),
            DeValue::Integer(number) if number.radix() == 10 => number.as_str().replace('_', "").parse().ok(),
            _ => None,
        };
        match number {
            // A range holds neither NaN nor infinity.
            Some(number) if range.contains(&number) => Ok(number),
            _ => {
                let allowed = if *range.start() == ABOVE_ZERO {
                    format!("a number above 0, up to {}", range.end())
                } else {
                    format!("a number from {} to {}", range.start(), range.end())
                };
                Err(self.refuse(key, &allowed))
            }
        }
    }

    fn name(&self) -> Result<String, InputError> {
        match self.values.get("name") {
            Some(Value { parsed: DeValue::String(name), .. }) if !name.trim().is_empty() => {
                Ok(name.to_string())
            }
            _ => Err(self.refuse("name", "a text in quotes that is not empty")),
        }
    }

    fn patterns(&self) -> Result<Patterns, InputError> {
        let Some(value) = self.values.get("patterns") else { return Ok(Patterns::default()) };
        match &value.parsed {
            DeValue::String(name) if name == "paper" => Ok(Patterns::Paper),
            DeValue::String(name) if name == "optimal" => Ok(Patterns::Optimal),
            _ => Err(self.refuse("patterns", "\"paper\" or \"optimal\"")),
        }
    }

    fn pole_pairs(&self) -> Result<u32, InputError> {
        let pole_pairs = self.number("pole_pairs", 1.0..=100.0, 0.0)?;
        if pole_pairs.fract() != 0.0 {
            return Err(self.refuse("pole_pairs", "a whole number from 1 to 100"));
        }
        Ok(pole_pairs as u32)
    }
}

/// Reports an unknown key, and the one that was probably meant: the same quantity in another unit, or a typing error.
fn unknown(name: &str) -> String {
    let known = || REQUIRED.iter().chain(OPTIONAL);
    let quantity = |key: &str| UNITS.iter().find_map(|unit| key.strip_suffix(unit).map(str::to_owned));
    let in_other_unit = |key: &&&str| {
        quantity(key).is_some_and(|stem| {
            name.strip_prefix(&stem).is_some_and(|unit| unit.is_empty() || unit.starts_with('_'))
        })
    };
    if let Some(meant) = known().find(in_other_unit) {
        return format!("{name}: wrong unit: must be {meant}");
    }
    let nearest = known().min_by_key(|key| slips(name, key));
    match nearest {
        Some(meant) if slips(name, meant) <= 3 => format!("{name}: unknown key: must probably be {meant}"),
        _ => format!("{name}: unknown key: must be one of {}, {}", REQUIRED.join(", "), OPTIONAL.join(", ")),
    }
}

/// The least number that counts as above 0.
const ABOVE_ZERO: f64 = 1e-9;

/// Link voltage of a two-level inverter whose six-step fundamental equals the largest voltage of a motor of a nine-switch inverter, over the capacitors'
/// voltage: π/(4 √3).
pub const TWO_LEVEL_SHARE: f64 = 0.453_449_841_058_554_5;

/// Unit suffixes of the known keys, longest first.
const UNITS: [&str; 12] =
    ["_nm_per_s", "_kg_m2", "_ohm", "_rpm", "_nm", "_hz", "_fraction", "_w", "_a", "_v", "_h", "_f"];

/// Number of letters to insert, remove or change that turns one word into the other (Levenshtein).
fn slips(a: &str, b: &str) -> usize {
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, x) in a.bytes().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, y) in b.bytes().enumerate() {
            let changed = diagonal + usize::from(x != y);
            diagonal = row[j + 1];
            row[j + 1] = changed.min(diagonal + 1).min(row[j] + 1);
        }
    }
    row[b.len()]
}

fn line_at(text: &str, offset: usize) -> u64 {
    1 + text.as_bytes()[..offset.min(text.len())].iter().filter(|byte| **byte == b'\n').count() as u64
}

#[cfg(test)]
mod tests;
