//! The idle loop's part: once a slot, look, step, allow, tell.

use super::machine::Operator;
use super::{Demands, Feedback, Grant, Input, Settings, Slotted, Status, Timed, cells};
use crate::cell::Words;
use crate::time::{Clock, Instant};

/// What the operator needs of a board and of whoever commands it.
pub trait OperatorPort<D: Demands = super::TorqueDemand> {
    /// What is asked, and what the board says, in the slot that began at `at`.
    fn ask(&mut self, at: Instant) -> (D::Request, Feedback);
    /// What came of it; its switches are to be set at `from`, or as soon as the board can.
    fn tell(&mut self, from: Instant, status: &Status<D::Told>);
}

/// The operator with its place in time.
pub struct Slot<D> {
    operator: Operator<D>,
    /// The slot that was done last.
    done: Option<Instant>,
}

impl<D: Demands> Slot<D> {
    /// At power-up.
    pub const fn new() -> Self {
        Self { operator: Operator::new(), done: None }
    }

    /// As often as the idle loop likes: does the newest slot if it is not done yet. Returns whether it did one.
    pub fn run<const PERMIT: usize, const OBSERVATION: usize>(
        &mut self,
        desk: &cells::Desk<D::Permit, D::Observation, PERMIT, OBSERVATION>,
        port: &mut impl OperatorPort<D>,
        settings: &Settings,
        clock: &Clock,
    ) -> bool
    where
        D::Permit: Grant,
        D::Observation: Slotted + Words<OBSERVATION>,
        Timed<D::Permit>: Words<PERMIT>,
    {
        let Some(observed) = desk.observed() else {
            return false;
        };
        let at = observed.at();
        if self.done == Some(at) {
            return false;
        }
        self.done = Some(at);
        let (request, feedback) = port.ask(at);
        let input = Input { request: &request, observed: &observed, feedback: &feedback };
        let output = self.operator.step(&input, settings);
        let from = desk.allow(output.permit, &observed, clock);
        port.tell(from, &output.status);
        true
    }
}

impl<D: Demands> Default for Slot<D> {
    fn default() -> Self {
        Self::new()
    }
}
