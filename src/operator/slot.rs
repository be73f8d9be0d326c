//! The idle loop's part: once a slot, look, step, allow, tell.

use super::{Desk, Feedback, Input, Operator, Request, Settings, Status};
use crate::time::{Clock, Instant};

/// What the operator needs of a board and of whoever commands it.
pub trait OperatorPort {
    /// What is asked, and what the board says, in the slot that began at `at`.
    fn ask(&mut self, at: Instant) -> (Request, Feedback);
    /// What came of it; its switches are to be set at `from`, or as soon as the board can.
    fn tell(&mut self, from: Instant, status: &Status);
}

/// The operator with its place in time.
pub struct Slot {
    operator: Operator,
    /// The slot that was done last.
    done: Option<Instant>,
}

impl Slot {
    /// At power-up.
    pub const fn new() -> Self {
        Self { operator: Operator::new(), done: None }
    }

    /// As often as the idle loop likes: does the newest slot if it is not done yet. Returns whether it did one.
    pub fn run(
        &mut self,
        desk: &Desk,
        port: &mut impl OperatorPort,
        settings: &Settings,
        clock: &Clock,
    ) -> bool {
        let Some(observed) = desk.observed() else {
            return false;
        };
        if self.done == Some(observed.at) {
            return false;
        }
        self.done = Some(observed.at);
        let (request, feedback) = port.ask(observed.at);
        let input = Input { request: &request, observed: &observed, feedback: &feedback };
        let output = self.operator.step(&input, settings);
        let from = desk.allow(output.permit, &observed, clock);
        port.tell(from, &output.status);
        true
    }
}

impl Default for Slot {
    fn default() -> Self {
        Self::new()
    }
}
