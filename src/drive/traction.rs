//! The PMaSynRM drive: one control task, one PWM task, two cells.
//!
//! Logical execution time: a command sampled at one control instant may be used from the next one on, and each task
//! looks at the other's words by their instants, not by their arrival. So where one interrupt lands in the other
//! changes nothing, and the same inputs give the same pulses on every board and on the host.

use super::messages::{COMMITTAL_WORDS, Committal, CommittalRecord, Gates, HalfKind, Report, VoltageCommand};
use crate::board::{ControlPort, PwmPort, Sample};
use crate::cell::{Downlink, SEEN, Trail, Uplink};
use crate::control::{
    Boundary, Committed, Controller, Demand, Follows, Gains, Input, Law, Ripple, six_step_v,
};
use crate::frames::{Abc, AlphaBeta, Angle, UNITS_PER_RADIAN};
use crate::machine::{Machine, Tables};
use crate::modulation::{
    Devices, Mode, Modulator, Reference, RippleFlux, Schedule, compensated, depth_limit, first_half,
    ripple_share,
};
use crate::protection::{self, Disarmed, Fault, FrozenWatch, SafeState, Trip, Violation};
use crate::recorder::{Record, Recorder, State};
use crate::time::{Clock, Instant};
use core::sync::atomic::{AtomicU32, Ordering};

/// A demand that jumps by more than this share of the largest torque is worth revising the next half for.
const JUMP_SHARE: f32 = 0.05;

/// Control periods that the running half must still last for the next one to be revised: one until the command is valid, and one
/// in which control sees what became of it.
const REVISION_PERIODS: u32 = 2;

/// By which part of a control period an interrupt may be late before the other one calls it lost: more than it takes to enter it.
const PWM_LATE_PART: u32 = 4;
const CONTROL_LATE_PART: u32 = 16;

/// How fast the voltage glides from square wave to what the torque needs, in shares of six-step per second.
const GLIDE_PER_S: f32 = 12.0;

/// Flux linkage that the voltage forces, over the magnets', above which torque keeps its sign.
const ONE_SIDED_FLUX: f32 = 1.2;
/// What is left of torque that keeps its sign, as a share of the largest.
const ONE_SIDED_SHARE: f32 = 0.001;

/// Phase current, as a share of the largest, whose sign may change within a half.
const SMALL_CURRENT_SHARE: f32 = 0.05;

/// Share of a mode's largest fundamental that the operating point may use where the voltage must also regulate.
const REGULATION_ROOM: f32 = 0.999;

/// What both tasks are built with.
#[derive(Clone, Copy, Debug)]
pub struct Settings {
    /// The timers' clock.
    pub clock: Clock,
    /// The inverter's devices.
    pub devices: Devices,
    /// The current loop's gains.
    pub gains: Gains,
}

/// The cells between the two interrupts, and the flight recorder, if there is one.
pub struct Shared<'a> {
    /// What control wants of the modulator.
    pub command: Downlink<VoltageCommand, 10>,
    /// What the modulator does.
    pub applied: Trail<COMMITTAL_WORDS>,
    /// What the PWM interrupt tripped on.
    pub trip: Uplink<Trip, 4>,
    /// Instant of the newest control interrupt, from its beginning on.
    pub began: AtomicU32,
    recorder: Option<&'a Recorder>,
}

impl<'a> Shared<'a> {
    /// Empty cells.
    #[cfg(not(loom))]
    pub const fn new() -> Self {
        Self {
            command: Downlink::new(),
            applied: Trail::new(),
            trip: Uplink::new(),
            began: AtomicU32::new(0),
            recorder: None,
        }
    }

    /// The same with a flight recorder, which the control interrupt fills.
    #[cfg(not(loom))]
    pub const fn recorded_by(recorder: &'a Recorder) -> Self {
        Self { recorder: Some(recorder), ..Self::new() }
    }
}

#[cfg(not(loom))]
impl Default for Shared<'_> {
    fn default() -> Self {
        Self::new()
    }
}

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
    /// Fundamental that the last operating point would have without a limit, as a share of six-step.
    depth: f32,
    /// The last torque that was not zero, in N·m: its sign is the side of the flux circle on which the machine is.
    side_nm: f32,
    /// Fundamental to which the voltage has glided after square wave, as a share of six-step; 0 otherwise.
    filled_to: f32,
    /// Mode that the newest command was made for, and the halves for which its flux hexagon still changes its size.
    unsettled: (Mode, u32),
    /// The last demand, in N·m, and whether it has jumped and no half has been revised for it yet.
    demand_nm: f32,
    jumped: bool,
    /// Whether the newest command is for the half that is already committed.
    revises: bool,
    disarmed: Disarmed,
    trip: Option<Trip>,
    /// Number of the acknowledge that both interrupts have carried out.
    acknowledged: u8,
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
            side_nm: 0.0,
            filled_to: 0.0,
            unsettled: (Mode::Off, 0),
            demand_nm: 0.0,
            jumped: false,
            revises: false,
            disarmed: Disarmed::NONE,
            trip: None,
            acknowledged: 0,
        }
    }

    /// Whether [`PwmTask::revise`] is to run before the next [`ControlTask::run`], at the same instant: first thing in the interrupt,
    /// the handler makes the PWM interrupt pending.
    pub fn wants_revision(&self) -> bool {
        self.revises
    }

    /// The same without a check.
    pub const fn without(mut self, disarmed: Disarmed) -> Self {
        self.disarmed = disarmed;
        self
    }

    /// The control timer's interrupt. Deadline: one control period after its nominal instant; a missed one is a fault.
    pub fn run(&mut self, port: &mut impl ControlPort, shared: &Shared) {
        let now = self.now;
        self.now = now.after(self.settings.clock.control_ticks);
        shared.began.store(now.0, Ordering::Relaxed);
        let sample = port.sample(now);
        let applied = shared.applied.read(|records| Applied::seen(records, now)).flatten();
        self.forget_acknowledged(sample.acknowledge, applied.as_ref());
        if self.trip.is_none() && applied.as_ref().is_some_and(|applied| applied.next.kind.is_tripped()) {
            self.trip = shared.trip.read();
        }
        if let Some(fault) = sample.hardware {
            // That the gates are held is only what comes of it.
            self.trip = self.trip.filter(|trip| trip.fault != Fault::GatesHeld);
            self.check(Some((fault, 1.0, 0.0)), &sample, port);
        }
        let overdue = applied.as_ref().and_then(|applied| applied.overdue(now, &self.settings.clock));
        self.check(overdue, &sample, port);
        self.check_legs(&sample, port);
        let omega = self.track(&sample, port);
        self.check(
            protection::check_measurements(&sample.measured, omega, &self.machine.tables().ratings),
            &sample,
            port,
        );
        if sample.enable {
            self.check(
                protection::check_undervoltage(sample.measured.udc_v, &self.machine.tables().ratings),
                &sample,
                port,
            );
        }
        self.check(protection::check_demand(&sample.demand), &sample, port);
        let pulsing = self.trip.is_none() && sample.enable && self.controller.speed_is_known();
        let mut report = Report {
            frequency_hz: omega / core::f32::consts::TAU,
            udc_v: sample.measured.udc_v,
            current_a: sample.measured.currents_a.peak(),
            speed_known: self.controller.speed_is_known(),
            acknowledged: self.acknowledged,
            ..Report::default()
        };
        let mut command = VoltageCommand {
            reference: Reference {
                voltage_v: 0.0,
                vector: AlphaBeta::default(),
                carrier_angle: sample.measured.angle,
                rate: self.rate(omega),
                at: now,
                udc_v: sample.measured.udc_v,
                depth: 0.0,
            },
            valid_from: self.now,
            gates: Gates::Off,
            revises: false,
            acknowledge: sample.acknowledge,
        };
        if pulsing {
            let frozen = self.watch.check(
                &sample.measured,
                omega,
                self.settings.clock.control_s(),
                &self.machine.tables().ratings,
            );
            self.check(frozen, &sample, port);
            self.pulse(&sample, applied.as_ref(), omega, &mut command, &mut report);
        } else {
            self.controller.idle();
            self.watch = FrozenWatch::new();
            self.boundary = None;
            self.steady_v = 0.0;
            self.side_nm = 0.0;
        }
        let finite = command.reference.voltage_v.is_finite() && command.reference.rate.is_finite();
        self.check(
            (!finite).then_some((Fault::NotFinite, command.reference.voltage_v, f32::MAX)),
            &sample,
            port,
        );
        let late = port.overrun_ticks(now);
        let late_s = self.settings.clock.seconds(late as i32);
        self.check((late > 0).then_some((Fault::ControlDeadline, late_s, 0.0)), &sample, port);
        if self.trip.is_some() {
            command.gates = Gates::Off;
        }
        self.revises = command.revises && command.gates == Gates::Pulse;
        shared.command.publish(command);
        report.trip = self.trip;
        if let Some(recorder) = shared.recorder {
            let mode = applied.as_ref().map_or(Mode::Off, |applied| applied.mode);
            recorder.record(self.entry(now, &sample, &report, mode, command.gates), self.trip.is_some());
        }
        port.report(now, &report);
    }

    /// The period's entry in the flight recorder.
    #[inline(always)]
    fn entry(&self, at: Instant, sample: &Sample, report: &Report, mode: Mode, gates: Gates) -> Record {
        Record {
            at,
            currents_a: sample.measured.currents_a,
            udc_v: sample.measured.udc_v,
            angle: sample.measured.angle,
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

    /// Follows the angle; returns the electrical speed, in rad/s. An angle that cannot be leaves the speed as it was.
    fn track(&mut self, sample: &Sample, port: &mut impl ControlPort) -> f32 {
        let clock = self.settings.clock;
        if self.controller.speed_is_known() {
            let surprise_rad = self.controller.surprise_rad(sample.measured.angle, &clock);
            let lost = protection::check_angle(surprise_rad);
            if lost.is_some() && !self.disarmed.has(Fault::AngleLost) {
                self.check(lost, sample, port);
                return self.controller.omega();
            }
        }
        self.controller.track(sample.measured.angle, &clock)
    }

    /// Control law and its surroundings, while pulses are made.
    fn pulse(
        &mut self,
        sample: &Sample,
        applied: Option<&Applied>,
        omega: f32,
        command: &mut VoltageCommand,
        report: &mut Report,
    ) {
        let now = command.reference.at;
        command.revises = applied.is_some_and(|applied| self.is_to_revise(applied, now, &sample.demand));
        let committed = self.committed(applied, now, omega, sample.measured.udc_v, command.revises);
        let boundary = self.new_boundary(applied, now, sample.measured.udc_v);
        let decided = applied.map_or(Mode::Off, |applied| applied.next.kind.ahead()[0]);
        let committed = Committed { settled: self.is_settled(decided, boundary.is_some()), ..committed };
        let demand = self.one_sided(&sample.demand, committed.filled, omega, sample.measured.udc_v);
        let input = Input {
            measured: &sample.measured,
            demand: &demand,
            window: &sample.window,
            committed: &committed,
            boundary: boundary.as_ref(),
        };
        let Settings { gains, clock, .. } = &self.settings;
        let output = self.controller.step(&input, &Law { gains, clock, tables: self.machine.tables() });
        self.steady_v = output.voltage.steady_v;
        self.depth = output.voltage.depth;
        if output.torque_nm != 0.0 {
            self.side_nm = output.torque_nm;
        }
        command.reference.voltage_v = output.voltage.voltage_v;
        command.reference.vector = output.voltage.vector;
        command.reference.carrier_angle = output.voltage.carrier.angle();
        command.reference.depth = output.voltage.depth;
        command.gates = Gates::Pulse;
        report.torque_nm = output.torque_nm;
        report.id_a = output.point.current.d;
        report.iq_a = output.point.current.q;
        report.voltage_v = output.voltage.voltage_v;
        report.map_error = output.map_error;
        report.mode = decided;
    }

    /// The largest fundamental as a share of six-step, and whether it is to be used whatever the torque needs: in square wave, and
    /// after it for as long as the voltage glides from there to what the torque needs.
    fn fill(&mut self, decided: Mode, largest: f32) -> (f32, bool) {
        if decided == Mode::Square {
            self.filled_to = 1.0;
            return (largest, true);
        }
        self.filled_to -= GLIDE_PER_S * self.settings.clock.control_s();
        if !decided.is_pattern() || self.filled_to < self.depth {
            self.filled_to = 0.0;
            return (largest, false);
        }
        (if self.filled_to < largest { self.filled_to } else { largest }, true)
    }

    /// The demand, which keeps its sign for as long as the voltage forces much more flux upon the machine than its magnets have: near
    /// no torque the two signs then lie far apart on the circle of flux linkage, and the way between them goes past currents
    /// beyond the largest. The voltage is on its way down meanwhile, so this lasts tens of milliseconds.
    fn one_sided(&self, demand: &Demand, filled: bool, omega: f32, udc_v: f32) -> Demand {
        let ratings = &self.machine.tables().ratings;
        let forced_v = self.filled_to * six_step_v(udc_v);
        let forces = filled && forced_v > ONE_SIDED_FLUX * omega.abs() * ratings.magnet_flux_wb;
        let least_nm = ONE_SIDED_SHARE * ratings.max_torque_nm;
        let (side, along_nm) =
            if self.side_nm < 0.0 { (-1.0, -demand.torque_nm) } else { (1.0, demand.torque_nm) };
        if forces && self.side_nm != 0.0 && along_nm < least_nm {
            return Demand { torque_nm: side * least_nm, ..*demand };
        }
        *demand
    }

    /// Whether two sectors have passed since the square wave gave way to a pattern or the other way round: so long the flux
    /// hexagon is off its centre, on its way to another size.
    fn is_settled(&mut self, decided: Mode, boundary_passed: bool) -> bool {
        let (mode, halves) = &mut self.unsettled;
        if decided != *mode {
            let echoes = (decided == Mode::Square && mode.is_pattern())
                || (*mode == Mode::Square && decided.is_pattern());
            *halves = if echoes { 2 * decided.sector_halves() } else { 0 };
            *mode = decided;
        } else if boundary_passed {
            *halves = halves.saturating_sub(1);
        }
        *halves == 0
    }

    /// Angle units per tick of an electrical speed in rad/s.
    fn rate(&self, omega: f32) -> f32 {
        omega * (UNITS_PER_RADIAN * self.settings.clock.tick_s)
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

    /// What the modulator will do until a command of this period can act; with `revises` only the running half stands.
    fn committed(
        &mut self,
        applied: Option<&Applied>,
        now: Instant,
        omega: f32,
        udc_v: f32,
        revises: bool,
    ) -> Committed {
        let Settings { clock, devices, .. } = self.settings;
        let Some(applied) = applied else {
            return Committed {
                horizon_s: 0.0,
                volt_seconds: None,
                ripple: None,
                interval_s: clock.seconds(devices.shortest_half_ticks as i32),
                follows: Follows::Mean,
                depth_limit: depth_limit(Mode::Async, 0.0, &devices),
                steady_share: 1.0,
                filled: false,
                ripple_share: ripple_share(Mode::Async, 0.0),
                settled: true,
            };
        };
        let kind = applied.next.kind;
        let [decided, _] = kind.ahead();
        let largest = depth_limit(decided, self.rate(omega), &devices);
        let largest = if decided == Mode::Square { largest } else { REGULATION_ROOM * largest };
        let (depth_limit, filled) = self.fill(decided, largest);
        let running = applied.next.begins.since(now).max(0) as u32;
        let left = running + if revises { 0 } else { applied.next.period_ticks };
        let volt_ticks =
            applied.running.map(|ticks| if revises { ticks } else { ticks + applied.next.volt_ticks });
        let (interval_s, follows) = match decided.carriers() {
            0 => (clock.seconds(devices.shortest_half_ticks as i32), Follows::Mean),
            carriers => {
                let interval_s = core::f32::consts::PI / (carriers as f32 * omega.abs());
                let follows = match decided {
                    Mode::Mid7 | Mode::Mid3 => Follows::Fundamental,
                    Mode::Square => Follows::Angle,
                    _ => Follows::Mean,
                };
                (interval_s, follows)
            }
        };
        Committed {
            horizon_s: clock.seconds(left as i32),
            volt_seconds: volt_ticks.map(|ticks| ticks * (udc_v * clock.tick_s)),
            ripple: self.ripple(kind, omega.abs(), udc_v),
            interval_s,
            follows,
            depth_limit,
            steady_share: 1.0,
            filled,
            ripple_share: ripple_share(decided, self.depth),
            settled: true,
        }
    }

    /// Ripple flux at the end of the committed half `next`, and the one wanted at the end of the half after it. Where a
    /// pattern begins at the first of these, its own ripple is expected; where a carrier begins, what the old pattern leaves.
    fn ripple(&self, next: HalfKind, omega: f32, udc_v: f32) -> Option<Ripple> {
        let (mode, [decided, after]) = (next.mode(), next.ahead());
        let flux = |mode: Mode| RippleFlux::new(mode, self.steady_v, udc_v, omega);
        let seen = |ripple: AlphaBeta| AlphaBeta {
            beta: if next.is_mirrored() { -ripple.beta } else { ripple.beta },
            ..ripple
        };
        let end = next.half() + 1;
        if mode == decided && decided == after {
            let flux = flux(mode)?;
            return Some(Ripple { at_horizon_wb: seen(flux.at(end)), after_wb: seen(flux.at(end + 1)) });
        }
        let number = |from: Mode, to: Mode, half: u32| {
            if from == to { half } else { first_half(from, to, half, Angle::ZERO) }
        };
        let at = |mode: Mode, half: u32| flux(mode).map_or(AlphaBeta::default(), |flux| seen(flux.at(half)));
        let begins = number(mode, decided, end);
        let at_horizon_wb = if decided.is_carrier() { at(mode, end) } else { at(decided, begins) };
        Some(Ripple { at_horizon_wb, after_wb: at(after, number(decided, after, begins + 1)) })
    }

    /// The newest boundary, once.
    fn new_boundary(&mut self, applied: Option<&Applied>, now: Instant, udc_v: f32) -> Option<Boundary> {
        let applied = applied?;
        if self.boundary == Some(applied.at) {
            return None;
        }
        let consecutive = self.boundary == Some(applied.before);
        self.boundary = Some(applied.at);
        let clock = &self.settings.clock;
        let passed = if consecutive { applied.passed } else { None };
        Some(Boundary {
            currents_a: applied.currents_a,
            age_s: clock.seconds(now.since(applied.at)),
            volt_seconds: passed.map(|ticks| ticks * (udc_v * clock.tick_s)),
            length_s: clock.seconds(applied.at.since(applied.before)),
        })
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
        let safe = protection::safe_state(
            self.controller.omega(),
            sample.measured.udc_v,
            &self.machine.tables().ratings,
        );
        port.enter(safe, at);
        self.trip = Some(Trip { fault, value, limit, at, safe });
    }

    /// Forgets the fault that is acknowledged once the PWM interrupt has: what it told before that cannot come back, and
    /// the safe state that it has left is not entered again for the old fault's sake.
    fn forget_acknowledged(&mut self, acknowledge: u8, applied: Option<&Applied>) {
        if acknowledge != self.acknowledged
            && applied.is_some_and(|applied| applied.acknowledged == acknowledge)
        {
            self.acknowledged = acknowledge;
            self.trip = None;
        }
    }

    /// First of all checks: a leg that is stuck decides on the safe state.
    fn check_legs(&mut self, sample: &Sample, port: &mut impl ControlPort) {
        let found = port.leg_faults();
        if let (Some((fault, value, limit)), None) = (found.check(), self.trip) {
            let at = self.now.before(self.settings.clock.control_ticks);
            let (omega, ratings) = (self.controller.omega(), &self.machine.tables().ratings);
            let safe = found.safe_state(omega, sample.measured.udc_v, ratings);
            port.enter(safe, at);
            self.trip = Some(Trip { fault, value, limit, at, safe });
        }
    }
}

/// What control makes of the modulator's records: the newest boundary and what is committed from there on. Of the voltages only
/// the ticks for which they act.
struct Applied {
    /// The newest boundary, and the one before it.
    at: Instant,
    before: Instant,
    /// Phase currents at the newest one, in A.
    currents_a: Abc,
    /// What the half gave that ended there; `None` while the gates were off.
    passed: Option<AlphaBeta>,
    /// What the running half gives from now on; `None` if the gates are off in it or in the next one.
    running: Option<AlphaBeta>,
    /// Mode of the running half.
    mode: Mode,
    next: Next,
    /// Number of the acknowledge that the PWM interrupt had carried out.
    acknowledged: u8,
}

/// The half after the running one.
struct Next {
    begins: Instant,
    period_ticks: u32,
    volt_ticks: AlphaBeta,
    kind: HalfKind,
}

impl Applied {
    /// The PWM interrupt that should have come by `now` and has not: since when, in s.
    fn overdue(&self, now: Instant, clock: &Clock) -> Option<Violation> {
        let late = now.since(self.next.begins);
        let limit = (clock.control_ticks / PWM_LATE_PART) as i32;
        (late > limit).then(|| (Fault::PwmDeadline, clock.seconds(late), clock.seconds(limit)))
    }

    /// As it stood at `now`, even if the PWM interrupt has come since.
    #[inline]
    fn seen(records: [crate::cell::Record<COMMITTAL_WORDS>; SEEN], now: Instant) -> Option<Self> {
        let [newest, one, two, three] = records.map(CommittalRecord);
        if now.reached(newest.at()) {
            return Some(Self::of([newest, one, two], now));
        }
        // Words that were never written say instant 0, of which there is none.
        now.reached(one.at()).then(|| Self::of([one, two, three], now))
    }

    #[inline]
    fn of([newest, one, two]: [CommittalRecord; 3], now: Instant) -> Self {
        let (at, kind) = (newest.at(), newest.kind());
        let (begins, period_ticks, volt_ticks) =
            (newest.begins(), newest.period_ticks(), newest.volt_ticks());
        let next = Next { begins, period_ticks, volt_ticks, kind };
        let mode = one.kind().mode();
        let off = mode == Mode::Off || kind.mode() == Mode::Off;
        let running = (!off).then(|| one.volt_ticks_from(now.since(at).max(0) as u32));
        let passed = (two.kind().mode() != Mode::Off).then(|| two.volt_ticks());
        Self {
            at,
            before: one.at(),
            currents_a: newest.currents_a(),
            passed,
            running,
            mode,
            next,
            acknowledged: newest.acknowledged(),
        }
    }
}

/// The PWM interrupt's task, for a machine.
pub struct PwmTask<M = &'static Tables> {
    machine: M,
    settings: Settings,
    modulator: Modulator,
    /// What was decided at the last boundary. Where its half begins is the nominal instant of the next call.
    newest: Committal,
    /// Phase currents at the boundary before, in A.
    currents_before_a: Abc,
    trip: Option<Trip>,
    disarmed: Disarmed,
    /// Number of the acknowledge that was carried out last.
    acknowledged: u8,
}

impl<M: Machine> PwmTask<M> {
    /// A task whose first call is at `first`, with all gates off until then and for one half more.
    pub const fn new(machine: M, settings: Settings, first: Instant) -> Self {
        Self::with_schedule(machine, settings, first, Schedule::new(&settings.clock))
    }

    /// The same with a schedule of one's own.
    pub const fn with_schedule(machine: M, settings: Settings, first: Instant, schedule: Schedule) -> Self {
        Self {
            machine,
            settings,
            modulator: Modulator::new(settings.devices, schedule),
            newest: Committal::at_rest(first, settings.devices.shortest_half_ticks),
            currents_before_a: Abc { a: 0.0, b: 0.0, c: 0.0 },
            trip: None,
            disarmed: Disarmed::NONE,
            acknowledged: 0,
        }
    }

    /// The same without a check.
    pub const fn without(mut self, disarmed: Disarmed) -> Self {
        self.disarmed = disarmed;
        self
    }

    /// The same for a timer whose first two halves, before the first one of the modulator's, have another length.
    pub const fn after_halves_of(mut self, ticks: u32) -> Self {
        self.newest = Committal::at_rest(self.newest.begins, ticks);
        self
    }

    /// The PWM timer's interrupt, at a carrier boundary. Deadline: the next boundary, where the shadow registers take over.
    pub fn run(&mut self, port: &mut impl PwmPort, shared: &Shared) {
        let now = self.newest.begins;
        let currents_a = port.sample(now);
        self.currents_before_a = self.newest.currents_a;
        let command = shared.command.newest(|command| now.reached(VoltageCommand::valid_from(command)));
        self.forget_acknowledged(&command, now, port, shared);
        self.check(&currents_a, &command, port, shared);
        let begins = now.after(self.newest.half.period_ticks);
        let pulsing = self.trip.is_none();
        let half = match &command {
            Some(command) if command.gates == Gates::Pulse && pulsing => {
                self.modulator.step(begins, Some(&command.reference))
            }
            resting => self.modulator.rest(begins, resting.as_ref().map(|command| &command.reference)),
        };
        let mirrored = self.modulator.is_mirrored();
        self.newest = Committal {
            at: now,
            currents_a,
            begins,
            half,
            mirrored,
            tripped: !pulsing,
            acknowledged: self.acknowledged,
        };
        self.play(port);
        self.check_late(port, shared);
        shared.applied.publish(self.newest.to_words());
    }

    /// The PWM interrupt when it is no boundary that it comes for, but control's [`ControlTask::wants_revision`]: makes the next half
    /// anew from the newest command, if its boundary is still ahead.
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

    /// Forgets the fault that is acknowledged and leaves the safe state, gates off. Each acknowledge does so once: while pulses are
    /// made there is nothing to forget.
    fn forget_acknowledged(
        &mut self,
        command: &Option<VoltageCommand>,
        now: Instant,
        port: &mut impl PwmPort,
        shared: &Shared,
    ) {
        let Some(command) = command else {
            return;
        };
        if command.acknowledge == self.acknowledged {
            return;
        }
        self.acknowledged = command.acknowledge;
        if command.gates == Gates::Pulse {
            return;
        }
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
pub(super) fn stale(now: Instant, began: Instant, clock: &Clock) -> Option<Violation> {
    let age = now.since(began);
    let limit = (clock.control_ticks + clock.control_ticks / CONTROL_LATE_PART) as i32;
    (age > limit).then(|| (Fault::StaleCommand, clock.seconds(age), clock.seconds(limit)))
}
