//! The control interrupt's task.

use super::axis::{self, Axis, AxisInput, AxisOutput, TRACKING_RAD_S};
use super::{DualApplied, DualCommand, MotorShare, Settings, Shared};
use crate::control::{ControlLaw, Controller, Measurements, ZSource, ZSourceError, ZSourceInput};
use crate::drive::acknowledge::Acknowledge;
use crate::drive::{Gates, PeriodInput, SlotTimer};
use crate::frames::{Angle, SQRT_3};
use crate::machine::{Machine, Tables};
use crate::ports::{ControlPort, Dual, DualDriveCommand, DualReport, DualSample, HardwareBreak, MotorDemand};
use crate::protection::{self, BoostWatch, FailedCheck, Fault, MaskedFaults, SafeState, Trip};
use crate::recorder::{DualRecord, DualState};
use crate::time::Instant;
use core::f32::consts::{FRAC_PI_4, TAU};
use core::sync::atomic::Ordering;

type Input<'a> = PeriodInput<'a, Dual>;

/// Corner of the filter on the voltage limit, in Hz: fed with the unfiltered link voltage, the limit would make it oscillate.
const LIMIT_FILTER_HZ: f32 = 10.0;
/// A motor has at most U_c/(2√3). This is the link of a two-level inverter with an equally large six-step fundamental, as a share of U_c.
pub(crate) const TWO_LEVEL_SHARE: f32 = FRAC_PI_4 / SQRT_3;
/// The name of a lost sensor, by motor.
const SENSOR_LOST: [Fault; 2] = [Fault::SensorLost1, Fault::SensorLost2];

/// The ZS9's control task, for a machine and with one control law per motor.
pub struct ControlTask<M = &'static Tables, L = Controller<false>> {
    machine: M,
    settings: Settings,
    axes: [Axis<L>; 2],
    link: ZSource,
    boost: BoostWatch,
    /// The results of the last period.
    driven: Driven,
    /// `true` if the upper motor had a new operating point in that period.
    upper_aims: bool,
    /// Filtered capacitor voltage, in V; `None` before the first sample.
    filtered_v: Option<f32>,
    /// Nominal instant of the next call.
    now: Instant,
    masked: MaskedFaults,
    trip: Option<Trip>,
    acknowledge: Acknowledge,
    /// `true` once the operator was asked for a command; an operator who is not asked gets no reports.
    operated: bool,
    slots: SlotTimer,
}

/// The results of a control period.
struct Driven {
    motors: [AxisOutput; 2],
    duty: f32,
    /// The reference that is reported, as in [`DualReport`].
    inductor_ref_a: f32,
}

impl Driven {
    /// The results while no pulses are made.
    const NOTHING: Self = Self { motors: [AxisOutput::NOTHING; 2], duty: 0.0, inductor_ref_a: 0.0 };
}

impl<M: Machine> ControlTask<M> {
    /// A task whose first call is the control timer's first interrupt, one control period after the start.
    pub const fn new(machine: M, settings: Settings) -> Self {
        let [upper, lower] = [Controller::with_tracking(TRACKING_RAD_S); 2];
        Self::with_laws(machine, settings, upper, lower)
    }
}

impl<M: Machine, L: ControlLaw> ControlTask<M, L> {
    /// The same task with other control laws, at rest: the upper motor's, the lower motor's.
    pub const fn with_laws(machine: M, settings: Settings, upper: L, lower: L) -> Self {
        Self {
            machine,
            settings,
            axes: [Axis::new(upper), Axis::new(lower)],
            link: ZSource::new(),
            boost: BoostWatch::REST,
            driven: Driven::NOTHING,
            upper_aims: false,
            filtered_v: None,
            now: Instant(settings.clock.control_ticks),
            masked: MaskedFaults::NONE,
            trip: None,
            acknowledge: Acknowledge::new(),
            operated: false,
            slots: SlotTimer::new(&settings.clock),
        }
    }

    /// The same task with timers that start at another instant than 0.
    pub fn beginning_at(mut self, origin: Instant) -> Self {
        self.now = origin.after(self.settings.clock.control_ticks);
        self
    }

    /// The same task without a check.
    pub const fn without(mut self, masked: MaskedFaults) -> Self {
        self.masked = masked;
        self
    }

    /// Sets other settings than those that it was built with, with the same clock; before the first call.
    pub fn set_up(&mut self, settings: Settings) {
        self.settings = settings;
    }

    /// The control timer's interrupt, at a valley of the carrier. Deadline: [`Settings::deadline_ticks`] after its nominal instant, when the command
    /// must be available; a missed deadline is a fault.
    pub fn run(&mut self, port: &mut impl ControlPort<Dual>, shared: &Shared) {
        let now = self.now;
        port.begin(false);
        self.now = now.after(self.settings.clock.control_ticks);
        shared.began.store(now.0, Ordering::Relaxed);
        // First of all: the next peak overwrites it.
        let newest = shared.applied.read();
        let applied = newest.filter(|applied| now.reached(applied.at));
        let sample = port.sample(now);
        let operator = || {
            self.operated = true;
            shared.operator.command(now)
        };
        let mut command = port.command(now, operator);
        if !sample.may_pulse {
            command.enable = false;
        }
        let input = Input { sample: &sample, command: &command };
        let Input { sample, command } = input;
        // Only after the PWM interrupt has released: the trip that it reported before cannot return.
        let released = applied.as_ref().map(|applied| applied.released);
        if self.acknowledge.step(command.acknowledge, self.trip.is_some(), released) {
            self.trip = None;
            self.axes.iter_mut().for_each(Axis::recover_angle);
        }
        if let (None, Some(trip)) = (self.trip, newest.and_then(|newest| newest.trip)) {
            // Also a trip from after this call's instant: that only happens if calls of it have been lost.
            self.trip = Some(trip);
        }
        if let Some(HardwareBreak { fault, seen }) = sample.hardware {
            // Gates that are held, or that did not follow their orders, are only a consequence of this fault.
            self.trip = self.trip.filter(|trip| !matches!(trip.fault, Fault::GatesHeld | Fault::LegStuck));
            self.check(Some((fault, f32::from(seen), 0.0)), port);
        }
        self.check(applied.and_then(|applied| self.overdue(&applied, now)), port);
        let angles = self.track(input, port);
        let measured = self.measured(sample, angles);
        self.check_measurements(input, &measured, port);
        let known = self.axes.iter().all(Axis::speed_is_known);
        let pulsing = self.trip.is_none() && command.enable && known;
        if pulsing {
            self.check_frozen(&measured, port);
            let next = applied.and_then(|applied| applied.next);
            self.pulse(input, &measured, next, port);
        } else {
            self.idle();
        }
        let deadline_ticks = self.settings.deadline_ticks();
        let late = port.overrun_ticks(now, deadline_ticks);
        let late_s = self.settings.clock.seconds(late as i32);
        self.check((late > 0).then_some((Fault::ControlDeadline, late_s, 0.0)), port);
        let gates = if pulsing && self.trip.is_none() { Gates::Pulse } else { Gates::Off };
        let [upper, lower] = &self.driven.motors;
        shared.command.publish(DualCommand {
            motors: [upper.command, lower.command],
            at: now,
            valid_from: now.after(deadline_ticks),
            duty: self.driven.duty,
            scheme: command.scheme,
            gates,
            release: self.acknowledge.release(),
        });
        self.tell(input, gates, port, shared);
    }

    /// The period as the flight recorder and any observer see it. Out of line: none of it is on the stack while the control laws are.
    #[inline(never)]
    fn tell(&mut self, input: Input, gates: Gates, port: &mut impl ControlPort<Dual>, shared: &Shared) {
        let now = self.now.before(self.settings.clock.control_ticks);
        if let Some(recorder) = shared.recorder {
            recorder.record(self.entry(now, input, gates), self.trip.is_some(), gates == Gates::Pulse);
        }
        if self.operated && self.slots.begins() {
            if input.command.calibrate | self.axes.iter().any(|axis| axis.calibrating) {
                self.calibrate(input.command, gates == Gates::Pulse);
            }
            shared.operator.tell(now, &self.report(input));
        }
        port.report(now, || self.report(input));
    }

    /// Calibrates the zeros of both position sensors for a slot, each if that is possible.
    #[cold]
    #[inline(never)]
    fn calibrate(&mut self, command: &DualDriveCommand, pulsing: bool) {
        let tables = self.machine.tables();
        for (axis, demand) in self.axes.iter_mut().zip(&command.demands) {
            axis.calibrate(command.calibrate && pulsing, demand, tables);
        }
    }

    /// The period's report.
    fn report(&self, input: Input) -> DualReport {
        let Input { sample, command } = input;
        let ([upper, lower], driven) = (&self.axes, &self.driven);
        DualReport {
            torque_nm: driven.motors.each_ref().map(|motor| motor.torque_nm),
            voltage_v: driven.motors.each_ref().map(|motor| motor.command.voltage_v),
            weakening: driven.motors.each_ref().map(|motor| motor.weakening),
            duty: driven.duty,
            inductor_ref_a: driven.inductor_ref_a,
            scheme: command.scheme,
            trip: self.trip,
            omega: [upper.omega(), lower.omega()],
            current_a: sample.currents_a.map(|currents| currents.peak()),
            capacitor_v: sample.capacitor_v,
            source_v: sample.source_v,
            speed_known: upper.speed_is_known() && lower.speed_is_known(),
            acknowledged: self.acknowledge.answered(),
            angle_zeros: [upper.zero.angle(), lower.zero.angle()],
            calibrating: [upper.calibrating, lower.calibrating],
        }
    }

    /// The period's entry in the flight recorder.
    #[inline(always)]
    fn entry(&self, at: Instant, input: Input, gates: Gates) -> DualRecord {
        let Input { sample, command } = input;
        let ([first, second], [upper, lower]) = (sample.angles, &self.driven.motors);
        DualRecord {
            at,
            currents_a: sample.currents_a,
            angles: [first.unwrap_or(Angle::ZERO), second.unwrap_or(Angle::ZERO)],
            capacitor_v: sample.capacitor_v,
            source_v: sample.source_v,
            inductor_a: sample.inductor_a,
            torque_nm: [upper.torque_nm, lower.torque_nm],
            duty: self.driven.duty,
            state: DualState {
                scheme: command.scheme,
                enabled: command.enable,
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

    /// The failed check of a PWM interrupt that should have come since the last one seen and has not; with its delay, in s.
    fn overdue(&self, applied: &DualApplied, now: Instant) -> Option<FailedCheck> {
        let late = now.since(applied.at.after(self.settings.carrier_ticks));
        (late >= 0).then(|| (Fault::PwmDeadline, self.settings.clock.seconds(late), 0.0))
    }

    /// Follows both rotors.
    #[inline(always)]
    fn track(&mut self, input: Input, port: &mut impl ControlPort<Dual>) -> [Angle; 2] {
        let [first, second] = input.sample.angles;
        let enable = input.command.enable;
        let (first, upper) = self.follow::<0>(first, enable);
        let (second, lower) = self.follow::<1>(second, enable);
        // The upper motor's first if both are lost.
        self.check(upper, port);
        self.check(lower, port);
        [first, second]
    }

    /// Follows one rotor. Returns its angle, and the failed check.
    #[inline(always)]
    fn follow<const MOTOR: usize>(
        &mut self,
        measured: Option<Angle>,
        enable: bool,
    ) -> (Angle, Option<FailedCheck>) {
        let (axis, fault) = (&mut self.axes[MOTOR], SENSOR_LOST[MOTOR]);
        let trusted = self.masked.has(fault);
        let Some(measured) = measured else { return (Angle::ZERO, axis.lose_angle(fault, enable)) };
        let angle = measured + axis.zero.angle();
        let lost = axis.track(angle, trusted, &self.settings, self.machine.tables());
        (angle, lost.map(|off_rad| (fault, off_rad, axis::INNOVATION_RAD)))
    }

    /// The measurements for the control law, with the link as that of a two-level inverter of equal output.
    fn measured(&mut self, sample: &DualSample, [first, second]: [Angle; 2]) -> [Measurements; 2] {
        let before_v = self.filtered_v.unwrap_or(sample.capacitor_v);
        let share = TAU * LIMIT_FILTER_HZ * self.settings.clock.control_s();
        let filtered_v = before_v + share * (sample.capacitor_v - before_v);
        // A value that is not finite trips, and must not stay in the filter.
        self.filtered_v = filtered_v.is_finite().then_some(filtered_v);
        let udc_v = TWO_LEVEL_SHARE * filtered_v;
        let [upper, lower] = sample.currents_a;
        [
            Measurements { currents_a: upper, udc_v, angle: first },
            Measurements { currents_a: lower, udc_v, angle: second },
        ]
    }

    fn check_measurements(
        &mut self,
        input: Input,
        measured: &[Measurements; 2],
        port: &mut impl ControlPort<Dual>,
    ) {
        let Input { sample, command } = input;
        let ([upper, lower], [first, second]) = (&self.axes, measured);
        let (limits, tables) = (&self.settings.limits, self.machine.tables());
        let [of_upper, of_lower] = &command.demands;
        let sound = limits.check_link(sample.source_v, sample.capacitor_v).is_none()
            && limits.check_link_reference(command.link_ref_v, sample.source_v).is_none()
            && sample.inductor_a.is_finite()
            && axis::is_sound(first, upper.omega(), tables)
            && axis::is_sound(second, lower.omega(), tables)
            && check_demand(of_upper).is_none()
            && check_demand(of_lower).is_none();
        if !sound {
            // Copies: a value behind a reference would be in memory in every period.
            let measured = *measured;
            self.find_fault(input, &measured, port);
        }
    }

    /// The fault of a period's input, if it has one.
    #[cold]
    #[inline(never)]
    fn find_fault(&mut self, input: Input, measured: &[Measurements; 2], port: &mut impl ControlPort<Dual>) {
        let Input { sample, command } = input;
        let limits = &self.settings.limits;
        let armed = |(fault, _, _): &FailedCheck| !self.masked.has(*fault);
        let mut failed = limits
            .check_link(sample.source_v, sample.capacitor_v)
            .or_else(|| limits.check_link_reference(command.link_ref_v, sample.source_v))
            .filter(armed)
            .or_else(|| inductor_fault(sample.inductor_a));
        for ((axis, measured), demand) in self.axes.iter().zip(measured).zip(&command.demands) {
            failed = failed
                .filter(armed)
                .or_else(|| axis::check(measured, axis.omega(), self.machine.tables()))
                .filter(armed)
                .or_else(|| check_demand(demand));
        }
        self.check(failed, port);
    }

    #[inline(always)]
    fn check_frozen(&mut self, [first, second]: &[Measurements; 2], port: &mut impl ControlPort<Dual>) {
        let (settings, tables) = (&self.settings, self.machine.tables());
        let [upper, lower] = &mut self.axes;
        let [lost_upper, lost_lower] = SENSOR_LOST;
        let upper = upper.check_frozen(first, lost_upper, settings, tables);
        let lower = lower.check_frozen(second, lost_lower, settings, tables);
        self.check(upper, port);
        self.check(lower, port);
        for motor in 0..2 {
            self.check(self.axes[motor].check_voltage(self.machine.tables()), port);
        }
    }

    /// A period without pulses.
    #[inline(always)]
    fn idle(&mut self) {
        self.axes.iter_mut().for_each(Axis::idle);
        (self.link, self.boost, self.driven) = (ZSource::new(), BoostWatch::REST, Driven::NOTHING);
    }

    /// Control laws of motors and link, while pulses are made.
    fn pulse(
        &mut self,
        input: Input,
        measured: &[Measurements; 2],
        applied: Option<[MotorShare; 2]>,
        port: &mut impl ControlPort<Dual>,
    ) {
        let Input { sample, command } = input;
        let duty = self.settings.least_duty(self.driven.duty);
        let period_s = self.settings.clock.control_s();
        let boost = self.boost.step(sample.source_v, sample.capacitor_v, duty, period_s);
        self.check(boost, port);
        let link_v = 2.0 * sample.capacitor_v - sample.source_v;
        let [first, second] = &mut self.axes;
        let ([m1, m2], [d1, d2]) = (measured, &command.demands);
        let (a1, a2) = applied.map_or((None, None), |[a1, a2]| (Some(a1), Some(a2)));
        let (settings, tables) = (&self.settings, self.machine.tables());
        let [l1, l2] = command.speed_torque_nm;
        // The operating points alternate: the lower motor's is made in the periods between.
        self.upper_aims = !self.upper_aims;
        let turns = [self.upper_aims, !self.upper_aims];
        let motors = &mut self.driven.motors;
        let [o1, o2] = motors;
        let upper =
            AxisInput { measured: m1, demand: d1, speed_torque_nm: l1, applied: a1, link_v, aims: turns[0] };
        first.step(&upper, settings, tables, o1);
        let lower =
            AxisInput { measured: m2, demand: d2, speed_torque_nm: l2, applied: a2, link_v, aims: turns[1] };
        second.step(&lower, settings, tables, o2);
        let learns = if turns[0] { second } else { first };
        learns.explain(link_v, settings, tables);
        let link = ZSourceInput {
            capacitor_v: sample.capacitor_v,
            inductor_a: sample.inductor_a,
            source_v: sample.source_v,
            power_w: if L::FEEDS_POWER_FORWARD {
                motors.iter().map(|motor| motor.power_w).sum()
            } else {
                0.0
            },
            link_ref_v: command.link_ref_v,
            duty_room: 1.0,
        };
        let (duty, inductor_ref_a, refused) =
            match self.link.step(&link, &self.settings.link, &self.settings.link_gains) {
                Ok(output) => (output.duty, output.inductor_ref_a, None),
                Err(ZSourceError::NotFinite) => (0.0, 0.0, Some((Fault::NotFinite, link.power_w, f32::MAX))),
                Err(ZSourceError::NoSource(volts)) => {
                    (0.0, 0.0, Some((Fault::SourceUndervoltage, volts, 0.0)))
                }
            };
        let odd = motors.iter().map(|motor| motor.command.voltage_v + motor.command.rate);
        let odd = odd.fold(None, |found, sum| found.or((!sum.is_finite()).then_some(sum)));
        self.check(refused.or(odd.map(|sum| (Fault::NotFinite, sum, f32::MAX))), port);
        (self.driven.duty, self.driven.inductor_ref_a) = (duty, inductor_ref_a);
    }

    fn check(&mut self, failed: Option<FailedCheck>, port: &mut impl ControlPort<Dual>) {
        if let (Some(failed), None) = (failed, self.trip) {
            self.trip_on(failed, port);
        }
    }

    /// Out of line: it happens once, and there are many checks.
    #[cold]
    #[inline(never)]
    fn trip_on(&mut self, (fault, value, limit): FailedCheck, port: &mut impl ControlPort<Dual>) {
        if self.masked.has(fault) {
            return;
        }
        let at = self.now.before(self.settings.clock.control_ticks);
        port.enter(SafeState::GatesOff, at);
        self.trip = Some(Trip { fault, value, limit, at, safe: SafeState::GatesOff });
        self.acknowledge.entered();
    }
}

/// The check of an inductor's current: the network's own limit is not known, but a converter that gives nothing is.
fn inductor_fault(inductor_a: f32) -> Option<FailedCheck> {
    (!inductor_a.is_finite()).then_some((Fault::NotFinite, inductor_a, f32::MAX))
}

/// The check of a demand: any finite number is one, which the envelope limits.
fn check_demand(demand: &MotorDemand) -> Option<FailedCheck> {
    match demand {
        MotorDemand::Torque(demand) => protection::check_demand(demand),
        MotorDemand::Speed(speed) if speed.is_finite() => None,
        MotorDemand::Speed(speed) => Some((Fault::NotFinite, *speed, f32::MAX)),
    }
}

#[cfg(all(test, not(loom)))]
mod tests {
    use super::*;
    use crate::built_in::zs9::BUILT_IN;
    use crate::control::WithoutTorque;
    use crate::drive::dual::Settings;
    use crate::frames::Dq;
    use crate::time::Clock;

    const SETTINGS: Settings = Settings::new(Clock::new(25_000_000, 2_500), 2_500, &BUILT_IN);

    /// The correction of a sensor's zero is added to the angle that it measures; a lost sensor has none.
    #[test]
    fn a_correction_is_added_to_the_measured_angle() {
        let mut task = ControlTask::new(&BUILT_IN, SETTINGS);
        let rest = WithoutTorque {
            unexplained_v: Dq { d: 20.0, q: 0.0 },
            omega: 400.0,
            max_omega: 840.0,
            magnets_wb: 0.2,
            length_s: 0.1,
        };
        task.axes[1].zero.learn(&rest);
        let zero = task.axes[1].zero.angle();
        assert!(zero.signed_radians() > 0.05, "{zero:?}");
        let measured = Angle(0x4000_0000);
        assert_eq!(task.follow::<0>(Some(measured), false), (measured, None));
        assert_eq!(task.follow::<1>(Some(measured), false), (measured + zero, None));
        assert_eq!(task.follow::<1>(None, false).0, Angle::ZERO);
    }

    /// Both zeros are calibrated while the gates pulse; a motor with a demand is left out.
    #[test]
    fn zeros_are_calibrated_while_the_gates_pulse() {
        let demand =
            |torque_nm| MotorDemand::Torque(crate::control::Demand { torque_nm, slew_limited: true });
        for (calibrate, pulsing, second_nm, wanted) in [
            (true, true, 0.0, [true, true]),
            (true, true, 5.0, [true, false]),
            (true, false, 0.0, [false, false]),
            (false, true, 0.0, [false, false]),
        ] {
            let mut task = ControlTask::new(&BUILT_IN, SETTINGS);
            for period in 0..300_u16 {
                let angle = Angle::within_half_turn(0.005 * f32::from(period));
                assert_eq!(task.follow::<0>(Some(angle), false).1, None);
                assert_eq!(task.follow::<1>(Some(angle), false).1, None);
            }
            let demands = [demand(0.0), demand(second_nm)];
            task.calibrate(&DualDriveCommand { calibrate, demands, ..DualDriveCommand::NONE }, pulsing);
            assert_eq!(task.axes.each_ref().map(|axis| axis.calibrating), wanted, "{calibrate} {pulsing}");
        }
    }
}
