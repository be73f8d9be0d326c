//! The nine-switch modulator, judged by a referee that knows only the gates: it rebuilds every leg's state at every
//! instant in double precision, and asks the table of legal states for all the rest.

use proptest::prelude::*;
use std::collections::BTreeMap;
use tractive::frames::Angle;
use tractive::nine_switch::{LegState, MotorVoltage, Period, Refused, Request, Scheme, step};

/// A leg's state as the paper's table 1 has it; 2 stands for shoot-through.
fn leg_state(gates: [bool; 3]) -> Result<i32, String> {
    match gates {
        [true, false, true] => Ok(1),
        [false, true, true] => Ok(0),
        [true, true, false] => Ok(-1),
        [true, true, true] => Ok(2),
        _ => Err(format!("illegal leg {gates:?}")),
    }
}

/// A stretch of the period in which no gate toggles.
#[derive(Debug)]
struct Stretch {
    length: f64,
    legs: [i32; 3],
}

/// The gates' work.
#[derive(Debug)]
struct Seen {
    stretches: Vec<Stretch>,
    toggles: usize,
}

fn look(period: &Period) -> Result<Seen, String> {
    let gates: Vec<(bool, Vec<f64>)> =
        period.gates.iter().map(|gate| (gate.starts_on(), gate.toggles().map(f64::from).collect())).collect();
    look_at(&gates, 1.0)
}

fn look_at(gates: &[(bool, Vec<f64>)], length: f64) -> Result<Seen, String> {
    let mut instants = vec![0.0, length];
    for (_, toggles) in gates {
        if toggles.windows(2).any(|pair| pair[0] >= pair[1]) || toggles.len() % 2 == 1 {
            return Err(format!("not sorted, or not periodic: {toggles:?}"));
        }
        if toggles.iter().any(|t| *t <= 0.0 || *t >= length) {
            return Err(format!("outside the period: {toggles:?}"));
        }
        instants.extend(toggles);
    }
    instants.sort_by(f64::total_cmp);
    instants.dedup();
    let mut stretches = Vec::new();
    for pair in instants.windows(2) {
        let middle = 0.5 * (pair[0] + pair[1]);
        let level = |gate: usize| {
            let (start, toggles) = &gates[gate];
            start ^ (toggles.iter().filter(|t| **t < middle).count() % 2 == 1)
        };
        let mut legs = [0; 3];
        for (leg, state) in legs.iter_mut().enumerate() {
            *state = leg_state([level(leg), level(leg + 3), level(leg + 6)])
                .map_err(|e| format!("{e} at {middle}"))?;
        }
        stretches.push(Stretch { length: pair[1] - pair[0], legs });
    }
    Ok(Seen { stretches, toggles: gates.iter().map(|(_, toggles)| toggles.len()).sum() })
}

fn vector(u: f64, v: f64, w: f64) -> [f64; 2] {
    [(2.0 * u - v - w) / 3.0, (v - w) / 3_f64.sqrt()]
}

impl Seen {
    /// Mean voltage vectors of the upper and lower motor in shares of the link voltage.
    fn means(&self) -> [[f64; 2]; 2] {
        let mut means = [[0.0; 2]; 2];
        for stretch in self.stretches.iter().filter(|stretch| !stretch.legs.contains(&2)) {
            let node = |leg: usize, lower: bool| match stretch.legs[leg] {
                1 => f64::from(!lower),
                0 => 0.0,
                _ => 1.0,
            };
            for (mean, lower) in means.iter_mut().zip([false, true]) {
                let [alpha, beta] = vector(node(0, lower), node(1, lower), node(2, lower));
                mean[0] += alpha * stretch.length;
                mean[1] += beta * stretch.length;
            }
        }
        means
    }

    /// The share of the period in which some leg is shorted.
    fn shorted(&self) -> f64 {
        self.stretches.iter().filter(|s| s.legs.contains(&2)).map(|s| s.length).sum()
    }

    /// Most legs that are shorted at the same time.
    fn shorted_at_once(&self) -> usize {
        self.stretches.iter().map(|s| s.legs.iter().filter(|leg| **leg == 2).count()).max().unwrap_or(0)
    }

    /// Time of each active vector: those whose three states are not all the same, and not shorted.
    fn dwells(&self) -> BTreeMap<[i32; 3], f64> {
        let mut dwells = BTreeMap::new();
        for stretch in &self.stretches {
            let [u, v, w] = stretch.legs;
            let zero = u == v && v == w;
            if !zero && !stretch.legs.contains(&2) {
                *dwells.entry(stretch.legs).or_insert(0.0) += stretch.length;
            }
        }
        dwells
    }

    /// Changes from one vector to another, the one at the period's end included.
    fn changes(&self) -> usize {
        let count = self.stretches.len();
        (0..count).filter(|k| self.stretches[*k].legs != self.stretches[(k + 1) % count].legs).count()
    }

    /// The number of the vector of each stretch of the rising half.
    fn rising(&self) -> Vec<i32> {
        const VECTORS: [[i32; 3]; 15] = [
            [1, 0, 0],
            [1, 1, 0],
            [0, 1, 0],
            [0, 1, 1],
            [0, 0, 1],
            [1, 0, 1],
            [-1, 1, 1],
            [-1, -1, 1],
            [1, -1, 1],
            [1, -1, -1],
            [1, 1, -1],
            [-1, 1, -1],
            [1, 1, 1],
            [0, 0, 0],
            [-1, -1, -1],
        ];
        let half = self.stretches.len() / 2;
        self.stretches[..=half]
            .iter()
            .map(|s| VECTORS.iter().position(|v| *v == s.legs).unwrap() as i32 + 1)
            .collect()
    }
}

/// Numbers that are the same in every run.
struct Draw(u64);

impl Draw {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / 9_007_199_254_740_992.0
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.next()
    }

    /// A request that fits, one in ten so closely that it takes all but 1e-7 of the room.
    fn feasible(&mut self, scheme: Scheme) -> Request {
        self.within(scheme, 0.999_999_9)
    }

    /// A request that takes up to this part of the room.
    fn within(&mut self, scheme: Scheme, most: f64) -> Request {
        let duty = if self.next() < 0.1 { 0.0 } else { self.between(0.01, 0.6) };
        let (angle1, angle2) = (self.between(0.0, 360.0), self.between(0.0, 360.0));
        let (room1, room2) = if scheme == Scheme::RthdSlide {
            let first = 2.0 * (1.0 - duty) * self.next();
            (first, 2.0 * (1.0 - duty) - first)
        } else {
            (1.0 - duty, 1.0 - duty)
        };
        let mut share = || if self.next() < 0.1 { most } else { self.between(0.02, most) };
        let (share1, share2) = (share(), share());
        Request {
            scheme,
            upper: motor(angle1, share1 * room1 / span(angle1)),
            lower: motor(angle2, share2 * room2 / span(angle2)),
            shoot_through: duty as f32,
        }
    }
}

fn motor(angle_deg: f64, modulation_index: f64) -> MotorVoltage {
    let units = (angle_deg / 360.0).rem_euclid(1.0) * 4_294_967_296.0;
    MotorVoltage { angle: Angle(units.round() as u64 as u32), modulation_index: modulation_index as f32 }
}

fn degrees(motor: MotorVoltage) -> f64 {
    f64::from(motor.angle.0) * 360.0 / 4_294_967_296.0
}

fn phases(angle_deg: f64) -> [f64; 3] {
    [0.0, 120.0, 240.0].map(|shift| (angle_deg - shift).to_radians().cos())
}

/// Largest minus smallest phase of the unit vector.
fn span(angle_deg: f64) -> f64 {
    let phases = phases(angle_deg);
    phases.into_iter().fold(f64::MIN, f64::max) - phases.into_iter().fold(f64::MAX, f64::min)
}

/// The shorter of a motor's two active vectors in the rising half, in periods.
fn shortest(motor: MotorVoltage) -> f64 {
    let mut phases = phases(degrees(motor));
    phases.sort_by(f64::total_cmp);
    0.25 * f64::from(motor.modulation_index) * (phases[1] - phases[0]).min(phases[2] - phases[1])
}

/// The largest phase and the smallest.
fn extremes(angle_deg: f64) -> (usize, usize) {
    let phases = phases(angle_deg);
    let by = |a: &usize, b: &usize| phases[*a].total_cmp(&phases[*b]);
    ((0..3).max_by(by).unwrap(), (0..3).min_by(by).unwrap())
}

/// The same voltages, without shoot-through.
fn without_shoot_through(request: &Request) -> Seen {
    // Those applied: a request that fits within rounding has lost some 1e-7 of its voltage.
    let applied = step(request).unwrap().applied;
    let mut request = Request { shoot_through: 0.0, ..*request };
    (request.upper.modulation_index, request.lower.modulation_index) =
        (applied.upper_index, applied.lower_index);
    look(&step(&request).unwrap()).unwrap()
}

/// Distance of the mean vectors from those wanted, in shares of the link voltage.
fn voltage_error(seen: &Seen, wanted: [(f64, f64); 2]) -> f64 {
    let mut worst = 0.0_f64;
    for (mean, (angle_deg, modulation_index)) in seen.means().into_iter().zip(wanted) {
        let (sin, cos) = angle_deg.to_radians().sin_cos();
        worst =
            worst.max((mean[0] - 0.5 * modulation_index * cos).hypot(mean[1] - 0.5 * modulation_index * sin));
    }
    worst
}

/// As many cases of each scheme.
const CASES: usize = 4_000;

#[test]
fn voltages_and_shoot_through_are_what_was_asked_for() {
    for scheme in Scheme::ALL {
        let mut draw = Draw(scheme as u64 + 1);
        let (mut voltage, mut duty, mut dwell) = (0.0_f64, 0.0_f64, 0.0_f64);
        for _ in 0..CASES {
            let request = draw.feasible(scheme);
            let period = step(&request).unwrap();
            assert!(period.applied.feasible(), "{request:?}");
            assert_eq!(step(&request), Ok(period));
            let seen = look(&period).unwrap_or_else(|e| panic!("{e}: {request:?}"));
            let wanted = [request.upper, request.lower].map(|m| (degrees(m), f64::from(m.modulation_index)));
            voltage = voltage.max(voltage_error(&seen, wanted));
            duty = duty.max((seen.shorted() - f64::from(request.shoot_through)).abs());
            assert!(seen.shorted_at_once() <= 1, "{request:?}");
            let (with, without) = (seen.dwells(), without_shoot_through(&request).dwells());
            for (vector, time) in &without {
                dwell = dwell.max((with.get(vector).copied().unwrap_or(0.0) - time).abs());
            }
            assert!(with.keys().all(|vector| without.contains_key(vector)), "{request:?}");
        }
        println!(
            "{:<13} voltage {voltage:.1e} U_in, shoot-through {duty:.1e} T, dwell {dwell:.1e} T",
            scheme.name()
        );
        assert!(voltage < 1e-6 && duty < 1e-6);
        assert_eq!(dwell, 0.0, "{scheme:?}");
    }
}

#[test]
fn toggles_and_changes_are_those_of_the_table() {
    for scheme in Scheme::ALL {
        let mut draw = Draw(scheme as u64 + 11);
        let (mut toggles, mut changes, mut cases) = (0, 0, 0);
        for _ in 0..CASES {
            // No vector so short that single precision loses it. Not to the last: where the shoot-through fills V13, M may have no pause left, and toggles less.
            let request = draw.within(scheme, 0.999);
            if shortest(request.upper).min(shortest(request.lower)) < 1e-6 {
                continue;
            }
            cases += 1;
            let (with, without) = (look(&step(&request).unwrap()).unwrap(), without_shoot_through(&request));
            let added = with.toggles as i32 - without.toggles as i32;
            let central = scheme == Scheme::RthdCentral && request.shoot_through > 0.0;
            assert_eq!(added, if central { 4 } else { 0 }, "{request:?}");
            let meet = extremes(degrees(request.upper)).1 == extremes(degrees(request.lower)).0;
            match scheme {
                Scheme::S => assert_eq!((without.toggles, without.changes()), (24, 12), "{request:?}"),
                Scheme::Rs => assert_eq!((without.toggles, without.changes()), (16, 8), "{request:?}"),
                Scheme::Zvo => {}
                _ => assert_eq!(
                    (without.toggles, without.changes()),
                    (if meet { 20 } else { 24 }, 10),
                    "{request:?}"
                ),
            }
            toggles += without.toggles;
            changes += without.changes();
        }
        let mean = |count: usize| count as f64 / f64::from(cases);
        let (toggles, changes) = (mean(toggles), mean(changes));
        assert!(cases > CASES as i32 * 9 / 10);
        println!("{:<13} toggles {toggles:.2}, vector changes {changes:.2}", scheme.name());
        match scheme {
            Scheme::Zvo => assert!((toggles - 19.7).abs() < 0.2 && (changes - 9.5).abs() < 0.1),
            Scheme::Rthd => assert!((toggles - 22.7).abs() < 0.2),
            _ => {}
        }
    }
}

#[test]
fn vectors_come_in_the_order_of_the_table() {
    let rising = |scheme, angle1, angle2| {
        let request =
            Request { scheme, upper: motor(angle1, 0.4), lower: motor(angle2, 0.3), shoot_through: 0.0 };
        look(&step(&request).unwrap()).unwrap().rising()
    };
    assert_eq!(rising(Scheme::S, 20.0, 40.0), [15, 8, 7, 13, 2, 1, 14]);
    assert_eq!(rising(Scheme::Rs, 20.0, 40.0), [8, 7, 13, 2, 1]);
    for scheme in [Scheme::Rthd, Scheme::RthdCentral, Scheme::RthdSlide] {
        assert_eq!(rising(scheme, 20.0, 40.0), [15, 8, 7, 2, 1, 14]);
    }
    assert_eq!(rising(Scheme::Zvo, 20.0, 10.0), [15, 8, 7, 2, 1, 14]);
    assert_eq!(rising(Scheme::Zvo, 40.0, 50.0), [8, 7, 13, 2, 1]);
    assert_eq!(rising(Scheme::Zvo, 20.0, 40.0), [8, 7, 13, 2, 1, 14]);
    assert_eq!(rising(Scheme::Zvo, 40.0, 20.0), [15, 8, 7, 13, 2, 1]);
    // Sector II, and the mirror image far round.
    assert_eq!(rising(Scheme::S, 80.0, 100.0), [15, 8, 9, 13, 2, 3, 14]);
    assert_eq!(rising(Scheme::S, 340.0, 320.0), [15, 12, 7, 13, 6, 1, 14]);
}

#[test]
fn zero_vectors_change_exactly_at_the_half_sectors() {
    for border in 0..12 {
        let angle = 30.0 * f64::from(border);
        // In [−30°, 30°), [90°, 150°), [210°, 270°) the motors take V14 and V15.
        let outer = ((angle + 30.0) / 60.0) as i32 % 2 == 0;
        let request = Request {
            scheme: Scheme::Zvo,
            upper: motor(angle, 0.4),
            lower: motor(angle, 0.4),
            shoot_through: 0.0,
        };
        let seen = look(&step(&request).unwrap()).unwrap();
        let has = |state| seen.stretches.iter().any(|s| s.legs == [state; 3]);
        assert_eq!((has(0), has(-1), has(1)), (outer, outer, !outer), "{angle}°");
    }
}

#[test]
fn each_motor_has_its_turn() {
    let mut draw = Draw(21);
    for scheme in [Scheme::S, Scheme::Rs, Scheme::Rthd, Scheme::Zvo, Scheme::RthdCentral] {
        for _ in 0..CASES / 4 {
            let request = draw.feasible(scheme);
            let seen = look(&step(&request).unwrap()).unwrap();
            let mut now = 0.0;
            for stretch in &seen.stretches {
                let middle = now + 0.5 * stretch.length;
                now += stretch.length;
                let upper_turn = (0.25..0.75).contains(&middle);
                assert!(!stretch.legs.contains(&if upper_turn { -1 } else { 0 }), "{middle}: {request:?}");
            }
        }
    }
}

#[test]
fn zero_time_and_shoot_through_are_divided_as_the_scheme_says() {
    for (scheme, inner, junctions) in [(Scheme::S, 0.5, 8), (Scheme::Rs, 1.0, 4), (Scheme::Rthd, 0.0, 4)] {
        let mut draw = Draw(scheme as u64 + 41);
        for _ in 0..CASES / 4 {
            let request = draw.within(scheme, 0.99);
            let spans =
                [request.upper, request.lower].map(|m| span(degrees(m)) * f64::from(m.modulation_index));
            // Zero time of both motors: half the period each, less the half span.
            let zeros = spans.map(|span| 0.5 - 0.5 * span);
            let seen = without_shoot_through(&request);
            let time = |state| {
                let those = seen.stretches.iter().filter(|s| s.legs == [state; 3]);
                those.map(|s| s.length).sum::<f64>()
            };
            for (got, wanted) in [
                (time(0), zeros[0] * (1.0 - inner)),
                (time(-1), zeros[1] * (1.0 - inner)),
                (time(1), (zeros[0] + zeros[1]) * inner),
            ] {
                assert!((got - wanted).abs() < 1e-6, "{got} for {wanted}: {request:?}");
            }
            let each = f64::from(request.shoot_through) / f64::from(junctions);
            let seen = look(&step(&request).unwrap()).unwrap();
            let shorted: Vec<f64> =
                seen.stretches.iter().filter(|s| s.legs.contains(&2)).map(|s| s.length).collect();
            if each > 0.0 && shortest(request.upper).min(shortest(request.lower)) > 1e-6 {
                assert_eq!(shorted.len(), junctions as usize, "{request:?}");
                assert!(shorted.iter().all(|length| (length - each).abs() < 5e-7), "{shorted:?} {request:?}");
            }
        }
    }
}

/// The gates for these indices at the worst angles.
fn worst(scheme: Scheme, duty: f64, depth1: f64, depth2: f64) -> Period {
    let request = Request {
        scheme,
        upper: motor(30.0, depth1),
        lower: motor(150.0, depth2),
        shoot_through: duty as f32,
    };
    step(&request).unwrap()
}

#[test]
fn the_sliding_boundary_shares_what_the_fixed_one_leaves() {
    for duty in [0.0, 0.1, 0.25, 0.5] {
        let sum = 2.0 * (1.0 - duty) / 3_f64.sqrt();
        for part in [0.0, 0.1, 0.35, 0.5, 0.8, 1.0] {
            let (depth1, depth2) = (part * sum, (1.0 - part) * sum);
            assert!(worst(Scheme::RthdSlide, duty, depth1, depth2).applied.feasible(), "{duty} {part}");
            assert!(
                !worst(Scheme::RthdSlide, duty, depth1 + 1e-4, depth2 + 1e-4).applied.feasible(),
                "{duty} {part}"
            );
            assert_eq!(worst(Scheme::Rthd, duty, depth1, depth2).applied.feasible(), part == 0.5);
        }
        // One motor may want too much; the other keeps its own share, and the first has the rest.
        let applied = worst(Scheme::RthdSlide, duty, 5.0, 0.3 * sum).applied;
        assert!(applied.upper_limited && !applied.lower_limited);
        assert!((f64::from(applied.upper_index) - 0.7 * sum).abs() < 2e-6);
        let applied = worst(Scheme::RthdSlide, duty, 5.0, 5.0).applied;
        assert!(applied.upper_limited && applied.lower_limited);
        assert!((f64::from(applied.lower_index) - 0.5 * sum).abs() < 2e-6);
    }
}

#[test]
fn what_does_not_fit_is_scaled_and_reported() {
    let mut draw = Draw(31);
    for scheme in Scheme::ALL {
        for _ in 0..CASES {
            let mut request = draw.feasible(scheme);
            let scale = draw.between(0.9, 3.0);
            for modulation_index in [&mut request.upper.modulation_index, &mut request.lower.modulation_index]
            {
                *modulation_index = (f64::from(*modulation_index) * scale) as f32;
            }
            let period = step(&request).unwrap();
            let motors = [request.upper, request.lower];
            let spans = motors.map(|m| span(degrees(m)) * f64::from(m.modulation_index));
            let own = 1.0 - f64::from(request.shoot_through);
            let rooms = if scheme == Scheme::RthdSlide {
                [own.max(2.0 * own - spans[1]), own.max(2.0 * own - spans[0])]
            } else {
                [own, own]
            };
            let applied = period.applied;
            let given =
                [(applied.upper_index, applied.upper_limited), (applied.lower_index, applied.lower_limited)];
            for (k, (modulation_index, limited)) in given.into_iter().enumerate() {
                let fits = motors[k].modulation_index.into();
                let left = rooms[k] / span(degrees(motors[k]));
                assert!(
                    (f64::from(modulation_index) - left.min(fits)).abs() < 2e-6,
                    "{k} {request:?} {applied:?}"
                );
                if (spans[k] - rooms[k]).abs() > 3e-6 {
                    assert_eq!(limited, spans[k] > rooms[k], "{k} {request:?} {applied:?}");
                }
            }
            let seen = look(&period).unwrap_or_else(|e| panic!("{e}: {request:?}"));
            let wanted = [0, 1].map(|k| (degrees(motors[k]), f64::from(given[k].0)));
            assert!(voltage_error(&seen, wanted) < 1e-6, "{request:?}");
            assert!((seen.shorted() - f64::from(request.shoot_through)).abs() < 1e-6, "{request:?}");
            assert!(seen.shorted_at_once() <= 1, "{request:?}");
        }
    }
}

#[test]
fn nonsense_is_refused_by_name() {
    let good = Request {
        scheme: Scheme::Rthd,
        upper: motor(10.0, 0.5),
        lower: motor(20.0, 0.5),
        shoot_through: 0.1,
    };
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, -0.1] {
        let with = |motor: MotorVoltage| MotorVoltage { modulation_index: bad, ..motor };
        assert_eq!(step(&Request { upper: with(good.upper), ..good }), Err(Refused::UpperIndex));
        assert_eq!(step(&Request { lower: with(good.lower), ..good }), Err(Refused::LowerIndex));
        assert_eq!(step(&Request { shoot_through: bad, ..good }), Err(Refused::ShootThrough));
    }
    assert_eq!(step(&Request { shoot_through: 1.001, ..good }), Err(Refused::ShootThrough));
}

#[test]
fn schemes_have_their_names_and_codes() {
    let names = ["s", "rs", "rthd", "zvo", "rthd-central", "rthd-slide"];
    assert_eq!(Scheme::ALL.map(Scheme::name), names);
    for code in 0..10 {
        let scheme = Scheme::ALL.get(code as usize).copied().unwrap_or(Scheme::Rthd);
        assert_eq!(Scheme::from_code(code), scheme);
    }
}

#[test]
fn legs_know_their_states() {
    for code in 0..8 {
        let gates = [code & 4 != 0, code & 2 != 0, code & 1 != 0];
        let [high, middle, low] = gates;
        let expected = match leg_state(gates) {
            Ok(1) => Some((LegState::One, (1.0, 0.0))),
            Ok(0) => Some((LegState::Zero, (0.0, 0.0))),
            Ok(-1) => Some((LegState::MinusOne, (1.0, 1.0))),
            Ok(_) => Some((LegState::ShootThrough, (0.0, 0.0))),
            Err(_) => None,
        };
        assert_eq!(LegState::of_gates(high, middle, low).map(|s| (s, s.nodes())), expected);
    }
}

fn any_request() -> impl Strategy<Value = Request> {
    let modulation_index =
        prop_oneof![4 => 0.0..2.0_f32, 1 => Just(0.0), 1 => Just(f32::MAX), 1 => 0.0..1e-6_f32];
    let duty = prop_oneof![4 => 0.0..1.0_f32, 1 => Just(0.0), 1 => Just(1.0)];
    // Sector borders and their neighbours too.
    let angle = prop_oneof![
        any::<u32>(),
        (0..24_u64, -2..=2_i32).prop_map(|(k, d)| (((k << 32) / 24) as u32).wrapping_add_signed(d)),
    ];
    (0..6_usize, angle.clone(), modulation_index.clone(), angle, modulation_index, duty).prop_map(
        |(scheme, angle1, depth1, angle2, depth2, shoot_through)| Request {
            scheme: Scheme::ALL[scheme],
            upper: MotorVoltage { angle: Angle(angle1), modulation_index: depth1 },
            lower: MotorVoltage { angle: Angle(angle2), modulation_index: depth2 },
            shoot_through,
        },
    )
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(4000) })]

    #[test]
    fn whatever_is_asked_for_the_legs_are_legal(request in any_request(), half_ticks in 1..=4_194_304_u32) {
        let period = step(&request).unwrap();
        for gate in period.gates {
            prop_assert!(0.0 <= gate.off_from && gate.off_from <= gate.off_to && gate.off_to <= 0.5, "{gate:?}");
        }
        let seen = look(&period).map_err(TestCaseError::fail)?;
        prop_assert!(seen.shorted_at_once() <= 1, "{period:?}");
        prop_assert!((seen.shorted() - f64::from(request.shoot_through)).abs() < 1e-6);
        let applied = period.applied;
        prop_assert!(voltage_error(&seen, [
            (degrees(request.upper), applied.upper_index.into()),
            (degrees(request.lower), applied.lower_index.into()),
        ]) < 1e-6);
        // On a timer: within half a tick each, and as legal.
        let length = f64::from(half_ticks);
        let mut gates = Vec::new();
        for (gate, ticks) in period.gates.iter().zip(period.ticks(half_ticks)) {
            prop_assert!(ticks.off_from <= ticks.off_to && ticks.off_to <= half_ticks);
            for (tick, instant) in [(ticks.off_from, gate.off_from), (ticks.off_to, gate.off_to)] {
                prop_assert!((f64::from(tick) - 2.0 * length * f64::from(instant)).abs() <= 0.75);
            }
            let paused = ticks.off_from < ticks.off_to;
            prop_assert_eq!(ticks.is_on(0), !(paused && ticks.off_from == 0));
            let mut toggles = Vec::new();
            if paused && ticks.off_from > 0 { toggles.push(f64::from(ticks.off_from)); }
            if paused && ticks.off_to < half_ticks { toggles.push(f64::from(ticks.off_to)); }
            let back: Vec<f64> = toggles.iter().rev().map(|t| 2.0 * length - t).collect();
            toggles.extend(back);
            gates.push((ticks.is_on(0), toggles));
        }
        look_at(&gates, 2.0 * length).map_err(TestCaseError::fail)?;
    }
}
