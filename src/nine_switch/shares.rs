//! Who has how much of the period: the boundary between the two motors' shares, and the voltages that fit.

use super::vectors::Direction;
use super::{Applied, Request};

/// What is kept of a share besides active vectors and shoot-through, in periods, so that rounding never lets one share reach
/// into the other. A voltage less by four times this (two shares' worth, and rounding) is not reported as limited.
const ROUNDING: f32 = 1.0 / 8_388_608.0;

/// The two shares of the rising half, and what is in them.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shares {
    /// The end of the lower motor's share and the beginning of the upper one's, in periods, 0 ..= 1/2.
    pub boundary: f32,
    /// Active time of the upper motor in the half, in periods: (T1 + T2)/2.
    pub upper_span: f32,
    /// The same of the lower motor: (T3 + T4)/2.
    pub lower_span: f32,
    pub applied: Applied,
}

/// The depths that fit, and the boundary.
#[inline]
pub(super) fn divide(request: &Request, slides: bool, upper: &Direction, lower: &Direction) -> Shares {
    let (m1, m2) = (request.upper.depth, request.lower.depth);
    // A quarter of the period each, less the motor's half of the shoot-through.
    let room = larger(0.25 - 0.25 * request.shoot_through - ROUNDING, 0.0);
    let (mut upper_room, mut lower_room) = (room, room);
    if slides {
        // What the other leaves of its own is to be had as well.
        upper_room = larger(room, 2.0 * room - m2 * lower.span);
        lower_room = larger(room, 2.0 * room - m1 * upper.span);
    }
    let (upper_depth, upper_limited) = fit(m1, upper.span, upper_room);
    let (lower_depth, lower_limited) = fit(m2, lower.span, lower_room);
    let (upper_span, lower_span) = (upper_depth * upper.span, lower_depth * lower.span);
    // T0/4 + (T3 + T4)/2.
    let boundary = if slides { 0.25 + 0.5 * (lower_span - upper_span) } else { 0.25 };
    let applied = Applied { upper_depth, lower_depth, upper_limited, lower_limited };
    Shares { boundary, upper_span, lower_span, applied }
}

/// The depth that fits into the room, and whether that is less.
#[inline]
fn fit(depth: f32, span: f32, room: f32) -> (f32, bool) {
    let wanted = depth * span;
    if wanted <= room { (depth, false) } else { (room / span, wanted > room + 4.0 * ROUNDING) }
}

#[inline]
fn larger(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}
