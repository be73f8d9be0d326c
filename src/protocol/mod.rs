//! Commands and telemetry in CAN frames: the same bytes on a bus and on the link to the rig.
//!
//! Every message is a [`Message`] of eight bytes: CRC and counter first ([`e2e`], AUTOSAR's profile 2), then [`Signal`]s as the DBC file publishes
//! them. The drive's end is a [`Session`]. It judges incoming frames ([`Receiver`]: a frame takes effect whole or not at all, and every rejected one
//! is counted by its cause), turns them into a request that ages (torque zero, then off), and sends telemetry in fixed slots (`Sender`).
//!
//! Pure, without a clock: one step per slot of 1 ms, in the idle loop.

#![forbid(unsafe_code)]

#[cfg(feature = "authentication")]
pub mod authentication;
mod commands;
pub mod crc;
pub mod e2e;
mod endpoint;
mod experiment;
mod frame;
mod message;
mod message_set;
mod parameters;
mod receiver;
mod scales;
mod sender;
mod session;
mod signal;
mod telemetry;
mod traction;
mod zs9;

pub use commands::{
    COMMAND, Command, LIMITS, LINK_LIMITS, LinkLimits, PARAMETER_REQUEST, ParameterRequest, TorqueLimits,
};
pub use experiment::{EXPERIMENT, ExperimentFrame, FROM_IDENTIFICATION, OBSERVATION, ObservationFrame};
pub use frame::{Frame, LENGTH};
pub use message::{COUNTER, CRC, Message};
pub use message_set::{MessageSet, Taken};
pub use parameters::{PARAMETERS, Parameter, Parameters, RPM_PER_RAD_S, WriteError};
pub use receiver::Reject;
pub use scales::{Quantity, Scales};
pub use signal::{Kind, OutOfRange, Payload, Signal};
pub use telemetry::{
    ANGLE_ZERO, COUNTERS, CURRENTS, Counts, FAULT_LIMIT, FAULT_VALUE, Listening, MOTION, Measured, Outcome,
    PARAMETER_ANSWER, ParameterAnswer, Pattern, STATUS, StatusFrame, TEMPERATURES, TORQUE_ESTIMATE,
    TemperaturesFrame, VOLTAGES, trip_frames, trip_number,
};

/// The messages to the drive.
pub const TO_DRIVE: [&Message; 4] = [&COMMAND, &LIMITS, &LINK_LIMITS, &PARAMETER_REQUEST];

/// The messages from the drive.
pub const FROM_DRIVE: [&Message; 11] = [
    &STATUS,
    &MOTION,
    &CURRENTS,
    &VOLTAGES,
    &FAULT_VALUE,
    &FAULT_LIMIT,
    &COUNTERS,
    &PARAMETER_ANSWER,
    &TORQUE_ESTIMATE,
    &TEMPERATURES,
    &ANGLE_ZERO,
];

pub use traction::{Content, Traction};
pub use zs9::{
    FROM_ZS9, MotorMeasured, TO_ZS9, ZS9_COMMAND, ZS9_LIMITS, ZS9_LINK, ZS9_PARAMETER_REQUEST, ZS9_STATUS,
    Zs9, Zs9Command, Zs9Content, Zs9Demands, Zs9Link, Zs9Measured,
};

/// The receiver of the messages to the PMaSynRM drive.
pub type Receiver = receiver::Receiver<Traction>;
/// The PMaSynRM drive's end.
pub type Session = session::Session<Traction>;
/// The source of the PMaSynRM drive's telemetry.
pub type TelemetrySource<'a> = session::TelemetrySource<'a, Traction>;
/// The PMaSynRM drive's end beside its operator.
pub type CanEndpoint = endpoint::CanEndpoint<Traction>;
/// The ZS9's end.
pub type Zs9Session = session::Session<Zs9>;
/// The ZS9's end beside its operator.
pub type Zs9CanEndpoint = endpoint::CanEndpoint<Zs9>;
