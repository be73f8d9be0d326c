//! The PWM interrupt's task.

use super::{COMPARE_STEPS, DualApplied, DualCommand, MotorShare, Settings, Shared};
use crate::drive::Gates;
use crate::drive::traction::stale;
use crate::frames::{Angle, limit};
use crate::machine::{Machine, Tables};
use crate::nine_switch::{self, DeadTime, GateTicks, MotorVoltage, Period, Refused, Request};
use crate::ports::{Dual, GateFeedback, PlayedPeriod, PowerSample, PwmPort};
use crate::protection::{self, FailedCheck, Fault, MaskedFaults, SafeState, Trip};
use crate::time::Instant;
use core::sync::atomic::Ordering;

/// Largest credible move of the link in a carrier period, over the source's nominal voltage; a larger one is a measurement error.
const MOST_MOVED_SHARE: f32 = 0.025;
/// Least link voltage used as a divisor, over the source's nominal voltage.
const LEAST_LINK_SHARE: f32 = 0.125;

/// Phase current, as a share of the largest, below which the sign may change within a period.
const SMALL_CURRENT_SHARE: f32 = 0.05;

/// The ZS9's PWM task.
pub struct PwmTask<M = &'static Tables> {
    machine: M,
    settings: Settings,
    /// As [`Settings::longest_pause_steps`].
    longest_pause_steps: u32,
    /// Nominal instant of the next call: a peak.
    now: Instant,
    /// The period that begins at the next valley, made in place.
    next: PlayedPeriod,
    /// The states that the gates should have shown in the period played before, and in the one that is being played.
    expected: [Expected; 2],
    masked: MaskedFaults,
    trip: Option<Trip>,
    /// Link voltage at the last peak, in V.
    last_link_v: Option<f32>,
    /// Number of the release carried out last.
    released: u8,
}

impl<M: Machine> PwmTask<M> {
    /// A task whose first call is at the first peak, half a carrier period after the start, gates off until the second valley.
    pub const fn new(machine: M, settings: Settings) -> Self {
        Self {
            machine,
            settings,
            longest_pause_steps: settings.longest_pause_steps(),
            now: Instant(settings.first_peak_ticks()),
            next: PlayedPeriod::off(settings.half_steps()),
            expected: [Expected::OFF; 2],
            masked: MaskedFaults::NONE,
            trip: None,
            last_link_v: None,
            released: 0,
        }
    }

    /// The same task with timers that start at another instant than 0.
    pub fn beginning_at(mut self, origin: Instant) -> Self {
        self.now = origin.after(self.settings.first_peak_ticks());
        self
    }

    /// The same task without a check.
    pub const fn without(mut self, masked: MaskedFaults) -> Self {
        self.masked = masked;
        self
    }

    /// Sets other settings than those that it was built with; before the first call.
    pub fn set_up(&mut self, settings: Settings) {
        self.settings = settings;
        self.longest_pause_steps = settings.longest_pause_steps();
        self.now = Instant(settings.first_peak_ticks());
    }

    /// The PWM timer's interrupt, at the carrier's peak. Deadline: the next valley, where the shadow registers take over. Returns `true` if it came
    /// for a peak.
    pub fn run(&mut self, port: &mut impl PwmPort<Dual>, shared: &Shared) -> bool {
        let peak = port.begin();
        if peak {
            self.pass(port, shared);
        }
        peak
    }

    /// A peak.
    #[inline(always)]
    fn pass(&mut self, port: &mut impl PwmPort<Dual>, shared: &Shared) {
        let now = self.now;
        self.now = now.after(self.settings.carrier_ticks);
        let sample = port.sample(now);
        let command = shared.command.newest(|command| now.reached(DualCommand::valid_from(command)));
        if let Some(command) = &command
            && command.release != self.released
        {
            self.released = command.release;
            self.release(port);
        }
        let began = Instant(shared.began.load(Ordering::Relaxed));
        let stale = stale(now, began, &self.settings.clock);
        let failed = self.failed(&sample, command.as_ref(), stale);
        self.check(failed, port);
        let mut given = None;
        let half_steps = self.settings.half_steps();
        let mut expected = Expected::OFF;
        let pulsing = command.filter(|command| command.gates == Gates::Pulse && self.trip.is_none());
        let request = pulsing.map(|command| self.request(&command, &sample));
        match request.as_ref().map(|request| (nine_switch::step(request), request)) {
            Some((Ok(period), request)) => {
                for (ticks, gate) in self.next.gates.iter_mut().zip(&period.gates) {
                    *ticks = gate.ticks(half_steps);
                }
                if self.settings.dead_time_ticks > 0 {
                    self.dead_time().compensate(&mut self.next.gates, &sample.currents_a);
                }
                expected = Expected::of(&self.next, half_steps, self.longest_pause_steps);
                given = Some(shares(request, &period));
            }
            Some((Err(refused), request)) => {
                self.check(Some(refusal(refused, request)), port);
                self.next = PlayedPeriod::off(half_steps);
            }
            None => self.next = PlayedPeriod::off(half_steps),
        }
        self.last_link_v = Some(link_v(&sample));
        let [_, running] = self.expected;
        self.expected = [running, expected];
        port.play(now, &self.next);
        shared.applied.publish(DualApplied {
            at: now,
            next: given,
            trip: self.trip,
            released: self.released,
        });
    }

    /// Nominal instant of the next call.
    pub fn next_call(&self) -> Instant {
        self.now
    }

    /// The latched fault.
    pub fn trip(&self) -> Option<Trip> {
        self.trip
    }

    /// The command at the middle of the period that begins at the next valley, for the link voltage extrapolated to there.
    fn request(&self, command: &DualCommand, sample: &PowerSample) -> Request {
        let link_v = link_v(sample);
        // The middle of the period that is made here lies as far ahead as the last peak lies back.
        let source_v = self.machine.tables().z_source.source_v;
        let (most_v, least_v) = (MOST_MOVED_SHARE * source_v, LEAST_LINK_SHARE * source_v);
        let moved_v = limit(link_v - self.last_link_v.unwrap_or(link_v), -most_v, most_v);
        let link_v = link_v + moved_v;
        let link_v = if link_v > least_v { link_v } else { least_v };
        let index_per_volt = 2.0 / link_v;
        let ahead = self.now.since(command.at) as f32;
        let [upper, lower] = command.motors.map(|motor| MotorVoltage {
            angle: motor.angle + Angle((motor.rate * ahead) as i32 as u32),
            modulation_index: motor.voltage_v * index_per_volt,
        });
        Request { scheme: command.scheme, upper, lower, shoot_through: command.duty }
    }

    /// The dead time in compare steps.
    fn dead_time(&self) -> DeadTime {
        DeadTime {
            ticks: self.settings.dead_time_ticks * COMPARE_STEPS,
            small_a: SMALL_CURRENT_SHARE * self.machine.tables().ratings.max_current_a,
        }
    }

    fn failed(
        &self,
        sample: &PowerSample,
        command: Option<&DualCommand>,
        stale: Option<FailedCheck>,
    ) -> Option<FailedCheck> {
        let limits = &self.settings.limits;
        let [upper, lower] = &sample.currents_a;
        let armed = |(fault, _, _): &FailedCheck| !self.masked.has(*fault);
        protection::check_currents(upper, &self.machine.tables().ratings)
            .filter(armed)
            .or_else(|| protection::check_currents(lower, &self.machine.tables().ratings).filter(armed))
            .or_else(|| limits.check_link(sample.source_v, sample.capacitor_v).filter(armed))
            .or_else(|| {
                let command = command.filter(|command| command.gates == Gates::Pulse)?;
                // Only while pulses are wanted: control may have turned the gates off meanwhile.
                self.stuck(&sample.gates)
                    .filter(armed)
                    .or_else(|| stale.filter(armed))
                    .or_else(|| limits.check_duty(command.duty))
            })
    }

    /// The check for gates not seen as they should be since the last peak, that is, in the falling half of one period and the rising half of the
    /// other. A pause is only required to be seen in its rising half: if it lies close around the peak, its falling half may be over before the board
    /// has begun to look anew.
    fn stuck(&self, seen: &GateFeedback) -> Option<FailedCheck> {
        let [before, running] = &self.expected;
        let missing = (before.must_be_on | running.must_be_on) & !seen.on;
        let surplus = seen.on & !(before.may_be_on | running.may_be_on);
        let off = (running.is_off | before.is_off & seen.off) ^ seen.off;
        let wrong = (missing | surplus | off) & ALL_GATES;
        (wrong != 0).then_some((Fault::LegStuck, f32::from(wrong), 0.0))
    }

    /// Forgets the fault and lets the gates go, once for each release that control asks for.
    #[cold]
    #[inline(never)]
    fn release(&mut self, port: &mut impl PwmPort<Dual>) {
        self.trip = None;
        let at = self.now.before(self.settings.carrier_ticks);
        if !port.leave(at) {
            self.check(Some((Fault::GatesHeld, 1.0, 0.0)), port);
        }
    }

    fn check(&mut self, failed: Option<FailedCheck>, port: &mut impl PwmPort<Dual>) {
        let (Some((fault, value, limit)), None) = (failed, self.trip) else {
            return;
        };
        if self.masked.has(fault) {
            return;
        }
        let at = self.now.before(self.settings.carrier_ticks);
        port.enter(SafeState::GatesOff, at);
        self.trip = Some(Trip { fault, value, limit, at, safe: SafeState::GatesOff });
    }
}

impl PlayedPeriod {
    /// All nine gates off, with this number of compare steps in a half.
    pub const fn off(half_steps: u32) -> Self {
        Self { gates: [GateTicks { off_from: 0, off_to: half_steps }; 9] }
    }
}

/// Link voltage outside shoot-through, in V.
fn link_v(sample: &PowerSample) -> f32 {
    2.0 * sample.capacitor_v - sample.source_v
}

/// A bit for each of the nine gates.
const ALL_GATES: u16 = 0x1FF;

/// The states of the gates in a period, a bit each in the order of [`crate::nine_switch::GATES`].
#[derive(Clone, Copy, Debug)]
struct Expected {
    /// On for longer than dead times may take; a gate that is to be on for less may stay off.
    must_be_on: u16,
    may_be_on: u16,
    /// Off at some time.
    is_off: u16,
}

impl Expected {
    const OFF: Self = Self { must_be_on: 0, may_be_on: 0, is_off: ALL_GATES };

    /// The states for this many compare steps in a half, and at most so many in a pause of a gate that must be seen on.
    fn of(period: &PlayedPeriod, half: u32, longest_pause: u32) -> Self {
        let mut expected = Self { must_be_on: ALL_GATES, may_be_on: ALL_GATES, is_off: ALL_GATES };
        // Most gates are both on and off for long: one comparison is enough.
        let ordinary = longest_pause.saturating_sub(1);
        let mut bit = 1;
        for gate in &period.gates {
            // Never the other way round: rounding keeps order.
            let pause = gate.off_to.wrapping_sub(gate.off_from);
            if pause.wrapping_sub(1) >= ordinary {
                expected.must_be_on ^= if pause < longest_pause { 0 } else { bit };
                expected.may_be_on ^= if pause < half { 0 } else { bit };
                expected.is_off ^= if pause > 0 { 0 } else { bit };
            }
            bit <<= 1;
        }
        expected
    }
}

fn shares(request: &Request, period: &Period) -> [MotorShare; 2] {
    let applied = &period.applied;
    [
        MotorShare { modulation_index: applied.upper_index, angle: request.upper.angle },
        MotorShare { modulation_index: applied.lower_index, angle: request.lower.angle },
    ]
}

fn refusal(refused: Refused, request: &Request) -> FailedCheck {
    match refused {
        Refused::UpperIndex => (Fault::NotFinite, request.upper.modulation_index, f32::MAX),
        Refused::LowerIndex => (Fault::NotFinite, request.lower.modulation_index, f32::MAX),
        Refused::ShootThrough => (Fault::DutyRange, request.shoot_through, 1.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::built_in::zs9::BUILT_IN;
    use crate::nine_switch::GateTicks as Pause;
    use crate::time::Clock;

    /// Pauses at each limit: which gates must be on, may be on, are off.
    #[test]
    fn what_a_gate_must_show_goes_by_the_length_of_its_pause() {
        let (half, longest) = (1_000, 900);
        let pauses = [0, 1, longest - 1, longest, longest + 1, half - 1, half, 0, half];
        let gates = pauses.map(|pause| Pause { off_from: 0, off_to: pause });
        let got = Expected::of(&PlayedPeriod { gates }, half, longest);
        for (gate, pause) in pauses.into_iter().enumerate() {
            let is = |word: u16| word >> gate & 1 != 0;
            let wanted = (pause < longest, pause < half, pause > 0);
            assert_eq!((is(got.must_be_on), is(got.may_be_on), is(got.is_off)), wanted, "{pause}");
        }
    }

    /// A gate that is not as it should be in either period, seen on or off, is reported once.
    #[test]
    fn a_gate_that_shows_what_it_should_not_is_told() {
        let on = Expected { must_be_on: 1, may_be_on: 1, is_off: 0 };
        let off = Expected { must_be_on: 0, may_be_on: 0, is_off: 1 };
        let both = Expected { must_be_on: 1, may_be_on: 1, is_off: 1 };
        let settings = Settings::new(Clock::new(25_000_000, 2_500), 2_500, &crate::built_in::zs9::BUILT_IN);
        let mut task = PwmTask::new(&BUILT_IN, settings).beginning_at(Instant(70));
        assert_eq!(task.next_call(), Instant(70 + 1_250), "a peak is half a carrier period on");
        for (before, running, seen_on, seen_off, told) in [
            (on, on, 1, 0, false),
            (on, on, 0, 0, true),
            (on, on, 1, 1, true),
            (on, off, 1, 1, false),
            (on, off, 0, 1, true),
            (off, on, 0, 1, true),
            (off, on, 1, 1, false),
            // The pause before may be over.
            (off, on, 1, 0, false),
            (off, off, 0, 1, false),
            (off, off, 1, 1, true),
            (both, both, 1, 1, false),
            (both, both, 1, 0, true),
            (both, both, 0, 0, true),
        ] {
            task.expected = [before, running];
            let wrong = task.stuck(&GateFeedback { on: seen_on, off: seen_off });
            let found = wrong.map(|(fault, value, _)| (fault == Fault::LegStuck, value));
            assert_eq!(found, told.then_some((true, 1.0)), "{before:?} {running:?} {seen_on} {seen_off}");
        }
    }
}
