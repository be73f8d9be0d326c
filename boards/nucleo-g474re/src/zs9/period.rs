//! A carrier period in the form that the timers' shadow registers take.
//!
//! The counter is 0 at the valley and [`HALF_CYCLES`] at the peak, and the way down is the mirror image of the way up. Of a leg's gates H is off
//! around the peak, L around the valley, and M in between: four compares.
//!
//! | gate | on while the counter is | compares |
//! |---|---|---|
//! | H | below `high` | 1 |
//! | L | at `low` or beyond | 2 |
//! | M | below `middle_from`, or at `middle_to` or beyond | 3, 4 |

use super::HALF_CYCLES;
use tractive::drive::dual::COMPARE_STEPS;
use tractive::nine_switch::GateTicks;
use tractive::ports::PlayedPeriod;

/// The compares of a leg, in cycles since the valley, 0 ..= [`HALF_CYCLES`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LegCompares {
    /// H is on below this count.
    pub high: u16,
    /// L is on from this count on.
    pub low: u16,
    /// M is on below this count.
    pub middle_from: u16,
    /// M is on from this count on.
    pub middle_to: u16,
}

impl LegCompares {
    /// All three gates off.
    pub const OFF: Self = Self { high: 0, low: HALF_CYCLES, middle_from: 0, middle_to: HALF_CYCLES };
}

/// The register values of a period.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PeriodCompares {
    /// The legs U, V, W.
    pub legs: [LegCompares; 3],
}

impl PeriodCompares {
    /// All nine gates off.
    pub const OFF: Self = Self { legs: [LegCompares::OFF; 3] };

    /// Made of the modulator's period. `None` if an H is on again before the peak, or an L at the valley: only the scheme with its shoot-through in
    /// the centres of V14 and V15 has that, and these timers have no compares for it. The timers enforce the wait between gates of a leg,
    /// `dead_cycles`; here only a shoot-through that is no longer than that is removed.
    #[inline]
    pub fn new(period: &PlayedPeriod, dead_cycles: u16) -> Option<Self> {
        let [uh, vh, wh, um, vm, wm, ul, vl, wl] = &period.gates;
        let leg = |high, middle, low| leg(high, middle, low, dead_cycles);
        Some(Self { legs: [leg(uh, um, ul)?, leg(vh, vm, vl)?, leg(wh, wm, wl)?] })
    }
}

#[inline]
fn leg(high: &GateTicks, middle: &GateTicks, low: &GateTicks, dead_cycles: u16) -> Option<LegCompares> {
    let [high_from, high_to] = cycles(high);
    let [mut middle_from, mut middle_to] = cycles(middle);
    let [low_from, low_to] = cycles(low);
    let (high_pauses, low_pauses) = (high.off_from < high.off_to, low.off_from < low.off_to);
    if (high_pauses && high_to != HALF_CYCLES) || (low_pauses && low_from != 0) {
        return None;
    }
    let mut high = if high_pauses { high_from } else { HALF_CYCLES };
    let mut low = if low_pauses { low_to } else { 0 };
    // A pause that rounding would swallow becomes one cycle: the gate is expected to be seen off. Its neighbours make room.
    if high_pauses && high == HALF_CYCLES {
        high = HALF_CYCLES - 1;
        middle_to = middle_to.min(high);
    }
    if low_pauses && low == 0 {
        low = 1;
        middle_from = middle_from.max(low);
    }
    if middle.off_from < middle.off_to && middle_from >= middle_to {
        middle_from = middle_from.min(HALF_CYCLES - 1);
        middle_to = middle_from + 1;
        low = low.min(middle_from);
        high = high.max(middle_to);
    }
    // If the dead time would use up a shoot-through, all of its time is left to the dead time.
    if middle_from >= middle_to {
        if (1..=dead_cycles).contains(&high.saturating_sub(low)) {
            high = low;
        }
    } else {
        if (1..=dead_cycles).contains(&high.saturating_sub(middle_to)) {
            middle_to = high;
        }
        if (1..=dead_cycles).contains(&middle_from.saturating_sub(low)) {
            middle_from = low;
        }
    }
    Some(LegCompares { high, low, middle_from, middle_to })
}

/// Both ends of a pause, each rounded to the nearest cycle. Rounding keeps the order, and simultaneous instants stay so.
#[inline]
fn cycles(gate: &GateTicks) -> [u16; 2] {
    let nearest = |steps: u32| {
        let cycles = (steps * super::CYCLES_PER_TICK + COMPARE_STEPS / 2) / COMPARE_STEPS;
        (if cycles < HALF_CYCLES as u32 { cycles } else { HALF_CYCLES as u32 }) as u16
    };
    [nearest(gate.off_from), nearest(gate.off_to)]
}
