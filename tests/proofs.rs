//! Proofs that try all values of a few bits: instants, angles, frames, checksums, compare values, legs. `docs/proof.md` lists
//! what each one proves, and its bound; proofs of code that is not public stand beside that code.

use std::ops::Range;
use std::thread;
use tractive::frames::{Abc, Angle};
use tractive::modulation::{
    CarrierHalf, EdgeDelay, Mode, Modulator, Reference, Schedule, SwitchLimits, compensate,
};
use tractive::nine_switch::{DeadTime, GateTicks, LegState};
use tractive::protocol::e2e::{data_ids, is_intact, protect};
use tractive::protocol::{
    Command, LinkLimits, ParameterRequest, Payload, Scales, TorqueLimits, Zs9Command, Zs9Link,
};
use tractive::time::{Clock, Instant};

const CLOCK: Clock = Clock::new(25_000_000, 2_500);

/// Looks at every number of 32 bits, on all cores.
fn every_u32(look: impl Fn(Range<u64>) + Sync) {
    let cores = thread::available_parallelism().map_or(1, |cores| cores.get() as u64);
    let share = (1_u64 << 32).div_ceil(cores);
    thread::scope(|scope| {
        for core in 0..cores {
            let look = &look;
            scope.spawn(move || look(core * share..((core + 1) * share).min(1 << 32)));
        }
    });
}

#[test]
fn an_instant_is_reached_for_half_the_range_and_never_sooner_whatever_the_count() {
    every_u32(|range| {
        let mut wrong = 0_u32;
        for ticks in range.map(|ticks| ticks as u32) {
            // A count about to wrap.
            let now = Instant(0xFFFF_FFF0);
            let later = now.after(ticks);
            let is_right = later.reached(now) == (ticks < 1 << 31)
                && later.since(now) == ticks as i32
                && later.before(ticks) == now;
            wrong += u32::from(!is_right);
        }
        assert_eq!(wrong, 0);
    });
}

#[test]
fn an_angle_is_its_own_short_way_round() {
    every_u32(|range| {
        let mut wrong = 0_u32;
        for units in range.map(|units| units as u32) {
            let (angle, from) = (Angle(units), Angle(0xC000_0001));
            let there = from + angle;
            let radians = angle.signed_radians();
            let is_right = there - from == angle
                && (there - from).signed() == units as i32
                && (-core::f32::consts::PI..=core::f32::consts::PI).contains(&radians)
                && (radians < 0.0) == (units >= 1 << 31);
            wrong += u32::from(!is_right);
        }
        assert_eq!(wrong, 0);
    });
}

/// Takes minutes of a core.
#[test]
#[ignore = "every angle: two minutes; --include-ignored"]
fn sine_and_cosine_of_every_angle_are_within_their_bound() {
    every_u32(|range| {
        let mut most = 0.0_f64;
        for units in range.map(|units| units as u32) {
            let exact = f64::from(units) * (core::f64::consts::TAU / 4_294_967_296.0);
            let found = Angle(units).sin_cos();
            let off =
                (f64::from(found.sin) - exact.sin()).abs().max((f64::from(found.cos) - exact.cos()).abs());
            most = most.max(off);
        }
        assert!(most < 1.5e-7, "{most}");
    });
}

/// The places of the counter's bits.
const COUNTER: Range<u32> = 48..52;

/// The CRC is linear, and the counter selects the term that is added to it: a result for one frame holds for each frame with that counter.
#[test]
fn up_to_three_wrong_bits_and_every_burst_of_eight_are_found() {
    let ids = data_ids(7);
    for counter in 0..16 {
        let mut sound = [0x5A, 0, 0xC3, 0x0F, 0xFF, 0, 0x81, 0x18];
        protect(&mut sound, counter, &ids);
        // In the order in which the bits are sent: a burst hits neighbours.
        let number = u64::from_be_bytes(sound);
        let intact = |pattern: u64| is_intact(&(number ^ pattern).to_be_bytes(), &ids);
        assert!(intact(0));
        // A wrong counter belongs to another frame, and is judged by its place in the sequence.
        let bits: Vec<u32> = (0..64).filter(|bit| !COUNTER.contains(bit)).collect();
        for (first, a) in bits.iter().enumerate() {
            for (second, b) in bits.iter().enumerate().skip(first) {
                for c in bits.iter().skip(second) {
                    // The same bit twice stands for fewer wrong bits.
                    let pattern = 1_u64 << a | 1 << b | 1 << c;
                    assert!(!intact(pattern), "{a} {b} {c}");
                }
            }
        }
        for burst in 1..=255_u64 {
            for at in (0..=40).chain(56..=56) {
                assert!(!intact(burst << at), "{burst:#x} at {at}");
            }
        }
    }
}

/// Each content that decodes is encoded again unchanged: for each value of a signal, beside others that are in their range.
#[test]
fn every_word_of_a_command_comes_back_as_it_was() {
    let comes_back = |payload: Payload| {
        let command = Command::decode(payload, Scales::USUAL);
        command.inspect(|command| assert_eq!(command.encode(Scales::USUAL).ok(), Some(payload))).is_some()
    };
    let mut taken = 0;
    for levels in 0..1_u32 << 8 {
        let is_set = |bit: u32| levels >> bit & 1 == 1;
        let command = Command {
            enable: is_set(0),
            with_torque: is_set(1),
            off: is_set(2),
            coast: is_set(3),
            charge: is_set(4),
            discharge: is_set(5),
            acknowledge: is_set(6),
            calibrate: is_set(7),
            torque_nm: 0.0,
        };
        let levels = command.encode(Scales::USUAL).unwrap();
        assert_eq!(Command::decode(levels, Scales::USUAL), Some(command));
        taken += (0..1_u64 << 16).filter(|torque| comes_back(Payload(levels.0 | torque << 16))).count();
    }
    assert_eq!(taken, 256 * 60_001, "torques of −3,000 to 3,000 N·m by tenths, and no other");
    // The words that a command leaves free.
    for word in 1..1_u64 << 16 {
        for shift in [32, 48] {
            comes_back(Payload(word << shift));
        }
    }
}

#[test]
fn every_word_of_the_limits_comes_back_as_it_was() {
    let mut taken = [0; 2];
    for word in 0..1_u64 << 16 {
        for (shift, beside) in [(16, 1 << 48), (32, 1 << 48), (48, 0)] {
            let payload = Payload(word << shift | beside);
            if let Some(limits) = TorqueLimits::decode(payload, Scales::USUAL) {
                assert_eq!(limits.encode(Scales::USUAL).ok(), Some(payload));
                taken[0] += 1;
            }
        }
        for shift in [16, 32] {
            let payload = Payload(word << shift | if shift == 16 { 60_000 << 32 } else { 1 << 16 });
            if let Some(limits) = LinkLimits::decode(payload, Scales::USUAL) {
                assert_eq!(limits.encode(Scales::USUAL).ok(), Some(payload));
                taken[1] += 1;
            }
        }
    }
    assert!(taken.iter().all(|taken| *taken > 60_000), "{taken:?}");
}

/// Tries every word of 16 bits in each place of an otherwise good content: what decodes is encoded again unchanged. Returns how many decoded.
fn every_word(good: Payload, again: impl Fn(Payload) -> Option<Option<Payload>>) -> [usize; 3] {
    [16, 32, 48].map(|shift| {
        let comes_back = |word: &u64| {
            let payload = Payload(good.0 & !(0xFFFF << shift) | word << shift);
            let found = again(payload);
            assert!(found.is_none_or(|found| found == Some(payload)), "{payload:x?}: {found:x?}");
            found.is_some()
        };
        (0..1_u64 << 16).filter(comes_back).count()
    })
}

#[test]
fn every_word_of_a_command_to_the_zs9_comes_back_as_it_was() {
    let again = |payload| {
        Zs9Command::decode(payload, Scales::USUAL).map(|command| command.encode(Scales::USUAL).ok())
    };
    // No level, each one, all of them; four in the first word, three in the third.
    let levels = [0, 0x7F].into_iter().chain((0..7).map(|level| 1 << level));
    for levels in levels.map(|levels: u64| (levels & 0xF) << 12 | levels >> 4 << 32) {
        // Torques of −3,000 to 3,000 N·m by tenths, and no other; in the third word the other three levels and the page.
        assert_eq!(every_word(Payload(levels), again), [60_001, 16, 60_001]);
        // Speeds of −16,000 to 16,000 r/min by halves.
        assert_eq!(every_word(Payload(levels | 1 << 35), again), [64_001, 16, 64_001]);
    }
    let again = |payload| Zs9Link::decode(payload, Scales::USUAL).map(|link| link.encode(Scales::USUAL).ok());
    assert_eq!(every_word(Payload(0), again), [65_001, 2, 1], "0 to 6,500 V by tenths; to calibrate or not");
}

#[test]
fn every_word_of_a_parameter_request_comes_back_as_it_was() {
    let again = |payload| ParameterRequest::decode(payload).map(|request| request.encode().ok());
    assert_eq!(every_word(Payload(3 << 16), again), [256, 1, 1], "a read has no value");
    // 1.0 for parameter 3: of its upper words, 2 · 128 are those of numbers that are none.
    let write = Payload(0x3F80_0000 << 32 | 3 << 16 | 1 << 12);
    assert_eq!(every_word(write, again), [256, 65_536, 65_280]);
}

/// The shortest distance of an edge from an end of its half: a pulse spans two halves, so a half may hold half the shortest pulse.
const fn shortest_ticks(devices: &SwitchLimits) -> u32 {
    devices.min_pulse_ticks.div_ceil(2)
}

/// Checks that each edge stands within its half or at its beginning; a compare at the half's end or anywhere behind it means that there is
/// none. Counts edges that are as near to an end as they may be.
fn at_the_border(half: &CarrierHalf, devices: &SwitchLimits) -> usize {
    let (shortest, period) = (shortest_ticks(devices), half.period_ticks);
    let edges = half.compare_ticks.into_iter().filter(|compare| (1..period).contains(compare));
    let far = shortest..=period.saturating_sub(shortest);
    assert!(edges.clone().all(|edge| far.contains(&edge)), "{half:?}");
    assert!(half.compare_ticks.iter().all(|compare| *compare <= period || *compare == u32::MAX), "{half:?}");
    edges.filter(|edge| [far.start(), far.end()].contains(&edge)).count()
}

/// The free carrier at every angle of 16 bits, from no voltage to more than is available.
#[test]
fn compare_values_are_within_their_half() {
    let devices = SwitchLimits::new(250, 75, 900.0, &CLOCK);
    let mut border = 0;
    for volts in [0.0, 1.0, 50.0, 300.0, 600.0, 800.0, 840.0, 860.0, 900.0] {
        for upper in 0..1_u32 << 16 {
            let mut modulator = Modulator::new(devices, Schedule::new(&CLOCK));
            let reference = Reference::turning(volts, Angle(upper << 16), 0.0, Instant(0), 1_500.0);
            let half = modulator.step(Instant(0), Some(&reference));
            assert!(half.period_ticks >= devices.shortest_half_ticks, "{half:?}");
            border += at_the_border(&half, &devices);
        }
    }
    assert!(border > 10_000, "{border} at the border");
}

/// Every mode (with the feature `optimal` the optimised patterns too), for two turns either way from 64 angles, at five frequencies and
/// twelve voltages: the turn decides where each half begins.
#[test]
fn compare_values_are_within_their_half_in_every_mode() {
    let devices = SwitchLimits::new(250, 75, 900.0, &CLOCK);
    let mut edges = 0;
    for mode in Mode::ALL.into_iter().filter(|mode| *mode != Mode::Off) {
        let mut border = 0;
        for hz in [17.0, -60.0, 110.0, -230.0, 400.0_f32] {
            let rate = hz * 4_294_967_296.0 / 25e6;
            for (first, tenths) in
                (0..64_u32).flat_map(|first| (0..12_u32).map(move |tenths| (first, tenths)))
            {
                let mut modulator = Modulator::new(devices, Schedule::fixed(mode, &CLOCK));
                let (mut now, mut angle) = (Instant(0), Angle(first << 26));
                for _ in 0..4 * mode.carriers().max(10) {
                    let volts = 95.5 * tenths as f32;
                    let reference = Reference::turning(volts, angle, rate, now, 1_500.0);
                    let half = modulator.step(now, Some(&reference));
                    assert_eq!(half.mode, mode);
                    border += at_the_border(&half, &devices);
                    edges +=
                        half.compare_ticks.iter().filter(|compare| **compare < half.period_ticks).count();
                    now = now.after(half.period_ticks);
                    angle = angle + Angle((rate * half.period_ticks as f32) as i32 as u32);
                }
            }
        }
        assert!(border > 0, "{mode:?} has none at the border");
    }
    assert!(edges > 1_000_000, "{edges} edges");
}

/// Ticks of a carrier half in which every leg of nine switches is tried.
const FEW: u32 = 8;

/// Six instants in order, from 0 to [`FEW`]: the ends of the pauses of L, M and H.
fn every_leg() -> impl Iterator<Item = [u32; 6]> {
    let digit = |number: u32, place: u32| number / (FEW + 1).pow(place) % (FEW + 1);
    (0..(FEW + 1).pow(6))
        .map(move |number| [0, 1, 2, 3, 4, 5].map(|place| digit(number, place)))
        .filter(|ends| ends.is_sorted())
}

/// The ticks of a half in which a leg shorts the link; `None` if its state is illegal at any time.
fn shorted([low, middle, high]: [GateTicks; 3]) -> Option<usize> {
    let states =
        (0..FEW).map(|tick| LegState::of_gates(high.is_on(tick), middle.is_on(tick), low.is_on(tick)));
    let states: Option<Vec<LegState>> = states.collect();
    Some(states?.into_iter().filter(|state| *state == LegState::ShootThrough).count())
}

fn pauses([la, lb, ma, mb, ha, hb]: [u32; 6]) -> [GateTicks; 3] {
    [(la, lb), (ma, mb), (ha, hb)].map(|(off_from, off_to)| GateTicks { off_from, off_to })
}

/// Pauses in order make a legal leg, and overlapping ones do not: so legality is their order.
#[test]
fn a_leg_is_legal_where_its_pauses_are_apart() {
    let (mut apart, mut together) = (0, 0);
    for ends in every_leg() {
        assert!(shorted(pauses(ends)).is_some(), "{ends:?}");
        apart += 1;
        let [la, lb, ma, mb, ha, hb] = ends;
        // The same ends, two pauses exchanged to overlap.
        for (other, overlaps) in [([la, ma, lb, mb, ha, hb], lb < ma), ([la, lb, ma, ha, mb, hb], mb < ha)] {
            if overlaps && la < lb && ma < mb && ha < hb {
                assert_eq!(shorted(pauses(other)), None, "{other:?}");
                together += 1;
            }
        }
    }
    assert!(apart == 3_003 && together > 100, "{apart} {together}");
}

/// Every leg of a half of eight ticks, with every move of its two borders by up to eight: the compensation of dead time only compares,
/// adds and halves, so that a longer half holds nothing that this one does not.
#[test]
fn compensated_legs_stay_legal_and_short_nothing_for_longer() {
    let small_a = 8.0;
    let currents: Vec<f32> =
        (-8..=8).map(|tick| tick as f32).chain([f32::NAN, f32::INFINITY, f32::MIN]).collect();
    let currents: Vec<[f32; 2]> = currents.iter().flat_map(|a| currents.iter().map(|b| [*a, *b])).collect();
    let (mut moved, mut rests) = (0_u32, 0_u32);
    for ends in every_leg() {
        let [low, middle, high] = pauses(ends);
        let before = shorted([low, middle, high]);
        for (ticks, currents_a) in
            [0, 5, 16].into_iter().flat_map(|ticks| currents.iter().map(move |a| (ticks, a)))
        {
            let mut gates = [GateTicks::default(); 9];
            [gates[0], gates[3], gates[6]] = [high, middle, low];
            let currents_a = currents_a.map(|a| Abc { a, b: 8.0, c: -8.0 });
            DeadTime { ticks, small_a }.compensate(&mut gates, &currents_a);
            let leg = [gates[6], gates[3], gates[0]];
            let ordered = leg.iter().all(|gate| gate.off_from <= gate.off_to && gate.off_to <= FEW);
            let after = shorted(leg);
            assert!(
                ordered && after.is_some() && after <= before,
                "{ends:?} {ticks} {currents_a:?}: {leg:?}"
            );
            assert!([1, 2, 4, 5, 7, 8].iter().all(|other| gates[*other] == GateTicks::default()));
            assert!(ticks > 0 || leg == [low, middle, high]);
            *(if leg == [low, middle, high] { &mut rests } else { &mut moved }) += 1;
        }
    }
    assert!(moved > 500_000 && rests > 500_000, "{moved} {rests}");
}

/// Every edge of a half of 64 ticks of a two-level leg, with every dead time up to 70 and every current's share of it.
#[test]
fn compensated_edges_come_earlier_by_the_dead_time_at_most() {
    let (period_ticks, small_a) = (64, 8.0);
    let mut moved = 0;
    for (compare, dead_time_ticks) in (0..=70).flat_map(|compare| (0..=70).map(move |dead| (compare, dead))) {
        let delay = EdgeDelay::of_dead_time(dead_time_ticks);
        for current in (-10..=10).map(|a| a as f32).chain([f32::NAN, f32::INFINITY, f32::NEG_INFINITY]) {
            for level in [false, true] {
                let before = CarrierHalf {
                    period_ticks,
                    compare_ticks: [compare; 3],
                    start_levels: [level; 3],
                    ..CarrierHalf::default()
                };
                let mut half = before;
                compensate(&mut half, &Abc { a: current, b: current, c: current }, small_a, delay);
                let [found, ..] = half.compare_ticks;
                let against = if level { -current } else { current };
                let most = if compare < period_ticks && against > 0.0 { dead_time_ticks } else { 0 };
                assert!(
                    (compare.saturating_sub(most)..=compare).contains(&found),
                    "{before:?} {current} {found}"
                );
                // From the small current on, all of it; for a current that is not finite, which is a fault, it only stays within its limits.
                assert!(
                    against < small_a || against.is_infinite() || found == compare.saturating_sub(most),
                    "{before:?} {current} {found}"
                );
                assert_eq!(CarrierHalf { compare_ticks: [compare; 3], ..half }, before);
                moved += u32::from(found < compare);
            }
        }
    }
    assert!(moved > 50_000, "{moved}");
}
