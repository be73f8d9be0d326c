//! The messages from the drive.

mod answer;
mod counters;
mod measured;
mod status;
mod temperatures;
mod trip;

pub use answer::{Outcome, PARAMETER_ANSWER, ParameterAnswer};
pub use counters::{COUNTERS, Counts};
pub use measured::{ANGLE_ZERO, CURRENTS, MOTION, Measured, TORQUE_ESTIMATE, VOLTAGES};
pub use status::{Listening, Pattern, STATUS, StatusFrame};
pub use temperatures::{TEMPERATURES, TemperaturesFrame};
pub use trip::{FAULT_LIMIT, FAULT_VALUE, trip_frames, trip_number};

pub(super) use answer::{ANSWER_PARAMETER, ANSWER_RESULT, ANSWER_VALUE};
pub(super) use counters::COUNTER_SIGNALS;
pub(super) use measured::{CURRENT_A, FREQUENCY_HZ, SPEED_RPM, encode};
pub(super) use status::{
    CHOPPER, DISCHARGE, FAULT, LISTENING, MAIN, PRECHARGE, REFUSAL, REFUSALS, STATE, TAKEN, pattern,
};
pub(super) use trip::{TRIP_FAULT, TRIP_LIMIT, TRIP_VALUE};
