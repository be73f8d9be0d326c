//! The control interrupt's task.

use super::applied::{Applied, Steady, nothing_committed};
use super::glide::Glide;
use super::{Settings, Shared};
use crate::control::{Boundary, Committed, Controller, Demand, Input, Law, Measurements};
use crate::drive::acknowledge::Acknowledge;
use crate::drive::messages::{Gates, VoltageCommand};
use crate::frames::{AlphaBeta, Angle, Dq};
use crate::machine::{Machine, Tables};
use crate::modulation::{Mode, Reference};
use crate::ports::Report;
use crate::ports::{ControlPort, Sample};
use crate::protection::{self, Disarmed, Fault, FrozenWatch, Trip, Violation};
use crate::recorder::{Record, State};
use crate::time::Instant;
use core::sync::atomic::Ordering;

/// A demand that jumps by more than this share of the largest torque is worth revising the next half for.
const JUMP_SHARE: f32 = 0.05;

/// Control periods that the running half must still last for the next one to be revised: one until the command is valid, and one
/// in which control sees what became of it.
const REVISION_PERIODS: u32 = 2;

/// The control interrupt's task, for a machine.
pub struct ControlTask<M = &'static Tables> {
    machine: M,
    settings: Settings,
    controller: Controller,
    watch: FrozenWatch,
    /// Nominal instant of the next call.
    now: Instant,
    /// Instant of the newest carrier boundary that was used.
    boundary: Option<Instant>,
    /// The fundamental of the last operating point, in V.
    steady_v: f32,
    /// Fundamental that the last operating point would have without a limit and without the trim, as a share of six-step.
    depth: f32,
    glide: Glide,
    /// The last demand, in N·m, and whether it has jumped and no half has been revised for it yet.
    demand_nm: f32,
    jumped: bool,
    /// Whether the newest command is for the half that is already committed.
    revises: bool,
    disarmed: Disarmed,
    trip: Option<Trip>,
    acknowledge: Acknowledge,
    /// Electrical speed at which the angle was lost, in rad/s, until that is acknowledged.
    lost_at: Option<f32>,
}

/// What a period's control law makes; nothing while no pulses are made.
#[derive(Clone, Copy, Default)]
struct Driven {
    /// The command, as in [`Reference`].
    voltage_v: f32,
    vector: AlphaBeta,
    carrier_angle: Angle,
    depth: f32,
    /// Whether it is for the half that is already committed.
    revises: bool,
    /// What is told of it, as in [`Report`].
    torque_nm: f32,
    current: Dq,
    map_error: f32,
    mode: Mode,
}

impl<M: Machine> ControlTask<M> {
    /// A task whose first call is the control timer's first interrupt, at `first`.
    pub const fn new(machine: M, settings: Settings, first: Instant) -> Self {
        Self {
            machine,
            settings,
            controller: Controller::new(),
            watch: FrozenWatch::new(),
            now: first,
            boundary: None,
            steady_v: 0.0,
            depth: 0.0,
            glide: Glide::new(),
            demand_nm: 0.0,
            jumped: false,
            revises: false,
            disarmed: Disarmed::NONE,
            trip: None,
            acknowledge: Acknowledge::new(),
            lost_at: None,
        }
    }

    /// Whether [`PwmTask::revise`](super::PwmTask::revise) is to run before the next [`ControlTask::run`], at the same
    /// instant: first thing in the interrupt, the handler makes the PWM interrupt pending.
    pub fn wants_revision(&self) -> bool {
        self.revises
    }

    /// The same without a check.
    pub const fn without(mut self, disarmed: Disarmed) -> Self {
        self.disarmed = disarmed;
        self
    }

    /// Other settings than those it was built with, before the first call.
    pub fn set_up(&mut self, settings: Settings) {
        self.settings = settings;
    }

    /// The control timer's interrupt. Deadline: one control period after its nominal instant; a missed one is a fault.
    pub fn run(&mut self, port: &mut impl ControlPort, shared: &Shared) {
        let now = self.now;
        self.now = now.after(self.settings.clock.control_ticks);
        shared.began.store(now.0, Ordering::Relaxed);
        let sample = port.sample(now);
        let measured = sample.measured();
        let applied = shared.applied.read(|records| Applied::seen(records, now)).flatten();
        let released = applied.as_ref().map(|applied| applied.released);
        if self.acknowledge.step(sample.acknowledge, self.trip.is_some(), released) {
            (self.trip, self.lost_at) = (None, None);
        }
        if self.trip.is_none() && applied.as_ref().is_some_and(|applied| applied.next.kind.is_tripped()) {
            self.trip = shared.trip.read();
        }
        if let Some(fault) = sample.hardware {
            // That the gates are held is only what comes of it.
            self.trip = self.trip.filter(|trip| trip.fault != Fault::GatesHeld);
            self.check(Some((fault, 1.0, 0.0)), &sample, port);
        }
        self.check_legs(&sample, port);
        let overdue = applied.as_ref().and_then(|applied| applied.overdue(now, &self.settings.clock));
        let (omega, lost) = self.track(&sample);
        let violation = self
            .armed(overdue)
            .or_else(|| self.armed(lost))
            .or_else(|| self.judge(&sample, &measured, omega));
        self.check(violation, &sample, port);
        let pulsing =
            self.trip.is_none() && sample.enable && self.controller.speed_is_known() && !self.glide.crosses();
        let driven = if pulsing {
            let frozen = self.watch.check(
                &measured,
                omega,
                self.settings.clock.control_s(),
                &self.machine.tables().ratings,
            );
            self.check(frozen, &sample, port);
            self.pulse(&sample, &measured, applied.as_ref(), omega)
        } else {
            self.rest(measured.angle)
        };
        let rate = self.settings.clock.angle_rate(omega);
        // Not finite if either is not.
        let finite = (driven.voltage_v + rate).is_finite();
        self.check((!finite).then_some((Fault::NotFinite, driven.voltage_v, f32::MAX)), &sample, port);
        let late = port.overrun_ticks(now);
        let late_s = self.settings.clock.seconds(late as i32);
        self.check((late > 0).then_some((Fault::ControlDeadline, late_s, 0.0)), &sample, port);
        let gates = if pulsing && self.trip.is_none() { Gates::Pulse } else { Gates::Off };
        self.revises = driven.revises && gates == Gates::Pulse;
        shared.command.publish(VoltageCommand {
            reference: Reference {
                voltage_v: driven.voltage_v,
                vector: driven.vector,
                carrier_angle: driven.carrier_angle,
                rate,
                at: now,
                udc_v: sample.udc_v,
                depth: driven.depth,
            },
            valid_from: self.now,
            gates,
            revises: driven.revises,
            release: self.acknowledge.release(),
        });
        let report = Report {
            torque_nm: driven.torque_nm,
            id_a: driven.current.d,
            iq_a: driven.current.q,
            voltage_v: driven.voltage_v,
            frequency_hz: self.controller.omega() / core::f32::consts::TAU,
            map_error: driven.map_error,
            trip: self.trip,
            udc_v: sample.udc_v,
            current_a: sample.currents_a.peak(),
            speed_known: self.controller.speed_is_known(),
            acknowledged: self.acknowledge.answered(),
            mode: driven.mode,
        };
        if let Some(recorder) = shared.recorder {
            let mode = applied.as_ref().map_or(Mode::Off, |applied| applied.mode);
            recorder.record(self.entry(now, &sample, &report, mode, gates), self.trip.is_some());
        }
        port.report(now, &report);
    }

    /// No pulses: the control law begins anew.
    fn rest(&mut self, angle: Angle) -> Driven {
        self.controller.idle();
        if self.glide.crosses() {
            self.controller.begin_without_torque();
        }
        self.watch = FrozenWatch::new();
        self.boundary = None;
        self.steady_v = 0.0;
        self.glide.rest(self.settings.clock.control_s());
        Driven { carrier_angle: angle, ..Driven::default() }
    }

    /// The period's entry in the flight recorder.
    #[inline(always)]
    fn entry(&self, at: Instant, sample: &Sample, report: &Report, mode: Mode, gates: Gates) -> Record {
        Record {
            at,
            currents_a: sample.currents_a,
            udc_v: sample.udc_v,
            angle: sample.angle.unwrap_or(Angle::ZERO),
            id_a: report.id_a,
            iq_a: report.iq_a,
            voltage_v: report.voltage_v,
            state: State {
                mode,
                enabled: sample.enable,
                pulsing: gates == Gates::Pulse,
                fault: self.trip.map(|trip| trip.fault),
            },
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
    /// may be unknown until it is known for the first time, while nobody wants pulses. After a trip the angle is followed anew and its
    /// speed told, to leave the safe state by; whatever chooses a safe state keeps to the speed at which the angle was lost.
    fn track(&mut self, sample: &Sample) -> (f32, Option<Violation>) {
        let clock = self.settings.clock;
        let lost = match sample.angle {
            Some(angle) if self.controller.speed_is_known() => {
                protection::check_angle(self.controller.surprise_rad(angle, &clock))
            }
            Some(_) => None,
            None => protection::check_known(sample.enable || self.controller.is_following()),
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

    /// What is wrong with a sample by itself.
    fn judge(&self, sample: &Sample, measured: &Measurements, omega: f32) -> Option<Violation> {
        let ratings = &self.machine.tables().ratings;
        let empty =
            || if sample.enable { protection::check_undervoltage(measured.udc_v, ratings) } else { None };
        self.armed(protection::check_measurements(measured, omega, ratings))
            .or_else(|| self.armed(empty()))
            .or_else(|| protection::check_demand(&sample.demand))
    }

    /// Nothing where the check that found it is switched off.
    fn armed(&self, violation: Option<Violation>) -> Option<Violation> {
        violation.filter(|(fault, _, _)| !self.disarmed.has(*fault))
    }

    /// Control law and its surroundings, while pulses are made.
    #[inline(always)]
    fn pulse(
        &mut self,
        sample: &Sample,
        measured: &Measurements,
        applied: Option<&Applied>,
        omega: f32,
    ) -> Driven {
        let now = self.now.before(self.settings.clock.control_ticks);
        let revises = applied.is_some_and(|applied| self.is_to_revise(applied, now, &sample.demand));
        let udc_v = sample.udc_v;
        let steady = Steady { omega, udc_v, voltage_v: self.steady_v, depth: self.depth };
        let decided = applied.map_or(Mode::Off, Applied::decided);
        let committed = match applied {
            Some(applied) => {
                applied.committed(now, &steady, &mut self.glide, &self.settings, decided, revises)
            }
            None => nothing_committed(&self.settings),
        };
        let boundary = self.new_boundary(applied, now, udc_v);
        let settled = self.glide.is_settled(decided, boundary.is_some());
        let committed = Committed { settled, ..committed };
        let ratings = &self.machine.tables().ratings;
        let emf_v = omega.abs() * ratings.magnet_flux_wb * self.controller.map_scale();
        let torque_nm = self.glide.one_sided(sample.demand.torque_nm, emf_v, udc_v, ratings);
        let demand = Demand { torque_nm, ..sample.demand };
        let input = Input {
            measured,
            demand: &demand,
            window: Some(&sample.window),
            committed: &committed,
            boundary: boundary.as_ref(),
        };
        let Settings { gains, clock, .. } = &self.settings;
        let output = self.controller.step(&input, &Law { gains, clock, tables: self.machine.tables() });
        self.steady_v = output.voltage.steady_v;
        self.depth = output.voltage.depth;
        self.watch.command(output.voltage.vector);
        self.glide.drove(output.torque_nm);
        Driven {
            voltage_v: output.voltage.voltage_v,
            vector: output.voltage.vector,
            carrier_angle: output.voltage.carrier.angle(),
            depth: output.voltage.depth,
            torque_nm: output.torque_nm,
            current: output.point.current,
            map_error: output.map_error,
            mode: decided,
            revises,
        }
    }

    /// The newest boundary, once.
    fn new_boundary(&mut self, applied: Option<&Applied>, now: Instant, udc_v: f32) -> Option<Boundary> {
        let applied = applied?;
        let boundary = applied.boundary(self.boundary, now, udc_v, &self.settings.clock);
        self.boundary = Some(applied.at);
        boundary
    }

    /// Whether the demand has jumped and the next half can still be changed: the running one lasts long enough, and the next one is
    /// of the free carrier, whose length is always the same.
    fn is_to_revise(&mut self, applied: &Applied, now: Instant, demand: &Demand) -> bool {
        let change = demand.torque_nm - self.demand_nm;
        self.demand_nm = demand.torque_nm;
        let largest_nm = self.machine.tables().ratings.max_torque_nm;
        self.jumped |= !demand.slew_limited && change.abs() > JUMP_SHARE * largest_nm;
        let latest = now.after(REVISION_PERIODS * self.settings.clock.control_ticks);
        let revises = self.jumped && applied.next.kind.is_free() && applied.next.begins.reached(latest);
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
