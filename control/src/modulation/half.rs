//! One half of a carrier, and where it ends.

use super::Mode;
use crate::frames::Angle;

/// The pulse angle of boundary number `half` of `2 * carriers` halves a turn, rounded to the nearest angle unit.
pub(super) fn boundary(half: u32, carriers: u32) -> Angle {
    let halves = carriers.max(1) * 2;
    // 2³² = quotient · halves + rest, without numbers of 64 bits.
    let quotient = u32::MAX / halves;
    let rest = u32::MAX - quotient * halves + 1;
    Angle((half * quotient).wrapping_add((half * rest + halves / 2) / halves))
}

/// One interval between two PWM interrupts: one half of a carrier.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct CarrierHalf {
    /// Length, in ticks.
    pub period_ticks: u32,
    /// Instant after the start at which each phase's level toggles, in ticks; at or beyond `period_ticks`: never.
    pub compare_ticks: [u32; 3],
    /// Level at the start of each phase (true: upper device on). Without meaning in [`Mode::Off`].
    pub start_levels: [bool; 3],
    /// The mode that made it.
    pub mode: Mode,
    /// Number of the half within the turn, for locked modes (in the mirrored turn when turning backward); otherwise
    /// 0 for the rising and 1 for the falling carrier, and of the last two before an optimised pattern the number before that of the pattern's first.
    pub half: u8,
    /// Modes of the two halves that follow, as far as they are decided.
    pub ahead: [Mode; 2],
}

impl CarrierHalf {
    /// All gates off for this long.
    pub const fn off(period_ticks: u32) -> Self {
        Self {
            period_ticks,
            compare_ticks: [u32::MAX; 3],
            start_levels: [false; 3],
            mode: Mode::Off,
            half: 0,
            ahead: [Mode::Off; 2],
        }
    }

    /// `true` for a half of the free carrier that is followed by two more: its length depends on nothing.
    pub fn is_free(&self) -> bool {
        (self.mode, self.ahead) == (Mode::Async, [Mode::Async; 2])
    }

    /// Number of ticks for which each phase is at the upper level, from `from` ticks after the start to the end.
    pub fn on_ticks(&self, from: u32) -> [u32; 3] {
        let (mut on, end) = ([0; 3], self.period_ticks);
        let from = from.min(end);
        let phases = on.iter_mut().zip(self.compare_ticks).zip(self.start_levels);
        for ((ticks, compare), level) in phases {
            let toggle = compare.min(end).max(from);
            *ticks = if level { toggle - from } else { end - toggle };
        }
        on
    }

    /// The boundary's pulse angle at the end of this half, in the mirrored turn when turning backward; `None` for a
    /// carrier that is not locked.
    pub fn end_angle(&self) -> Option<Angle> {
        match self.mode.carriers() {
            0 => None,
            carriers => Some(boundary(u32::from(self.half) + 1, carriers)),
        }
    }
}
