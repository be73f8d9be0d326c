//! Where the link is shorted.
//!
//! In each half of the period each motor's turn holds D T/4, one leg at a time, at the borders between its zero and its
//! active vectors: the leg that steps there keeps the gate that turns off on a little longer, or turns on the other
//! a little earlier, on the zero vector's side. So active vectors keep their time, and no gate toggles once more.
//!
//! | zero vector | gate | leg of |
//! |---|---|---|
//! | V14 | H off later | the upper motor's largest phase |
//! | V15 | L on earlier | the lower motor's smallest phase |
//! | V13, upper motor's part | M on earlier | its smallest phase |
//! | V13, lower motor's part | M off later | its largest phase |
//!
//! One exception: a motor without voltage has no step at the period's end in RS and ZVO, so M makes a pulse there.

use super::sequence::{Compare, Sides, Site, Zeros};
use super::vectors::Leg;

/// A motor's edges in the rising half, in periods.
#[derive(Clone, Copy, Debug)]
pub(super) struct Edges {
    compare: Compare,
    /// M's edge in the near leg.
    near_middle: f32,
    /// The edge of the far leg's own gate, H or L.
    far_own: f32,
    /// Where that gate's pause ends on the side of the turn's end.
    far_end: f32,
    /// The same of the other legs.
    end: f32,
}

/// Adds a motor's part of the shoot-through `duty` (0 ..= 1 of the period) to its compare instants.
#[inline]
pub(super) fn insert(compare: &Compare, sides: &Sides, zeros: Zeros, site: Site, duty: f32) -> Edges {
    let whole = 0.25 * duty * sides.outward;
    let inner = whole * zeros.inner_part();
    let outer = whole - inner;
    let (far_own, far_end) = match site {
        Site::Sides => (compare.far.1 + outer, sides.end),
        Site::Centre => (compare.far.1, sides.end - outer),
    };
    Edges { compare: *compare, near_middle: compare.near.1 - inner, far_own, far_end, end: sides.end }
}

impl Edges {
    /// The instant of the leg's M, given its compare instant.
    #[inline]
    fn middle(&self, leg: Leg, instant: f32) -> f32 {
        if leg == self.compare.near.0 { self.near_middle } else { instant }
    }

    /// Begin and end of the pause of the leg's own gate (H or L), from the boundary outward.
    #[inline]
    fn own(&self, leg: Leg, instant: f32) -> (f32, f32) {
        if leg == self.compare.far.0 { (self.far_own, self.far_end) } else { (instant, self.end) }
    }

    /// For the legs U, V, W: M's edge, and the pause of the motor's own gate from the boundary outward.
    #[inline]
    pub fn legs(&self) -> [(f32, (f32, f32)); 3] {
        let [u, v, w] = self.compare.instants;
        [(Leg::U, u), (Leg::V, v), (Leg::W, w)]
            .map(|(leg, instant)| (self.middle(leg, instant), self.own(leg, instant)))
    }
}
