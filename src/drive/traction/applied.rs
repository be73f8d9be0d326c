//! What the modulator does, as the control interrupt sees it.

use super::Settings;
use super::glide::Glide;
use crate::cell::{Record, SEEN};
use crate::control::{Boundary, Committed, Earlier, Follows, Ripple};
use crate::drive::messages::{COMMITTAL_WORDS, CommittalRecord, HalfKind};
use crate::frames::{Abc, AlphaBeta, Angle};
use crate::modulation::{Mode, Regulation, RippleFlux, depth_limit, first_half, ripple_share};
use crate::protection::{Fault, Violation};
use crate::time::{Clock, Instant};

/// By which part of a control period the PWM interrupt may be late before control calls it lost: more than it takes to enter it.
const PWM_LATE_PART: u32 = 4;

/// Share of a mode's largest fundamental that the operating point may use where the voltage must also regulate.
const REGULATION_ROOM: f32 = 0.999;

/// What control makes of the modulator's records: the newest boundary and what is committed from there on. Of the voltages only
/// the ticks for which they act.
pub(super) struct Applied {
    /// The newest boundary, and the one before it.
    pub at: Instant,
    pub before: Instant,
    /// Phase currents at the newest one, in A.
    pub currents_a: Abc,
    /// What the half gave that ended there; `None` while the gates were off.
    pub passed: Option<AlphaBeta>,
    /// What the running half gives from now on; `None` if the gates are off in it or in the next one.
    pub running: Option<AlphaBeta>,
    /// Mode of the running half.
    pub mode: Mode,
    pub next: Next,
    /// Number of the release that the PWM interrupt had carried out.
    pub released: u8,
}

/// The half after the running one.
pub(super) struct Next {
    pub begins: Instant,
    pub period_ticks: u32,
    pub volt_ticks: AlphaBeta,
    pub kind: HalfKind,
}

impl Applied {
    /// Mode of the half that this period's command is made for.
    pub(super) fn decided(&self) -> Mode {
        self.next.kind.next_mode()
    }

    /// The PWM interrupt that should have come by `now` and has not: since when, in s.
    pub(super) fn overdue(&self, now: Instant, clock: &Clock) -> Option<Violation> {
        let late = now.since(self.next.begins);
        let limit = (clock.control_ticks / PWM_LATE_PART) as i32;
        (late > limit).then(|| (Fault::PwmDeadline, clock.seconds(late), clock.seconds(limit)))
    }

    /// As it stood at `now`, even if the PWM interrupt has come since.
    #[inline]
    pub(super) fn seen(records: [Record<COMMITTAL_WORDS>; SEEN], now: Instant) -> Option<Self> {
        let [newest, one, two, three] = records.map(CommittalRecord);
        if now.reached(newest.at()) {
            return Some(Self::of([newest, one, two], now));
        }
        // A half that was written has a length.
        (one.period_ticks() > 0 && now.reached(one.at())).then(|| Self::of([one, two, three], now))
    }

    #[inline]
    fn of([newest, one, two]: [CommittalRecord; 3], now: Instant) -> Self {
        let (at, kind) = (newest.at(), newest.kind());
        let (begins, period_ticks, volt_ticks) =
            (newest.begins(), newest.period_ticks(), newest.volt_ticks());
        let next = Next { begins, period_ticks, volt_ticks, kind };
        let mode = one.kind().mode();
        let off = one.kind().is_off() || kind.is_off();
        let running = (!off).then(|| one.volt_ticks_from(now.since(at).max(0) as u32));
        let passed = (!two.kind().is_off()).then(|| two.volt_ticks());
        Self {
            at,
            before: one.at(),
            currents_a: newest.currents_a(),
            passed,
            running,
            mode,
            next,
            released: newest.released(),
        }
    }
}

/// What the voltage is made for, at the instant of a control interrupt.
pub(super) struct Steady {
    /// Electrical angular speed, in rad/s.
    pub omega: f32,
    /// Link voltage, in V.
    pub udc_v: f32,
    /// The fundamental of the last operating point, in V.
    pub voltage_v: f32,
    /// Fundamental that the last operating point would have without a limit, as a share of six-step.
    pub depth: f32,
}

/// What is committed before the modulator has told anything: nothing.
pub(super) fn nothing_committed(settings: &Settings) -> Committed {
    let Settings { clock, devices, .. } = settings;
    Committed {
        horizon_s: 0.0,
        volt_seconds: None,
        ripple: None,
        interval_s: clock.seconds(devices.shortest_half_ticks as i32),
        follows: Follows::Mean,
        depth_limit: depth_limit(Mode::Async, 0.0, devices),
        steady_share: 1.0,
        filled: false,
        ripple_share: ripple_share(Mode::Async, 0.0),
        settled: true,
    }
}

impl Applied {
    /// What the modulator will do from `now` until a command of this period can act, which is for the mode `decided`; with `revises`
    /// only the running half stands.
    pub(super) fn committed(
        &self,
        now: Instant,
        steady: &Steady,
        glide: &mut Glide,
        settings: &Settings,
        decided: Mode,
        revises: bool,
    ) -> Committed {
        let Settings { clock, devices, .. } = settings;
        let next = &self.next;
        let largest = depth_limit(decided, clock.angle_rate(steady.omega), devices);
        let largest = if decided.is_whole() { largest } else { REGULATION_ROOM * largest };
        let (depth_limit, filled) = glide.fill(decided, largest, steady.depth, clock.control_s());
        let running = next.begins.since(now).max(0) as u32;
        let left = running + if revises { 0 } else { next.period_ticks };
        let volt_ticks = self.running.map(|ticks| if revises { ticks } else { ticks + next.volt_ticks });
        let interval_s = match decided.carriers() {
            0 => clock.seconds(devices.shortest_half_ticks as i32),
            carriers => core::f32::consts::PI / (carriers as f32 * steady.omega.abs()),
        };
        let follows = match decided.regulation() {
            Regulation::Mean => Follows::Mean,
            Regulation::Fundamental => Follows::Fundamental,
            Regulation::Angle => Follows::Angle,
        };
        Committed {
            horizon_s: clock.seconds(left as i32),
            volt_seconds: volt_ticks.map(|ticks| ticks * (steady.udc_v * clock.tick_s)),
            ripple: next.kind.ripple(decided, steady),
            interval_s,
            follows,
            depth_limit,
            steady_share: 1.0,
            filled,
            ripple_share: ripple_share(decided, steady.depth),
            settled: true,
        }
    }

    /// The newest boundary, unless it is the one that was `used` last.
    pub(super) fn boundary(
        &self,
        used: Option<Instant>,
        now: Instant,
        udc_v: f32,
        clock: &Clock,
    ) -> Option<Boundary> {
        if used == Some(self.at) {
            return None;
        }
        let passed = if used == Some(self.before) { self.passed } else { None };
        Some(Boundary {
            earlier: Some(Earlier { currents_a: self.currents_a, age_s: clock.seconds(now.since(self.at)) }),
            volt_seconds: passed.map(|ticks| ticks * (udc_v * clock.tick_s)),
            length_s: clock.seconds(self.at.since(self.before)),
        })
    }
}

impl HalfKind {
    /// Ripple flux at the end of this half, which is committed, and what the half after it, of the mode `decided`, is to change of it.
    /// Where a pattern begins at the first of these, its own ripple is expected; where a carrier begins, what the old pattern leaves.
    fn ripple(self, decided: Mode, steady: &Steady) -> Option<Ripple> {
        let (mode, end) = (self.mode(), self.half() + 1);
        if decided.is_pattern() {
            let at_horizon_wb = self.ripple_at(decided, number(mode, decided, end), steady);
            return Some(Ripple { at_horizon_wb, led_wb: AlphaBeta::default() });
        }
        let after = self.next_but_one_mode();
        if !mode.is_pattern() && !after.is_pattern() {
            return None;
        }
        let at_horizon_wb = self.ripple_at(mode, end, steady);
        let after_wb = self.ripple_at(after, number(decided, after, number(mode, decided, end) + 1), steady);
        Some(Ripple { at_horizon_wb, led_wb: after_wb - at_horizon_wb })
    }

    /// A mode's ripple where half number `half` begins, seen in the mirror if the half is: nothing under a carrier.
    fn ripple_at(self, mode: Mode, half: u32, steady: &Steady) -> AlphaBeta {
        let flux = RippleFlux::new(mode, steady.voltage_v, steady.udc_v, steady.omega.abs());
        let ripple = flux.map_or(AlphaBeta::default(), |flux| flux.at(half));
        AlphaBeta { beta: if self.is_mirrored() { -ripple.beta } else { ripple.beta }, ..ripple }
    }
}

/// What half number `half` of a mode is in the mode that follows.
fn number(from: Mode, to: Mode, half: u32) -> u32 {
    if from == to { half } else { first_half(from, to, half, Angle::ZERO) }
}
