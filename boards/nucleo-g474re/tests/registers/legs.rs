//! The legs: what each half writes, and that no two devices of a leg are ever on.

use crate::bench::Bench;
use crate::devices;
use nucleo_g474re::half::reload;
use nucleo_g474re::sampling::Zeros;
use nucleo_g474re::{CLOCK, Pwm};
use proptest::prelude::*;
use tractive::frames::Angle;
use tractive::modulation::{CarrierHalf, Ladder, Mode, Modulator, Reference, Schedule};
use tractive::ports::PwmPort;
use tractive::protection::SafeState;
use tractive::time::Instant;

const NOW: Instant = Instant(0);

/// A bench with the PWM interrupt's side of the board.
struct Rig {
    bench: Bench,
    pwm: Pwm,
}

impl Rig {
    fn new() -> Self {
        let bench = Bench::started(devices());
        let pwm = Pwm::new(bench.registers, Zeros::default());
        Self { bench, pwm }
    }

    /// Counts to the end of the running half and plays the next one from the interrupt there.
    fn interrupt(&mut self, next: &CarrierHalf) {
        while !self.bench.tick() {}
        self.answer(next);
    }

    fn answer(&mut self, next: &CarrierHalf) {
        self.pwm.acknowledge();
        self.bench.settle();
        self.pwm.begin_half();
        self.bench.settle();
        self.pwm.play(NOW, next);
        self.bench.settle();
    }

    fn gates(&self) -> [(bool, bool); 3] {
        self.bench.legs.map(|leg| leg.gates())
    }

    fn run(&mut self, ticks: u32) {
        (0..ticks).for_each(|_| {
            self.bench.tick();
        });
    }
}

const ALL_OFF: [(bool, bool); 3] = [(false, false); 3];

/// Halves of every mode, from the modulator itself, running up forward or backward.
fn halves_of_all_modes(direction: f32) -> Vec<CarrierHalf> {
    let ladder = Ladder::of(&[Mode::Sync15, Mode::Sync12, Mode::Mid7, Mode::Mid5, Mode::Mid3, Mode::Square]);
    let mut modulator = Modulator::new(devices(), Schedule::on(ladder, &CLOCK));
    let mut found: Vec<CarrierHalf> = Vec::new();
    let mut start = Instant(0);
    let (mut angle, mut hz) = (Angle::ZERO, 3.0_f32);
    for _ in 0..200_000 {
        let rate = direction * hz * 4_294_967_296.0 / CLOCK.ticks_per_s;
        let modulation_index = (hz / 120.0).min(1.05);
        let turning = Reference::turning(modulation_index.min(1.0) * 954.9, angle, rate, start, 1_500.0);
        let reference = Reference { modulation_index, ..turning };
        let half = modulator.step(start, Some(&reference));
        if found.iter().filter(|other| other.mode == half.mode).count() < 24 {
            found.push(half);
        }
        angle = angle + Angle((rate * half.period_ticks as f32) as i32 as u32);
        start = start.after(half.period_ticks);
        hz += 20.0 * half.period_ticks as f32 * CLOCK.tick_s;
        if hz > 150.0 {
            break;
        }
    }
    found.push(CarrierHalf::off(devices().shortest_half_ticks));
    found
}

#[test]
fn every_half_of_every_mode_is_played_tick_by_tick() {
    for direction in [1.0, -1.0] {
        let halves = halves_of_all_modes(direction);
        for mode in Mode::ALL {
            assert!(halves.iter().any(|half| half.mode == mode), "{mode:?} did not occur");
        }
        let mut rig = Rig::new();
        let mut following = halves.iter();
        rig.interrupt(following.next().unwrap());
        for (half, next) in halves.iter().zip(following) {
            let tim1 = rig.bench.registers.legs.tim1;
            assert_eq!(u32::from(tim1.arr().read().arr()), half.period_ticks - 1);
            rig.interrupt(next);
            for tick in 0..half.period_ticks {
                assert_eq!(rig.bench.count(), tick);
                let wanted: [bool; 3] =
                    core::array::from_fn(|n| half.start_levels[n] != (tick >= half.compare_ticks[n]));
                assert_eq!(rig.bench.legs.map(|leg| leg.reference()), wanted, "{half:?} at {tick}");
                if tick + 1 < half.period_ticks {
                    assert!(!rig.bench.tick(), "the half is too short");
                }
            }
        }
    }
}

/// A half with these levels and toggles.
fn half(period_ticks: u32, start_levels: [bool; 3], compare_ticks: [u32; 3]) -> CarrierHalf {
    CarrierHalf { mode: Mode::Async, start_levels, compare_ticks, ..CarrierHalf::off(period_ticks) }
}

const STEADY: [u32; 3] = [u32::MAX; 3];

#[test]
fn a_preloaded_half_changes_nothing_before_its_beginning() {
    let mut rig = Rig::new();
    rig.interrupt(&half(1_000, [true, false, true], [400, 500, 600]));
    rig.interrupt(&half(2_000, [false, true, false], [100, 200, 300]));
    for tick in 0..1_000 {
        assert_eq!(rig.bench.count(), tick);
        assert_eq!(rig.bench.legs.map(|leg| leg.reference()), [tick < 400, tick >= 500, tick < 600]);
        rig.bench.tick();
    }
    assert_eq!(rig.bench.count(), 0);
    assert_eq!(rig.bench.legs.map(|leg| leg.reference()), [false, true, false]);
}

#[test]
fn the_gates_go_on_with_the_first_half_and_off_after_the_last() {
    let mut rig = Rig::new();
    let on = half(2_000, [true, false, true], STEADY);
    rig.interrupt(&on);
    rig.run(1_000);
    assert_eq!(rig.gates(), ALL_OFF, "the half before still runs");
    rig.interrupt(&CarrierHalf::off(3_000));
    rig.run(1_000);
    assert_eq!(rig.gates(), [(true, false), (false, true), (true, false)]);
    while !rig.bench.tick() {}
    // Until software answers, nothing moves.
    for _ in 0..500 {
        assert_eq!(rig.gates(), [(true, false), (false, true), (true, false)]);
        rig.bench.tick();
    }
    rig.answer(&CarrierHalf::off(3_000));
    assert_eq!(rig.gates(), ALL_OFF);
    rig.interrupt(&on);
    assert_eq!(rig.gates(), ALL_OFF);
    rig.interrupt(&on);
    rig.run(1_000);
    assert_eq!(rig.gates(), [(true, false), (false, true), (true, false)], "a pause can be over");
}

#[test]
fn a_break_needs_no_software_and_stays() {
    let mut rig = Rig::new();
    let on = half(2_000, [true, false, true], STEADY);
    rig.interrupt(&on);
    rig.interrupt(&on);
    rig.run(500);
    assert_ne!(rig.gates(), ALL_OFF);
    rig.bench.fault = [true; 2];
    rig.bench.tick();
    assert_eq!(rig.gates(), ALL_OFF);
    rig.bench.fault = [false; 2];
    for _ in 0..5 {
        rig.interrupt(&on);
        rig.run(500);
        assert_eq!(rig.gates(), ALL_OFF);
    }
    rig.pwm.enter(SafeState::ShortCircuit, NOW);
    rig.run(500);
    assert_eq!(rig.gates(), ALL_OFF, "a break is stronger than a short circuit");
}

#[test]
fn a_break_of_one_timer_stops_the_other_within_a_half() {
    for timer in [0, 1] {
        let mut rig = Rig::new();
        let on = half(2_000, [true, false, true], STEADY);
        rig.interrupt(&on);
        rig.interrupt(&on);
        rig.run(500);
        rig.bench.fault[timer] = true;
        rig.bench.tick();
        rig.bench.fault[timer] = false;
        rig.interrupt(&on);
        assert_eq!(rig.gates(), ALL_OFF);
    }
}

#[test]
fn gates_off_is_at_once_and_for_good() {
    let mut rig = Rig::new();
    let on = half(2_000, [true, false, true], STEADY);
    rig.interrupt(&on);
    rig.interrupt(&on);
    rig.run(500);
    rig.pwm.enter(SafeState::GatesOff, NOW);
    rig.bench.settle();
    assert_eq!(rig.gates(), ALL_OFF);
    rig.interrupt(&on);
    rig.interrupt(&on);
    rig.run(500);
    assert_eq!(rig.gates(), ALL_OFF);
}

#[test]
fn a_short_circuit_outlasts_what_is_played() {
    const SHORT: [(bool, bool); 3] = [(false, true); 3];
    for pulsing in [true, false] {
        let mut rig = Rig::new();
        let on = half(2_000, [true, false, true], [300, 400, 500]);
        let before = if pulsing { on } else { CarrierHalf::off(2_000) };
        rig.interrupt(&before);
        rig.interrupt(&before);
        rig.run(200);
        rig.pwm.enter(SafeState::ShortCircuit, NOW);
        rig.run(120);
        assert_eq!(rig.gates(), SHORT, "after the dead time");
        for next in [CarrierHalf::off(2_000), on, CarrierHalf::off(2_000)] {
            rig.interrupt(&next);
            for _ in 0..1_900 {
                rig.bench.tick();
                assert_eq!(rig.gates(), SHORT);
            }
        }
    }
}

/// Gates that the drive has turned off may become the short circuit, which stays; those that the hardware has turned off may not.
#[test]
fn gates_off_become_a_short_circuit_that_stays() {
    let mut rig = Rig::new();
    rig.interrupt(&CarrierHalf::off(2_000));
    for entered in [SafeState::GatesOff, SafeState::ShortCircuit, SafeState::GatesOff] {
        rig.pwm.enter(entered, NOW);
        rig.run(120);
    }
    assert_eq!(rig.gates(), [(false, true); 3]);
    rig.bench.fault = [true; 2];
    rig.bench.settle();
    rig.pwm.enter(SafeState::ShortCircuit, NOW);
    rig.run(120);
    assert_eq!(rig.gates(), ALL_OFF);
}

#[test]
fn an_answer_that_comes_after_its_half_turns_the_gates_off() {
    let mut rig = Rig::new();
    let on = half(2_000, [true, false, true], STEADY);
    rig.interrupt(&on);
    rig.interrupt(&on);
    while !rig.bench.tick() {}
    rig.pwm.acknowledge();
    rig.bench.settle();
    rig.pwm.begin_half();
    rig.run(2_100);
    rig.pwm.play(NOW, &on);
    rig.bench.settle();
    assert_eq!(rig.gates(), ALL_OFF);
}

#[test]
fn a_latched_break_leaves_the_main_output_alone() {
    let rig = Rig::new();
    let legs = rig.bench.registers.legs;
    legs.tim8.sr().write(|w| w.set_bif(0, true));
    legs.switch_on();
    legs.short_circuit();
    // Before the hardware has its turn: not even for a moment.
    assert!(!legs.is_on());
    assert!(!legs.tim1.bdtr().read().moe() && !legs.tim8.bdtr().read().moe());
}

#[test]
fn reload_is_the_last_count() {
    assert_eq!([1, 2, 11_806, 65_535].map(reload), [0, 1, 11_805, 65_534]);
}

/// The calls of the board that may come.
#[derive(Clone, Debug)]
enum Call {
    Play(CarrierHalf),
    Enter(SafeState),
    Break,
    Wait(u32),
}

fn calls() -> impl Strategy<Value = Call> {
    let halves = (1_u32..1_500, any::<[bool; 3]>(), [0_u32..1_600, 0_u32..1_600, 0_u32..1_600], 0_u32..4);
    prop_oneof![
        40 => halves.prop_map(|(period, levels, compares, off)| Call::Play(match off {
            0 => CarrierHalf::off(period),
            _ => half(period, levels, compares),
        })),
        20 => (0_u32..400).prop_map(Call::Wait),
        1 => Just(Call::Enter(SafeState::ShortCircuit)),
        1 => Just(Call::Enter(SafeState::GatesOff)),
        1 => Just(Call::Break),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(96))]

    /// The bench asserts at every tick and after every call that no leg has both devices on, and that a device goes on
    /// no sooner than the dead time after the other went off. Calls come at any moment, not only from the interrupt.
    #[test]
    fn no_sequence_of_calls_turns_both_devices_of_a_leg_on(calls in proptest::collection::vec(calls(), 1..60)) {
        let mut rig = Rig::new();
        let (mut tripped, mut shorted) = (false, false);
        for call in calls {
            match call {
                Call::Play(half) => rig.interrupt(&half),
                Call::Enter(safe) => {
                    rig.pwm.enter(safe, NOW);
                    rig.bench.settle();
                    // Gates off may become the short circuit, which then stays.
                    shorted |= safe == SafeState::ShortCircuit;
                    tripped |= safe == SafeState::GatesOff && !shorted;
                    tripped &= safe == SafeState::GatesOff || rig.bench.registers.legs.is_tripped();
                }
                Call::Break => {
                    rig.bench.fault = [true; 2];
                    rig.bench.settle();
                    rig.bench.fault = [false; 2];
                    tripped = true;
                }
                Call::Wait(ticks) => rig.run(ticks),
            }
            prop_assert!(!tripped || rig.gates() == ALL_OFF);
        }
    }
}
