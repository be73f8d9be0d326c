//! A carrier period as the timers' shadow registers take it.
//!
//! The counter is 0 at the valley and [`HALF_CYCLES`] at the peak, and the way down is the mirror image of the way up. Of a
//! leg's gates H is off around the peak, L around the valley, M in between: four compares.
//!
//! | gate | on while the counter is | compares |
//! |---|---|---|
//! | H | below `high` | 1 |
//! | L | at `low` or beyond | 2 |
//! | M | below `middle_from`, or at `middle_to` or beyond | 3, 4 |

use super::HALF_CYCLES;
use crate::board::PlayedPeriod;
use crate::drive::dual::COMPARE_STEPS;
use crate::nine_switch::GateTicks;

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

/// What is written for a period.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PeriodCompares {
    /// The legs U, V, W.
    pub legs: [LegCompares; 3],
}

impl PeriodCompares {
    /// All nine gates off.
    pub const OFF: Self = Self { legs: [LegCompares::OFF; 3] };

    /// From the modulator's period. `None` where an H is on again before the peak, or an L at the valley: as only the scheme
    /// with its shoot-through in the centres of V14 and V15 has it; these timers have no compares for that.
    #[inline]
    pub fn new(period: &PlayedPeriod) -> Option<Self> {
        let [uh, vh, wh, um, vm, wm, ul, vl, wl] = &period.gates;
        Some(Self { legs: [leg(uh, um, ul)?, leg(vh, vm, vl)?, leg(wh, wm, wl)?] })
    }
}

#[inline]
fn leg(high: &GateTicks, middle: &GateTicks, low: &GateTicks) -> Option<LegCompares> {
    let [high_from, high_to] = cycles(high);
    let [middle_from, middle_to] = cycles(middle);
    let [low_from, low_to] = cycles(low);
    // Never off: the pause is empty, wherever it lies.
    let high = if high_from == high_to { HALF_CYCLES } else { high_from };
    let low = if low_from == low_to { 0 } else { low_to };
    let playable = (high == HALF_CYCLES || high_to == HALF_CYCLES) && (low == 0 || low_from == 0);
    playable.then_some(LegCompares { high, low, middle_from, middle_to })
}

/// Both ends of a pause, each to the nearest cycle. Rounding keeps order, and what was at the same instant stays so.
#[inline]
fn cycles(gate: &GateTicks) -> [u16; 2] {
    let nearest = |steps: u32| {
        let cycles = (steps * super::CYCLES_PER_TICK + COMPARE_STEPS / 2) / COMPARE_STEPS;
        (if cycles < HALF_CYCLES as u32 { cycles } else { HALF_CYCLES as u32 }) as u16
    };
    [nearest(gate.off_from), nearest(gate.off_to)]
}
