//! The control interrupt's task.

mod start_up;

use super::applied::{NO_LIMITS, Steady, Wanted, committed, follows, limits, passed};
use super::pulses::{Half, Order, Pulses};
use super::six_step_exit::SixStepExit;
use super::slot::{Decision, Slot};
use super::{Settings, Shared};
use crate::control::{
    AimInput, ControlLaw, Controller, Demand, Law, LinkDamper, Measurements, ModeLimits, RotorSample,
};
use crate::drive::acknowledge::Acknowledge;
use crate::drive::{PeriodInput, SlotTimer};
use crate::frames::Angle;
use crate::machine::{Machine, Tables};
use crate::modulation::{Mode, Reference, Schedule};
use crate::ports::{ControlPort, DriveCommand, Report, Sample, Traction};
use crate::protection::{self, Fault, FrozenWatch, MaskedFaults, Trip, Violation};
use crate::recorder::{Record, State};
use crate::time::Instant;
use core::sync::atomic::Ordering;
use start_up::Starting;

type Input<'a> = PeriodInput<'a, Traction>;

/// A demand that jumps by more than this share of the largest torque is worth revising the next half for.
const JUMP_SHARE: f32 = 0.05;

/// Control periods that the running half must still last for the next one to be revised: one until the command is valid, and one
/// in which control sees what became of it.
const REVISION_PERIODS: u32 = 2;

/// The control interrupt's task, for a machine and a control law.
pub struct ControlTask<M = &'static Tables, L = Controller> {
    machine: M,
    settings: Settings,
    controller: L,
    pulses: Pulses,
    watch: FrozenWatch,
    /// Nominal instant of the next call.
    now: Instant,
    /// Instant of the newest carrier boundary that was used.
    boundary: Option<Instant>,
    /// The boundary that the operating point was made for, `None` where none holds, and what the mode decided there allows.
    aimed: Option<Decision>,
    limits: ModeLimits,
    /// The fundamental of the last command's operating point, in V.
    steady_v: f32,
    /// Fundamental that the last operating point would have without a limit and without the trim, as a share of six-step.
    depth: f32,
    exit: SixStepExit,
    damper: LinkDamper,
    /// The last demand, in N·m, and whether it has jumped and no half has been revised for it yet.
    demand_nm: f32,
    jumped: bool,
    /// The newest command, and whether it is for the half that is already committed.
    reference: Reference,
    revises: bool,
    /// Mode that it was made for.
    mode: Mode,
    disarmed: MaskedFaults,
    trip: Option<Trip>,
    acknowledge: Acknowledge,
    /// `true` once the operator was asked for a command: who is not asked is not told.
    operated: bool,
    slots: SlotTimer,
    /// Electrical speed at which the angle was lost, in rad/s, until that is acknowledged.
    lost_at: Option<f32>,
    /// The search for the angle of a sensor that only counts.
    starting: Starting,
}

impl<M: Machine> ControlTask<M> {
    /// A task whose first call is the control timer's first interrupt, at `first`.
    pub const fn new(machine: M, settings: Settings, first: Instant) -> Self {
        Self::with_law(machine, settings, first, Controller::new())
    }
}

impl<M: Machine, L: ControlLaw> ControlTask<M, L> {
    /// The same with another control law, at rest.
    pub const fn with_law(machine: M, settings: Settings, first: Instant, controller: L) -> Self {
        Self {
            machine,
            settings,
            controller,
            pulses: Pulses::new(&settings, Schedule::new(&settings.clock)),
            watch: FrozenWatch::new(),
            now: first,
            boundary: None,
            aimed: None,
            limits: NO_LIMITS,
            steady_v: 0.0,
            depth: 0.0,
            exit: SixStepExit::new(),
            damper: LinkDamper::at(0.0),
            demand_nm: 0.0,
            jumped: false,
            reference: Reference::NONE,
            revises: false,
            mode: Mode::Off,
            disarmed: MaskedFaults::NONE,
            trip: None,
            acknowledge: Acknowledge::new(),
            operated: false,
            slots: SlotTimer::new(&settings.clock),
            lost_at: None,
            starting: Starting::new(),
        }
    }

    /// The same without a check.
    pub const fn without(mut self, disarmed: MaskedFaults) -> Self {
        self.disarmed = disarmed;
        self
    }

    /// The same with a schedule of one's own.
    pub const fn scheduled(mut self, schedule: Schedule) -> Self {
        self.pulses = Pulses::new(&self.settings, schedule);
        self
    }

    /// Another schedule, before the first call.
    #[cold]
    #[inline(never)]
    pub fn set_schedule(&mut self, schedule: Schedule) {
        self.pulses = Pulses::new(&self.settings, schedule);
    }

    /// Other settings than those it was built with, and the usual schedule, before the first call, which is at `first`.
    pub fn set_up(&mut self, settings: Settings, first: Instant) {
        (self.settings, self.now) = (settings, first);
        self.set_schedule(Schedule::new(&settings.clock));
    }

    /// Another control law of the same kind, at rest, before the first call.
    pub fn set_law(&mut self, controller: L) {
        self.controller = controller;
    }

    /// The control law, between two calls.
    pub fn law_mut(&mut self) -> &mut L {
        &mut self.controller
    }

    /// The control timer's interrupt. Deadline: one control period after its nominal instant; a missed one is a fault.
    pub fn run(&mut self, port: &mut impl ControlPort, shared: &Shared) {
        let now = self.now;
        let control_ticks = self.settings.clock.control_ticks;
        if self.revises {
            let release = self.acknowledge.release();
            let order = Order { pulses: true, reference: &self.reference, release };
            self.pulses.revise(&order, &shared.planned);
        }
        port.begin(self.revises);
        self.now = now.after(control_ticks);
        shared.began.store(now.0, Ordering::Relaxed);
        let sample = port.sample(now);
        let operator = || {
            self.operated = true;
            shared.operator.command(now)
        };
        let mut command = port.command(now, operator);
        command.enable &= sample.may_pulse;
        let input = Input { sample: &sample, command: &command };
        let Input { sample, command } = input;
        let mut measured = sample.measured();
        let told = self.pulses.look(&shared.loaded, now, self.now);
        let released = told.map(|told| told.released);
        if self.acknowledge.step(command.acknowledge, self.trip.is_some(), released) {
            (self.trip, self.lost_at) = (None, None);
        }
        if self.trip.is_none() && told.is_some_and(|told| told.tripped) {
            self.trip = shared.trip.read();
        }
        if let Some(fault) = sample.hardware {
            // That the gates are held is only what comes of it.
            self.trip = self.trip.filter(|trip| trip.fault != Fault::GatesHeld);
            self.check(Some((fault, 1.0, 0.0)), sample, port);
        }
        self.check_legs(sample, port);
        let overdue = self.pulses.newest().and_then(|newest| newest.overdue(now, &self.settings.clock));
        let (omega, lost) = self.track(sample, command.enable, port);
        measured.angle =
            measured.angle + Angle::within_half_turn(self.controller.omega() * self.settings.angle_late_s);
        let violation = self
            .armed(overdue)
            .or_else(|| self.armed(lost))
            .or_else(|| self.judge(command, &measured, omega));
        self.check(violation, sample, port);
        let mut pulsing =
            self.trip.is_none() && command.enable && self.controller.speed_is_known() && !self.exit.crosses();
        let slot = Slot::of(self.pulses.newest(), now, &self.settings.clock);
        if pulsing {
            let frozen = self.watch.check(
                &measured,
                omega,
                self.settings.clock.control_s(),
                &self.machine.tables().ratings,
            );
            self.check(frozen, sample, port);
            self.pulse(input, &measured, &slot, shared);
        } else {
            self.rest(now, omega, &measured);
            let commands = command.enable.then_some(slot.commands);
            pulsing = self.start_up(sample, commands, shared, port);
        }
        // Not finite if either is not.
        let odd = self.reference.voltage_v + omega;
        self.check((!odd.is_finite()).then_some((Fault::NotFinite, odd, f32::MAX)), sample, port);
        pulsing &= self.trip.is_none();
        self.revises &= pulsing;
        let release = self.acknowledge.release();
        let order = Order { pulses: pulsing, reference: &self.reference, release };
        self.pulses.plan(self.now.after(control_ticks), &order, &shared.planned);
        let late = port.overrun_ticks(now, control_ticks);
        let late_s = self.settings.clock.seconds(late as i32);
        self.check((late > 0).then_some((Fault::ControlDeadline, late_s, 0.0)), sample, port);
        pulsing &= self.trip.is_none();
        self.revises &= pulsing;
        let target = self.controller.target();
        let report = Report {
            torque_nm: target.torque_nm,
            flowing_nm: self.controller.flowing_nm(),
            id_a: target.current.d,
            iq_a: target.current.q,
            voltage_v: self.reference.voltage_v,
            omega: self.controller.omega(),
            map_error: self.controller.map_error(),
            trip: self.trip,
            udc_v: sample.udc_v,
            current_a: sample.currents_a.peak(),
            speed_known: self.controller.speed_is_known(),
            acknowledged: self.acknowledge.answered(),
            mode: self.mode,
        };
        if let Some(recorder) = shared.recorder {
            let mode = told.map_or(Mode::Off, |told| told.mode);
            recorder.record(self.entry(now, input, &report, mode, pulsing), self.trip.is_some());
        }
        if self.operated && self.slots.begins() {
            shared.operator.tell(now, &report);
        }
        port.report(now, &report);
    }

    /// No pulses: the control law begins anew.
    fn rest(&mut self, now: Instant, omega: f32, measured: &Measurements) {
        self.controller.idle();
        if self.exit.crosses() {
            self.controller.begin_without_torque();
        }
        self.watch = FrozenWatch::new();
        self.boundary = None;
        self.aimed = None;
        self.steady_v = 0.0;
        self.revises = false;
        self.mode = Mode::Off;
        self.exit.rest(self.settings.clock.control_s());
        self.damper = LinkDamper::at(measured.udc_v);
        self.reference = Reference {
            carrier_angle: measured.angle,
            rate: self.settings.clock.angle_rate(omega),
            at: now,
            udc_v: measured.udc_v,
            ..Reference::NONE
        };
    }

    /// The period's entry in the flight recorder.
    #[inline(always)]
    fn entry(&self, at: Instant, input: Input, report: &Report, mode: Mode, pulsing: bool) -> Record {
        let Input { sample, command } = input;
        Record {
            at,
            currents_a: sample.currents_a,
            udc_v: sample.udc_v,
            angle: sample.angle.unwrap_or(Angle::ZERO),
            id_a: report.id_a,
            iq_a: report.iq_a,
            voltage_v: report.voltage_v,
            state: State { mode, enabled: command.enable, pulsing, fault: self.trip.map(|trip| trip.fault) },
        }
    }

    /// Nominal instant of the next call.
    pub fn next_call(&self) -> Instant {
        self.now
    }

    /// The latched fault.
    pub fn trip(&self) -> Option<Trip> {
        self.trip
    }

    /// Follows the angle; returns the electrical speed, in rad/s. An angle that cannot be, or is not known, leaves the speed as it was. It
    /// may be unknown until it is known for the first time, while nobody wants pulses or the sensor counts. After a trip the angle is followed anew and its
    /// speed told, to leave the safe state by; whatever chooses a safe state keeps to the speed at which the angle was lost.
    fn track(
        &mut self,
        sample: &Sample,
        enable: bool,
        port: &mut impl ControlPort,
    ) -> (f32, Option<Violation>) {
        let clock = self.settings.clock;
        let lost = match sample.angle {
            Some(angle) if self.controller.speed_is_known() => {
                protection::check_angle(self.controller.innovation_rad(angle, &clock))
            }
            Some(_) => None,
            None => {
                let needed = self.controller.is_following() || (enable && port.turned().is_none());
                protection::check_known(needed)
            }
        };
        let lost = self.armed(lost);
        if lost.is_some() {
            self.lost_at.get_or_insert(self.controller.omega());
            self.controller.lose_angle();
        }
        if self.trip.is_some() {
            self.controller.recover_angle();
        }
        if let Some(angle) = sample.angle.filter(|_| lost.is_none() || self.trip.is_some()) {
            self.controller.track(angle, &clock);
        }
        (self.lost_at.unwrap_or(self.controller.omega()), lost)
    }

    /// The fault of a period's input by itself.
    fn judge(&self, command: &DriveCommand, measured: &Measurements, omega: f32) -> Option<Violation> {
        let ratings = &self.machine.tables().ratings;
        let empty =
            || if command.enable { protection::check_undervoltage(measured.udc_v, ratings) } else { None };
        self.armed(protection::check_measurements(measured, omega, ratings))
            .or_else(|| self.armed(empty()))
            .or_else(|| protection::check_demand(&command.demand))
    }

    /// Nothing where the check that found it is switched off.
    fn armed(&self, violation: Option<Violation>) -> Option<Violation> {
        violation.filter(|(fault, _, _)| !self.disarmed.has(*fault))
    }

    /// The control law's stages that this period is for, while pulses are made.
    #[inline(always)]
    fn pulse(&mut self, input: Input, measured: &Measurements, slot: &Slot, shared: &Shared) {
        let tables = self.machine.tables();
        let now = self.now.before(self.settings.clock.control_ticks);
        let here = RotorSample::new(measured.currents_a, measured.angle, tables);
        self.controller.observe(&here, tables);
        self.revises = self.is_to_revise(now, &input.command.demand);
        let commands = slot.commands || self.revises;
        let aims = slot.aims || (commands && self.aimed != Some(slot.key));
        if let Some(at) = self.pulses.newest().map(|newest| newest.at)
            && self.boundary != Some(at)
            && (aims || !commands)
        {
            self.learn(input.sample, measured.angle, slot.key.mode, shared);
            self.boundary = Some(at);
        }
        if aims {
            self.aim(input, slot);
        }
        if commands {
            self.command(input.sample, &here, slot);
        }
    }

    /// Learns from the newest boundary.
    fn learn(&mut self, sample: &Sample, angle: Angle, decided: Mode, shared: &Shared) {
        let Settings { gains, clock, .. } = &self.settings;
        let now = self.now.before(clock.control_ticks);
        let tables = self.machine.tables();
        let boundary = passed(&self.pulses, self.boundary, sample.udc_v, clock);
        if let Some(currents_a) = self.pulses.currents_a(&shared.loaded) {
            let age_s = clock.seconds(now.since(self.pulses.before(0).at));
            let angle = angle - Angle::within_half_turn(self.controller.omega() * age_s);
            let there = RotorSample::new(currents_a, angle, tables);
            self.controller.learn(&boundary, &there, follows(decided), &Law { gains, clock, tables });
        }
    }

    /// The operating point of the command that a boundary will use.
    fn aim(&mut self, input: Input, slot: &Slot) {
        let Input { sample, command } = input;
        let Settings { gains, clock, .. } = &self.settings;
        let (omega, udc_v) = (self.controller.omega(), sample.udc_v);
        let tables = self.machine.tables();
        let steady = Steady { omega, udc_v, voltage_v: self.steady_v, depth: self.depth };
        let passed_s = self.controller.passed_s(clock);
        self.limits = limits(&slot.key, &steady, &mut self.exit, &self.settings, passed_s);
        let emf_v = omega.abs() * tables.ratings.magnet_flux_wb * self.controller.map_scale();
        let torque_nm = self.exit.one_sided(command.demand.torque_nm, emf_v, udc_v, &tables.ratings);
        let demand = Demand { torque_nm, ..command.demand };
        let damps = gains.link_damping > 0.0;
        let swing = damps.then(|| self.damper.step(udc_v, passed_s, omega, self.limits.follows));
        let window = Some(&command.window);
        let aim = AimInput { demand: &demand, window, udc_v, swing, limits: &self.limits };
        self.controller.aim(&aim, &Law { gains, clock, tables });
        let target = self.controller.target();
        self.depth = target.depth;
        self.exit.drove(target.torque_nm);
        self.aimed = Some(slot.key);
    }

    /// The command itself.
    #[inline(always)]
    fn command(&mut self, sample: &Sample, here: &RotorSample, slot: &Slot) {
        let Settings { gains, clock, .. } = &self.settings;
        let now = self.now.before(clock.control_ticks);
        let (omega, udc_v) = (self.controller.omega(), sample.udc_v);
        let steady = Steady { omega, udc_v, voltage_v: self.steady_v, depth: self.depth };
        let (mode, revises) = (slot.key.mode, self.revises);
        let wanted = Wanted { mode, revises, between: slot.between, before: &self.reference };
        let committed = committed(&self.pulses, now, &steady, &self.settings, &wanted);
        let law = Law { gains, clock, tables: self.machine.tables() };
        let voltage = self.controller.regulate(here, &committed, &self.limits, &law);
        self.steady_v = voltage.steady_v;
        self.mode = mode;
        self.watch.command(voltage.vector);
        self.reference = Reference {
            // An optimised pattern is that of the operating point; the vector moves its edges.
            voltage_v: if mode.is_optimal() { voltage.steady_v } else { voltage.voltage_v },
            vector: voltage.vector,
            carrier_angle: voltage.carrier.angle(),
            rate: clock.angle_rate(omega),
            at: now,
            udc_v,
            depth: self.depth,
        };
    }

    /// `true` if the demand has jumped and the next half can still be changed: the running one lasts long enough, and the next one is
    /// of the free carrier, whose length is always the same. An operating point from before a jump does not hold.
    fn is_to_revise(&mut self, now: Instant, demand: &Demand) -> bool {
        let change = demand.torque_nm - self.demand_nm;
        self.demand_nm = demand.torque_nm;
        let largest_nm = self.machine.tables().ratings.max_torque_nm;
        if !demand.slew_limited && change.abs() > JUMP_SHARE * largest_nm {
            (self.jumped, self.aimed) = (true, None);
        }
        let latest = now.after(REVISION_PERIODS * self.settings.clock.control_ticks);
        let possible = |newest: &Half| newest.half.is_free() && newest.begins.reached(latest);
        let revises = self.jumped && self.pulses.newest().is_some_and(possible);
        self.jumped &= !revises;
        revises
    }

    fn check(&mut self, violation: Option<Violation>, sample: &Sample, port: &mut impl ControlPort) {
        if let (Some(violation), None) = (violation, self.trip) {
            self.trip_on(violation, sample, port);
        }
    }

    /// Out of line: it happens once, and there are many checks.
    #[cold]
    #[inline(never)]
    fn trip_on(&mut self, (fault, value, limit): Violation, sample: &Sample, port: &mut impl ControlPort) {
        if self.disarmed.has(fault) {
            return;
        }
        let at = self.now.before(self.settings.clock.control_ticks);
        let safe =
            protection::safe_state(self.controller.omega(), sample.udc_v, &self.machine.tables().ratings);
        port.enter(safe, at);
        self.trip = Some(Trip { fault, value, limit, at, safe });
    }

    /// First of all checks: a leg that is stuck decides on the safe state.
    fn check_legs(&mut self, sample: &Sample, port: &mut impl ControlPort) {
        let found = port.leg_faults();
        if let (Some((fault, value, limit)), None) = (found.check(), self.trip) {
            let at = self.now.before(self.settings.clock.control_ticks);
            let (omega, ratings) = (self.controller.omega(), &self.machine.tables().ratings);
            let safe = found.safe_state(omega, sample.udc_v, ratings);
            port.enter(safe, at);
            self.trip = Some(Trip { fault, value, limit, at, safe });
        }
    }
}
