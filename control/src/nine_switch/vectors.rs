//! Legs and their states, and the phases of a voltage vector.
//!
//! V1 ..= V6 = (1 0 0) (1 1 0) (0 1 0) (0 1 1) (0 0 1) (1 0 1) give the upper motor (2/3) U_in at 0°, 60° … 300°, the lower
//! one nothing; V7 ..= V12 = (−1 1 1) (−1 −1 1) (1 −1 1) (1 −1 −1) (1 1 −1) (−1 1 −1) the other way round; V13 = (1 1 1),
//! V14 = (0 0 0) and V15 = (−1 −1 −1) are zero for both.

use crate::frames::Angle;

/// The state of a leg's two nodes that its three switches make.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum LegState {
    /// 1: H and L on. Upper node at P, lower node at N.
    One,
    /// 0: M and L on. Both nodes at N.
    Zero,
    /// −1: H and M on. Both nodes at P.
    MinusOne,
    /// All three on: the link is shorted.
    ShootThrough,
}

impl LegState {
    /// The state with these gates on; `None` for all others, which leave a node without potential.
    pub const fn of_gates(high: bool, middle: bool, low: bool) -> Option<Self> {
        match (high, middle, low) {
            (true, false, true) => Some(Self::One),
            (false, true, true) => Some(Self::Zero),
            (true, true, false) => Some(Self::MinusOne),
            (true, true, true) => Some(Self::ShootThrough),
            _ => None,
        }
    }

    /// Potentials of the upper and lower node as shares of the link voltage, above N; zero while the link is shorted.
    pub const fn nodes(self) -> (f32, f32) {
        match self {
            Self::One => (1.0, 0.0),
            Self::Zero | Self::ShootThrough => (0.0, 0.0),
            Self::MinusOne => (1.0, 1.0),
        }
    }
}

/// A voltage vector's direction: its sector, and the dwell times in it at modulation index 1.
///
/// With a the angle in sector k, V_k acts for T1 = (√3/2) m T sin(60° − a), V_{k+1} for T2 = (√3/2) m T sin a. Counted from the
/// sector's middle, a = 30° + φ, both come from one sine and one cosine:
///
/// ```text
/// (T1 + T2)/2 = (√3/4) m T cos φ     T1/2 = (T1 + T2)/4 − (3/8) m T sin φ
/// ```
#[derive(Clone, Copy, Debug)]
pub(super) struct Direction {
    /// The sector less one, 0 ..= 5.
    sector: u32,
    /// Largest less smallest phase as a time in the rising half: (T1 + T2)/2 at modulation index 1, in periods; 3/8 ..= √3/4.
    pub span: f32,
    /// Largest less middle phase in the same way; from 0 to the span.
    pub high_gap: f32,
    /// The angle lies in [−30°, 30°), [90°, 150°) or [210°, 270°): a phase is at its positive peak.
    pub peak: bool,
}

impl Direction {
    #[inline]
    pub fn of(angle: Angle) -> Self {
        // 60° is not a whole number of units: one more, so that a value rounded down to a border counts as beyond it.
        let sectors = u64::from(angle.0.wrapping_add(1)) * 6;
        let (sector, within) = ((sectors >> 32) as u32, sectors as u32);
        // φ as a share of 30°, −1 ..= 1.
        let x = (within ^ (1 << 31)) as i32 as f32 * (1.0 / 2_147_483_648.0);
        let z = x * x;
        // (3/8) sin φ and (√3/4) cos φ, error below 3e-8, for a 30° that lacks 6e-7 of itself: so rounding makes no gap
        // negative.
        let sine = x * (0.196_349_41 + z * (-8.971_258e-3 + z * 1.217_830_7e-4));
        let span = 0.433_012_7 + z * (-5.935_636e-2 + z * (1.355_997_4e-3 - z * 1.227_165_5e-5));
        let odd = sector & 1 != 0;
        let high_gap = 0.5 * span + if odd { sine } else { -sine };
        // The second half of an odd-numbered sector belongs to the next peak, and so on.
        let peak = odd == (within >> 31 != 0);
        Self { sector, span, high_gap, peak }
    }

    /// For the legs U, V, W, what is given for those of the largest, the middle and the smallest phase.
    #[inline]
    pub fn by_leg<T>(&self, [largest, middle, smallest]: [T; 3]) -> [T; 3] {
        match self.sector {
            0 => [largest, middle, smallest],
            1 => [middle, largest, smallest],
            2 => [smallest, largest, middle],
            3 => [smallest, middle, largest],
            4 => [middle, smallest, largest],
            _ => [largest, smallest, middle],
        }
    }
}
