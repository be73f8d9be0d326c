//! The permission to pulse: the state machine between those who command and the drive.
//!
//! init → self-test → ready → precharge → charged → enabled → running, with coasting, stopping, discharge and fault. Gates
//! come on by an explicit edge only; a fault is left by an acknowledge and with a healthy cause only; a command that is not followed
//! has a reason.
//!
//! One pure step per slot of [`SLOT_PERIODS`] control periods, in the idle loop: what it looks at is the drive's word of the slot's
//! beginning, what it decides holds from the next slot's beginning on ([`Mailboxes`]). So when the idle loop really ran changes nothing.
//!
//! The drive's own protection does not wait for any of this: it trips in its interrupts, and tells.

#![forbid(unsafe_code)]

mod cells;
mod demand;
mod dual;
mod health;
mod line;
mod machine;
mod ramp;
mod request;
mod settings;
mod slot;
mod status;

pub use cells::{Grant, Slotted, Timed};
pub use demand::{Demands, TorqueDemand};
pub use dual::{
    DualDemands, DualDriveCommand, DualObservation, DualRequest, MotorLimits, MotorRequest, Wanted,
};
pub use ramp::{Ramp, Rates};
pub use request::{Configuration, Feedback, Levels, Limits, Observation, Request, Seen};
pub use settings::{Line, LineTimes, Settings};
pub use slot::OperatorPort;
pub use status::{DualStatus, Refusal, State, Status, Switches, Told};

use crate::control::{Demand, LinkWindow};
use crate::ports::Sample;
use crate::time::Clock;

/// The PMaSynRM drive's state machine.
pub type Operator = machine::Operator<TorqueDemand>;
/// The ZS9's.
pub type DualOperator = machine::Operator<DualDemands>;
/// The PMaSynRM drive's slots.
pub type Slot = slot::Slot<TorqueDemand>;
/// The ZS9's.
pub type DualSlot = slot::Slot<DualDemands>;
/// Between the PMaSynRM drive's operator and its control interrupt.
pub type Mailboxes = cells::Mailboxes<DriveCommand, Observation, 7, 12>;
/// Between the ZS9's operator and its control interrupt.
pub type DualMailboxes = cells::Mailboxes<DualDriveCommand, DualObservation, 7, 17>;

/// Control periods in a slot.
pub const SLOT_PERIODS: u32 = 10;

/// Length of a slot, in s.
pub fn slot_s(clock: &Clock) -> f32 {
    SLOT_PERIODS as f32 * clock.control_s()
}

/// Time for which everything must be in order in the self-test, in s.
const SELF_TEST_S: f32 = 0.05;
/// Longest time in which both interrupts carry out an acknowledge, in s.
const ACKNOWLEDGE_S: f32 = 0.05;

/// Everything that a step works on.
#[derive(Clone, Copy, Debug)]
pub struct Input<'a, Q = Request, O = Observation> {
    /// The request.
    pub request: &'a Q,
    /// The drive's observation of itself.
    pub observed: &'a O,
    /// The board's feedback.
    pub feedback: &'a Feedback,
}

/// Everything that the state machine itself works on, of whatever drive.
#[derive(Clone, Copy, Debug)]
struct Situation<'a> {
    observed: &'a Seen,
    feedback: &'a Feedback,
}

/// The permit for the drive.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct DriveCommand {
    /// Gates may pulse.
    pub enable: bool,
    /// Torque.
    pub demand: Demand,
    /// The window of link voltage in which it ends.
    pub window: LinkWindow,
    /// Number of the last acknowledge: a new number, with the gates off, makes both interrupts forget their fault.
    pub acknowledge: u8,
}

impl DriveCommand {
    /// Applies the permit to a sample: the board may hold the gates off, never more than that.
    #[inline]
    pub fn apply(&self, sample: &mut Sample) {
        sample.enable &= self.enable;
        sample.demand = self.demand;
        sample.window = self.window;
        sample.acknowledge = self.acknowledge;
    }

    /// Nothing.
    pub const NONE: Self = Self {
        enable: false,
        demand: Demand { torque_nm: 0.0, slew_limited: true },
        window: LinkWindow::OPEN,
        acknowledge: 0,
    };
}

/// A step's result.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Output<P = DriveCommand, T = f32> {
    /// For the drive.
    pub permit: P,
    /// The status; its [`Switches`] are for the board.
    pub status: Status<T>,
}
