//! The PWM interrupt's task.

use super::{Settings, Shared};
use crate::drive::messages::{Loaded, PlannedRecord};
use crate::frames::{Abc, UNITS_PER_RADIAN};
use crate::machine::{Machine, Tables};
use crate::modulation::{CarrierHalf, EdgeDelay, Mode, SwitchLimits, compensate};
use crate::ports::PwmPort;
use crate::protection::{self, DiodeWatch, FailedCheck, Fault, MaskedFaults, OpenGates, SafeState, Trip};
use crate::time::{Clock, Instant};
use core::sync::atomic::Ordering;

/// Part of a control period by which control may be late before the PWM interrupt considers it lost: more than it takes to enter it.
const CONTROL_LATE_PART: u32 = 16;

/// Phase current, as a share of the largest, below which the sign may change within a half.
const SMALL_CURRENT_SHARE: f32 = 0.05;

/// The PWM interrupt's task, for a machine.
pub struct PwmTask<M = &'static Tables> {
    machine: M,
    settings: Settings,
    /// The last boundary, and the next one, which is the nominal instant of the next call.
    at: Instant,
    begins: Instant,
    /// Length of the half that begins at that next boundary, in ticks.
    period_ticks: u32,
    /// `true` if that half has pulses.
    pulses: bool,
    /// Phase currents at the last boundary and at the one before, in A.
    currents_a: Abc,
    currents_before_a: Abc,
    trip: Option<Trip>,
    masked: MaskedFaults,
    /// Number of the release that was carried out last.
    released: u8,
    diodes: DiodeWatch,
}

impl<M: Machine> PwmTask<M> {
    /// A task whose first call is at `first`, with all gates off until then and for one more half.
    pub const fn new(machine: M, settings: Settings, first: Instant) -> Self {
        Self {
            machine,
            settings,
            at: first,
            begins: first,
            period_ticks: settings.devices.shortest_half_ticks,
            pulses: false,
            currents_a: Abc { a: 0.0, b: 0.0, c: 0.0 },
            currents_before_a: Abc { a: 0.0, b: 0.0, c: 0.0 },
            trip: None,
            diodes: DiodeWatch::new(),
            masked: MaskedFaults::NONE,
            released: 0,
        }
    }

    /// The same task without a check.
    pub const fn without(mut self, masked: MaskedFaults) -> Self {
        self.masked = masked;
        self
    }

    /// The same task for a timer whose first two halves, before the first planned one, have another length.
    pub const fn after_halves_of(mut self, ticks: u32) -> Self {
        self.period_ticks = ticks;
        self
    }

    /// The PWM timer's interrupt, at a carrier boundary, or when control has revised pulses. Deadline: the next boundary, where the shadow registers
    /// take over. Returns `true` if it came for a boundary.
    pub fn run(&mut self, port: &mut impl PwmPort, shared: &Shared) -> bool {
        let boundary = port.begin();
        if boundary {
            self.pass(port, shared);
            if let Some(trip) = self.trip {
                self.stay_safe(trip, port, shared);
            }
        } else {
            self.revise(port, shared);
        }
        boundary
    }

    /// A carrier boundary: loads the half that control has planned for it.
    #[inline(always)]
    fn pass(&mut self, port: &mut impl PwmPort, shared: &Shared) {
        let now = self.begins;
        self.currents_before_a = self.currents_a;
        self.currents_a = port.sample(now);
        let newest = shared.planned.find(|half| now.reached(PlannedRecord(*half).at())).map(PlannedRecord);
        self.release(newest.as_ref(), port, shared);
        self.check(newest.as_ref(), port, shared);
        let half = match &newest {
            Some(half) if half.at() == now && self.trip.is_none() => half.half(),
            _ => CarrierHalf::off(self.settings.devices.shortest_half_ticks),
        };
        self.at = now;
        self.begins = now.after(self.period_ticks);
        self.period_ticks = half.period_ticks;
        self.pulses = half.mode != Mode::Off;
        self.play(half, newest.as_ref(), port, shared);
        shared.loaded.publish(
            Loaded {
                at: now,
                begins: self.begins,
                currents_a: self.currents_a,
                tripped: self.trip.is_some(),
                released: self.released,
            }
            .to_words(),
        );
    }

    /// The PWM interrupt when it comes not for a boundary but for a request of [`ControlPort::begin`](crate::ports::ControlPort::begin): loads the
    /// next half as revised, if its boundary is still ahead.
    #[inline(never)]
    pub fn revise(&mut self, port: &mut impl PwmPort, shared: &Shared) {
        let newest = shared.planned.last().map(PlannedRecord);
        if let Some(half) = &newest
            && half.at() == self.at
            && self.trip.is_none()
        {
            self.play(half.half(), newest.as_ref(), port, shared);
        }
    }

    /// Gives the port the events that make the legs follow the half.
    #[inline(always)]
    fn play(
        &mut self,
        mut half: CarrierHalf,
        newest: Option<&PlannedRecord>,
        port: &mut impl PwmPort,
        shared: &Shared,
    ) {
        let Settings { devices: SwitchLimits { dead_time_ticks, .. }, drops, .. } = self.settings;
        let dead = EdgeDelay::of_dead_time(dead_time_ticks);
        let delay = if drops.is_none() {
            dead
        } else {
            let per_v = 1.0 / self.told(newest).1;
            dead.with_drops(drops.threshold_v * per_v, drops.slope_ohm * per_v, half.period_ticks)
        };
        if delay.ticks > 0.0 {
            let small_a = SMALL_CURRENT_SHARE * self.tables().ratings.max_current_a;
            compensate(&mut half, &self.expected_currents(), small_a, delay);
        }
        port.play(self.at, &half);
        self.check_late(port, shared);
    }

    /// Phase currents in the middle of the next half, from the boundaries at both ends of the half before the running one.
    fn expected_currents(&self) -> Abc {
        /// From the last boundary to the middle of the next half, in halves.
        const AHEAD: f32 = 1.5;
        let ahead = |now: f32, before: f32| now + AHEAD * (now - before);
        let (now, before) = (self.currents_a, self.currents_before_a);
        Abc { a: ahead(now.a, before.a), b: ahead(now.b, before.b), c: ahead(now.c, before.c) }
    }

    /// Nominal instant of the next call.
    pub fn next_call(&self) -> Instant {
        self.begins
    }

    /// The latched fault.
    pub fn trip(&self) -> Option<Trip> {
        self.trip
    }

    /// Forgets the fault and leaves the safe state, gates off, once for each release that control asks for.
    fn release(&mut self, newest: Option<&PlannedRecord>, port: &mut impl PwmPort, shared: &Shared) {
        let Some(release) = newest.map(PlannedRecord::release).filter(|number| *number != self.released)
        else {
            return;
        };
        self.released = release;
        self.trip = None;
        if !port.leave(self.begins) {
            let (fault, safe) = (Fault::GatesHeld, SafeState::GatesOff);
            self.latch(Trip { fault, value: 1.0, limit: 0.0, at: self.begins, safe }, shared);
        }
    }

    fn check(&mut self, newest: Option<&PlannedRecord>, port: &mut impl PwmPort, shared: &Shared) {
        if self.trip.is_some() {
            return;
        }
        let now = self.begins;
        let legs = port.leg_faults();
        let armed = |(fault, _, _): &FailedCheck| !self.masked.has(*fault);
        let currents = || protection::check_currents(&self.currents_a, &self.tables().ratings);
        let late = || {
            let pulses = newest.is_some_and(|half| !half.is_off());
            if !(pulses || self.pulses) {
                return None;
            }
            let clock = &self.settings.clock;
            let began = Instant(shared.began.load(Ordering::Relaxed));
            let planned = newest.map_or(self.at, PlannedRecord::at);
            let stale = || if pulses { stale(now, began, clock) } else { None };
            stale().or_else(|| unplanned(now, planned, clock))
        };
        let failed = legs.check().or_else(|| currents().filter(armed)).or_else(|| late().filter(armed));
        let Some((fault, value, limit)) = failed else {
            return;
        };
        let (omega, udc_v) = self.told(newest);
        let safe = legs.safe_state(omega, udc_v, &self.tables().ratings);
        port.enter(safe, now);
        self.latch(Trip { fault, value, limit, at: now, safe }, shared);
    }

    /// The electrical speed, in rad/s, and the link's voltage, in V, as last told by control.
    fn told(&self, newest: Option<&PlannedRecord>) -> (f32, f32) {
        let (rate, udc_v) = match newest {
            Some(half) => (half.rate(), half.udc_v()),
            None => (0.0, self.tables().ratings.dc_link_nominal_v),
        };
        (rate * self.settings.clock.ticks_per_s / UNITS_PER_RADIAN, udc_v)
    }

    /// The counterpart of control's `stay_safe` for when control is lost, based on what it last told.
    #[cold]
    #[inline(never)]
    fn stay_safe(&mut self, trip: Trip, port: &mut impl PwmPort, shared: &Shared) {
        if trip.at == self.at {
            // The interrupt that has found the fault is long enough.
            return;
        }
        let (omega, udc_v) = self.told(shared.planned.last().map(PlannedRecord).as_ref());
        let period_s = self.settings.clock.seconds(self.begins.since(self.at));
        let open = OpenGates { currents_a: self.currents_a, udc_v, omega, period_s };
        let ratings = &self.tables().ratings;
        if let Some(safe) = self.diodes.step(trip.safe, &open, &port.leg_faults(), ratings) {
            port.enter(safe, self.at);
            self.trip = Some(Trip { safe, ..trip });
        }
    }

    /// The check for a half that was loaded after its beginning: the board has turned the gates off.
    fn check_late(&mut self, port: &mut impl PwmPort, shared: &Shared) {
        if port.is_late() && self.trip.is_none() {
            let (fault, safe) = (Fault::PwmDeadline, SafeState::GatesOff);
            self.latch(Trip { fault, value: 1.0, limit: 0.0, at: self.at, safe }, shared);
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

/// The failed check of a control interrupt that should have come by `now` and has not; with the time since the last one began, in s.
pub(in crate::drive) fn stale(now: Instant, began: Instant, clock: &Clock) -> Option<FailedCheck> {
    let age = now.since(began);
    let limit = (clock.control_ticks + clock.control_ticks / CONTROL_LATE_PART) as i32;
    (age > limit).then(|| (Fault::StaleCommand, clock.seconds(age), clock.seconds(limit)))
}

/// The failed check of a half that control should have planned for `now` and has not; with the time since the boundary of the newest one, in s.
fn unplanned(now: Instant, newest: Instant, clock: &Clock) -> Option<FailedCheck> {
    let age = now.since(newest);
    (age > 0).then(|| (Fault::StaleCommand, clock.seconds(age), 0.0))
}
