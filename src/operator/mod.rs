//! WHETHER the drive may: the state machine between those who command and the drive.
//!
//! init → self-test → ready → precharge → charged → enabled → running, with coasting, stopping, discharge and fault. Gates
//! come on by an explicit edge only; a fault is left by an acknowledge and with a healthy cause only; a command that is not followed
//! has a reason.
//!
//! One pure step per slot of [`SLOT_PERIODS`] control periods, in the idle loop: what it looks at is the drive's word of the slot's
//! beginning, what it decides holds from the next slot's beginning on. So when the idle loop really ran changes nothing.

#![forbid(unsafe_code)]

mod request;
mod status;

pub use request::{Configuration, Feedback, Limits, Observation, Request};
pub use status::{Refusal, State, Status, Switches};

use crate::control::Demand;
use crate::machine::Ratings;

/// Control periods in a slot.
pub const SLOT_PERIODS: u32 = 10;

/// What a step looks at.
#[derive(Clone, Copy, Debug)]
pub struct Input<'a> {
    /// What is asked.
    pub request: &'a Request,
    /// What the drive says.
    pub observed: &'a Observation,
    /// What the board says.
    pub feedback: &'a Feedback,
}

/// What the drive may do.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Permit {
    /// Gates may pulse.
    pub enable: bool,
    /// Torque.
    pub demand: Demand,
    /// Number of the last acknowledge: a new number, with the gates off, makes both sides forget their fault.
    pub acknowledge: u8,
}

/// A step's result.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Output {
    /// For the drive.
    pub permit: Permit,
    /// What is told; its [`Switches`] are for the board.
    pub status: Status,
}

/// The state machine's state.
#[derive(Clone, Copy, Debug)]
pub struct Operator {
    state: State,
}

impl Operator {
    /// At power-up.
    pub const fn new(_ratings: &Ratings) -> Self {
        Self { state: State::Init }
    }

    /// One slot.
    pub fn step(&mut self, _input: &Input) -> Output {
        let switches = Switches::default();
        let status =
            Status { state: self.state, trip: None, refusal: None, refusals: 0, torque_nm: 0.0, switches };
        Output { permit: Permit { enable: false, demand: Demand::default(), acknowledge: 0 }, status }
    }
}
