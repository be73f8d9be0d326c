//! The PMaSynRM drive: one control task, one PWM task, two cells.
//!
//! Logical execution time: a command sampled at one control instant may be used from the next one on, and each task
//! looks at the other's words by their instants, not by their arrival. So where one interrupt lands in the other
//! changes nothing, and the same inputs give the same pulses on every board and on the host.

use super::messages::{Applied, Gates, Report, VoltageCommand};
use crate::board::{ControlPort, PwmPort, Sample};
use crate::cell::{Downlink, Uplink};
use crate::control::{Boundary, Committed, Controller, Demand, Follows, Gains, Input, Law, six_step_v};
use crate::frames::{Abc, AlphaBeta, Angle};
use crate::machine::Tables;
use crate::modulation::{
    CarrierPeriod, Devices, Mode, Modulator, Reference, Schedule, compensated, depth_limit, first_half,
    ripple_flux, ripple_share,
};
use crate::protection::{self, Disarmed, Fault, FrozenWatch, SafeState, Trip, Violation};
use crate::time::{Clock, Instant};

/// Angle units (2⁻³² turn) in one radian.
pub(super) const UNITS_PER_RADIAN: f32 = 4_294_967_296.0 / core::f32::consts::TAU;

/// A demand that jumps by more than this share of the largest torque is worth revising the next half for.
const JUMP_SHARE: f32 = 0.05;

/// Control periods that the running half must still last for the next one to be revised: one until the command is valid, and one
/// in which control sees what became of it.
const REVISION_PERIODS: u32 = 2;

/// Control periods after which a command is too old to make pulses from.
const STALE_PERIODS: i32 = 5;

/// How fast the voltage glides from square wave to what the torque needs, in shares of six-step per second.
const GLIDE_PER_S: f32 = 12.0;

/// Flux linkage that the voltage forces, over the magnets', above which torque keeps its sign.
const ONE_SIDED_FLUX: f32 = 1.5;
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

/// The cells between the two interrupts.
pub struct Shared {
    /// What control wants of the modulator.
    pub command: Downlink<VoltageCommand, 9>,
    /// What the modulator does.
    pub applied: Uplink<Applied, 27>,
}

impl Shared {
    /// Empty cells.
    #[cfg(not(loom))]
    pub const fn new() -> Self {
        Self { command: Downlink::new(), applied: Uplink::new() }
    }
}

#[cfg(not(loom))]
impl Default for Shared {
    fn default() -> Self {
        Self::new()
    }
}

/// The control interrupt's task.
pub struct ControlTask {
    tables: &'static Tables,
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

impl ControlTask {
    /// A task whose first call is the control timer's first interrupt, at `first`.
    pub const fn new(tables: &'static Tables, settings: Settings, first: Instant) -> Self {
        Self {
            tables,
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
        let sample = port.sample(now);
        let applied = shared.applied.read().map(|applied| as_of(&applied, now));
        self.forget_acknowledged(sample.acknowledge, applied.as_ref());
        self.check(sample.hardware.map(|fault| (fault, 1.0, 0.0)), &sample, port);
        self.adopt_trip(applied.as_ref().and_then(|applied| applied.trip));
        self.check_legs(&sample, port);
        let omega = self.track(&sample, port);
        self.check(
            protection::check_measurements(&sample.measured, omega, &self.tables.ratings),
            &sample,
            port,
        );
        if sample.enable {
            self.check(
                protection::check_undervoltage(sample.measured.udc_v, &self.tables.ratings),
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
                angle: sample.measured.angle,
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
                &self.tables.ratings,
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
        port.report(now, &report);
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
        let decided = applied.map_or(Mode::Off, |applied| applied.next.ahead[0]);
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
        let output = self.controller.step(&input, &Law { gains, clock, tables: self.tables });
        self.steady_v = output.voltage.steady_v;
        self.depth = output.voltage.depth;
        if output.torque_nm != 0.0 {
            self.side_nm = output.torque_nm;
        }
        command.reference.voltage_v = output.voltage.voltage_v;
        command.reference.angle = output.voltage.angle;
        command.reference.carrier_angle = output.voltage.carrier_angle;
        command.reference.depth = output.voltage.depth;
        command.gates = Gates::Pulse;
        report.torque_nm = output.torque_nm;
        report.id_a = output.point.current.d;
        report.iq_a = output.point.current.q;
        report.voltage_v = output.voltage.voltage_v;
        report.map_error = output.map_error;
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
        let ratings = &self.tables.ratings;
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
        self.jumped |= !demand.slew_limited && change.abs() > JUMP_SHARE * self.tables.ratings.max_torque_nm;
        let latest = now.after(REVISION_PERIODS * self.settings.clock.control_ticks);
        let end = applied.at.after(applied.running.period_ticks);
        let revises = self.jumped && applied.next.is_free() && end.reached(latest);
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
        let clock = self.settings.clock;
        let Some(applied) = applied else {
            let interval_s = clock.seconds(self.settings.devices.shortest_half_ticks as i32);
            return Committed {
                horizon_s: 0.0,
                volt_seconds: None,
                ripple_wb: AlphaBeta::default(),
                ripple_after_wb: AlphaBeta::default(),
                interval_s,
                follows: Follows::Mean,
                depth_limit: depth_limit(Mode::Async, 0.0, &self.settings.devices),
                steady_share: 1.0,
                filled: false,
                ripple_share: ripple_share(Mode::Async, 0.0),
                settled: true,
            };
        };
        let (running, next) = (&applied.running, &applied.next);
        let elapsed = now.since(applied.at).max(0) as u32;
        let off = running.mode == Mode::Off || next.mode == Mode::Off;
        let mut left = running.period_ticks.saturating_sub(elapsed);
        let mut volt_seconds = volt_seconds(running, elapsed, udc_v, &clock);
        if !revises {
            left += next.period_ticks;
            volt_seconds = volt_seconds + self::volt_seconds(next, 0, udc_v, &clock);
        }
        let [decided, _] = next.ahead;
        let largest = depth_limit(decided, self.rate(omega), &self.settings.devices);
        let largest = if decided == Mode::Square { largest } else { REGULATION_ROOM * largest };
        let (depth_limit, filled) = self.fill(decided, largest);
        let (ripple_wb, ripple_after_wb) = self.ripple(next, omega.abs(), udc_v, applied.mirrored);
        Committed {
            horizon_s: clock.seconds(left as i32),
            volt_seconds: (!off).then_some(volt_seconds),
            ripple_wb,
            ripple_after_wb,
            interval_s: match decided.carriers() {
                0 => clock.seconds(self.settings.devices.shortest_half_ticks as i32),
                carriers => core::f32::consts::PI / (carriers as f32 * omega.abs()),
            },
            follows: match decided {
                Mode::Mid7 | Mode::Mid3 => Follows::Fundamental,
                Mode::Square => Follows::Angle,
                _ => Follows::Mean,
            },
            depth_limit,
            steady_share: 1.0,
            filled,
            ripple_share: ripple_share(decided, self.depth),
            settled: true,
        }
    }

    /// Ripple flux at the end of the committed half `next`, and the one wanted at the end of the half after it. Where a
    /// pattern begins at the first of these, its own ripple is expected; where a carrier begins, what the old pattern leaves.
    fn ripple(&self, next: &CarrierPeriod, omega: f32, udc_v: f32, mirrored: bool) -> (AlphaBeta, AlphaBeta) {
        let [decided, after] = next.ahead;
        let end = u32::from(next.half) + 1;
        let number = |from: Mode, to: Mode, half: u32| {
            if from == to { half } else { first_half(from, to, half, Angle::ZERO) }
        };
        let at = |mode: Mode, half: u32| {
            let ripple = ripple_flux(mode, half, self.steady_v, udc_v, omega);
            AlphaBeta { beta: if mirrored { -ripple.beta } else { ripple.beta }, ..ripple }
        };
        let begins = number(next.mode, decided, end);
        let pattern = if decided.is_carrier() { at(next.mode, end) } else { at(decided, begins) };
        (pattern, at(after, number(decided, after, begins + 1)))
    }

    /// The newest boundary, once.
    fn new_boundary(&mut self, applied: Option<&Applied>, now: Instant, udc_v: f32) -> Option<Boundary> {
        let applied = applied?;
        if self.boundary == Some(applied.at) {
            return None;
        }
        let consecutive = self.boundary == Some(applied.at.before(applied.before.period_ticks));
        self.boundary = Some(applied.at);
        let clock = &self.settings.clock;
        let pulsed = consecutive && applied.before.mode != Mode::Off;
        Some(Boundary {
            currents_a: applied.currents_a,
            age_s: clock.seconds(now.since(applied.at)),
            volt_seconds: pulsed.then(|| volt_seconds(&applied.before, 0, udc_v, clock)),
            length_s: clock.seconds(applied.before.period_ticks as i32),
        })
    }

    fn check(&mut self, violation: Option<Violation>, sample: &Sample, port: &mut impl ControlPort) {
        let (Some((fault, value, limit)), None) = (violation, self.trip) else {
            return;
        };
        if self.disarmed.has(fault) {
            return;
        }
        let at = self.now.before(self.settings.clock.control_ticks);
        let safe =
            protection::safe_state(self.controller.omega(), sample.measured.udc_v, &self.tables.ratings);
        port.enter(safe, at);
        self.trip = Some(Trip { fault, value, limit, at, safe });
    }

    /// Forgets the fault that is acknowledged once the PWM interrupt has: what it told before that cannot come back, and
    /// the safe state that it has left is not entered again for the old fault's sake.
    fn forget_acknowledged(&mut self, acknowledge: u8, applied: Option<&Applied>) {
        if acknowledge != self.acknowledged
            && applied.is_some_and(|applied| applied.acknowledged[0] == acknowledge)
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
            let (omega, ratings) = (self.controller.omega(), &self.tables.ratings);
            let safe = found.safe_state(omega, sample.measured.udc_v, ratings);
            port.enter(safe, at);
            self.trip = Some(Trip { fault, value, limit, at, safe });
        }
    }

    fn adopt_trip(&mut self, trip: Option<Trip>) {
        if self.trip.is_none() {
            self.trip = trip;
        }
    }
}

/// The modulator's words as they stood at `now`, if the PWM interrupt has come since.
fn as_of(applied: &Applied, now: Instant) -> Applied {
    if now.reached(applied.at) {
        return *applied;
    }
    Applied {
        at: applied.at.before(applied.before.period_ticks),
        // Not known any more; its length, zero, makes it no neighbour of any boundary.
        before: CarrierPeriod::default(),
        running: applied.before,
        next: applied.running,
        currents_a: applied.currents_before_a,
        acknowledged: [applied.acknowledged[1]; 2],
        trip: applied.trip.filter(|trip| now.reached(trip.at)),
        ..*applied
    }
}

/// Volt-seconds of a half from `from` ticks after its start to its end, in V·s.
fn volt_seconds(half: &CarrierPeriod, from: u32, udc_v: f32, clock: &Clock) -> AlphaBeta {
    let [a, b, c] = half.on_ticks(from).map(|ticks| ticks as f32);
    Abc { a, b, c }.clarke() * (udc_v * clock.tick_s)
}

/// The PWM interrupt's task.
pub struct PwmTask {
    tables: &'static Tables,
    settings: Settings,
    modulator: Modulator,
    /// Nominal instant of the next call: the boundary where `applied.next` begins.
    now: Instant,
    applied: Applied,
    disarmed: Disarmed,
}

impl PwmTask {
    /// A task whose first call is at `first`, with all gates off until then and for one half more.
    pub const fn new(tables: &'static Tables, settings: Settings, first: Instant) -> Self {
        Self::with_schedule(tables, settings, first, Schedule::new(&settings.clock))
    }

    /// The same with a schedule of one's own.
    pub const fn with_schedule(
        tables: &'static Tables,
        settings: Settings,
        first: Instant,
        schedule: Schedule,
    ) -> Self {
        let off = CarrierPeriod::off(settings.devices.shortest_half_ticks);
        Self {
            tables,
            settings,
            modulator: Modulator::new(settings.devices, schedule),
            now: first,
            applied: Applied::at_rest(first, off),
            disarmed: Disarmed::NONE,
        }
    }

    /// The same without a check.
    pub const fn without(mut self, disarmed: Disarmed) -> Self {
        self.disarmed = disarmed;
        self
    }

    /// The same for a timer whose first two halves, before the first one of the modulator's, have another length.
    pub const fn after_halves_of(mut self, ticks: u32) -> Self {
        self.applied = Applied::at_rest(self.now, CarrierPeriod::off(ticks));
        self
    }

    /// The PWM timer's interrupt, at a carrier boundary. Deadline: the next boundary, where the shadow registers take over.
    pub fn run(&mut self, port: &mut impl PwmPort, shared: &Shared) {
        let now = self.now;
        let last = self.applied;
        self.applied = Applied {
            at: now,
            before: last.running,
            running: last.next,
            currents_a: port.sample(now),
            currents_before_a: last.currents_a,
            acknowledged: [last.acknowledged[0]; 2],
            ..last
        };
        let command = shared.command.newest(|command| now.reached(command.valid_from));
        self.forget_acknowledged(&command, port);
        self.check(&command, port);
        let start = now.after(self.applied.running.period_ticks);
        let pulsing = self.applied.trip.is_none();
        self.applied.next = match &command {
            Some(command) if command.gates == Gates::Pulse && pulsing => {
                self.modulator.step(start, Some(&command.reference))
            }
            resting => self.modulator.rest(start, resting.as_ref().map(|command| &command.reference)),
        };
        self.applied.mirrored = self.modulator.is_mirrored();
        self.now = start;
        self.play(port, shared);
    }

    /// The PWM interrupt when it is no boundary that it comes for, but control's [`ControlTask::wants_revision`]: makes the next half
    /// anew from the newest command, if its boundary is still ahead.
    pub fn revise(&mut self, port: &mut impl PwmPort, shared: &Shared) {
        let Applied { at, next, trip, .. } = self.applied;
        // A command from before the last boundary was for the half that runs by now.
        let command = shared.command.newest(|command| command.valid_from.reached(at));
        if let Some(command) = command
            && command.revises
            && trip.is_none()
            && next.is_free()
        {
            self.applied.next = self.modulator.revised(&next, self.now, &command.reference);
            self.play(port, shared);
        }
    }

    fn play(&self, port: &mut impl PwmPort, shared: &Shared) {
        let applied = &self.applied;
        let small_a = SMALL_CURRENT_SHARE * self.tables.ratings.max_current_a;
        let expected = self.expected_currents();
        port.play(applied.at, &compensated(&applied.next, &expected, small_a, &self.settings.devices));
        shared.applied.publish(*applied);
    }

    /// Phase currents in the middle of the next half, from the boundaries at both ends of the half before the running one.
    fn expected_currents(&self) -> Abc {
        /// From the last boundary to the middle of the next half, in halves.
        const AHEAD: f32 = 1.5;
        let ahead = |now: f32, before: f32| now + AHEAD * (now - before);
        let Applied { currents_a: now, currents_before_a: before, .. } = self.applied;
        Abc { a: ahead(now.a, before.a), b: ahead(now.b, before.b), c: ahead(now.c, before.c) }
    }

    /// Nominal instant of the next call.
    pub fn next_call(&self) -> Instant {
        self.now
    }

    /// The latched fault.
    pub fn trip(&self) -> Option<Trip> {
        self.applied.trip
    }

    /// Forgets the fault that is acknowledged and leaves the safe state, gates off. Each acknowledge does so once: while pulses are
    /// made there is nothing to forget.
    fn forget_acknowledged(&mut self, command: &Option<VoltageCommand>, port: &mut impl PwmPort) {
        let Some(command) = command else {
            return;
        };
        if command.acknowledge == self.applied.acknowledged[0] {
            return;
        }
        self.applied.acknowledged[0] = command.acknowledge;
        if command.gates == Gates::Pulse {
            return;
        }
        self.applied.trip = None;
        if !port.leave(self.now) {
            let (value, limit, safe) = (1.0, 0.0, SafeState::GatesOff);
            self.applied.trip = Some(Trip { fault: Fault::GatesHeld, value, limit, at: self.now, safe });
        }
    }

    fn check(&mut self, command: &Option<VoltageCommand>, port: &mut impl PwmPort) {
        if self.applied.trip.is_some() {
            return;
        }
        let legs = port.leg_faults();
        let armed = |(fault, _, _): &Violation| !self.disarmed.has(*fault);
        let currents = || protection::check_currents(&self.applied.currents_a, &self.tables.ratings);
        let stale = || command.as_ref().and_then(|command| self.stale(command));
        let violation = legs.check().or_else(|| currents().filter(armed)).or_else(|| stale().filter(armed));
        let Some((fault, value, limit)) = violation else {
            return;
        };
        let (rate, udc_v) = match command {
            Some(command) => (command.reference.rate, command.reference.udc_v),
            None => (0.0, self.tables.ratings.dc_link_nominal_v),
        };
        let omega = rate * self.settings.clock.ticks_per_s / UNITS_PER_RADIAN;
        let safe = legs.safe_state(omega, udc_v, &self.tables.ratings);
        port.enter(safe, self.now);
        self.applied.trip = Some(Trip { fault, value, limit, at: self.now, safe });
    }

    fn stale(&self, command: &VoltageCommand) -> Option<Violation> {
        let clock = &self.settings.clock;
        let age = self.now.since(command.reference.at);
        let limit = STALE_PERIODS * clock.control_ticks as i32;
        let stale = command.gates == Gates::Pulse && !(0..=limit).contains(&age);
        stale.then(|| (Fault::StaleCommand, clock.seconds(age), clock.seconds(limit)))
    }
}
