//! The modulator's work, as it is told to the control law.

use super::Settings;
use super::pulses::{Half, MOST_PLANNED, Pulses};
use super::six_step_exit::SixStepExit;
use super::slot::Decision;
use crate::control::{Boundary, Committed, ModeLimits, Regulated};
use crate::frames::{AlphaBeta, Angle};
use crate::modulation::{
    Mode, Regulation, first_half, index_ceiling, index_floor, index_limit, ripple_at, ripple_share,
    ripple_squares,
};
use crate::time::{Clock, Instant};

/// Share of a mode's largest fundamental that the operating point may use if the voltage must also regulate.
const REGULATION_ROOM: f32 = 0.999;

/// The voltage at the instant of a control interrupt, with the quantities that it is made for.
pub(super) struct Steady {
    /// Electrical angular speed, in rad/s.
    pub omega: f32,
    /// Link voltage, in V.
    pub udc_v: f32,
    /// The fundamental of the last operating point, in V.
    pub voltage_v: f32,
}

/// The volt-seconds of the halves that ended from the last boundary that was `used` until the newest one, and their duration, for a link of this
/// voltage and currents that are late by this many ticks.
#[inline(always)]
pub(super) fn passed(
    pulses: &Pulses,
    used: Option<Instant>,
    (udc_v, late): (f32, u32),
    clock: &Clock,
) -> Boundary {
    let newest = pulses.before(0).at;
    let unknown =
        || Boundary { volt_seconds: None, length_s: clock.seconds(newest.since(pulses.before(1).at)) };
    let Some(used) = used else { return unknown() };
    let mut volt_ticks = AlphaBeta::default();
    for boundaries in 1..=MOST_PLANNED {
        let ended = pulses.before(boundaries + 1);
        if ended.is_off() {
            break;
        }
        volt_ticks = volt_ticks + ended.volt_ticks;
        if pulses.before(boundaries).at == used {
            if late != 0 {
                // The currents are late: from as long before the beginning until as long before the end.
                let [earlier, last] =
                    [boundaries + 2, 2].map(|half| pulses.before(half).last_volt_ticks(late));
                volt_ticks = volt_ticks + earlier - last;
            }
            let volt_seconds = Some(volt_ticks * (udc_v * clock.tick_s));
            return Boundary { volt_seconds, length_s: clock.seconds(newest.since(used)) };
        }
    }
    unknown()
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

/// The limits before the first operating point.
pub(super) const NO_LIMITS: ModeLimits = ModeLimits { ripple_share: 1.0, ..ModeLimits::carrier(0.0) };

/// The limits that a decided mode sets to control at a speed, for the modulation index of the last operating point, made so long ago, in s.
pub(super) fn limits(
    decision: &Decision,
    (omega, modulation_index): (f32, f32),
    exit: &mut SixStepExit,
    settings: &Settings,
    passed_s: f32,
) -> ModeLimits {
    let Settings { clock, devices, .. } = settings;
    let mode = decision.mode;
    let follows = follows(mode);
    let rate = clock.angle_rate(omega);
    let largest = index_limit(mode, rate, devices);
    // With an optimised pattern, edges can move at its largest index, too.
    let is_all = !matches!(follows, Regulated::Mean | Regulated::Fundamental);
    let largest = if is_all { largest } else { REGULATION_ROOM * largest };
    // The half that leads to another pattern leads to the operating point that the torque's trim asks for there.
    let trimmed = if decision.leads() { decision.after } else { mode };
    let (index_limit, filled) =
        exit.fill(mode, [index_floor(rate, devices), largest], modulation_index, passed_s);
    ModeLimits {
        follows,
        index_limit,
        steady_limit: exit.open(follows, [index_ceiling(rate, devices), index_limit], passed_s),
        filled,
        ripple_share: if aliases(mode, settings) { 0.0 } else { ripple_share(trimmed, modulation_index) },
        ripple_s2: Some(ripple_squares(
            trimmed,
            modulation_index,
            omega.abs(),
            clock.seconds(devices.shortest_half_ticks as i32),
        )),
        settled: exit.is_settled(decision),
        joins: decision.joins(),
    }
}

/// Samples per carrier below which they may alias: if their number is whole, each sample always sees the same part of the ripple, or
/// drifts through it slowly.
const FEW_SAMPLES: u32 = 11;

/// `true` for a triangular carrier so fast that the mean torque of the samples may differ from the carrier's.
const fn aliases(mode: Mode, settings: &Settings) -> bool {
    let Settings { devices, clock, .. } = settings;
    mode.is_carrier() && 2 * devices.shortest_half_ticks < FEW_SAMPLES * clock.control_ticks
}

/// The change of the link voltage that is expected after the sample of a command, in V.
#[derive(Clone, Copy)]
pub(super) struct Ahead {
    /// In the middle of the halves that are committed.
    pub committed_v: f32,
    /// In the middle of the half that the command is for.
    pub next_v: f32,
}

impl Ahead {
    /// A link whose voltage stays constant.
    pub const NONE: Self = Self { committed_v: 0.0, next_v: 0.0 };
}

/// The half that a command is made for.
pub(super) struct Wanted {
    /// Mode of the half where it begins to act.
    pub mode: Mode,
    /// `true` if it is for the half that is already committed, so that only the running half is fixed.
    pub revises: bool,
    /// Mean link voltage until that half, in V.
    pub udc_v: f32,
    /// Expected time for which the command acts, in s.
    pub interval_s: f32,
}

/// Expected time for which a command of a mode acts, in s: that of the half that begins at its boundary, and of those whose boundaries come before a
/// newer command is valid, `used_ticks` after the first. Control periods are not whole multiples of halves: with halves of 0.83 of a period, a
/// command makes one or two.
#[inline(always)]
pub(super) fn interval_s(mode: Mode, omega: f32, used_ticks: i32, settings: &Settings) -> f32 {
    let Settings { clock, devices, .. } = settings;
    let shortest_s = clock.seconds(devices.shortest_half_ticks as i32);
    let half_s = match mode.carriers() {
        0 => shortest_s,
        carriers => core::f32::consts::PI / (carriers as f32 * omega.abs()),
    };
    // The time without a newer command is a control period at most.
    if half_s >= clock.control_s {
        return half_s;
    }
    // A boundary at the end of that time already uses the newer command.
    let more = clock.seconds(used_ticks - 1) / half_s;
    half_s * (1.0 + (more as u32) as f32)
}

/// The modulator's pulses from `now`, the instant of the currents, until a command of this period can act.
#[inline(always)]
pub(super) fn committed(
    pulses: &Pulses,
    now: Instant,
    steady: &Steady,
    clock: &Clock,
    wanted: &Wanted,
) -> Committed {
    let Wanted { mode: decided, revises, udc_v, interval_s } = *wanted;
    let (Some(newest), Some(last)) = (pulses.newest(), pulses.last()) else {
        return Committed { horizon_s: 0.0, volt_seconds: None, ripple_wb: None, interval_s };
    };
    let running = pulses.before(1);
    let elapsed = now.since(newest.at).max(0) as u32;
    // For currents from before the newest boundary.
    let before = newest.at.since(now).max(0) as u32;
    let rest = || {
        let rest = running.volt_ticks_from(elapsed);
        if before == 0 { rest } else { rest + pulses.before(2).last_volt_ticks(before) }
    };
    let until = if revises { newest.begins } else { last.ends() };
    let volt_ticks = if newest.is_off() || running.is_off() {
        None
    } else if revises {
        Some(rest())
    } else {
        pulses.unloaded_volt_ticks().map(|planned| rest() + newest.volt_ticks + planned)
    };
    Committed {
        horizon_s: clock.seconds(until.since(now).max(0)),
        volt_seconds: volt_ticks.map(|ticks| ticks * (udc_v * clock.tick_s)),
        ripple_wb: last.ripple_wb(decided, steady),
        interval_s,
    }
}

impl Half {
    /// Ripple flux at the end of this half, which is committed and followed by one of the mode `decided`: what an old pattern leaves to a carrier, or
    /// that of a pattern that begins there.
    fn ripple_wb(&self, decided: Mode, steady: &Steady) -> Option<AlphaBeta> {
        let (mode, end) = (self.half.mode, u32::from(self.half.half) + 1);
        if decided.has_path() {
            return Some(self.ripple_at(decided, number(mode, decided, end), steady));
        }
        mode.has_path().then(|| self.ripple_at(mode, end, steady))
    }

    /// A mode's ripple at the beginning of half number `half`, mirrored if the half is; none under a carrier.
    fn ripple_at(&self, mode: Mode, half: u32, steady: &Steady) -> AlphaBeta {
        let ripple = ripple_at(mode, half, steady.voltage_v, steady.udc_v, steady.omega.abs());
        AlphaBeta { beta: if self.mirrored { -ripple.beta } else { ripple.beta }, ..ripple }
    }
}

/// The number that half `half` of a mode has in the mode that follows.
fn number(from: Mode, to: Mode, half: u32) -> u32 {
    if from == to || from == Mode::Async && to.is_optimal() {
        half
    } else {
        first_half(from, to, half, Angle::ZERO)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::modulation::{CarrierHalf, SwitchLimits};
    use crate::time::Clock;

    #[test]
    fn a_carrier_of_fewer_than_eleven_samples_aliases() {
        let clock = Clock::new(25_000_000, 2_500);
        let of = |mode: Mode, switching_hz: f32| {
            aliases(mode, &Settings::new(clock, SwitchLimits::new(250, 0, switching_hz, &clock)))
        };
        for (switching_hz, does) in [(900.0, false), (909.0, false), (910.0, true), (10_000.0, true)] {
            assert_eq!(of(Mode::Async, switching_hz), does, "{switching_hz} Hz");
        }
        assert!(of(Mode::Sync15, 10_000.0) && !of(Mode::Sync15, 900.0));
        assert!(!of(Mode::Mid7, 10_000.0), "its ripple is known");
        let limits = SwitchLimits::new(250, 0, 900.0, &clock);
        let half = |shortest_half_ticks| Settings::new(clock, SwitchLimits { shortest_half_ticks, ..limits });
        assert!(
            aliases(Mode::Async, &half(13_749)) && !aliases(Mode::Async, &half(13_750)),
            "eleven are enough"
        );
    }

    /// A command acts for each half whose boundary comes before the next command is valid; at that instant the next one already acts.
    #[test]
    fn a_command_acts_for_the_halves_that_use_it() {
        let clock = Clock::new(25_000_000, 2_500);
        let devices = SwitchLimits::new(250, 0, 900.0, &clock);
        let halves = |half_ticks: u32, used_ticks: i32| {
            let devices = SwitchLimits { shortest_half_ticks: half_ticks, ..devices };
            let settings = Settings::new(clock, devices);
            let acts_s = interval_s(Mode::Async, 100.0, used_ticks, &settings);
            (acts_s / clock.seconds(half_ticks as i32)).round() as u32
        };
        for (half_ticks, used_ticks, are) in [
            (2_083, 2_500, 2),
            (2_083, 2_084, 2),
            (2_083, 2_083, 1),
            (1_250, 2_500, 2),
            (1_250, 2_501, 3),
            (833, 2_500, 4),
            (2_500, 2_500, 1),
            (13_889, 2_500, 1),
            (13_889, 0, 1),
            (13_889, -30_000, 1),
        ] {
            assert_eq!(halves(half_ticks, used_ticks), are, "{half_ticks} {used_ticks}");
        }
    }

    /// A pattern's ripple in a machine that turns backward is the mirrored ripple of one that turns forward.
    #[test]
    fn a_ripple_in_the_mirror_is_upside_down() {
        let steady = Steady { omega: 900.0, udc_v: 1_500.0, voltage_v: 800.0 };
        let half = |mirrored| Half {
            at: Instant(0),
            begins: Instant(1),
            half: CarrierHalf::off(1),
            mirrored,
            volt_ticks: AlphaBeta::default(),
        };
        for number in [1, 2, 4, 5] {
            let [forward, backward] =
                [false, true].map(|mirrored| half(mirrored).ripple_at(Mode::Mid3, number, &steady));
            assert_eq!((backward.alpha, backward.beta), (forward.alpha, -forward.beta), "{number}");
            assert!(forward.beta.abs() > 0.01, "{number}: {forward:?}");
        }
    }
}
