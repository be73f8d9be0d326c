//! The messages to the drive.

use super::message::Message;
use super::scales::{Quantity, Scales};
use super::signal::{OutOfRange, Payload, Signal};
use crate::operator::Levels;

/// Range of every torque, in N·m.
pub(super) const TORQUE_NM: [f32; 2] = [-3_000.0, 3_000.0];
const LIMIT_NM: [f32; 2] = [0.0, 3_000.0];
const LIMIT_RPM: [f32; 2] = [0.5, 30_000.0];
/// Range of every link voltage, in V.
pub(super) const LINK_V: [f32; 2] = [0.0, 6_500.0];

pub(super) const ENABLE: Signal = Signal::flag("enable", 12);
pub(super) const WITH_TORQUE: Signal = Signal::flag("with_torque", 13);
pub(super) const OFF: Signal = Signal::flag("off", 14);
pub(super) const COAST: Signal = Signal::flag("coast", 15);
const TORQUE: Signal = Signal::physical("torque_nm", "N.m", 16, 0.1, TORQUE_NM).of(Quantity::Torque);
pub(super) const CHARGE: Signal = Signal::flag("charge", 32);
pub(super) const DISCHARGE: Signal = Signal::flag("discharge", 33);
pub(super) const ACKNOWLEDGE: Signal = Signal::flag("acknowledge", 34);
const CALIBRATE: Signal = Signal::flag("calibrate", 35);

pub(super) const MOTORING: Signal =
    Signal::physical("motoring_nm", "N.m", 16, 0.1, LIMIT_NM).of(Quantity::Torque);
pub(super) const BRAKING: Signal =
    Signal::physical("braking_nm", "N.m", 32, 0.1, LIMIT_NM).of(Quantity::Torque);
pub(super) const SPEED: Signal =
    Signal::physical("speed_rpm", "r/min", 48, 0.5, LIMIT_RPM).of(Quantity::Speed);

const LINK_LOW: Signal = Signal::physical("link_low_v", "V", 16, 0.1, LINK_V).of(Quantity::Voltage);
const LINK_HIGH: Signal = Signal::physical("link_high_v", "V", 32, 0.1, LINK_V).of(Quantity::Voltage);

pub(super) const WRITE: Signal = Signal::flag("write", 12);
pub(super) const PARAMETER: Signal = Signal::number("parameter", 16, 8, 0xFF);
pub(super) const VALUE: Signal = Signal::float("value", 32);

/// Levels and torque. Without this message the drive does nothing.
pub const COMMAND: Message = Message::new(
    "COMMAND",
    0x101,
    1,
    10,
    &[ENABLE, WITH_TORQUE, OFF, COAST, TORQUE, CHARGE, DISCHARGE, ACKNOWLEDGE, CALIBRATE],
)
.telling(36, &[Quantity::Torque]);

/// Limits of torque and speed; the rated ones until it comes.
pub const LIMITS: Message = Message::new("LIMITS", 0x102, 2, 100, &[MOTORING, BRAKING, SPEED])
    .telling(12, &[Quantity::Torque, Quantity::Speed]);

/// Limits of the link; the rated ones until it comes.
pub const LINK_LIMITS: Message =
    Message::new("LINK_LIMITS", 0x103, 3, 100, &[LINK_LOW, LINK_HIGH]).telling(12, &[Quantity::Voltage]);

/// Reads or writes a parameter.
pub const PARAMETER_REQUEST: Message =
    Message::new("PARAMETER_REQUEST", 0x104, 4, 0, &[WRITE, PARAMETER, VALUE]);

/// A command's levels, without the one for a single motor.
#[inline(never)]
pub(super) fn put_levels(levels: &Levels) -> Payload {
    let mut payload = Payload::default();
    for (signal, level) in [
        (&ENABLE, levels.enable),
        (&WITH_TORQUE, levels.with_torque),
        (&OFF, levels.off),
        (&COAST, levels.coast),
        (&CHARGE, levels.charge),
        (&DISCHARGE, levels.discharge),
        (&ACKNOWLEDGE, levels.acknowledge),
    ] {
        signal.put_raw(&mut payload, level.into());
    }
    payload
}

/// The inverse of [`put_levels`].
pub(super) fn levels(payload: Payload) -> Levels {
    Levels {
        enable: ENABLE.is_set(payload),
        with_torque: WITH_TORQUE.is_set(payload),
        off: OFF.is_set(payload),
        coast: COAST.is_set(payload),
        charge: CHARGE.is_set(payload),
        discharge: DISCHARGE.is_set(payload),
        acknowledge: ACKNOWLEDGE.is_set(payload),
        calibrate: false,
    }
}

/// Content of [`COMMAND`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Command {
    /// Enable, by a rising edge.
    pub enable: bool,
    /// The enabling edge may come with a torque.
    pub with_torque: bool,
    /// Gates off at once.
    pub off: bool,
    /// Torque to zero, then gates off, for as long as this is set.
    pub coast: bool,
    /// Charge the link, by a rising edge.
    pub charge: bool,
    /// Discharge the link, by a rising edge.
    pub discharge: bool,
    /// Acknowledge the fault, by a rising edge.
    pub acknowledge: bool,
    /// Calibrate the zero of the position sensor, for as long as this is set and there is no torque.
    pub calibrate: bool,
    /// Torque, in N·m.
    pub torque_nm: f32,
}

impl Command {
    /// The command that asks for nothing.
    pub const AT_REST: Self = Self {
        enable: false,
        with_torque: false,
        off: false,
        coast: false,
        charge: false,
        discharge: false,
        acknowledge: false,
        calibrate: false,
        torque_nm: 0.0,
    };

    /// As a frame's content, without its mark.
    pub fn encode(&self, scales: Scales) -> Result<Payload, OutOfRange> {
        let Self { enable, with_torque, off, coast, charge, discharge, acknowledge, calibrate, .. } = *self;
        let levels = Levels { enable, with_torque, off, coast, charge, discharge, acknowledge, calibrate };
        let mut payload = put_levels(&levels);
        CALIBRATE.put_raw(&mut payload, calibrate.into());
        TORQUE.put_on(scales, &mut payload, self.torque_nm)?;
        Ok(payload)
    }

    /// From a frame's content without its mark; `None` if a value is out of its range or an unused bit is set.
    pub fn decode(payload: Payload, scales: Scales) -> Option<Self> {
        COMMAND.is_tidy(payload).then_some(())?;
        let Levels { enable, with_torque, off, coast, charge, discharge, acknowledge, .. } = levels(payload);
        let calibrate = CALIBRATE.is_set(payload);
        let torque_nm = TORQUE.get_on(scales, payload)?;
        Some(Self { enable, with_torque, off, coast, charge, discharge, acknowledge, calibrate, torque_nm })
    }
}

/// Content of [`LIMITS`].
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct TorqueLimits {
    /// Largest motoring torque, in N·m.
    pub motoring_nm: f32,
    /// Largest braking torque, in N·m.
    pub braking_nm: f32,
    /// Speed beyond which the drive does not accelerate, in r/min.
    pub speed_rpm: f32,
}

impl TorqueLimits {
    /// As a frame's content, without its mark.
    pub fn encode(&self, scales: Scales) -> Result<Payload, OutOfRange> {
        let mut payload = Payload::default();
        MOTORING.put_on(scales, &mut payload, self.motoring_nm)?;
        BRAKING.put_on(scales, &mut payload, self.braking_nm)?;
        SPEED.put_on(scales, &mut payload, self.speed_rpm)?;
        Ok(payload)
    }

    /// From a frame's content without its mark; `None` if a value is out of its range or an unused bit is set.
    pub fn decode(payload: Payload, scales: Scales) -> Option<Self> {
        // The ZS9's motors have the same signals.
        LIMITS.is_tidy(payload).then_some(())?;
        Some(Self {
            motoring_nm: MOTORING.get_on(scales, payload)?,
            braking_nm: BRAKING.get_on(scales, payload)?,
            speed_rpm: SPEED.get_on(scales, payload)?,
        })
    }
}

/// Content of [`LINK_LIMITS`].
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct LinkLimits {
    /// Voltage at and below which there is no motoring torque, in V.
    pub low_v: f32,
    /// Voltage at and above which there is no braking torque, in V.
    pub high_v: f32,
}

impl LinkLimits {
    /// As a frame's content, without its mark.
    pub fn encode(&self, scales: Scales) -> Result<Payload, OutOfRange> {
        let mut payload = Payload::default();
        LINK_LOW.put_on(scales, &mut payload, self.low_v)?;
        LINK_HIGH.put_on(scales, &mut payload, self.high_v)?;
        Ok(payload)
    }

    /// From a frame's content without its mark; `None` if a value is out of its range, an unused bit is set, or low is not below high.
    pub fn decode(payload: Payload, scales: Scales) -> Option<Self> {
        LINK_LIMITS.is_tidy(payload).then_some(())?;
        let (low_v, high_v) = (LINK_LOW.get_on(scales, payload)?, LINK_HIGH.get_on(scales, payload)?);
        let limits = Self { low_v, high_v };
        (limits.low_v < limits.high_v).then_some(limits)
    }
}

/// Content of [`PARAMETER_REQUEST`].
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct ParameterRequest {
    /// The parameter's number.
    pub parameter: u8,
    /// The value to write; `None` reads.
    pub write: Option<f32>,
}

impl ParameterRequest {
    /// As a frame's content.
    pub fn encode(&self) -> Result<Payload, OutOfRange> {
        let mut payload = Payload::default();
        PARAMETER.put_raw(&mut payload, self.parameter.into());
        if let Some(value) = self.write {
            WRITE.put_raw(&mut payload, 1);
            VALUE.put(&mut payload, value)?;
        }
        Ok(payload)
    }

    /// From a frame's content; `None` if the value is not finite, an unused bit is set, or a value comes with a read.
    pub fn decode(payload: Payload) -> Option<Self> {
        PARAMETER_REQUEST.is_tidy(payload).then_some(())?;
        let value = VALUE.get(payload)?;
        let write = WRITE.is_set(payload);
        if !write && VALUE.raw(payload) != 0 {
            return None;
        }
        Some(Self { parameter: PARAMETER.raw(payload) as u8, write: write.then_some(value) })
    }
}
