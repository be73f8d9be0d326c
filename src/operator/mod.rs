//! The permission to pulse: the state machine between those who command and the drive.
//!
//! init → self-test → ready → precharge → charged → enabled → running, with coasting, stopping, discharge and fault. Gates come on only by an
//! explicit edge; a fault is left only by an acknowledge, and only if its cause is gone; every command that is not followed has a reason.
//!
//! One pure step per slot of a millisecond, a whole number of control periods, in the idle loop: its input is the drive's report from the slot's
//! beginning, and its decision holds from the next slot's beginning on ([`Mailboxes`](crate::drive::Mailboxes)). So it makes no difference when the
//! idle loop really ran.
//!
//! The drive's own protection does not wait for any of this: it trips in its interrupts, and reports.

#![forbid(unsafe_code)]

mod ahead;
mod contacts;
mod demand;
mod dual;
mod grip;
mod health;
mod line;
mod line_limits;
mod machine;
mod ramp;
mod request;
mod set_point;
mod settings;
mod slot;
mod status;
mod train;

pub use demand::{Aim, Demands, Orders, TorqueDemand};
pub use dual::{DualDemands, DualRequest, MotorLimits, MotorRequest, Wanted};
pub use ramp::{Ramp, Rates};
pub use request::{Configuration, Feedback, Levels, Limits, Request, Seen};
pub use settings::{Line, LineTimes, Settings};
pub use slot::OperatorPort;
pub use status::{DemandWords, DualStatus, Refusal, State, Status, Switches};
pub use train::TrainLimits;

use crate::drive::Observation;
use crate::ports::{DriveCommand, Report};
use crate::protection::FailedCheck;
use crate::time::Clock;

/// The PMaSynRM drive's state machine.
pub type Operator = machine::Operator<TorqueDemand>;
/// The ZS9's.
pub type DualOperator = machine::Operator<DualDemands>;
/// The PMaSynRM drive's slots.
pub type Slot = slot::Slot<TorqueDemand>;
/// The ZS9's.
pub type DualSlot = slot::Slot<DualDemands>;
/// Length of a slot, in s.
pub fn slot_s(clock: &Clock) -> f32 {
    clock.millisecond_periods() as f32 * clock.control_s()
}

/// Time for which everything must be in order during the self-test, in s.
const SELF_TEST_S: f32 = 0.05;
/// Longest time for both interrupts to carry out an acknowledge, in s.
const ACKNOWLEDGE_S: f32 = 0.05;

/// The inputs of a step.
#[derive(Clone, Copy, Debug)]
pub struct Input<'a, Q = Request, R = Report> {
    /// The request.
    pub request: &'a Q,
    /// The drive's observation of itself.
    pub observed: &'a Observation<R>,
    /// The board's feedback.
    pub feedback: &'a Feedback,
    /// `true` for an observation and a feedback that were not there before; `false` in the steps of slots that were missed.
    pub fresh: bool,
}

/// The inputs of the state machine itself, for any drive.
#[derive(Clone, Copy, Debug)]
struct Situation<'a> {
    observed: &'a Seen,
    feedback: &'a Feedback,
    /// The first failed check of the temperatures and their sensors.
    thermal: Option<FailedCheck>,
    fresh: bool,
}

/// A step's result.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Output<C = DriveCommand, T = f32> {
    /// For the drive.
    pub command: C,
    /// The status; its [`Switches`] are for the board.
    pub status: Status<T>,
}
