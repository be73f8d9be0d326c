//! Commands and telemetry in CAN frames: the same bytes on a bus and on the link to the rig.
//!
//! Every message is a [`Message`] of eight bytes: CRC and counter first ([`e2e`], AUTOSAR's profile 2), then [`Signal`]s as the
//! DBC file publishes them. The drive's end is a [`Session`]: it judges what comes ([`Receiver`]: a frame takes effect whole
//! or not at all, and every rejected one is counted by its cause), makes a request of it that ages (torque zero, then off), and
//! sends telemetry in fixed slots ([`Sender`]).
//!
//! Pure, without a clock: one step a slot of 1 ms, in the idle loop.

#![forbid(unsafe_code)]

mod commands;
pub mod crc;
pub mod e2e;
mod frame;
mod message;
mod parameters;
mod receiver;
mod sender;
mod session;
mod signal;
mod station;
mod telemetry;

pub use commands::{
    COMMAND, Command, LIMITS, LINK_LIMITS, LinkLimits, PARAMETER_REQUEST, ParameterRequest, TorqueLimits,
};
pub use frame::{Frame, LENGTH};
pub use message::{COUNTER, CRC, Message};
pub use parameters::{PARAMETERS, Parameter, Parameters, RPM_PER_RAD_S, WriteError};
pub use receiver::{Content, Receiver, Reject};
pub use sender::Sender;
pub use session::{Session, Told};
pub use signal::{Kind, OutOfRange, Payload, Signal};
pub use station::Station;
pub use telemetry::{
    COUNTERS, CURRENTS, Counts, FAULT_LIMIT, FAULT_VALUE, Listening, MOTION, Measured, Outcome,
    PARAMETER_ANSWER, ParameterAnswer, STATUS, StatusFrame, VOLTAGES, trip_frames, trip_number,
};

/// What is sent to the drive.
pub const TO_DRIVE: [&Message; 4] = [&COMMAND, &LIMITS, &LINK_LIMITS, &PARAMETER_REQUEST];

/// What the drive sends.
pub const FROM_DRIVE: [&Message; 8] =
    [&STATUS, &MOTION, &CURRENTS, &VOLTAGES, &FAULT_VALUE, &FAULT_LIMIT, &COUNTERS, &PARAMETER_ANSWER];
