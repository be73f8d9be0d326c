//! The boundary that uses the command of a control period, and so the purpose of the period.

use super::pulses::Half;
use crate::modulation::Mode;
use crate::time::{Clock, Instant};

/// Halves between, where a carrier lasts a control period.
const MOST_BETWEEN: u32 = 2;

/// Control periods within which an operating point serves another boundary: halves shorter than that make one for every second of them, as often as the
/// free carrier's do.
const SERVES_PERIODS: u32 = 3;

/// The decision of a boundary: the mode of the half that begins at the one after it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Decision {
    pub boundary: Instant,
    pub mode: Mode,
    /// The mode of the half after that, as far as it is decided.
    pub after: Mode,
}

impl Decision {
    /// `true` if an operating point for one serves the other, too: that of the same boundary and mode, and that of one before which is less than
    /// [`SERVES_PERIODS`] away.
    pub fn serves(&self, other: &Self, clock: &Clock) -> bool {
        let away = other.boundary.since(self.boundary) as u32;
        self.mode == other.mode && away < SERVES_PERIODS * clock.control_ticks
    }
}

/// The work of a control period. A boundary uses the last command that is valid by then, and of those before it nothing: so each
/// command is made once, in the period before it is used, and its operating point one period earlier. Where a carrier half is shorter
/// than two periods, both are made in one.
pub(super) struct Slot {
    /// Its nominal instant.
    pub now: Instant,
    pub key: Decision,
    /// `true` if the boundary uses the command of this period.
    pub commands: bool,
    /// `true` if it uses that of the next one.
    pub aims: bool,
    /// Halves of a triangular carrier between the one that is committed already and the first of this command: those of the command before.
    pub between: u32,
}

impl Slot {
    /// The period that begins at `now`. While nothing is known of the modulator each one may be the last.
    #[inline]
    pub(super) fn of(newest: Option<&Half>, now: Instant, clock: &Clock) -> Self {
        let Some(newest) = newest else {
            let key = Decision { boundary: now, mode: Mode::Off, after: Mode::Off };
            return Self { now, key, commands: true, aims: false, between: 0 };
        };
        let period = clock.control_ticks;
        let valid = now.after(period);
        let later = |halves| newest.begins.after(halves * newest.half.period_ticks);
        let [next, next_but_one] = newest.half.ahead;
        let rest = later(0).since(valid);
        if rest >= 2 * period as i32 {
            // Most periods of a long half.
            let key = Decision { boundary: newest.begins, mode: next, after: next_but_one };
            return Self { now, key, commands: false, aims: false, between: 0 };
        }
        let halves = if rest >= 0 {
            0
        } else if later(1).reached(valid) {
            1
        } else {
            MOST_BETWEEN
        };
        let left = later(halves).since(valid);
        let commands = left < period as i32;
        // A pattern's half of less than two periods, which is rare, counts as if this command were in time for the next boundary.
        let between = if commands && !newest.half.is_carried() { 0 } else { halves };
        let mode = if between == 0 { next } else { next_but_one };
        Self {
            now,
            key: Decision { boundary: later(between), mode, after: next_but_one },
            commands,
            aims: !commands && left < 2 * period as i32,
            between,
        }
    }
}

#[cfg(all(test, not(loom)))]
mod tests {
    use super::*;

    /// An operating point serves its own boundary and those of the same mode that come less than three periods after it, also where instants wrap; none that
    /// came before.
    #[test]
    fn an_operating_point_serves_its_mode_for_less_than_three_periods() {
        let clock = Clock::new(25_000_000, 2_500);
        let at = |instant: u32, mode| Decision { boundary: Instant(instant), mode, after: Mode::Mid3 };
        for first in [0, 1_000_000, u32::MAX - 3_000] {
            for (away, serves) in
                [(0, true), (7_499, true), (7_500, false), (1 << 31, false), (u32::MAX, false)]
            {
                let aimed = at(first, Mode::Mid7);
                let later = at(first.wrapping_add(away), Mode::Mid7);
                assert_eq!(aimed.serves(&later, &clock), serves, "{first} {away}");
                assert!(!aimed.serves(&Decision { mode: Mode::Mid3, ..later }, &clock), "{first} {away}");
            }
        }
    }
}
