//! The idle loop's part: once a slot, observe, step, permit, report.

use super::machine::Operator;
use super::{Demands, Feedback, Input, Output, Settings, Status};
use crate::cell::Words;
use crate::drive::{Mailboxes, Observation, Timed, next_slot, slots_between};
use crate::protection::{FailedCheck, SafeState, Trip};
use crate::time::{Clock, Instant};

/// The port between the operator, its board and whoever commands it.
pub trait OperatorPort<D: Demands = super::TorqueDemand> {
    /// The request and the board's feedback in the slot that began at `at`, this many `slots` after the last one done.
    fn ask(&mut self, at: Instant, slots: u32) -> (D::Request, Feedback);
    /// Reports the status after the step, with its switches to be set at `from` or as soon as the board can, and the drive's report from the slot's
    /// beginning, `None` if the drive has not started.
    fn tell(&mut self, from: Instant, status: &Status<D::Status>, report: Option<&D::Report>);
}

/// Steps that a slot makes at most: an idle loop that is away for longer does not count as running.
const MOST_STEPS: u32 = 50;

/// The operator and its position in time.
pub struct Slot<D> {
    operator: Operator<D>,
    /// The slot that was done last.
    done: Option<Instant>,
}

impl<D: Demands> Slot<D> {
    /// The state at power-up.
    pub const fn new() -> Self {
        Self { operator: Operator::new(), done: None }
    }

    /// Does the newest slot if it is not done yet; to be called as often as the idle loop likes. Returns `true` if it did one.
    pub fn run<const COMMAND: usize, const OBSERVATION: usize>(
        &mut self,
        mailboxes: &Mailboxes<D::DriveCommand, D::Report, COMMAND, OBSERVATION>,
        port: &mut impl OperatorPort<D>,
        settings: &Settings,
        clock: &Clock,
    ) -> bool
    where
        D::DriveCommand: Default,
        Observation<D::Report>: Words<OBSERVATION>,
        Timed<D::DriveCommand>: Words<COMMAND>,
    {
        let newest = mailboxes.observed();
        let Some(observed) = &newest else {
            return false;
        };
        let at = observed.at;
        if self.done == Some(at) {
            return false;
        }
        let slots = self.done.map_or(1, |done| slots_between(done, at, clock));
        let asked = port.ask(at, slots);
        let output = self.step(observed, slots, asked, settings);
        let from = next_slot(at, clock);
        mailboxes.publish(output.command, from);
        port.tell(from, &output.status, Some(&observed.report));
        true
    }

    /// A slot of a drive that has not started, with the reason `why`: nothing is measured and nothing permitted, but every command is answered. To be
    /// called once in a slot's time instead of [`Self::run`].
    pub fn refuse(
        &mut self,
        why: FailedCheck,
        port: &mut impl OperatorPort<D>,
        settings: &Settings,
        clock: &Clock,
    ) {
        let at = self.done.map_or(Instant(0), |done| next_slot(done, clock));
        let (fault, value, limit) = why;
        let trip = Trip { fault, value, limit, at: Instant(0), safe: SafeState::GatesOff };
        let asked = port.ask(at, 1);
        let output = self.step(&Observation { at, report: D::refused(trip) }, 1, asked, settings);
        port.tell(next_slot(at, clock), &output.status, None);
    }

    /// The slot of an observation. The state machine also makes the steps of slots that were missed, so that its times are those of the clock.
    fn step(
        &mut self,
        observed: &Observation<D::Report>,
        slots: u32,
        (request, feedback): (D::Request, Feedback),
        settings: &Settings,
    ) -> Output<D::DriveCommand, D::Status> {
        self.done = Some(observed.at);
        let input = Input { request: &request, observed, feedback: &feedback, fresh: true };
        for _ in 1..slots.min(MOST_STEPS) {
            self.operator.step(&Input { fresh: false, ..input }, settings);
        }
        self.operator.step(&input, settings)
    }
}
