//! Parameters: values that are set once for a drive, whatever its machine. They are kept in RAM; a reset restores the defaults.

use crate::machine::Ratings;
use crate::operator::{Settings, TrainLimits};
use core::f32::consts::TAU;

/// A parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Parameter {
    /// Number in the messages.
    pub id: u8,
    /// Name.
    pub name: &'static str,
    /// Unit.
    pub unit: &'static str,
    /// Smallest value.
    pub min: f32,
    /// Largest value; the machine's rating may be lower.
    pub max: f32,
    /// Its purpose.
    pub purpose: &'static str,
}

const NONE: TrainLimits = TrainLimits::NONE;

/// Every parameter, by its number from 1 on.
pub const PARAMETERS: [Parameter; 11] = [
    parameter(1, "torque_slew", "N.m/s", [1.0, 1e6], "fastest change of the torque demand"),
    parameter(2, "torque_jerk", "N.m/s2", [1.0, 1e9], "fastest change of that change"),
    parameter(3, "torque_limit", "N.m", [0.0, 3_000.0], "largest torque demand, either sign"),
    parameter(4, "speed_limit", "r/min", [0.5, 30_000.0], "speed beyond which nothing accelerates"),
    parameter(5, "command_zero", "ms", [20.0, 1_000.0], "silence after which torque is zero"),
    parameter(6, "command_off", "ms", [20.0, 10_000.0], "silence after which the drive stops"),
    parameter(7, "line_current_motoring", "A", [0.0, NONE.motoring_a], "largest line current, motoring"),
    parameter(8, "line_current_braking", "A", [0.0, NONE.braking_a], "largest line current, braking"),
    parameter(9, "line_power_motoring", "kW", [0.0, NONE.motoring_w / 1e3], "largest line power, motoring"),
    parameter(10, "line_power_braking", "kW", [0.0, NONE.braking_w / 1e3], "largest line power, braking"),
    parameter(11, "acceleration_limit", "r/min/s", [1.0, 1e9], "largest acceleration of a wheel with grip"),
];

const fn parameter(
    id: u8,
    name: &'static str,
    unit: &'static str,
    [min, max]: [f32; 2],
    purpose: &'static str,
) -> Parameter {
    Parameter { id, name, unit, min, max, purpose }
}

/// r/min in one rad/s.
pub const RPM_PER_RAD_S: f32 = 60.0 / TAU;

/// The values.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Parameters {
    /// Fastest change of the torque demand, in N·m/s.
    pub torque_slew_nm_s: f32,
    /// Fastest change of the torque's rate, in N·m/s².
    pub torque_jerk_nm_s2: f32,
    /// Largest torque demand, in N·m.
    pub torque_limit_nm: f32,
    /// Speed beyond which the drive does not accelerate, in r/min.
    pub speed_limit_rpm: f32,
    /// Silence after which torque is zero, in ms.
    pub command_zero_ms: f32,
    /// Silence after which the drive stops, in ms; counted from the same command as the one above.
    pub command_off_ms: f32,
    /// Largest line current while motoring, in A.
    pub line_current_motoring_a: f32,
    /// Largest line current while braking, in A.
    pub line_current_braking_a: f32,
    /// Largest line power while motoring, in kW.
    pub line_power_motoring_kw: f32,
    /// Largest line power while braking, in kW.
    pub line_power_braking_kw: f32,
    /// Largest acceleration of the rotor on rails with grip, in r/min/s.
    pub acceleration_limit_rpm_s: f32,
}

/// The reason why a value was not written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum WriteError {
    /// There is no such parameter.
    Unknown,
    /// The value is out of the parameter's range or beyond the machine's rating.
    OutOfRange,
}

impl Parameters {
    /// The values as the machine is rated, with the operator's usual slew and jerk.
    pub const fn rated(ratings: &Ratings) -> Self {
        let usual = Settings::rated(ratings, 0.0, None);
        Self {
            torque_slew_nm_s: usual.slew_nm_s,
            torque_jerk_nm_s2: usual.jerk_nm_s2,
            torque_limit_nm: ratings.max_torque_nm,
            speed_limit_rpm: ratings.max_speed_rad_s * RPM_PER_RAD_S,
            command_zero_ms: 50.0,
            command_off_ms: 500.0,
            line_current_motoring_a: NONE.motoring_a,
            line_current_braking_a: NONE.braking_a,
            line_power_motoring_kw: NONE.motoring_w / 1e3,
            line_power_braking_kw: NONE.braking_w / 1e3,
            acceleration_limit_rpm_s: 1e9,
        }
    }

    /// The limits of line and acceleration.
    pub fn train(&self) -> TrainLimits {
        TrainLimits {
            motoring_a: self.line_current_motoring_a,
            braking_a: self.line_current_braking_a,
            motoring_w: 1e3 * self.line_power_motoring_kw,
            braking_w: 1e3 * self.line_power_braking_kw,
            acceleration_rad_s2: self.acceleration_limit_rpm_s / RPM_PER_RAD_S,
        }
    }

    fn slot(&mut self, id: u8) -> Option<&mut f32> {
        Some(match id {
            1 => &mut self.torque_slew_nm_s,
            2 => &mut self.torque_jerk_nm_s2,
            3 => &mut self.torque_limit_nm,
            4 => &mut self.speed_limit_rpm,
            5 => &mut self.command_zero_ms,
            6 => &mut self.command_off_ms,
            7 => &mut self.line_current_motoring_a,
            8 => &mut self.line_current_braking_a,
            9 => &mut self.line_power_motoring_kw,
            10 => &mut self.line_power_braking_kw,
            11 => &mut self.acceleration_limit_rpm_s,
            _ => return None,
        })
    }

    /// The value of a parameter.
    pub fn read(&self, id: u8) -> Option<f32> {
        let mut copy = *self;
        copy.slot(id).copied()
    }

    /// Writes a parameter, or leaves everything as it is. Slew, torque and speed are limited to the machine's ratings, and the time-out to zero
    /// torque must not be longer than the one to stop.
    pub fn write(&mut self, id: u8, value: f32, ratings: &Ratings) -> Result<(), WriteError> {
        let known = PARAMETERS.iter().find(|parameter| parameter.id == id).ok_or(WriteError::Unknown)?;
        let rated = Self::rated(ratings);
        let largest = match id {
            1 | 3 | 4 => rated.read(id).unwrap_or(known.max),
            5 => self.command_off_ms,
            _ => known.max,
        };
        let smallest = if id == 6 { self.command_zero_ms } else { known.min };
        let inside = value >= smallest && value <= known.max && value <= largest;
        if !inside {
            return Err(WriteError::OutOfRange);
        }
        *self.slot(id).ok_or(WriteError::Unknown)? = value;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::built_in::traction::BUILT_IN;

    #[test]
    fn a_fresh_drive_has_no_limits_of_the_line() {
        let [own, none] = [Parameters::rated(&BUILT_IN.ratings).train(), NONE];
        let pairs = [
            (own.motoring_a, none.motoring_a),
            (own.braking_a, none.braking_a),
            (own.motoring_w, none.motoring_w),
            (own.braking_w, none.braking_w),
        ];
        for (own, none) in pairs {
            assert!((own / none - 1.0).abs() < 1e-6, "{own}, not {none}");
        }
    }

    #[test]
    fn each_parameter_is_its_own_and_ends_where_it_says() {
        for parameter in PARAMETERS {
            let mut parameters = Parameters {
                command_off_ms: 1e4,
                command_zero_ms: 20.0,
                ..Parameters::rated(&BUILT_IN.ratings)
            };
            let largest = parameter.max.min(match parameter.id {
                1 | 3 | 4 => parameters.read(parameter.id).unwrap(),
                _ => parameter.max,
            });
            for value in [parameter.min.next_down(), largest.next_up(), f32::NAN] {
                let refused = parameters.write(parameter.id, value, &BUILT_IN.ratings);
                assert_eq!(refused, Err(WriteError::OutOfRange), "{} {value}", parameter.name);
            }
            let before = parameters;
            for value in [parameter.min, largest] {
                assert_eq!(
                    parameters.write(parameter.id, value, &BUILT_IN.ratings),
                    Ok(()),
                    "{} {value}",
                    parameter.name
                );
                assert_eq!(parameters.read(parameter.id), Some(value));
            }
            let others = PARAMETERS.iter().filter(|other| other.id != parameter.id);
            assert!(others.map(|other| other.id).all(|id| parameters.read(id) == before.read(id)));
        }
    }
}
