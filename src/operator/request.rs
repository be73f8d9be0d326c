//! The request to the drive, and the feedback of the board.

use super::settings::Ends;
use crate::cell::Words;
use crate::configuration::Refused;
use crate::frames::Abc;
use crate::machine::Ratings;
use crate::protection::{Fault, Trip};
use crate::thermal::Ratios;
use crate::time::Instant;

/// The request of the command's sender, as levels: a lost or repeated frame changes nothing. If a command is an edge, the edge is the change from
/// `false` to `true` between two steps; at power-up every level counts as having been `true`.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Request {
    /// Rising edge: enable. `false`: stop, torque ramped to zero, then gates off.
    pub enable: bool,
    /// The permission for the enabling edge to come with a torque demand other than zero.
    pub with_torque: bool,
    /// `true`: gates off at once, without a ramp; like a stop it needs a new enabling edge afterwards.
    pub off: bool,
    /// `true`: torque ramped to zero, then gates off, while the drive stays enabled; `false` again: the machine is caught.
    pub coast: bool,
    /// Rising edge: precharge the link and close the main contactor.
    pub charge: bool,
    /// Rising edge: open the main contactor and discharge the link.
    pub discharge: bool,
    /// Rising edge: acknowledge the fault.
    pub acknowledge: bool,
    /// `true`, while the gates pulse without torque: calibrate the zero of the position sensor.
    pub calibrate: bool,
    /// Torque demand, in N·m; positive turns the rotor forward.
    pub torque_nm: f32,
    /// Limits within the machine's ratings.
    pub limits: Limits,
}

impl Request {
    /// A request for nothing, with limits as rated.
    pub const fn idle(ratings: &Ratings) -> Self {
        Self {
            enable: false,
            with_torque: false,
            off: false,
            coast: false,
            charge: false,
            discharge: false,
            acknowledge: false,
            calibrate: false,
            torque_nm: 0.0,
            limits: Limits::rated(ratings),
        }
    }
}

/// The levels that every drive's request has; see [`Request`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Levels {
    /// Rising edge: enable. `false`: stop.
    pub enable: bool,
    /// The permission for the enabling edge to come with a demand other than zero.
    pub with_torque: bool,
    /// Gates off at once.
    pub off: bool,
    /// Coast.
    pub coast: bool,
    /// Rising edge: charge.
    pub charge: bool,
    /// Rising edge: discharge.
    pub discharge: bool,
    /// Rising edge: acknowledge.
    pub acknowledge: bool,
    /// Calibrate the zero of the position sensor, or of both.
    pub calibrate: bool,
}

impl Levels {
    /// No level set.
    pub const NONE: Self = Self {
        enable: false,
        with_torque: false,
        off: false,
        coast: false,
        charge: false,
        discharge: false,
        acknowledge: false,
        calibrate: false,
    };
}

/// Limits that the command's sender may set, each within the machine's ratings: limits outside them are refused, and the previous limits remain in
/// force.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Limits {
    /// Largest motoring torque, in N·m, 0 ..= the rated largest.
    pub motoring_nm: f32,
    /// Largest braking torque, in N·m, 0 ..= the rated largest.
    pub braking_nm: f32,
    /// Mechanical speed at which torque that would raise it further is zero, in rad/s, above 0, at most the rated largest.
    pub speed_rad_s: f32,
    /// Link voltage at and below which there is no motoring torque, in V.
    pub link_low_v: f32,
    /// Link voltage at and above which there is no braking torque, in V.
    pub link_high_v: f32,
}

impl Limits {
    /// The limits as the machine is rated: braking ends between the link's highest operating voltage and its trip level, motoring between its lowest
    /// one and that trip level.
    pub const fn rated(ratings: &Ratings) -> Self {
        let ends = Ends::rated(ratings);
        Self {
            motoring_nm: ratings.max_torque_nm,
            braking_nm: ratings.max_torque_nm,
            speed_rad_s: ratings.max_speed_rad_s,
            link_low_v: ends.motoring_none_v,
            link_high_v: ends.braking_none_v,
        }
    }

    /// `true` for torques and a speed within the rated ones.
    pub(super) fn motor_is_within(&self, rated: &Self) -> bool {
        (0.0..=rated.motoring_nm).contains(&self.motoring_nm)
            && (0.0..=rated.braking_nm).contains(&self.braking_nm)
            && (0.0..=rated.speed_rad_s).contains(&self.speed_rad_s)
            && self.speed_rad_s > 0.0
    }

    /// `true` for a window of the link within the rated one.
    pub(super) fn link_is_within(&self, rated: &Self) -> bool {
        let window = rated.link_low_v..=rated.link_high_v;
        window.contains(&self.link_low_v)
            && window.contains(&self.link_high_v)
            && self.link_low_v < self.link_high_v
    }
}

/// The check of the configuration ([`crate::configuration`]).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(u8)]
pub enum Configuration {
    /// Not checked yet.
    #[default]
    Unchecked = 0,
    /// Checked and good.
    Good = 1,
    /// Checked and refused.
    Bad = 2,
}

impl From<Result<(), Refused>> for Configuration {
    fn from(checked: Result<(), Refused>) -> Self {
        if checked.is_ok() { Self::Good } else { Self::Bad }
    }
}

/// The board's feedback on itself.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Feedback {
    /// The precharge relay's auxiliary contact: closed.
    pub precharge_closed: bool,
    /// The main contactor's auxiliary contact: closed.
    pub main_closed: bool,
    /// The gate drivers are ready.
    pub driver_ready: bool,
    /// The input that lets the gates pulse is high.
    pub enable_input: bool,
    /// The position sensor answers, or is of a kind that cannot tell at standstill.
    pub sensor_alive: bool,
    /// The rotor's angle is known (an incremental encoder's index has passed).
    pub position_known: bool,
    /// The position sensor counts, so that an unknown angle can be found once the drive is enabled.
    pub position_counted: bool,
    /// Phase currents that the sensors show without current, in A, as found at the start.
    pub offsets_a: Abc,
    /// The configuration's check.
    pub configuration: Configuration,
    /// Parameters are being written.
    pub parameters_open: bool,
    /// The cause that keeps the gates off in hardware, while it lasts.
    pub hardware: Option<Fault>,
    /// The temperature sensors' voltages; ignored if the settings contain no sensors.
    pub temperatures: Ratios,
}

/// The part of an observation that is common to all drives.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Seen {
    /// The control instant.
    pub at: Instant,
    /// Voltage of the capacitors, in V, in the terms of the settings' ratings.
    pub udc_v: f32,
    /// Largest magnitude of a phase current, in A.
    pub current_a: f32,
    /// Sum of the squares of the phase currents, in A²; 0 of a drive without temperatures.
    pub squares_a2: f32,
    /// Magnitude of the current's reference, in A; 0 if the map's error is not known.
    pub reference_a: f32,
    /// Share by which the machine's flux linkage seems to exceed the map's; 0 while that is not known.
    pub map_error: f32,
    /// Electrical angular speed, of the faster motor, in rad/s.
    pub omega: f32,
    /// The electrical speed whose EMF acts on the diodes, in rad/s: for two motors the sum, because one bridge has them in series.
    pub emf_omega: f32,
    /// `true` once all speeds have been followed long enough to be used.
    pub speed_known: bool,
    /// The fault that either side has latched.
    pub trip: Option<Trip>,
    /// Number of the last acknowledge that both sides have carried out.
    pub acknowledged: u8,
}

/// Flags as bits of a word, the first the lowest.
pub(super) fn bits<const N: usize>(flags: [bool; N]) -> u32 {
    flags.into_iter().rev().fold(0, |word, flag| word << 1 | u32::from(flag))
}

impl Words<7> for Request {
    fn to_words(self) -> [u32; 7] {
        let Self { enable, with_torque, off, coast, charge, discharge, acknowledge, calibrate, .. } = self;
        let Self { torque_nm, limits, .. } = self;
        let Limits { motoring_nm, braking_nm, speed_rad_s, link_low_v, link_high_v } = limits;
        let flags = bits([enable, with_torque, off, coast, charge, discharge, acknowledge, calibrate]);
        let [torque, motoring, braking, speed, low, high] =
            [torque_nm, motoring_nm, braking_nm, speed_rad_s, link_low_v, link_high_v].map(f32::to_bits);
        [flags, torque, motoring, braking, speed, low, high]
    }

    fn from_words(words: [u32; 7]) -> Self {
        let [flags, values @ ..] = words;
        let [torque_nm, motoring_nm, braking_nm, speed_rad_s, link_low_v, link_high_v] =
            values.map(f32::from_bits);
        let flag = |bit: u32| flags >> bit & 1 != 0;
        Self {
            enable: flag(0),
            with_torque: flag(1),
            off: flag(2),
            coast: flag(3),
            charge: flag(4),
            discharge: flag(5),
            acknowledge: flag(6),
            calibrate: flag(7),
            torque_nm,
            limits: Limits { motoring_nm, braking_nm, speed_rad_s, link_low_v, link_high_v },
        }
    }
}

impl Words<5> for Feedback {
    fn to_words(self) -> [u32; 5] {
        let flags = bits([
            self.precharge_closed,
            self.main_closed,
            self.driver_ready,
            self.enable_input,
            self.sensor_alive,
            self.position_known,
            self.parameters_open,
            self.position_counted,
        ]);
        let hardware = self.hardware.map_or(0, |fault| fault as u32);
        let [a, b, c] = self.offsets_a.to_bits();
        let Ratios { winding, heat_sink } = self.temperatures;
        let temperatures = u32::from(winding) | u32::from(heat_sink) << 16;
        [flags | (self.configuration as u32) << 8 | hardware << 16, a, b, c, temperatures]
    }

    fn from_words(words: [u32; 5]) -> Self {
        let [flags, a, b, c, temperatures] = words;
        let flag = |bit: u32| flags >> bit & 1 != 0;
        Self {
            precharge_closed: flag(0),
            main_closed: flag(1),
            driver_ready: flag(2),
            enable_input: flag(3),
            sensor_alive: flag(4),
            position_known: flag(5),
            parameters_open: flag(6),
            position_counted: flag(7),
            offsets_a: Abc::from_bits([a, b, c]),
            configuration: match flags >> 8 & 0xFF {
                1 => Configuration::Good,
                2 => Configuration::Bad,
                _ => Configuration::Unchecked,
            },
            hardware: Fault::from_code(flags >> 16),
            temperatures: Ratios { winding: temperatures as u16, heat_sink: (temperatures >> 16) as u16 },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn requests_and_feedback_survive_as_words() {
        for bit in 0..8 {
            let words = [1 << bit, 1, 2, 3, 4, 5, 6];
            assert_eq!(Request::from_words(words).to_words(), words);
        }
        for flags in (0..8).map(|bit| 1 << bit).chain([1 << 8, 2 << 8, (Fault::GateDriver as u32) << 16]) {
            let words = [flags, 7, 8, 9, 10 | 11 << 16];
            assert_eq!(Feedback::from_words(words).to_words(), words);
        }
    }

    #[test]
    fn a_configuration_is_what_its_check_says() {
        let refused = Ratings { pole_pairs: 0.0, ..crate::built_in::traction::BUILT_IN.ratings }.check();
        assert!(refused.is_err());
        assert_eq!([Ok(()), refused].map(Configuration::from), [Configuration::Good, Configuration::Bad]);
    }
}
