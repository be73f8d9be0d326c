//! Legs and their states, and the phases of a voltage vector.
//!
//! V1 ..= V6 = (1 0 0) (1 1 0) (0 1 0) (0 1 1) (0 0 1) (1 0 1) give the upper motor (2/3) U_in at 0°, 60° … 300°, the lower
//! one nothing; V7 ..= V12 = (−1 1 1) (−1 −1 1) (1 −1 1) (1 −1 −1) (1 1 −1) (−1 1 −1) the other way round; V13 = (1 1 1),
//! V14 = (0 0 0) and V15 = (−1 −1 −1) are zero for both.

use crate::frames::{AlphaBeta, Angle};

/// A leg of the inverter, and the phase of both motors that it feeds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Leg {
    /// Phase a.
    U,
    /// Phase b.
    V,
    /// Phase c.
    W,
}

/// What the three switches of a leg make of its two nodes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
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

/// A unit vector's three phases and their order.
#[derive(Clone, Copy, Debug)]
pub(super) struct Phases {
    /// cos θ, cos(θ − 120°), cos(θ + 120°).
    pub values: [f32; 3],
    pub largest: (Leg, f32),
    /// Never the leg that is the largest.
    pub smallest: (Leg, f32),
}

impl Phases {
    #[inline]
    pub fn of(angle: Angle) -> Self {
        let direction = angle.sin_cos();
        let phases = AlphaBeta { alpha: direction.cos, beta: direction.sin }.abc();
        let (u, v, w) = ((Leg::U, phases.a), (Leg::V, phases.b), (Leg::W, phases.c));
        let (large, small) = if u.1 >= v.1 { (u, v) } else { (v, u) };
        let largest = if large.1 >= w.1 { large } else { w };
        let smallest = if small.1 < w.1 { small } else { w };
        Self { values: [phases.a, phases.b, phases.c], largest, smallest }
    }

    /// Largest less smallest phase, 1.5 ..= √3.
    #[inline]
    pub fn span(&self) -> f32 {
        self.largest.1 - self.smallest.1
    }
}
