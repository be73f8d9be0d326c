//! The modulator under arbitrary references: whatever it is asked for, its pulses are legal.

use proptest::prelude::*;
use tractive::frames::Angle;
use tractive::modulation::{CarrierHalf, Mode, Modulator, Reference, Schedule, SwitchLimits};
use tractive::time::{Clock, Instant};

const CLOCK: Clock = Clock::new(25_000_000, 2_500);
const MIN_PULSE: u32 = 250;

fn devices() -> SwitchLimits {
    SwitchLimits::new(MIN_PULSE, 0, 900.0, &CLOCK)
}

/// Angle units per tick of a frequency.
fn rate(hz: f32) -> f32 {
    hz * 4_294_967_296.0 / 25e6
}

/// Steps through halves with references drawn by the test: modulation index, Hz, V.
fn by_halves(references: &[(f32, f32, f32)]) -> Vec<CarrierHalf> {
    let mut modulator = Modulator::new(devices(), Schedule::new(&CLOCK));
    let (mut now, mut angle) = (Instant(u32::MAX - 1_000_000), Angle::ZERO);
    let mut halves = Vec::new();
    for (modulation_index, hz, udc_v) in references {
        let voltage_v = modulation_index * udc_v * std::f32::consts::FRAC_2_PI;
        let reference = Reference::turning(voltage_v, angle, rate(*hz), now, *udc_v);
        let half = modulator.step(now, Some(&reference));
        now = now.after(half.period_ticks);
        angle = angle + Angle((rate(*hz) * half.period_ticks as f32) as i32 as u32);
        halves.push(half);
    }
    halves
}

/// The same with each reference for 40 halves.
fn play(references: &[(f32, f32, f32)]) -> Vec<CarrierHalf> {
    let held = references.iter().flat_map(|reference| [*reference; 40]);
    by_halves(&held.collect::<Vec<_>>())
}

proptest! {
    #[test]
    fn pulses_are_legal(references in prop::collection::vec((0.0..1.6_f32, -420.0..420.0_f32, 700.0..2000.0_f32), 1..12)) {
        let halves = play(&references);
        for half in &halves {
            prop_assert!(half.period_ticks >= 1 && half.period_ticks <= devices().longest_half_ticks());
            prop_assert!(half.mode != Mode::Off);
            let ons = half.on_ticks(0);
            for (on, compare) in ons.into_iter().zip(half.compare_ticks) {
                prop_assert!(on <= half.period_ticks);
                // A pulse that does not span the half's border is whole or has half its length at least.
                let period = half.period_ticks;
                if compare < period && compare > 0 {
                    prop_assert!(compare >= MIN_PULSE / 2 || period < MIN_PULSE, "{half:?}");
                    prop_assert!(period - compare >= MIN_PULSE / 2 || period < MIN_PULSE, "{half:?}");
                }
            }
        }
    }

    #[test]
    fn nonsense_makes_no_endless_half(voltage in any::<f32>(), rate in any::<f32>(), udc in any::<f32>(), modulation_index in any::<f32>()) {
        let mut modulator = Modulator::new(devices(), Schedule::new(&CLOCK));
        let reference = Reference { modulation_index, ..Reference::turning(voltage, Angle(77), rate, Instant(0), udc) };
        for k in 0..10 {
            let half = modulator.step(Instant(k * 10_000), Some(&reference));
            prop_assert!(half.period_ticks >= 1 && half.period_ticks <= devices().longest_half_ticks());
        }
    }

    #[test]
    fn on_time_is_what_levels_say(period in 1..20_000_u32, compare in 0..30_000_u32, level: bool, from in 0..20_000_u32) {
        let half = CarrierHalf {
            period_ticks: period,
            compare_ticks: [compare; 3],
            start_levels: [level; 3],
            ..CarrierHalf::default()
        };
        let brute = (from..period).filter(|tick| level ^ (*tick >= compare)).count();
        prop_assert_eq!(half.on_ticks(from)[0] as usize, brute);
    }

    #[test]
    fn words_come_back_as_they_went(period: u32, compare: [u32; 3], levels: [bool; 3], mode in 0..Mode::ALL.len() as u32, half in 0..60_u8) {
        let sent = CarrierHalf { period_ticks: period, compare_ticks: compare, start_levels: levels, mode: Mode::from_code(mode), half, ahead: [Mode::from_code(mode), Mode::Mid3] };
        prop_assert_eq!(tractive::drive::half_from_words(tractive::drive::half_to_words(sent)), sent);
    }
}

#[test]
fn mean_voltage_of_every_carrier_half_is_the_reference() {
    for (mode, hz) in [(Mode::Async, 20.0), (Mode::Sync15, 50.0), (Mode::Sync12, 70.0)] {
        let mut modulator =
            Modulator::new(SwitchLimits { min_pulse_ticks: 0, ..devices() }, Schedule::fixed(mode, &CLOCK));
        let mut now = Instant(0);
        for _ in 0..200 {
            let turned = (f64::from(rate(hz)) * f64::from(now.0)) as u64 as u32;
            let reference = Reference::turning(600.0, Angle(turned), rate(hz), now, 1500.0);
            let half = modulator.step(now, Some(&reference));
            let [a, b, c] = half.on_ticks(0).map(|on| f64::from(on) * 1500.0 / f64::from(half.period_ticks));
            let (alpha, beta) = ((2.0 * a - b - c) / 3.0, (b - c) / 3_f64.sqrt());
            let middle = (f64::from(turned) / 4_294_967_296.0
                + f64::from(hz) * f64::from(half.period_ticks) / 50e6)
                * std::f64::consts::TAU;
            assert!(
                (alpha - 600.0 * middle.cos()).abs() < 0.3 && (beta - 600.0 * middle.sin()).abs() < 0.3,
                "{mode:?}"
            );
            now = now.after(half.period_ticks);
        }
    }
}

/// The centre of a pattern's flux in the turn after its first half, in parts of the fundamental flux. Begun at
/// `begin` turns with an EMF of a share of the voltage, `lead` turns ahead of it.
fn centre_after_catch(
    (mode, hz, modulation_index): (Mode, f32, f32),
    begin: f32,
    share: f32,
    lead: f32,
) -> f64 {
    const UDC_V: f32 = 1500.0;
    let voltage_v = modulation_index * UDC_V * std::f32::consts::FRAC_2_PI;
    let omega = f64::from(hz) * std::f64::consts::TAU;
    let asked = |volts: f32, turns: f32, now: Instant| {
        let angle = Angle::from_turns(turns) + Angle((f64::from(rate(hz)) * f64::from(now.0)) as u64 as u32);
        Reference::turning(volts, angle, rate(hz), now, UDC_V)
    };
    let mut modulator = Modulator::new(devices(), Schedule::fixed(mode, &CLOCK));
    let emf = asked(share * voltage_v, begin + lead, Instant(0)).vector;
    let mut flux = [f64::from(emf.beta) / omega, -f64::from(emf.alpha) / omega];
    let (mut now, mut centre) = (Instant(0), [0.0; 2]);
    let turn = 6 * mode.sector_halves();
    for number in 0..=turn {
        let pattern = asked(voltage_v, begin, now);
        let reference = if number == 0 { Reference { vector: emf, ..pattern } } else { pattern };
        let half = modulator.step(now, Some(&reference));
        assert_eq!(half.mode, mode);
        let [a, b, c] = half.on_ticks(0).map(|on| f64::from(on) / 25e6 * f64::from(UDC_V));
        flux = [flux[0] + (2.0 * a - b - c) / 3.0, flux[1] + (b - c) / 3_f64.sqrt()];
        if number > 0 {
            centre = [0, 1].map(|axis: usize| centre[axis] + flux[axis] / f64::from(turn));
        }
        now = now.after(half.period_ticks);
    }
    centre[0].hypot(centre[1]) * omega / f64::from(voltage_v)
}

#[test]
fn a_pattern_that_catches_a_machine_stands_on_its_centre_at_once() {
    let patterns = [
        (Mode::Mid7, 100.0, 0.9),
        (Mode::Mid5, 150.0, 0.92),
        (Mode::Mid3, 200.0, 0.95),
        (Mode::Square, 300.0, 1.0),
    ];
    let magnets = [(0.4, 0.0), (0.7, 0.0), (0.9, 0.0), (0.7, -0.1), (0.7, 0.1)];
    for (pattern, (share, lead)) in patterns.into_iter().flat_map(|pattern| magnets.map(|own| (pattern, own)))
    {
        // A flux that lags so far would take a longer half than there is at 100 Hz; it is forced in square wave and near it.
        if pattern.0 == Mode::Mid7 && lead < 0.0 {
            continue;
        }
        for begin in 0..72 {
            let off = centre_after_catch(pattern, begin as f32 / 72.0, share, lead);
            assert!(off < 0.01, "{pattern:?} {begin} {share} {lead}: {off}");
        }
    }
}

/// However quickly a frequency swings across a border, a mode is kept for 30 ms.
#[test]
fn a_mode_is_kept_for_its_dwell_time() {
    for swings in [3, 5, 20] {
        let reference = |k: usize| (0.3, if (k / swings).is_multiple_of(2) { 36.0 } else { 44.0 }, 1500.0);
        let halves = by_halves(&(0..2_000).map(reference).collect::<Vec<_>>());
        let (mut now_s, mut last_s, mut shortest_s) = (0.0, None, f64::INFINITY);
        for pair in halves.windows(2) {
            now_s += f64::from(pair[0].period_ticks) / 25e6;
            if pair[0].mode != pair[1].mode {
                shortest_s = shortest_s.min(last_s.map_or(f64::INFINITY, |last_s| now_s - last_s));
                last_s = Some(now_s);
            }
        }
        assert!((0.03..0.05).contains(&shortest_s), "{swings}: {shortest_s} s");
    }
}

/// The move of a pattern's flux hexagon while another pattern takes over, in parts of the fundamental flux, and the modes before and
/// after: at a frequency, from one share of six-step to another, each with the share that chooses the mode.
fn moved_by_a_switch(hz: f32, (before, low): (f32, f32), (after, high): (f32, f32)) -> (Mode, Mode, f64) {
    const UDC_V: f32 = 1500.0;
    let mut modulator = Modulator::new(devices(), Schedule::new(&CLOCK));
    let (mut now, mut flux, mut halves) = (Instant(0), [0.0_f64; 2], Vec::<(Mode, _)>::new());
    let mut next = Mode::Off;
    for number in 0..400 {
        // The voltage changes with the mode, which is announced.
        let modulation_index = if number < 200 || next == halves[199].0 { before } else { after };
        let turned = Angle((f64::from(rate(hz)) * f64::from(now.0)) as u64 as u32);
        let voltage_v = modulation_index * UDC_V * std::f32::consts::FRAC_2_PI;
        let reference = Reference::turning(voltage_v, turned, rate(hz), now, UDC_V);
        let wanted = if number < 200 { low } else { high };
        let half = modulator.step(now, Some(&Reference { modulation_index: wanted, ..reference }));
        next = half.ahead[0];
        halves.push((half.mode, flux));
        let [a, b, c] = half.on_ticks(0).map(|on| f64::from(on) / 25e6 * f64::from(UDC_V));
        flux = [flux[0] + (2.0 * a - b - c) / 3.0, flux[1] + (b - c) / 3_f64.sqrt()];
        now = now.after(half.period_ticks);
    }
    let (old, new) = (halves[199].0, halves[399].0);
    let switch = halves.iter().position(|(mode, _)| *mode == new && *mode != old).unwrap_or(200);
    let centre = |from: usize, mode: Mode| {
        let turn = &halves[from..from + 6 * mode.sector_halves() as usize];
        [0, 1].map(|axis: usize| turn.iter().map(|(_, flux)| flux[axis]).sum::<f64>() / turn.len() as f64)
    };
    let from = centre(switch - 6 * old.sector_halves() as usize, old);
    let to = centre(switch + 5 * new.sector_halves() as usize, new);
    let unit = f64::from(after * UDC_V * std::f32::consts::FRAC_2_PI / hz) / std::f64::consts::TAU;
    (old, new, (to[0] - from[0]).hypot(to[1] - from[1]) / unit)
}

#[test]
fn a_pattern_that_takes_over_from_another_stands_on_the_same_centre() {
    let largest = |hz: f32| 1.0 - std::f32::consts::TAU * hz * MIN_PULSE as f32 / 25e6;
    let mut switches = Vec::new();
    for (hz, share) in [(100.0, 0.9), (110.0, 0.88), (120.0, 0.6), (119.0, 0.3)] {
        switches.push((hz, (Mode::Mid7, share), (Mode::Mid3, share), (0.8, 0.95)));
    }
    for (hz, share) in [(130.0, 0.98), (167.0, 0.97), (200.0, 0.9), (240.0, 0.8)] {
        switches.push((hz, (Mode::Mid3, share), (Mode::Square, 1.0), (0.9, 1.02)));
        // What it will have is not known before: the most that it can.
        switches.push((hz, (Mode::Mid3, largest(hz)), (Mode::Square, 1.0), (0.9, 1.02)));
    }
    for (hz, (low, below), (high, above), (least, most)) in switches {
        let up = moved_by_a_switch(hz, (below, least), (above, most));
        let down = moved_by_a_switch(hz, (above, most), (below, least));
        let down = (high != Mode::Square || below == largest(hz)).then_some((down, high, low));
        for ((old, new, moved), from, to) in [(up, low, high)].into_iter().chain(down) {
            println!("{hz} Hz, {from:?} {below} to {to:?} {above}: {moved}");
            assert_eq!((old, new), (from, to), "{hz} Hz");
            assert!(moved < 0.0005, "{hz} Hz, {from:?} {below} to {to:?} {above}: {moved}");
        }
    }
}

/// Gates that go off between the last half of a pattern and the first of another leave nothing for the pattern that begins later.
#[test]
fn a_pattern_begins_alike_whatever_was_under_way_when_the_gates_went_off() {
    const UDC_V: f32 = 1500.0;
    let play = |modulator: &mut Modulator, from: Instant, index: f32, halves: u32| {
        let mut now = from;
        let mut step = |_| {
            let turned = Angle((f64::from(rate(110.0)) * f64::from(now.0)) as u64 as u32);
            let voltage_v = index * UDC_V * std::f32::consts::FRAC_2_PI;
            let half =
                modulator.step(now, Some(&Reference::turning(voltage_v, turned, rate(110.0), now, UDC_V)));
            now = now.after(half.period_ticks);
            half
        };
        (0..halves).map(&mut step).collect::<Vec<_>>()
    };
    let begun_after = |halves: u32| {
        let mut modulator = Modulator::new(devices(), Schedule::new(&CLOCK));
        let before = play(&mut modulator, Instant(0), 0.88, 200);
        let end = before.iter().fold(Instant(0), |now, half| now.after(half.period_ticks));
        let modes = play(&mut modulator, end, 0.95, halves);
        modulator.rest(Instant(4_000_000), None);
        let changes = modes.windows(2).any(|pair| pair[0].mode != pair[1].mode);
        (changes, play(&mut modulator, Instant(5_000_000), 0.95, 40))
    };
    let (_, usual) = begun_after(0);
    assert!(usual.iter().any(|half| half.mode == Mode::Mid3));
    for halves in 1..80 {
        assert!(begun_after(halves).1 == usual, "after {halves} halves");
    }
    assert!(begun_after(79).0, "the pattern never changed");
}
