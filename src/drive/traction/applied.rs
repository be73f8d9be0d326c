//! The modulator's work, as the control interrupt sees it.

use super::Settings;
use super::six_step_exit::SixStepExit;
use super::slot::Decision;
use crate::cell::{History, Place, Record};
use crate::control::{Boundary, Committed, ModeLimits, Regulated, Ripple};
use crate::drive::messages::{COMMITTAL_WORDS, CommittalRecord, HalfKind};
use crate::frames::{Abc, AlphaBeta, Angle};
#[cfg(feature = "optimal")]
use crate::modulation::optimal_ripple;
use crate::modulation::{Mode, Reference, Regulation, RippleFlux, depth_limit, first_half, ripple_share};
use crate::protection::{Fault, Violation};
use crate::time::{Clock, Instant};

/// By which part of a control period the PWM interrupt may be late before control calls it lost: more than it takes to enter it.
const PWM_LATE_PART: u32 = 4;

/// Records of which one is that of the newest boundary at a control interrupt's instant: two may have come since.
const LATEST: u32 = 3;

/// Share of a mode's largest fundamental that the operating point may use where the voltage must also regulate.
const REGULATION_ROOM: f32 = 0.999;

/// The newest boundary, and what is committed from there on, as it stood at a control interrupt.
#[derive(Clone, Copy)]
pub(super) struct Applied {
    /// The record of the newest boundary.
    place: Place,
    /// The newest boundary.
    pub at: Instant,
    /// The boundary after it, where the half begins that was committed last; that half's length, in ticks, and its kind.
    pub begins: Instant,
    pub period_ticks: u32,
    pub kind: HalfKind,
    /// Mode of the half that runs until then.
    pub mode: Mode,
    /// Number of the release that the PWM interrupt had carried out.
    pub released: u8,
}

impl Applied {
    /// As it stood at `now`, even if the PWM interrupt has come since, as it does twice in a control period where a carrier lasts one;
    /// `None` before the modulator has told anything.
    #[inline]
    pub(super) fn read(trail: &History<COMMITTAL_WORDS>, now: Instant) -> Option<Self> {
        let stands = |record: Record<COMMITTAL_WORDS>| {
            let record = CommittalRecord(record);
            // A half that was written has a length.
            record.period_ticks() > 0 && now.reached(record.at())
        };
        let place = trail.find(LATEST, stands)?;
        trail.read(place, |records: [Record<COMMITTAL_WORDS>; 2]| {
            let [newest, one] = records.map(CommittalRecord);
            Self {
                place,
                at: newest.at(),
                begins: newest.begins(),
                period_ticks: newest.period_ticks(),
                kind: newest.kind(),
                mode: one.kind().mode(),
                released: newest.released(),
            }
        })
    }

    /// The PWM interrupt that should have come by `now` and has not: since when, in s.
    pub(super) fn overdue(&self, now: Instant, clock: &Clock) -> Option<Violation> {
        let late = now.since(self.begins);
        let limit = (clock.control_ticks / PWM_LATE_PART) as i32;
        (late > limit).then(|| (Fault::PwmDeadline, clock.seconds(late), clock.seconds(limit)))
    }
}

/// The voltage at the instant of a control interrupt, with what it is made for.
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

/// A boundary's own sample, and what the halves gave since the one before that was used.
pub(super) struct Passed {
    /// Phase currents, in A.
    pub currents_a: Abc,
    /// Time since then, in s.
    pub age_s: f32,
    pub boundary: Boundary,
}

impl Passed {
    /// The newest boundary. The half that ended there counts where its beginning was the boundary that was `used` last, and two of them
    /// where that was the one before.
    #[inline(always)]
    pub(super) fn read(
        trail: &History<COMMITTAL_WORDS>,
        applied: &Applied,
        used: Option<Instant>,
        now: Instant,
        udc_v: f32,
        clock: &Clock,
    ) -> Option<Self> {
        trail.read(applied.place, |records: [Record<COMMITTAL_WORDS>; 4]| {
            let [newest, one, two, three] = records.map(CommittalRecord);
            let both = used == Some(two.at());
            let before = if both { two.at() } else { one.at() };
            let known = used == Some(before) && !two.kind().is_off() && !(both && three.kind().is_off());
            let volt_ticks = || if both { two.volt_ticks() + three.volt_ticks() } else { two.volt_ticks() };
            Self {
                currents_a: newest.currents_a(),
                age_s: clock.seconds(now.since(applied.at)),
                boundary: Boundary {
                    volt_seconds: known.then(|| volt_ticks() * (udc_v * clock.tick_s)),
                    length_s: clock.seconds(applied.at.since(before)),
                },
            }
        })
    }
}

impl Applied {
    /// Phase currents at the newest boundary, in A, and the volt-seconds of the half that ended there, in V·s; `None` for those while the gates
    /// were off. Another look than [`Passed::read`], so that this one costs a running drive nothing.
    #[inline(never)]
    pub(super) fn ended(
        &self,
        trail: &History<COMMITTAL_WORDS>,
        udc_v: f32,
        clock: &Clock,
    ) -> Option<(AlphaBeta, Option<AlphaBeta>)> {
        trail.read(self.place, |records: [Record<COMMITTAL_WORDS>; 3]| {
            let [newest, _, two] = records.map(CommittalRecord);
            let volt_seconds = || two.volt_ticks() * (udc_v * clock.tick_s);
            (newest.currents_a().clarke(), (!two.kind().is_off()).then(volt_seconds))
        })
    }
}

/// The quantities that control may regulate in a mode.
pub(super) const fn follows(mode: Mode) -> Regulated {
    match mode.regulation() {
        Regulation::Mean => Regulated::Mean,
        Regulation::Fundamental => Regulated::Fundamental,
        Regulation::Angle => Regulated::Angle,
        #[cfg(feature = "optimal")]
        Regulation::Path => Regulated::Path,
    }
}

/// Before the first operating point.
pub(super) const NO_LIMITS: ModeLimits = ModeLimits {
    follows: Regulated::Mean,
    depth_limit: 0.0,
    steady_share: 1.0,
    filled: false,
    ripple_share: 1.0,
    settled: true,
};

/// The limits that a decided mode sets to control, so long after the last operating point, in s.
pub(super) fn limits(
    decision: &Decision,
    steady: &Steady,
    exit: &mut SixStepExit,
    settings: &Settings,
    passed_s: f32,
) -> ModeLimits {
    let Settings { clock, devices, .. } = settings;
    let mode = decision.mode;
    let largest = depth_limit(mode, clock.angle_rate(steady.omega), devices);
    let largest = if mode.is_whole() { largest } else { REGULATION_ROOM * largest };
    let (depth_limit, filled) = exit.fill(mode, largest, steady.depth, passed_s);
    ModeLimits {
        follows: follows(mode),
        depth_limit,
        steady_share: 1.0,
        filled,
        ripple_share: ripple_share(mode, steady.depth),
        settled: exit.is_settled(decision),
    }
}

/// The half that a command is made for.
pub(super) struct Wanted<'a> {
    /// Mode of the half where it begins to act.
    pub mode: Mode,
    /// `true` if it is for the half that is already committed: only the running one stands.
    pub revises: bool,
    /// Halves between the committed one and that half, as in [`Slot::between`](super::slot::Slot::between), and the command that they
    /// are made from.
    pub between: u32,
    pub before: &'a Reference,
}

/// The modulator's pulses from `now` until a command of this period can act.
#[inline(always)]
pub(super) fn committed(
    trail: &History<COMMITTAL_WORDS>,
    applied: Option<&Applied>,
    now: Instant,
    steady: &Steady,
    settings: &Settings,
    wanted: &Wanted,
) -> Committed {
    let Wanted { mode: decided, revises, between, before } = *wanted;
    let Settings { clock, devices, .. } = settings;
    let shortest_s = clock.seconds(devices.shortest_half_ticks as i32);
    let interval_s = match decided.carriers() {
        // A command acts for a control period at least.
        0 if shortest_s < clock.control_s => clock.control_s,
        0 => shortest_s,
        carriers => core::f32::consts::PI / (carriers as f32 * steady.omega.abs()),
    };
    let look = |applied: &Applied| {
        trail.read(applied.place, |records: [Record<COMMITTAL_WORDS>; 2]| {
            let [newest, one] = records.map(CommittalRecord);
            let off = one.kind().is_off() || applied.kind.is_off();
            let running = || one.volt_ticks_from(now.since(applied.at).max(0) as u32);
            let volt_ticks =
                (!off).then(|| if revises { running() } else { running() + newest.volt_ticks() });
            let left =
                applied.begins.since(now).max(0) as u32 + if revises { 0 } else { applied.period_ticks };
            let volt_seconds = volt_ticks.map(|ticks| ticks * (steady.udc_v * clock.tick_s));
            let gap = between * applied.period_ticks;
            let made = || before.vector_at(now.after(left + gap / 2)) * clock.seconds(gap as i32);
            Committed {
                horizon_s: clock.seconds((left + gap) as i32),
                volt_seconds: if gap == 0 { volt_seconds } else { volt_seconds.map(|known| known + made()) },
                ripple: applied.kind.ripple(decided, steady),
                interval_s,
            }
        })
    };
    let nothing = Committed { horizon_s: 0.0, volt_seconds: None, ripple: None, interval_s };
    applied.and_then(look).unwrap_or(nothing)
}

impl HalfKind {
    /// Ripple flux at the end of this half, which is committed, and what the half after it, of the mode `decided`, is to change of it.
    /// Where a pattern begins at the first of these, its own ripple is expected; where a carrier begins, what the old pattern leaves.
    fn ripple(self, decided: Mode, steady: &Steady) -> Option<Ripple> {
        let (mode, end) = (self.mode(), self.half() + 1);
        let after = self.next_but_one_mode();
        if decided.is_pattern() {
            let at_horizon_wb = self.ripple_at(decided, number(mode, decided, end), steady);
            return Some(Ripple { at_horizon_wb, led_wb: AlphaBeta::default() });
        }
        if decided.is_optimal() {
            // The pattern itself leads the flux along its own path, and what moves its edges to that of the next one.
            let half = number(mode, decided, end);
            let at_horizon_wb = self.ripple_at(decided, half, steady);
            let change = || {
                let own = self.ripple_at(decided, half + 1, steady);
                self.ripple_at(after, number(decided, after, half + 1), steady) - own
            };
            let led_wb = if after == decided { AlphaBeta::default() } else { change() };
            return Some(Ripple { at_horizon_wb, led_wb });
        }
        if !has_path(mode) && !has_path(after) {
            return None;
        }
        let at_horizon_wb = self.ripple_at(mode, end, steady);
        let after_wb = self.ripple_at(after, number(decided, after, number(mode, decided, end) + 1), steady);
        Some(Ripple { at_horizon_wb, led_wb: after_wb - at_horizon_wb })
    }

    /// A mode's ripple where half number `half` begins, seen in the mirror if the half is: nothing under a carrier.
    fn ripple_at(self, mode: Mode, half: u32, steady: &Steady) -> AlphaBeta {
        let omega = steady.omega.abs();
        let flux = RippleFlux::new(mode, steady.voltage_v, steady.udc_v, omega);
        let ripple = flux.map_or(AlphaBeta::default(), |flux| flux.at(half));
        #[cfg(feature = "optimal")]
        let ripple = optimal_ripple(mode, half, steady.voltage_v, steady.udc_v, omega).unwrap_or(ripple);
        AlphaBeta { beta: if self.is_mirrored() { -ripple.beta } else { ripple.beta }, ..ripple }
    }
}

/// `true` for a mode whose flux stands off its fundamental at the boundaries.
const fn has_path(mode: Mode) -> bool {
    mode.is_pattern() || mode.is_optimal()
}

/// The number of half `half` of a mode in the mode that follows.
fn number(from: Mode, to: Mode, half: u32) -> u32 {
    if from == to { half } else { first_half(from, to, half, Angle::ZERO) }
}

#[cfg(all(test, not(loom)))]
mod tests {
    use super::*;
    use crate::drive::messages::Committal;

    #[test]
    fn what_stood_at_an_instant_stands_whatever_the_pwm_interrupt_has_told_since() {
        const HALF_TICKS: u32 = 625;
        let history = History::new();
        let now = Instant(10 * HALF_TICKS + 1);
        for boundary in 0..=12 {
            history.publish(Committal::at_rest(Instant(boundary * HALF_TICKS), HALF_TICKS).to_words());
            let newest = boundary.min(10) * HALF_TICKS;
            assert_eq!(
                Applied::read(&history, now).map(|applied| applied.at),
                Some(Instant(newest)),
                "{boundary}"
            );
        }
    }
}
