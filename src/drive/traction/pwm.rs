//! The PWM interrupt's task.

use super::{Settings, Shared};
use crate::drive::messages::{Committal, Gates, VoltageCommand};
use crate::frames::{Abc, UNITS_PER_RADIAN};
use crate::machine::{Machine, Tables};
use crate::modulation::{Modulator, Schedule, compensated};
use crate::ports::PwmPort;
use crate::protection::{self, Fault, MaskedFaults, SafeState, Trip, Violation};
use crate::time::{Clock, Instant};
use core::sync::atomic::Ordering;

/// By which part of a control period control may be late before the PWM interrupt calls it lost: more than it takes to enter it.
const CONTROL_LATE_PART: u32 = 16;

/// Phase current, as a share of the largest, whose sign may change within a half.
const SMALL_CURRENT_SHARE: f32 = 0.05;

/// The PWM interrupt's task, for a machine.
pub struct PwmTask<M = &'static Tables> {
    machine: M,
    settings: Settings,
    modulator: Modulator,
    /// The decision of the last boundary. The boundary where its half begins is the nominal instant of the next call.
    newest: Committal,
    /// Phase currents at the boundary before, in A.
    currents_before_a: Abc,
    trip: Option<Trip>,
    disarmed: MaskedFaults,
    /// Number of the release that was carried out last.
    released: u8,
}

impl<M: Machine> PwmTask<M> {
    /// A task whose first call is at `first`, with all gates off until then and for one half more.
    pub const fn new(machine: M, settings: Settings, first: Instant) -> Self {
        Self {
            machine,
            settings,
            modulator: Modulator::new(settings.devices, Schedule::new(&settings.clock)),
            newest: Committal::at_rest(first, settings.devices.shortest_half_ticks),
            currents_before_a: Abc { a: 0.0, b: 0.0, c: 0.0 },
            trip: None,
            disarmed: MaskedFaults::NONE,
            released: 0,
        }
    }

    /// The same with a schedule of one's own.
    pub const fn scheduled(mut self, schedule: Schedule) -> Self {
        self.modulator = Modulator::new(self.settings.devices, schedule);
        self
    }

    /// The same without a check.
    pub const fn without(mut self, disarmed: MaskedFaults) -> Self {
        self.disarmed = disarmed;
        self
    }

    /// The same for a timer whose first two halves, before the first one of the modulator's, have another length.
    pub const fn after_halves_of(mut self, ticks: u32) -> Self {
        self.newest = Committal::at_rest(self.newest.begins, ticks);
        self
    }

    /// The PWM timer's interrupt, at a carrier boundary, or where control has pulses to revise. Deadline: the next boundary, where the shadow
    /// registers take over. Says whether it came for a boundary.
    pub fn run(&mut self, port: &mut impl PwmPort, shared: &Shared) -> bool {
        let boundary = port.begin();
        if boundary {
            self.pass(port, shared);
        } else {
            self.revise(port, shared);
        }
        boundary
    }

    /// A carrier boundary.
    #[inline(always)]
    fn pass(&mut self, port: &mut impl PwmPort, shared: &Shared) {
        let now = self.newest.begins;
        let currents_a = port.sample(now);
        self.currents_before_a = self.newest.currents_a;
        let command = shared.command.newest(|command| now.reached(VoltageCommand::valid_from(command)));
        self.release(&command, now, port, shared);
        self.check(&currents_a, &command, port, shared);
        let begins = now.after(self.newest.half.period_ticks);
        let pulsing = self.trip.is_none();
        // Field by field: the half goes where it stays.
        self.newest.half = match &command {
            Some(command) if command.gates == Gates::Pulse && pulsing => {
                self.modulator.step(begins, Some(&command.reference))
            }
            resting => self.modulator.rest(begins, resting.as_ref().map(|command| &command.reference)),
        };
        self.newest.at = now;
        self.newest.currents_a = currents_a;
        self.newest.begins = begins;
        self.newest.mirrored = self.modulator.is_mirrored();
        self.newest.tripped = !pulsing;
        self.newest.released = self.released;
        self.play(port);
        self.check_late(port, shared);
        shared.applied.publish(self.newest.to_words());
    }

    /// The PWM interrupt when it is no boundary that it comes for, but control's
    /// [`ControlTask::wants_revision`](super::ControlTask::wants_revision): makes the next half anew from the newest command, if
    /// its boundary is still ahead.
    pub fn revise(&mut self, port: &mut impl PwmPort, shared: &Shared) {
        let Committal { at, begins, half, tripped, .. } = self.newest;
        // A command from before the last boundary was for the half that runs by now.
        let command = shared.command.newest(|command| VoltageCommand::valid_from(command).reached(at));
        if let Some(command) = command
            && command.revises
            && !tripped
            && half.is_free()
        {
            self.newest.half = self.modulator.revised(&half, begins, &command.reference);
            self.play(port);
            self.check_late(port, shared);
            shared.applied.revise(self.newest.to_words());
        }
    }

    /// Gives the port the half that makes the legs do what the newest one says.
    fn play(&self, port: &mut impl PwmPort) {
        let (newest, devices) = (&self.newest, &self.settings.devices);
        if devices.dead_time_ticks == 0 {
            return port.play(newest.at, &newest.half);
        }
        let small_a = SMALL_CURRENT_SHARE * self.tables().ratings.max_current_a;
        port.play(newest.at, &compensated(&newest.half, &self.expected_currents(), small_a, devices));
    }

    /// Phase currents in the middle of the next half, from the boundaries at both ends of the half before the running one.
    fn expected_currents(&self) -> Abc {
        /// From the last boundary to the middle of the next half, in halves.
        const AHEAD: f32 = 1.5;
        let ahead = |now: f32, before: f32| now + AHEAD * (now - before);
        let (now, before) = (self.newest.currents_a, self.currents_before_a);
        Abc { a: ahead(now.a, before.a), b: ahead(now.b, before.b), c: ahead(now.c, before.c) }
    }

    /// Nominal instant of the next call.
    pub fn next_call(&self) -> Instant {
        self.newest.begins
    }

    /// The latched fault.
    pub fn trip(&self) -> Option<Trip> {
        self.trip
    }

    /// Forgets the fault and leaves the safe state, gates off, once for each release that control asks for.
    fn release(
        &mut self,
        command: &Option<VoltageCommand>,
        now: Instant,
        port: &mut impl PwmPort,
        shared: &Shared,
    ) {
        let Some(command) = command else {
            return;
        };
        if command.release == self.released {
            return;
        }
        self.released = command.release;
        self.trip = None;
        if !port.leave(now) {
            let (fault, safe) = (Fault::GatesHeld, SafeState::GatesOff);
            self.latch(Trip { fault, value: 1.0, limit: 0.0, at: now, safe }, shared);
        }
    }

    fn check(
        &mut self,
        currents_a: &Abc,
        command: &Option<VoltageCommand>,
        port: &mut impl PwmPort,
        shared: &Shared,
    ) {
        if self.trip.is_some() {
            return;
        }
        let legs = port.leg_faults();
        let armed = |(fault, _, _): &Violation| !self.disarmed.has(*fault);
        let currents = || protection::check_currents(currents_a, &self.tables().ratings);
        let pulses = command.as_ref().is_some_and(|command| command.gates == Gates::Pulse);
        let began = Instant(shared.began.load(Ordering::Relaxed));
        let stale = || if pulses { stale(self.newest.begins, began, &self.settings.clock) } else { None };
        let violation = legs.check().or_else(|| currents().filter(armed)).or_else(|| stale().filter(armed));
        let Some((fault, value, limit)) = violation else {
            return;
        };
        let (rate, udc_v) = match command {
            Some(command) => (command.reference.rate, command.reference.udc_v),
            None => (0.0, self.tables().ratings.dc_link_nominal_v),
        };
        let omega = rate * self.settings.clock.ticks_per_s / UNITS_PER_RADIAN;
        let safe = legs.safe_state(omega, udc_v, &self.tables().ratings);
        let at = self.newest.begins;
        port.enter(safe, at);
        self.latch(Trip { fault, value, limit, at, safe }, shared);
    }

    /// A half that was loaded after its beginning: the board has turned the gates off.
    fn check_late(&mut self, port: &mut impl PwmPort, shared: &Shared) {
        if port.is_late() && self.trip.is_none() {
            let (fault, safe) = (Fault::PwmDeadline, SafeState::GatesOff);
            self.latch(Trip { fault, value: 1.0, limit: 0.0, at: self.newest.at, safe }, shared);
            self.newest.tripped = true;
        }
    }

    fn latch(&mut self, trip: Trip, shared: &Shared) {
        shared.trip.publish(trip);
        self.trip = Some(trip);
    }

    fn tables(&self) -> &'static Tables {
        self.machine.tables()
    }
}

/// The control interrupt that should have come by `now` and has not: how long ago the last one began, in s.
pub(in crate::drive) fn stale(now: Instant, began: Instant, clock: &Clock) -> Option<Violation> {
    let age = now.since(began);
    let limit = (clock.control_ticks + clock.control_ticks / CONTROL_LATE_PART) as i32;
    (age > limit).then(|| (Fault::StaleCommand, clock.seconds(age), clock.seconds(limit)))
}
