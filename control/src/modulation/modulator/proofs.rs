//! Proofs of the switches between modes, by every state that a modulator can be in when another mode is wanted: each mode, each half of
//! its turn, each mode to come, forward and in the mirror.

extern crate std;

use super::*;
use crate::time::Clock;
use std::vec::Vec;

const CLOCK: Clock = Clock::new(25_000_000, 2_500);
const LINK_V: f32 = 1_500.0;
const START: Instant = Instant(u32::MAX - 100_000);

/// The locked modes.
fn locked() -> impl Iterator<Item = Mode> {
    Mode::ALL.into_iter().filter(|mode| mode.carriers() > 0)
}

fn fixed(mode: Mode) -> Schedule {
    Schedule::fixed(mode, &CLOCK)
}

/// A modulator in a mode before half number `next_half`, of which another mode is wanted.
fn in_mode(from: Mode, next_half: u32, to: Mode, mirrored: bool) -> Modulator {
    let devices = SwitchLimits::new(250, 0, 900.0, &CLOCK);
    Modulator { mode: from, next_half, mirrored, ..Modulator::new(devices, fixed(to)) }
}

/// The next half, whose carrier is `off` beside its angle at 100 Hz.
fn next(modulator: &mut Modulator, start: Instant, off: Angle) -> CarrierHalf {
    let angle = boundary(modulator.next_half, modulator.mode.carriers()) + off - Angle::DEG_90;
    let rate = 100.0 * 4_294_967_296.0 / 25e6;
    let seen = Reference::turning(850.0, angle, rate, start, LINK_V);
    let reference = if modulator.mirrored { seen.mirrored() } else { seen };
    modulator.step(start, Some(&reference))
}

/// The halves up to the second one of another mode, or of so many turns.
fn course(mut modulator: Modulator, off: Angle, turns: u32) -> Vec<CarrierHalf> {
    let (from, most) = (modulator.mode, 2 * modulator.mode.carriers() * turns);
    let (mut halves, mut start, mut others) = (Vec::<CarrierHalf>::new(), START, 0);
    while others < 2 && halves.len() < most as usize {
        let half = next(&mut modulator, start, off);
        start = start.after(half.period_ticks);
        others += u32::from(half.mode != from);
        halves.push(half);
    }
    halves
}

/// `true` if the boundary at which half number `half` begins is one where the modes may change: 360°/gcd(N1, N2) apart, by the specification.
/// Optimised patterns meet where their flux paths do, at an angle that both have.
fn is_legal(from: Mode, to: Mode, half: u32) -> bool {
    let [old, new] = [from, to].map(Mode::carriers);
    if from.is_optimal() && to.is_optimal() {
        return (half * new).is_multiple_of(old);
    }
    let divisor = (1..=old).rev().find(|n| old.is_multiple_of(*n) && new.is_multiple_of(*n)).unwrap_or(1);
    (half * divisor).is_multiple_of(2 * old)
}

/// A switch between locked modes comes once, in its place in the turn, and is announced two halves before.
#[test]
fn every_locked_switch_is_announced_and_legal() {
    let mut switches = 0_u32;
    for (from, to) in locked().flat_map(|from| locked().map(move |to| (from, to))).filter(|(a, b)| a != b) {
        let turn = 2 * from.carriers();
        for (next_half, mirrored) in (0..turn).flat_map(|half| [(half, false), (half, true)]) {
            for off in [Angle::ZERO, KEPT_ANGLE - Angle(1), Angle(1) - KEPT_ANGLE] {
                let halves = course(in_mode(from, next_half, to, mirrored), off, 2);
                let told = || std::format!("{from:?} {to:?} from {next_half}: {halves:?}");
                let at =
                    halves.iter().position(|half| half.mode != from).unwrap_or_else(|| panic!("{}", told()));
                assert!(at >= 2 && at <= 2 + turn as usize && halves.len() == at + 2, "{}", told());
                assert!(halves[at..].iter().all(|half| half.mode == to), "{}", told());
                for (number, half) in halves[..at].iter().enumerate() {
                    assert_eq!(u32::from(half.half), (next_half + number as u32) % turn, "{}", told());
                    let ahead = match at - number {
                        1 => [to; 2],
                        2 => [from, to],
                        _ => [from; 2],
                    };
                    assert_eq!(half.ahead, ahead, "{}", told());
                }
                let old = (u32::from(halves[at - 1].half) + 1) % turn;
                let gap = boundary(old, from.carriers()) - boundary(halves[at].half.into(), to.carriers());
                assert!(is_legal(from, to, old) && gap.signed().abs() < 8, "{}", told());
                switches += 1;
            }
        }
    }
    std::println!("{switches} switches");
    assert!(switches > 4_000);
}

/// A carrier that is off its angle does not give way to a pattern, however long that lasts; to another carrier it does.
#[test]
fn a_pattern_waits_until_the_carrier_keeps_its_angle() {
    let away = [KEPT_ANGLE, KEPT_ANGLE + Angle(1), Angle::DEG_90, Angle(1 << 31)];
    for (from, to) in locked().flat_map(|from| locked().map(move |to| (from, to))).filter(|(a, b)| a != b) {
        for off in away.into_iter().flat_map(|off| [off, -off]) {
            let halves = course(in_mode(from, 0, to, false), off, 3);
            let gave_way = halves.iter().any(|half| half.mode != from);
            assert_eq!(gave_way, to.is_carrier(), "{from:?} {to:?} {off:?}");
        }
    }
}

/// A step of torque after the announcement of a pattern takes it back, in either of the two halves; once the carrier keeps its angle again the
/// pattern is announced anew.
#[test]
fn a_step_of_torque_takes_an_announced_pattern_back() {
    let pairs = locked().flat_map(|from| locked().map(move |to| (from, to)));
    for (from, to) in pairs.filter(|(from, to)| from.is_carrier() && !to.is_carrier()) {
        for (step, off) in [1, 2].into_iter().flat_map(|step| [(step, KEPT_ANGLE), (step, Angle::DEG_90)]) {
            let (mut modulator, mut start) = (in_mode(from, 0, to, false), START);
            let mut course = |count: u32, off: Angle| {
                let halves = (0..count).map(|_| {
                    let half = next(&mut modulator, start, off);
                    start = start.after(half.period_ticks);
                    half
                });
                halves.collect::<Vec<_>>()
            };
            let mut announced = course(1, Angle::ZERO)[0];
            while announced.ahead == [from; 2] {
                announced = course(1, Angle::ZERO)[0];
            }
            let halves = [course(step - 1, Angle::ZERO), course(4 * from.carriers(), off)].concat();
            let told = std::format!("{from:?} {to:?} {step}: {halves:?}");
            assert!(halves.iter().all(|half| half.mode == from), "{told}");
            assert!(halves[step as usize - 1..].iter().all(|half| half.ahead == [from; 2]), "{told}");
            let halves = course(2 * from.carriers() + 3, Angle::ZERO);
            assert!(halves.iter().any(|half| half.mode == to), "{from:?} {to:?} {step}: {halves:?}");
        }
    }
}

/// An announced switch comes, whatever is wanted meanwhile, and nothing else comes before it.
#[test]
fn a_switch_that_is_announced_comes_whatever_is_wanted_meanwhile() {
    for (from, to) in locked().flat_map(|from| locked().map(move |to| (from, to))).filter(|(a, b)| a != b) {
        for (next_half, other) in
            (0..2 * from.carriers()).flat_map(|half| Mode::ALL.map(|other| (half, other)))
        {
            let (mut modulator, mut start, mut left) = (in_mode(from, next_half, to, false), START, None);
            for _ in 0..2 * from.carriers() + 4 {
                let half = next(&mut modulator, start, Angle::ZERO);
                start = start.after(half.period_ticks);
                let Some(plan) = modulator.plan else {
                    match left {
                        Some(left) => {
                            assert_eq!((half.mode, left), (to, 0), "{other:?} meanwhile");
                            break;
                        }
                        None => continue,
                    }
                };
                assert_eq!((half.mode, plan.to), (from, to), "{other:?} meanwhile");
                modulator.schedule = fixed(other);
                left = Some(left.map_or(1, |left: u32| left - 1));
            }
            assert_eq!(left, Some(0), "{from:?} {to:?}");
        }
    }
}

/// A free carrier gives way at its valley alone, where all upper devices are on; with gates off every mode begins at once. Without a
/// reference the gates are off in the very half, out of each state.
#[test]
fn a_free_carrier_gives_way_at_its_valley_and_gates_go_off_at_once() {
    for (to, half) in locked().flat_map(|to| [(to, 0), (to, 1)]) {
        let mut modulator = in_mode(Mode::Async, half, to, false);
        // An optimised pattern waits for its angle, but not for ever.
        let wait = if to.is_optimal() { 300 } else { 2 };
        let modes = (0..wait).map(|_| {
            let is_valley = modulator.next_half == 0;
            (next(&mut modulator, START, Angle::ZERO).mode, is_valley)
        });
        let first = modes.into_iter().find(|(mode, _)| *mode != Mode::Async);
        assert_eq!(first, Some((to, true)), "{half}");
    }
    for (from, to) in Mode::ALL.into_iter().flat_map(|from| Mode::ALL.map(|to| (from, to))) {
        for half in 0..2 * from.carriers().max(1) {
            let mut modulator = in_mode(from, half, to, false);
            modulator.plan = Some(Plan { to, at: half });
            let off = modulator.step(START, None);
            assert_eq!((off.mode, off.ahead, modulator.mode), (Mode::Off, [Mode::Off; 2], Mode::Off));
            assert!(modulator.plan.is_none() && off.compare_ticks == [u32::MAX; 3]);
        }
    }
    for to in Mode::ALL.into_iter().filter(|to| *to != Mode::Off) {
        assert_eq!(next(&mut in_mode(Mode::Off, 0, to, false), START, Angle::ZERO).mode, to);
    }
}

/// Out of a free carrier or none a carrier begins with the start that has passed, a pattern with the carrier, or the optimised pattern's half, that is
/// nearest: at every angle of 16 bits, and where the first half changes.
#[test]
fn the_first_half_is_the_last_or_the_nearest_one_of_the_turn() {
    for to in locked() {
        let turn = 2 * to.carriers();
        let step = if to.is_optimal() { 1 } else { 2 };
        let half_angle = boundary(1, to.carriers()).0;
        let changes =
            (0..2 * turn).map(|k| boundary(k / 2, to.carriers()).0.wrapping_add(k % 2 * (half_angle / 2)));
        let near = changes.flat_map(|at| (0..9).map(move |units| at.wrapping_add(units).wrapping_sub(4)));
        let angles = (0..1_u32 << 16).map(|upper| upper << 16);
        for pulse in angles.chain(near).map(Angle) {
            let half = first_half(Mode::Async, to, 0, pulse);
            assert!(half < turn && half.is_multiple_of(step), "{to:?} {pulse:?}: {half}");
            let passed = (pulse - boundary(half, to.carriers())).signed();
            let whole = (step * half_angle) as i32;
            let of = if to.is_carrier() { 0..=whole } else { -whole / 2..=whole / 2 };
            assert!(
                (of.start() - 2..=of.end() + 2).contains(&passed),
                "{to:?} {pulse:?}: {half}, {passed} of {whole}"
            );
        }
    }
}
