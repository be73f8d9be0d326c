//! The control interrupt's task.

mod checks;
mod law;
mod start_up;

use super::applied::{Ahead, NO_LIMITS};
use super::current_delay::CurrentDelay;
use super::current_gains::CurrentGains;
use super::current_zeros::CurrentZeros;
use super::pulses::{Order, Pulses};
use super::six_step_exit::SixStepExit;
use super::slot::{Decision, Slot};
use super::{Settings, Shared};
use crate::control::{
    AngleHarmonics, ControlLaw, Controller, LinkDamper, LinkRipple, Measurements, ModeLimits, Target,
};
use crate::drive::acknowledge::Acknowledge;
use crate::drive::{PeriodInput, SlotTimer};
use crate::frames::Angle;
use crate::machine::{Machine, Tables};
use crate::modulation::{Mode, Reference, Schedule};
use crate::ports::{ControlPort, Report, Sample, Traction};
use crate::protection::{DiodeWatch, Fault, FrozenWatch, MaskedFaults, Trip, UnexplainedWatch};
use crate::recorder::{Record, State};
use crate::time::{Clock, Instant};
use core::sync::atomic::Ordering;
use start_up::Starting;

type Input<'a> = PeriodInput<'a, Traction>;

/// A period after its checks: its nominal instant, the measurements with the angle at their instant, and the electrical speed in rad/s.
struct Seen {
    now: Instant,
    measured: Measurements,
    omega: f32,
}

/// The control interrupt's task, for a machine and a control law. The order in memory is deliberate, with the remembered halves last: a number within
/// 1,020 bytes of the beginning is loaded by one instruction, one beyond by two.
#[repr(C)]
pub struct ControlTask<M = &'static Tables, L = Controller> {
    machine: M,
    settings: Settings,
    controller: L,
    watch: FrozenWatch,
    unexplained: UnexplainedWatch,
    /// Nominal instant of the next call.
    now: Instant,
    /// Instant of the newest carrier boundary that has been used.
    boundary: Option<Instant>,
    /// The boundary that the operating point was made for, `None` if none holds, and the limits of the mode decided there.
    aimed: Option<Decision>,
    limits: ModeLimits,
    /// The fundamental of the last command's operating point, in V.
    steady_v: f32,
    /// Fundamental that the last operating point would have without limit and trim, as a share of six-step.
    modulation_index: f32,
    exit: SixStepExit,
    /// The link's voltage divided by its sensor's reading, as far as it is known.
    link_scale: f32,
    damper: LinkDamper,
    /// The link's ripple, the instant of its last sample, and the change that is expected of the link (see [`Ahead`]).
    ripple: LinkRipple,
    link_seen: Instant,
    ahead: Ahead,
    /// The last demand, in N·m, and whether it has jumped without a half having been revised for it yet.
    demand_nm: f32,
    jumped: bool,
    /// The newest command, and whether it is for the half that is already committed.
    reference: Reference,
    revises: bool,
    /// Mode that the command was made for, and that of the newest half that was loaded.
    mode: Mode,
    loaded: Mode,
    masked: MaskedFaults,
    trip: Option<Trip>,
    acknowledge: Acknowledge,
    /// `true` once the operator was asked for a command; an operator who is not asked gets no reports.
    operated: bool,
    slots: SlotTimer,
    /// Electrical speed at which the angle was lost, in rad/s, until the loss is acknowledged.
    lost_at: Option<f32>,
    /// The search for the angle with a sensor that only counts.
    starting: Starting,
    /// The known errors of the position sensor, and the deviation of the angle from the one extrapolated from the last by the speed, in rad.
    harmonics: AngleHarmonics,
    innovation_rad: f32,
    /// `true` while the zero of the position sensor is being found.
    calibrating: bool,
    zeros: CurrentZeros,
    gains: CurrentGains,
    delay: CurrentDelay,
    diodes: DiodeWatch,
    pulses: Pulses,
}

impl<M: Machine> ControlTask<M> {
    /// A task whose first call is the control timer's first interrupt, at `first`.
    pub const fn new(machine: M, settings: Settings, first: Instant) -> Self {
        Self::with_law(machine, settings, first, Controller::new())
    }
}

impl<M: Machine, L: ControlLaw> ControlTask<M, L> {
    /// The same task with another control law, at rest.
    pub const fn with_law(machine: M, settings: Settings, first: Instant, controller: L) -> Self {
        Self {
            machine,
            settings,
            controller,
            pulses: Pulses::new(&settings, Schedule::new(&settings.clock)),
            watch: FrozenWatch::new(),
            unexplained: UnexplainedWatch::new(),
            diodes: DiodeWatch::new(),
            now: first,
            boundary: None,
            aimed: None,
            limits: NO_LIMITS,
            steady_v: 0.0,
            modulation_index: 0.0,
            exit: SixStepExit::new(),
            link_scale: 1.0,
            damper: LinkDamper::at(0.0),
            ripple: LinkRipple::at(0.0),
            link_seen: first,
            ahead: Ahead::NONE,
            demand_nm: 0.0,
            jumped: false,
            reference: Reference::NONE,
            revises: false,
            mode: Mode::Off,
            loaded: Mode::Off,
            masked: MaskedFaults::NONE,
            trip: None,
            acknowledge: Acknowledge::new(),
            operated: false,
            slots: SlotTimer::new(&settings.clock),
            lost_at: None,
            starting: Starting::new(),
            harmonics: AngleHarmonics::new(
                settings.angle_late_s - settings.clock.seconds(settings.current_filter_ticks as i32),
            ),
            innovation_rad: 0.0,
            calibrating: false,
            zeros: CurrentZeros::new(),
            gains: CurrentGains::new(),
            delay: CurrentDelay::NONE,
        }
    }

    /// The same task without a check.
    pub const fn without(mut self, masked: MaskedFaults) -> Self {
        self.masked = masked;
        self
    }

    /// The same task with another schedule.
    pub const fn scheduled(mut self, schedule: Schedule) -> Self {
        self.pulses = Pulses::new(&self.settings, schedule);
        self
    }

    /// Sets another schedule, before the first call.
    #[cold]
    #[inline(never)]
    pub fn set_schedule(&mut self, schedule: Schedule) {
        self.pulses = Pulses::new(&self.settings, schedule);
    }

    /// Sets other settings than those it was built with, and the usual schedule, before the first call, which is at `first`.
    pub fn set_up(&mut self, settings: Settings, first: Instant) {
        (self.settings, self.now) = (settings, first);
        self.set_schedule(Schedule::new(&settings.clock));
    }

    /// Sets another control law of the same kind, at rest, before the first call.
    pub fn set_law(&mut self, controller: L) {
        self.controller = controller;
    }

    /// The control law, between two calls.
    pub fn law_mut(&mut self) -> &mut L {
        &mut self.controller
    }

    /// The control timer's interrupt. Deadline: one control period after its nominal instant; a missed deadline is a fault.
    pub fn run(&mut self, port: &mut impl ControlPort, shared: &Shared) {
        let now = self.begin(port, shared);
        let sample = port.sample(now);
        let operator = || {
            self.operated = true;
            shared.operator.command(now)
        };
        let mut command = port.command(now, operator);
        command.enable &= sample.may_pulse;
        let input = Input { sample: &sample, command: &command };
        let seen = self.protect(now, input, port, shared);
        let pulsing = self.decide(&seen, input, port, shared);
        let pulsing = self.plan(&seen, pulsing, &sample, port, shared);
        self.tell(&seen, pulsing, input, port, shared);
    }

    /// The half that this period may still change, and the period's clock; returns the period's nominal instant.
    #[inline(always)]
    fn begin(&mut self, port: &mut impl ControlPort, shared: &Shared) -> Instant {
        let now = self.now;
        if self.revises {
            let release = self.acknowledge.release();
            let order = Order { pulses: true, reference: &self.reference, release };
            self.pulses.revise(&order, &shared.planned);
        }
        port.begin(self.revises);
        self.now = now.after(self.settings.clock.control_ticks);
        shared.began.store(now.0, Ordering::Relaxed);
        now
    }

    /// Every check of the measurements and of what the PWM interrupt reports.
    #[inline(always)]
    fn protect(&mut self, now: Instant, input: Input, port: &mut impl ControlPort, shared: &Shared) -> Seen {
        let Input { sample, command } = input;
        let mut measured = sample.measured();
        // Limits apply to the sensors' readings: learnt gains would hide a failing sensor.
        measured.currents_a = self.zeros.without(sample.currents_a);
        let told = self.pulses.look(&shared.loaded, now, self.now);
        let released = told.map(|told| told.released);
        if self.acknowledge.step(command.acknowledge, self.trip.is_some(), released) {
            (self.trip, self.lost_at) = (None, None);
        }
        if self.trip.is_none() && told.is_some_and(|told| told.tripped) {
            self.trip = shared.trip.read();
        }
        if let Some(fault) = sample.hardware {
            // Held gates are only a consequence of this fault.
            self.trip = self.trip.filter(|trip| trip.fault != Fault::GatesHeld);
            self.check(Some((fault, 1.0, 0.0)), sample, port);
        }
        self.check_legs(sample, port);
        let angle = sample.angle.map(|angle| self.harmonics.corrected(angle));
        let (omega, lost) = self.track(angle, command.enable, port);
        let coarse = self.settings.counts_coarsely();
        let here = if coarse { self.controller.tracker().angle() } else { angle.unwrap_or(Angle::ZERO) };
        // The angle at the instant of the currents.
        let ahead_s = self.settings.angle_late_s - self.delay.s;
        measured.angle = here + Angle::within_half_turn(self.controller.omega() * ahead_s);
        let overdue = self.pulses.newest().and_then(|newest| newest.overdue(now, &self.settings.clock));
        self.check(overdue, sample, port);
        self.check(lost, sample, port);
        let failed = self.judge(command, &measured, omega);
        self.check(failed, sample, port);
        measured.currents_a = self.gains.without(measured.currents_a);
        self.loaded = told.map_or(Mode::Off, |told| told.mode);
        Seen { now, measured, omega }
    }

    /// The control law, or its restart; `true` if there are to be pulses.
    #[inline(always)]
    fn decide(&mut self, seen: &Seen, input: Input, port: &mut impl ControlPort, shared: &Shared) -> bool {
        let Input { sample, command } = input;
        let Seen { now, ref measured, omega } = *seen;
        let pulsing =
            self.trip.is_none() && command.enable && self.controller.speed_is_known() && !self.exit.crosses();
        let slot = Slot::of(&self.pulses, now, &self.settings.clock);
        let pulsing = if pulsing {
            let ratings = &self.machine.tables().ratings;
            let angle = sample.angle.unwrap_or(Angle::ZERO);
            let frozen = self.watch.check(
                &Measurements { angle, ..*measured },
                omega,
                self.settings.clock.control_s(),
                ratings,
            );
            let offset = self.zeros.begin(ratings.max_current_a);
            self.check(frozen.or(offset), sample, port);
            self.check(self.unexplained.check(self.machine.tables()), sample, port);
            self.pulse(input, measured, &slot, shared);
            true
        } else {
            self.rest(now, omega, measured);
            // Without an operator, whoever blocked the gates may release them at any time.
            if self.operated || self.trip.is_some() {
                self.stay_safe(sample, omega, port);
            }
            let commands = command.enable.then_some(slot.commands);
            let pulses = self.start_up(sample, commands, shared, port);
            if pulses {
                let offset = self.zeros.begin(self.machine.tables().ratings.max_current_a);
                self.check(offset, sample, port);
            }
            self.rest_currents(sample, pulses);
            pulses
        };
        // The sum is not finite if either term is not.
        let odd = self.reference.voltage_v + omega;
        self.check((!odd.is_finite()).then_some((Fault::NotFinite, odd, f32::MAX)), sample, port);
        pulsing && self.trip.is_none()
    }

    /// The halves that the PWM interrupt will play, with the check that they came in time; `true` if they are pulses.
    #[inline(always)]
    fn plan(
        &mut self,
        seen: &Seen,
        pulsing: bool,
        sample: &Sample,
        port: &mut impl ControlPort,
        shared: &Shared,
    ) -> bool {
        let Clock { control_ticks, .. } = self.settings.clock;
        let until = self.now.after(control_ticks);
        if self.pulses.lack(until) {
            let release = self.acknowledge.release();
            let order = Order { pulses: pulsing, reference: &self.reference, release };
            self.pulses.plan(until, &order, &shared.planned);
        }
        let late = port.overrun_ticks(seen.now, control_ticks);
        let late_s = self.settings.clock.seconds(late as i32);
        self.check((late > 0).then_some((Fault::ControlDeadline, late_s, 0.0)), sample, port);
        let pulsing = pulsing && self.trip.is_none();
        // No revision after a fault.
        self.revises &= pulsing;
        pulsing
    }

    /// The period as the flight recorder, the operator and any observer see it.
    #[inline(always)]
    fn tell(
        &mut self,
        seen: &Seen,
        pulsing: bool,
        input: Input,
        port: &mut impl ControlPort,
        shared: &Shared,
    ) {
        let now = seen.now;
        if let Some(recorder) = shared.recorder {
            recorder.record(self.entry(now, input, pulsing), self.trip.is_some(), pulsing);
        }
        if self.operated && self.slots.begins() {
            shared.operator.tell(now, &self.report(input.sample));
            if input.command.calibrate | self.calibrating {
                self.calibrate(input.command, pulsing);
            }
        }
        port.report(now, || self.report(input.sample));
    }

    /// The period's report.
    fn report(&self, sample: &Sample) -> Report {
        let target = self.controller.target();
        Report {
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
            squares_a2: sample.currents_a.squares(),
            speed_known: self.controller.speed_is_known(),
            acknowledged: self.acknowledge.answered(),
            mode: self.mode,
            angle_zero: self.harmonics.zero(),
            calibrating: self.calibrating,
        }
    }

    /// The period's entry in the flight recorder.
    #[inline(always)]
    fn entry(&self, at: Instant, input: Input, pulsing: bool) -> Record {
        let Input { sample, command } = input;
        let Target { current, .. } = self.controller.target();
        Record {
            at,
            currents_a: sample.currents_a,
            udc_v: sample.udc_v,
            angle: sample.angle.unwrap_or(Angle::ZERO),
            id_a: current.d,
            iq_a: current.q,
            voltage_v: self.reference.voltage_v,
            state: State {
                mode: self.loaded,
                enabled: command.enable,
                pulsing,
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
}
