//! The boundary that uses the command of a control period, and so the purpose of the period.

use super::pulses::Half;
use crate::modulation::Mode;
use crate::time::{Clock, Instant};

/// Halves between, where a carrier lasts a control period.
const MOST_BETWEEN: u32 = 2;

/// The decision of a boundary: the mode of the half that begins at the one after it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Decision {
    pub boundary: Instant,
    pub mode: Mode,
    /// The mode of the half after that, as far as it is decided.
    pub after: Mode,
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
    /// Halves of a free carrier between the one that is committed already and the first of this command: those of the command before.
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
        let between = if commands && !newest.half.is_free() { 0 } else { halves };
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
