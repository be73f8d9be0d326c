//! The boundary that uses the command of a control period, and so the purpose of the period.

use super::pulses::{Half, Pulses};
use crate::modulation::Mode;
use crate::time::{Clock, Instant};

/// Control periods within which an operating point serves another boundary: shorter halves make an operating point for every second of them, as often
/// as the free carrier's do.
const SERVES_PERIODS: u32 = 3;

/// The same after a single half of less than two periods, which leaves no period for an operating point: longer by such a half.
const LATE_SERVES_PERIODS: u32 = SERVES_PERIODS + 2;

/// The decision at a boundary: the mode of the half that begins at the boundary after it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Decision {
    pub boundary: Instant,
    pub mode: Mode,
    /// The mode of the half before it.
    pub before: Mode,
    /// The mode of the half after it, as far as it is decided.
    pub after: Mode,
}

impl Decision {
    /// `true` for a pattern's first half after another pattern.
    pub const fn joins(&self) -> bool {
        self.before.is_pattern() && self.mode.is_pattern() && self.before as u8 != self.mode as u8
    }

    /// `true` for a pattern's last half before another, which leads to that one's operating point; always for an optimised pattern. A pattern of
    /// whole edges that gives way to more carriers leaves the transition to them: otherwise its zero vector would last so much longer, and at a third
    /// to half of the torque and 1,800 V this would take 45 N·m beyond its ripple.
    pub const fn leads(&self) -> bool {
        let Self { mode, after, .. } = self;
        let of_edges = mode.is_pattern() && after.is_pattern() && after.carriers() < mode.carriers();
        of_edges || mode.is_optimal() && after.is_optimal() && *after as u8 != *mode as u8
    }

    /// `true` if an operating point for one serves the other, too: one of the same boundary and mode, or one of an earlier boundary less than
    /// [`SERVES_PERIODS`] away, or [`LATE_SERVES_PERIODS`] if nothing newer could be made.
    pub fn serves(&self, other: &Self, clock: &Clock, nothing_newer: bool) -> bool {
        let away = other.boundary.since(self.boundary) as u32;
        let periods = if nothing_newer { LATE_SERVES_PERIODS } else { SERVES_PERIODS };
        self.mode == other.mode && away < periods * clock.control_ticks
    }
}

/// The work of a control period. A boundary uses the last command that is valid by then and none of those before it. So each command is made once, in
/// the period before it is used, and its operating point one period earlier. If a carrier half is shorter than two periods, both are made in one
/// period.
pub(super) struct Slot {
    /// The period's nominal instant.
    pub now: Instant,
    pub key: Decision,
    /// `true` if the boundary uses the command of this period.
    pub commands: bool,
    /// `true` if the boundary uses the command of the next period.
    pub aims: bool,
    /// `true` if halves last less than two periods, so that no period is left between the operating point and the command; not set for a single short
    /// half, as when a pattern catches up with its angle.
    pub folds: bool,
}

impl Slot {
    /// The work of the period that begins at `now`. While nothing is known of the modulator each period may be the last.
    #[inline(always)]
    pub(super) fn of(pulses: &Pulses, now: Instant, clock: &Clock) -> Self {
        let Some(last) = pulses.last() else {
            let key = Decision { boundary: now, mode: Mode::Off, before: Mode::Off, after: Mode::Off };
            return Self { now, key, commands: true, aims: false, folds: false };
        };
        let [mode, after] = last.half.ahead;
        let left = last.begins.since(now) - clock.control_ticks as i32;
        let commands = left < clock.control_ticks as i32;
        let is_short = |half: &Half| half.half.period_ticks < 2 * clock.control_ticks;
        Self {
            now,
            key: Decision { boundary: last.begins, mode, before: last.half.mode, after },
            commands,
            aims: !commands && left < 2 * clock.control_ticks as i32,
            folds: is_short(last) && (pulses.unloaded() > 0 || is_short(pulses.before(1))),
        }
    }

    /// Ticks from the boundary that uses the command, this period's or the next one's, until the following command is valid; zero or negative if that
    /// boundary comes later.
    #[inline(always)]
    pub(super) fn used_ticks(&self, clock: &Clock) -> i32 {
        let periods = if self.commands { 2 } else { 3 };
        self.now.after(periods * clock.control_ticks).since(self.key.boundary)
    }
}

#[cfg(all(test, not(loom)))]
mod tests {
    use super::super::Settings;
    use super::super::pulses::{Order, Planned};
    use super::*;
    use crate::cell::History;
    use crate::drive::messages::Loaded;
    use crate::frames::{Abc, Angle};
    use crate::modulation::{Reference, Schedule, SwitchLimits};

    /// Number of periods out of two hundred that have both, for a free carrier of such halves, this long after a control period.
    fn folded(half_ticks: u32, phase_ticks: u32) -> usize {
        let clock = Clock::new(25_000_000, 2_500);
        let devices =
            SwitchLimits { shortest_half_ticks: half_ticks, ..SwitchLimits::new(250, 0, 900.0, &clock) };
        let schedule = Schedule::fixed(Mode::Async, &clock);
        let mut pulses = Pulses::new(&Settings::new(clock, devices), schedule);
        let (history, planned) = (History::new(), Planned::new());
        let mut at = Instant(half_ticks + phase_ticks);
        let periods = (1..=200).filter(|period| {
            let now = Instant(period * 2_500);
            while now.reached(at) {
                let begins = at.after(half_ticks);
                let loaded = Loaded { at, begins, currents_a: Abc::default(), tripped: false, released: 0 };
                history.publish(loaded.to_words());
                at = begins;
            }
            pulses.look(&history, now, now.after(2_500));
            let slot = Slot::of(&pulses, now, &clock);
            let reference = Reference::turning(100.0, Angle::ZERO, 1_000.0, now, 1_500.0);
            let until = now.after(2 * 2_500);
            if pulses.lack(until) {
                pulses.plan(until, &Order { pulses: true, reference: &reference, release: 0 }, &planned);
            }
            slot.folds
        });
        periods.count()
    }

    /// From two periods on there is one for each.
    #[test]
    fn slices_fold_where_a_half_is_shorter_than_two_periods() {
        assert!(folded(4_999, 1_250) > 80 && folded(2_000, 1_250) > 150);
        assert_eq!([5_000, 5_001, 13_889].map(|half_ticks| folded(half_ticks, 1_250)), [0; 3]);
        // If boundaries coincide with control's own periods, every planned half is loaded.
        assert!(folded(2_500, 0) > 150, "{}", folded(2_500, 0));
    }

    /// Patterns meet; a carrier is led to and left by other laws.
    #[test]
    fn one_pattern_leads_to_the_one_of_fewer_carriers() {
        use Mode::{Mid3, Mid7, Off, Square, Sync12};
        for (before, mode, after, joins, leads) in [
            (Mid7, Mid7, Mid7, false, false),
            (Mid7, Mid7, Mid3, false, true),
            (Mid7, Mid3, Mid3, true, false),
            (Mid3, Mid3, Mid7, false, false),
            (Mid3, Mid7, Mid7, true, false),
            (Mid3, Mid3, Square, false, false),
            (Mid3, Square, Square, true, false),
            (Mid7, Mid7, Sync12, false, false),
            (Mid7, Sync12, Sync12, false, false),
            (Sync12, Mid7, Mid7, false, false),
            (Sync12, Sync12, Mid7, false, false),
            (Off, Mid3, Mid3, false, false),
            (Mid3, Mid3, Off, false, false),
        ] {
            let decision = Decision { boundary: Instant(0), before, mode, after };
            assert_eq!((decision.joins(), decision.leads()), (joins, leads), "{before:?} {mode:?} {after:?}");
        }
    }

    /// An operating point serves its own boundary and those of the same mode that come less than three periods after it, also when instants wrap, but
    /// no earlier boundary.
    #[test]
    fn an_operating_point_serves_its_mode_for_less_than_three_periods() {
        let clock = Clock::new(25_000_000, 2_500);
        let at = |instant: u32, mode| Decision {
            boundary: Instant(instant),
            mode,
            before: mode,
            after: Mode::Mid3,
        };
        for first in [0, 1_000_000, u32::MAX - 3_000] {
            for (away, serves) in [
                (0, true),
                (7_499, true),
                (7_500, false),
                (12_499, false),
                (12_500, false),
                (u32::MAX, false),
            ] {
                let aimed = at(first, Mode::Mid7);
                let later = at(first.wrapping_add(away), Mode::Mid7);
                assert_eq!(aimed.serves(&later, &clock, false), serves, "{first} {away}");
                assert_eq!(aimed.serves(&later, &clock, true), away < 12_500, "{first} {away}");
                for nothing_newer in [false, true] {
                    let another = Decision { mode: Mode::Mid3, ..later };
                    assert!(!aimed.serves(&another, &clock, nothing_newer), "{first} {away}");
                }
            }
        }
    }
}
