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

use super::sequence::Steps;

/// A motor's edges in the rising half, each as a distance from the boundary, in periods.
#[derive(Clone, Copy, Debug)]
pub(super) struct Edges {
    /// Of the leg next to the boundary: its own gate's (H or L) and M's.
    pub near: (f32, f32),
    /// Of the leg between, both gates'.
    pub middle: f32,
    /// Of the leg next to the end: its own gate's and M's.
    pub far: (f32, f32),
    /// Where the far leg's own gate turns on again: the share's end unless the shoot-through is central.
    pub again: f32,
}

/// Adds a motor's part of the shoot-through `duty` (0 ..= 1) to its steps in a share that lasts `share` periods.
#[inline]
pub(super) fn insert(steps: &Steps, duty: f32, share: f32, inner: f32, central: bool) -> Edges {
    let part = 0.25 * duty;
    let inside = part * inner;
    let outside = part - inside;
    let (later, again) = if central { (0.0, share - outside) } else { (outside, share) };
    Edges {
        near: (steps.near, steps.near - inside),
        middle: steps.middle,
        far: (steps.far + later, steps.far),
        again,
    }
}
