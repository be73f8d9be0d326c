//! The idle loop's part: once a slot, look, step, allow, tell.

use super::cells::{self, next_slot, slots_between};
use super::machine::Operator;
use super::{Demands, Feedback, Grant, Input, Output, Settings, Slotted, Status, Timed};
use crate::cell::Words;
use crate::protection::{SafeState, Trip, Violation};
use crate::time::{Clock, Instant};

/// The port between the operator, its board and whoever commands it.
pub trait OperatorPort<D: Demands = super::TorqueDemand> {
    /// The request and the board's feedback in the slot that began at `at`, so many `slots` after the last one that was done.
    fn ask(&mut self, at: Instant, slots: u32) -> (D::Request, Feedback);
    /// Tells the status after the step; its switches are to be set at `from`, or as soon as the board can.
    fn tell(&mut self, from: Instant, status: &Status<D::Told>);
}

/// Steps that a slot makes at most: an idle loop that is away for longer is none that goes on.
const MOST_STEPS: u32 = 50;

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
        desk: &cells::Mailboxes<D::DriveCommand, D::Observation, PERMIT, OBSERVATION>,
        port: &mut impl OperatorPort<D>,
        settings: &Settings,
        clock: &Clock,
    ) -> bool
    where
        D::DriveCommand: Grant,
        D::Observation: Slotted + Words<OBSERVATION>,
        Timed<D::DriveCommand>: Words<PERMIT>,
    {
        let Some(observed) = desk.observed() else {
            return false;
        };
        let at = observed.at();
        if self.done == Some(at) {
            return false;
        }
        let slots = self.done.map_or(1, |done| slots_between(done, at, clock));
        let output = self.step(&observed, slots, port, settings);
        let from = desk.allow(output.permit, &observed, clock);
        port.tell(from, &output.status);
        true
    }

    /// A slot of a drive that has not started, `why` it has not: nothing is measured and nothing permitted, but every command is
    /// answered. Call it once in a slot's time instead of [`Self::run`].
    pub fn refuse(
        &mut self,
        why: Violation,
        port: &mut impl OperatorPort<D>,
        settings: &Settings,
        clock: &Clock,
    ) where
        D::Observation: Slotted,
    {
        let at = self.done.map_or(Instant(0), |done| next_slot(done, clock));
        let (fault, value, limit) = why;
        let trip = Trip { fault, value, limit, at: Instant(0), safe: SafeState::GatesOff };
        let output = self.step(&D::Observation::refused(at, trip), 1, port, settings);
        port.tell(next_slot(at, clock), &output.status);
    }

    /// The slot of an observation. The state machine also makes the steps of slots that nobody has looked at, so that its times are the
    /// clock's.
    fn step(
        &mut self,
        observed: &D::Observation,
        slots: u32,
        port: &mut impl OperatorPort<D>,
        settings: &Settings,
    ) -> Output<D::DriveCommand, D::Told>
    where
        D::Observation: Slotted,
    {
        let at = observed.at();
        self.done = Some(at);
        let (request, feedback) = port.ask(at, slots);
        let input = Input { request: &request, observed, feedback: &feedback };
        for _ in 1..slots.min(MOST_STEPS) {
            self.operator.step(&input, settings);
        }
        self.operator.step(&input, settings)
    }
}

impl<D: Demands> Default for Slot<D> {
    fn default() -> Self {
        Self::new()
    }
}
