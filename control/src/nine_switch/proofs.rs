//! Proofs that the legs of the nine switches are legal, and short-circuit the link where and for as long as intended, whatever
//! finite request comes.
//!
//! A leg is legal as long as at most one of its gates is off; if none is, it shorts the link. So its pauses must not overlap: 0 ≤ L's ≤ M's ≤ H's ≤
//! 1/2 (`tests/proofs.rs` shows that nothing else is needed). The first two are at the lower motor's edges, below the boundary, the others at the upper
//! motor's, above it: each share is legal by itself, or it is not. Its edges are made of six numbers, of which only two matter:
//!
//! - Every operation is rounded to the nearest number, so it keeps order: `a ≤ b` gives `a + c ≤ b + c` as they are computed. Whatever is added
//!   and not negative lets no edge pass the one before it. What is left are the two ends: the shoot-through at the boundary does not pass
//!   it, the one at the share's end does not pass that.
//! - Both are nearest for the largest active time that fits, and for the largest duty that leaves it. The room of a share is a whole multiple of
//!   2⁻²⁶ of a period, so there are 2²⁴ of them; each is tried with the largest duty that it is made of, and with an
//!   active time four numbers larger than the code made of it here: `room / span * span` is rounded twice, by 2⁻²⁴ of it each.
//!
//! A sliding boundary has two active times in one number: there the roundings are added up, and corners are tried.

extern crate std;

use super::sequence::{Steps, steps};
use super::shares::{Share, divide};
use super::shoot_through::{LegEdges, Shoot};
use super::*;
use std::thread;
use std::vec::Vec;

/// 2⁻²⁶: the distance of two numbers from 1/8 to 1/4; in a period.
const STEP: f32 = 1.0 / 67_108_864.0;

/// Looks at every number below `end`, on all cores.
fn every(end: u64, look: impl Fn(core::ops::Range<u64>) + Sync) {
    let cores = thread::available_parallelism().map_or(1, |cores| cores.get() as u64);
    let share = end.div_ceil(cores);
    thread::scope(|scope| {
        for core in 0..cores {
            let look = &look;
            scope.spawn(move || look(core * share..((core + 1) * share).min(end)));
        }
    });
}

#[test]
fn every_direction_has_a_gap_within_its_span() {
    every(1 << 32, |angles| {
        let mut wrong = 0_u32;
        for angle in angles.map(|angle| angle as u32) {
            let Direction { span, high_gap, peak, .. } = Direction::of(Angle(angle));
            // Half-sectors of 30°; the peaks are around 0°, 120° and 240°.
            let half_sector = (u64::from(angle.wrapping_add(1)) * 12) >> 32;
            let is_peak = half_sector.div_ceil(2).is_multiple_of(2);
            let is_gap = (0.0..=span).contains(&high_gap) && (0.374_999..=0.433_012_8).contains(&span);
            let is_right = is_gap && peak == is_peak;
            wrong += u32::from(!is_right);
        }
        assert_eq!(wrong, 0);
    });
}

/// The farthest distance of the last step from the boundary with half the zero voltage inside, for this active time and every smaller one. Its place
/// is 1/8 and half the active time; two roundings are added to that, of 2⁻²⁸ and of 2⁻²⁷.
fn farthest(span: f32) -> f32 {
    let bound = 0.125 + 0.5 * f64::from(span) + if span > 0.0 { 0.75 * f64::from(STEP) } else { 0.0 };
    let nearest = bound as f32;
    if f64::from(nearest) > bound { nearest.next_down() } else { nearest }
}

/// Every active time that a quarter of the period holds: with all zero voltage inside, the last step is exactly at the share's end; with half of
/// it, not beyond its [`farthest`] place.
#[test]
fn the_last_step_is_where_it_should_be_for_every_active_time() {
    let share = |span| Share { boundary: 0.25, end: 0.5, outward: 1.0, span };
    // Below 2⁻²⁸ the time beside it is a quarter still, as from there on to 2⁻²⁷.
    let least = 0.25 * STEP;
    let ends = u64::from(least.to_bits())..u64::from(0.25_f32.to_bits() + 1);
    every(ends.end - ends.start, |bits| {
        let mut wrong = 0_u32;
        for span in bits.map(|bits| f32::from_bits((bits + ends.start) as u32)) {
            let [whole, half] = [1.0, 0.5].map(|inner| steps(&share(span), inner, 0.0).far);
            wrong += u32::from(whole != 0.25 || half > farthest(span));
        }
        assert_eq!(wrong, 0);
    });
    assert_eq!([0.0, f32::from_bits(1), least].map(|span| steps(&share(span), 1.0, 0.0).far), [0.25; 3]);
}

/// The largest duties that leave number `number` of the rooms, counted from the largest: where they are rounded the border is one of two numbers.
fn largest_duties(number: u64) -> impl Iterator<Item = f32> {
    let quarter = number as f32 * STEP;
    let is_rounded = quarter < 0.125;
    let duty = 4.0 * if is_rounded { quarter + 0.5 * STEP } else { quarter };
    [Some(duty), is_rounded.then(|| duty.next_down())].into_iter().flatten()
}

/// The edges of a share from its boundary outward, each of which must lie beyond the one before.
fn outward(share: &Share, edges: &[LegEdges; 3]) -> [f32; 8] {
    let [near, between, far] = edges;
    let way = |instant: f32| share.outward * instant;
    [
        way(share.boundary),
        way(near.middle),
        way(near.own),
        way(between.own),
        way(far.middle),
        way(far.own),
        way(far.again),
        way(share.end),
    ]
}

/// `true` if a share's edges are in order, and its legs short the link for as long as intended.
fn is_legal(share: &Share, steps: &Steps, (inner, central, duty): (f32, bool, f32)) -> bool {
    let edges = Shoot::new(duty, inner, central).insert(steps, share);
    let [near, between, far] = &edges;
    let in_order = outward(share, &edges).windows(2).all(|pair| pair[0] <= pair[1]);
    // Two roundings of a number below 1/2.
    let lasts = |from: f32, to: f32, length: f64| {
        ((f64::from(to) - f64::from(from)).abs() - length).abs() <= f64::from(STEP)
    };
    let (inside, outside) = (0.25 * f64::from(duty) * f64::from(inner), 0.25 * f64::from(duty));
    let outer = if central { (far.again, share.end) } else { (far.middle, far.own) };
    let unshorted = between.own == between.middle
        && [near, between].iter().all(|edges| edges.again == share.end)
        && if central { far.own == far.middle } else { far.again == share.end };
    let right_length = lasts(near.middle, near.own, inside) && lasts(outer.0, outer.1, outside - inside);
    in_order && unshorted && right_length
}

/// A request for more than there is, at a direction's angle, with a duty.
fn too_much(duty: f32, angles: [Angle; 2]) -> Request {
    let [upper, lower] = angles.map(|angle| MotorVoltage { angle, modulation_index: f32::MAX });
    Request { scheme: Scheme::Rthd, upper, lower, shoot_through: duty }
}

/// The schemes' ways: the part of the zero time that is V13, and whether the shoot-through is central.
const WAYS: [(f32, bool); 4] = [(0.0, false), (0.5, false), (1.0, false), (0.0, true)];

#[test]
fn every_duty_is_shorted_beside_a_zero_vector_and_no_edge_passes_another() {
    let angles = [Angle(0x1234_5678), Angle(0x9ABC_DEF0)];
    let [upper, lower] = angles.map(Direction::of);
    every((1 << 24) + 1, |numbers| {
        for duty in numbers.flat_map(largest_duties) {
            let shares = divide(&too_much(duty, angles), false, &upper, &lower);
            for share in [shares.upper, shares.lower] {
                let larger = |span: f32| if span > 0.0 { span.next_up() } else { span };
                let span = larger(larger(larger(larger(share.span))));
                let share = Share { span, ..share };
                for (inner, central) in WAYS {
                    let mut steps = steps(&share, inner, span);
                    if inner == 0.5 {
                        steps.far = farthest(span);
                    }
                    let way = (inner, central, duty);
                    assert!(is_legal(&share, &steps, way), "{way:?} {share:?} {steps:?}");
                }
            }
        }
    });
}

/// Roundings where the boundary slides. With `r` the room of a share, `r ≤ 1/4 − D/4 − spare`, the active times add up to no more than 2 r and the roundings
/// of `room / span * span` (2⁻²³ of it, 2⁻²⁴ in all) and of `2 r − m span` (2⁻²⁶). Half of that, the roundings of the boundary (2⁻²⁷ and 2⁻²⁶),
/// of the last step (2⁻²⁶) and of the room itself (2⁻²⁷) must be less than what is spared.
#[test]
fn a_boundary_that_slides_leaves_room_for_its_roundings() {
    let angles = [Angle(0), Angle(0)];
    let at_rest = Direction::of(Angle(0));
    let shares = divide(&too_much(0.0, angles), false, &at_rest, &at_rest);
    let (step, spare) = (f64::from(STEP), 0.25 - f64::from(shares.upper.span));
    let active = 0.5 * (4.0 * step + step);
    let roundings = active + 0.5 * step + step + step + 0.5 * step;
    assert!(roundings < spare, "{roundings} of {spare}");
}

#[test]
fn no_edge_passes_another_where_the_boundary_slides() {
    // Where the span is largest and where it is smallest.
    let angles = [Angle(0x1555_5555), Angle(0x2AAA_AAAA)];
    let parts = || (0..=32).map(|part| part as f32 / 16.0).chain([f32::MIN_POSITIVE, f32::MAX]);
    let parts: Vec<(f32, f32)> = parts().flat_map(|one| parts().map(move |other| (one, other))).collect();
    let (mut smallest, mut largest) = (0.5_f32, 0.0_f32);
    for duty in (0..=256).flat_map(|part| around(part as f32 / 256.0)).filter(|duty| *duty <= 1.0) {
        for (angle1, angle2) in angles.into_iter().flat_map(|one| angles.map(|other| (one, other))) {
            let (upper, lower) = (Direction::of(angle1), Direction::of(angle2));
            let room = 0.25 - 0.25 * duty;
            for (part1, part2) in &parts {
                let mut request = too_much(duty, [angle1, angle2]);
                let modulation_index =
                    |part: f32, span: f32| if part < 3.0 { part * room / span } else { part };
                request.upper.modulation_index = modulation_index(*part1, upper.span);
                request.lower.modulation_index = modulation_index(*part2, lower.span);
                let shares = divide(&request, true, &upper, &lower);
                let boundary = shares.upper.boundary;
                (smallest, largest) = (smallest.min(boundary), largest.max(boundary));
                for share in [shares.upper, shares.lower] {
                    let steps = steps(&share, 0.0, share.span);
                    assert!(is_legal(&share, &steps, (0.0, false, duty)), "{request:?} {shares:?}");
                }
            }
        }
    }
    assert!(smallest < 0.001 && largest > 0.499, "{smallest} {largest}");
}

/// A number and its neighbours that are not negative.
fn around(number: f32) -> impl Iterator<Item = f32> {
    [number.next_down(), number, number.next_up()].into_iter().filter(|number| *number >= 0.0)
}

/// The gates' own order for requests in every corner: at the borders of the half-sectors, with as much voltage as fits and its neighbours, none
/// and far too much.
#[test]
fn every_corner_of_a_request_makes_legal_legs() {
    let near =
        |units: i32| (0..12_u64).map(move |k| Angle(((k << 32) / 12) as u32).0.wrapping_add_signed(units));
    let angles: Vec<Angle> = [-1, 0, 1, 0x0500_0000].into_iter().flat_map(near).map(Angle).collect();
    let duties = [0.0, f32::from_bits(1), 1e-7, 0.1, 0.25, 0.5, 1.0_f32.next_down(), 1.0];
    let mut legs = 0_u32;
    for scheme in Scheme::ALL {
        for (number, duty) in angles.iter().flat_map(|angle| duties.map(|duty| (*angle, duty))) {
            let upper = Direction::of(number);
            let fits = (0.25 - 0.25 * duty) / upper.span;
            for modulation_index in around(fits).chain([0.0, f32::from_bits(1), 0.5 * fits, f32::MAX]) {
                for (angle, other) in angles.iter().step_by(5).zip([fits, 0.0, f32::MAX].into_iter().cycle())
                {
                    let request = Request {
                        scheme,
                        upper: MotorVoltage { angle: number, modulation_index },
                        lower: MotorVoltage { angle: *angle, modulation_index: other },
                        shoot_through: duty,
                    };
                    let period = step(&request).unwrap_or_else(|refused| panic!("{refused:?} {request:?}"));
                    legs += 3;
                    for leg in 0..3 {
                        assert!(are_apart(&period, leg), "{request:?} {period:?}");
                    }
                }
            }
        }
    }
    assert!(legs > 100_000, "{legs}");
}

/// `true` if the pauses of a leg's gates are apart, as they are and in ticks.
fn are_apart(period: &Period, leg: usize) -> bool {
    let ends = |row: usize| [period.gates[row + leg].off_from, period.gates[row + leg].off_to];
    let [high, middle, low] = [ends(0), ends(3), ends(6)];
    let instants = [[0.0; 2], low, middle, high, [0.5; 2]].concat();
    let in_ticks = [1, 2, 3_571, 4_000, 1 << 22].into_iter().all(|half| {
        let gates = period.ticks(half);
        let ends = |row: usize| [gates[row + leg].off_from, gates[row + leg].off_to];
        let ticks = [[0; 2], ends(6), ends(3), ends(0), [half; 2]].concat();
        ticks.windows(2).all(|pair| pair[0] <= pair[1])
    });
    instants.windows(2).all(|pair| pair[0] <= pair[1]) && in_ticks
}

/// Every length of a half: its end is its last tick, its beginning the first one. Between them rounding keeps order.
#[test]
fn the_ends_of_every_half_are_ticks() {
    for half_ticks in 1..=1 << 22 {
        let whole = GatePattern { off_from: 0.0, off_to: 0.5 };
        assert_eq!(whole.ticks(half_ticks), GateTicks { off_from: 0, off_to: half_ticks });
    }
}

#[test]
fn no_value_outside_its_range_makes_pulses() {
    let good = too_much(0.1, [Angle(0); 2]);
    let outside =
        [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MIN, -f32::MIN_POSITIVE, -f32::from_bits(1)];
    for bad in outside {
        let with = |motor: MotorVoltage| MotorVoltage { modulation_index: bad, ..motor };
        assert_eq!(step(&Request { upper: with(good.upper), ..good }), Err(Refused::UpperIndex));
        assert_eq!(step(&Request { lower: with(good.lower), ..good }), Err(Refused::LowerIndex));
        assert_eq!(step(&Request { shoot_through: bad, ..good }), Err(Refused::ShootThrough));
    }
    assert_eq!(step(&Request { shoot_through: 1.0_f32.next_up(), ..good }), Err(Refused::ShootThrough));
    assert!(step(&Request { shoot_through: 1.0, ..good }).is_ok());
}
