//! Who has how much of the period: the boundary between the two motors' turns, and the voltages that fit.

use super::{Applied, Request};

/// How the two turns are parted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Boundary {
    /// At T/4 and 3T/4: half the period each.
    Fixed,
    /// At t_b = T0/4 + (T3 + T4)/2: the same zero time for each.
    Sliding,
}

/// What is kept of the zero time besides the shoot-through, so that rounding never lets one turn reach into the other;
/// in units of a span, four times the time. A voltage less by this little is not reported as limited.
const ROUNDING: f32 = 1.0 / 2_097_152.0;

/// The depths that fit, and the boundary in periods, 0 ..= 1/2. Spans are those of the unit vectors, 1.5 ..= √3.
#[inline]
pub(super) fn divide(
    request: &Request,
    boundary: Boundary,
    upper_span: f32,
    lower_span: f32,
) -> (Applied, f32) {
    let (upper, lower) = (request.upper.depth, request.lower.depth);
    let room = larger(1.0 - request.shoot_through - ROUNDING, 0.0);
    // Half the room is each one's own; when the boundary slides, also what the other does not use of its half.
    let (upper_room, lower_room) = match boundary {
        Boundary::Fixed => (room, room),
        Boundary::Sliding => {
            (larger(room, 2.0 * room - lower * lower_span), larger(room, 2.0 * room - upper * upper_span))
        }
    };
    let (upper_depth, upper_limited) = fit(upper, upper_span, upper_room);
    let (lower_depth, lower_limited) = fit(lower, lower_span, lower_room);
    let at = match boundary {
        Boundary::Fixed => 0.25,
        // T0/4 + (T3 + T4)/2, with T1 + T2 and T3 + T4 half the spans.
        Boundary::Sliding => 0.25 + 0.125 * (lower_depth * lower_span - upper_depth * upper_span),
    };
    (Applied { upper_depth, lower_depth, upper_limited, lower_limited }, at)
}

/// The depth that fits into the room, and whether that is less.
#[inline]
fn fit(depth: f32, span: f32, room: f32) -> (f32, bool) {
    let wanted = depth * span;
    if wanted <= room { (depth, false) } else { (room / span, wanted > room + 2.0 * ROUNDING) }
}

#[inline]
fn larger(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}
