//! The nine gates of a carrier period, as a timer plays them.

use super::Applied;
use super::shoot_through::LegEdges;

/// The gates' names, in the order of [`Period::gates`].
pub const GATES: [&str; 9] = ["UH", "VH", "WH", "UM", "VM", "WM", "UL", "VL", "WL"];

/// A gate in one carrier period. It is on except in one pause of the rising half, 0 ≤ `off_from` ≤ `off_to` ≤ 1/2, and
/// that pause's mirror image in the falling half, 1 − `off_to` … 1 − `off_from`.
///
/// For an up-down counter these are two compare values: the gate is off while it counts between them, either way. The end of a pause
/// at 0 or 1/2 is no edge: there the pause meets its mirror image.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct GatePattern {
    /// Beginning of the pause, in periods.
    pub off_from: f32,
    /// End of the pause, in periods; equal to its beginning if the gate is never off.
    pub off_to: f32,
}

impl GatePattern {
    /// `true` if the gate is on just after t = 0.
    pub fn starts_on(&self) -> bool {
        self.pause().is_none_or(|(from, _)| from > 0.0)
    }

    /// The toggles in the period, sorted, each at 0 < t < 1, in periods: none, two or four. On a grid of 2⁻²⁴, where the
    /// mirror image is exact.
    pub fn toggles(&self) -> impl Iterator<Item = f32> + use<> {
        let pause = self.pause();
        let from = pause.and_then(|(from, _)| (from > 0.0).then_some(from));
        let to = pause.and_then(|(_, to)| (to < 0.5).then_some(to));
        [from, to, to.map(|t| 1.0 - t), from.map(|t| 1.0 - t)].into_iter().flatten()
    }

    /// The pause on that grid, if the gate has one.
    fn pause(&self) -> Option<(f32, f32)> {
        let grid = |instant: f32| (instant + 0.5) - 0.5;
        let (from, to) = (grid(self.off_from), grid(self.off_to));
        (from < to).then_some((from, to))
    }

    /// The pause in ticks of a carrier half with `half_ticks` (1 ..= 2²²), each end to the nearest. Rounding keeps the order, and ends at
    /// the same instant stay together: legal legs stay legal.
    #[inline]
    pub fn ticks(&self, half_ticks: u32) -> GateTicks {
        let scale = 2.0 * half_ticks as f32;
        let round = |instant: f32| (instant * scale + 0.5) as u32;
        GateTicks { off_from: round(self.off_from), off_to: round(self.off_to) }
    }
}

/// A gate's pause in ticks since the half's beginning; see [`GatePattern`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct GateTicks {
    /// Beginning of the pause.
    pub off_from: u32,
    /// End of the pause; equal to its beginning if the gate is never off.
    pub off_to: u32,
}

impl GateTicks {
    /// `true` if the gate is on in the tick that begins `tick` ticks after the rising half.
    #[inline]
    pub const fn is_on(&self, tick: u32) -> bool {
        tick < self.off_from || tick >= self.off_to
    }
}

/// The gates of one carrier period and the resulting voltages.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub struct Period {
    /// The gates in the order of [`GATES`].
    pub gates: [GatePattern; 9],
    /// The voltages that the motors get.
    pub applied: Applied,
}

impl Period {
    /// The period from the edges of the legs U, V, W.
    #[inline]
    pub(super) fn new(upper: [LegEdges; 3], lower: [LegEdges; 3], applied: Applied) -> Self {
        let high = |upper: LegEdges| GatePattern { off_from: upper.own, off_to: upper.again };
        let low = |lower: LegEdges| GatePattern { off_from: lower.again, off_to: lower.own };
        let middle =
            |lower: LegEdges, upper: LegEdges| GatePattern { off_from: lower.middle, off_to: upper.middle };
        let ([uu, uv, uw], [lu, lv, lw]) = (upper, lower);
        Self {
            gates: [
                high(uu),
                high(uv),
                high(uw),
                middle(lu, uu),
                middle(lv, uv),
                middle(lw, uw),
                low(lu),
                low(lv),
                low(lw),
            ],
            applied,
        }
    }

    /// Every gate's pause, in the order of [`GATES`], in ticks of a carrier half with `half_ticks` (1 ..= 2²²); see
    /// [`GatePattern::ticks`].
    #[inline]
    pub fn ticks(&self, half_ticks: u32) -> [GateTicks; 9] {
        self.gates.map(|gate| gate.ticks(half_ticks))
    }
}
