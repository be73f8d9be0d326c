//! The instants at which the link is shorted.
//!
//! In each half of the period each motor's share holds D T/4, one leg at a time, at the borders between its zero and its
//! active vectors: the leg that steps there keeps the gate that turns off on a little longer, or turns the other gate on
//! a little earlier, on the zero vector's side. So active vectors keep their time, and no gate toggles an extra time.
//!
//! | zero vector | gate | leg of |
//! |---|---|---|
//! | V14 | H off later | the upper motor's largest phase |
//! | V15 | L on earlier | the lower motor's smallest phase |
//! | V13, upper motor's part | M on earlier | its smallest phase |
//! | V13, lower motor's part | M off later | its largest phase |
//!
//! Two exceptions: a motor without voltage never steps if all its zero time is V13, so M makes a pulse there for the
//! shoot-through; and if shoot-through fills V13 completely, one leg's M has no pause left and toggles less.

use super::sequence::Steps;
use super::shares::Share;

/// One leg's edges in the rising half due to one motor, in periods.
#[derive(Clone, Copy, Debug)]
pub(super) struct LegEdges {
    /// Edge of the motor's own gate: H off for the upper motor, L on for the lower one.
    pub own: f32,
    /// The other end of that gate's pause: the end of the motor's share unless the shoot-through is central.
    pub again: f32,
    /// Edge of M.
    pub middle: f32,
}

/// A motor's shoot-through in the rising half.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shoot {
    /// At the border with V13, in periods.
    inside: f32,
    /// In V14 or V15, in periods.
    outside: f32,
    central: bool,
}

impl Shoot {
    /// The motor's part of the `duty` (0 ..= 1), if the part `inner` of its zero time is V13.
    #[inline]
    pub fn new(duty: f32, inner: f32, central: bool) -> Self {
        let inside = 0.25 * duty * inner;
        Self { inside, outside: 0.25 * duty - inside, central }
    }

    /// The edges of the legs that step next to the boundary, between, and next to the share's end.
    #[inline]
    pub fn insert(&self, steps: &Steps, share: &Share) -> [LegEdges; 3] {
        let &Share { boundary, end, outward, .. } = share;
        let (inside, outside) = (outward * self.inside, outward * self.outside);
        let near = boundary + outward * steps.near;
        let between = boundary + outward * steps.between;
        let far = boundary + outward * steps.far;
        let (own, again) = if self.central { (far, end - outside) } else { (far + outside, end) };
        [
            LegEdges { own: near, again: end, middle: near - inside },
            LegEdges { own: between, again: end, middle: between },
            LegEdges { own, again, middle: far },
        ]
    }
}
