//! The two motors' shares of the period: the boundary between them, and the voltages that fit.

use super::vectors::Direction;
use super::{Applied, Request};

/// The part of a share kept free besides active vectors and shoot-through, in periods, so that rounding never lets one share reach
/// into the other. A voltage lower by four times this (two shares' worth, and rounding) is not reported as limited.
const ROUNDING: f32 = 1.0 / 8_388_608.0;

/// One motor's part of the rising half.
#[derive(Clone, Copy, Debug)]
pub(super) struct Share {
    /// The boundary with the other motor's share, in periods, 0 ..= 1/2.
    pub boundary: f32,
    /// Its other end: 1/2, the peak, for the upper motor; 0, the valley, for the lower one.
    pub end: f32,
    /// Direction from the boundary to the end, 1 or −1.
    pub outward: f32,
    /// Active time in it, in periods: (T1 + T2)/2 or (T3 + T4)/2.
    pub span: f32,
}

/// Both motors' parts.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shares {
    pub upper: Share,
    pub lower: Share,
    pub applied: Applied,
}

/// The indices that fit, and the boundary.
#[inline]
pub(super) fn divide(request: &Request, slides: bool, upper: &Direction, lower: &Direction) -> Shares {
    let (m1, m2) = (request.upper.modulation_index, request.lower.modulation_index);
    // A quarter of the period each, less the motor's half of the shoot-through.
    let room = larger(0.25 - 0.25 * request.shoot_through - ROUNDING, 0.0);
    let (mut upper_room, mut lower_room) = (room, room);
    if slides {
        // What the other leaves of its own is available as well.
        upper_room = larger(room, 2.0 * room - m2 * lower.span);
        lower_room = larger(room, 2.0 * room - m1 * upper.span);
    }
    let (upper_index, upper_limited) = fit(m1, upper.span, upper_room);
    let (lower_index, lower_limited) = fit(m2, lower.span, lower_room);
    let (upper_span, lower_span) = (upper_index * upper.span, lower_index * lower.span);
    // T0/4 + (T3 + T4)/2.
    let boundary = if slides { 0.25 + 0.5 * (lower_span - upper_span) } else { 0.25 };
    Shares {
        upper: Share { boundary, end: 0.5, outward: 1.0, span: upper_span },
        lower: Share { boundary, end: 0.0, outward: -1.0, span: lower_span },
        applied: Applied { upper_index, lower_index, upper_limited, lower_limited },
    }
}

/// The modulation index that fits into the room, and whether that is less.
#[inline]
fn fit(modulation_index: f32, span: f32, room: f32) -> (f32, bool) {
    let wanted = modulation_index * span;
    if wanted <= room { (modulation_index, false) } else { (room / span, wanted > room + 4.0 * ROUNDING) }
}

#[inline]
fn larger(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}
