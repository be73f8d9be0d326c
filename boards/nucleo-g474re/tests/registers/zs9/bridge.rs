//! The nine gates: what each period writes, and that no sequence of calls makes an illegal state.

use super::model::{DEAD_CYCLES, Model};
use nucleo_g474re::zs9::period::PeriodCompares;
use nucleo_g474re::zs9::sampling::Zeros;
use nucleo_g474re::zs9::{CYCLES_PER_TICK, HALF_CYCLES, Pwm, settings};
use proptest::prelude::*;
use tractive::drive::dual::COMPARE_STEPS;
use tractive::frames::Angle;
use tractive::nine_switch::{self, LegState, MotorVoltage, Request, Scheme};
use tractive::ports::{PlayedPeriod, PwmPort};
use tractive::protection::SafeState;
use tractive::time::Instant;

const NOW: Instant = Instant(0);

/// The schemes that these timers can play: all but the shoot-through in the centres.
const SCHEMES: [Scheme; 5] = [Scheme::S, Scheme::Rs, Scheme::Rthd, Scheme::Zvo, Scheme::RthdSlide];

/// A model with the PWM interrupt's side of the board.
pub struct Rig {
    pub model: Model,
    pub pwm: Pwm,
}

impl Rig {
    pub fn new() -> Self {
        let model = Model::started();
        let pwm = Pwm::new(model.registers, Zeros::default());
        Self { model, pwm }
    }

    /// Counts to the next interrupt that is the drive's, serving those at valleys. `each` sees every cycle.
    fn until_peak(&mut self, each: &mut dyn FnMut(&Model)) {
        loop {
            let beat = self.model.tick();
            each(&self.model);
            if beat && self.serve() {
                return;
            }
        }
    }

    /// The interrupt's first instructions; whether it is the drive's.
    pub fn serve(&mut self) -> bool {
        self.pwm.acknowledge();
        self.model.settle();
        let peak = self.pwm.begin_half();
        self.model.settle();
        peak
    }

    /// To the next peak, where the next period is loaded.
    fn play(&mut self, next: &PlayedPeriod, each: &mut dyn FnMut(&Model)) {
        self.until_peak(each);
        self.pwm.play(NOW, next);
        self.model.settle();
    }

    fn run(&mut self, cycles: u32) {
        for _ in 0..cycles {
            if self.model.tick() {
                self.serve();
            }
        }
    }
}

fn period(request: &Request) -> PlayedPeriod {
    PlayedPeriod { gates: nine_switch::step(request).unwrap().ticks(settings().half_steps()) }
}

fn off() -> PlayedPeriod {
    PlayedPeriod::off(settings().half_steps())
}

fn request(scheme: Scheme, degrees: [f32; 2], indices: [f32; 2], shoot_through: f32) -> Request {
    let voltage = |k: usize| MotorVoltage {
        angle: Angle::from_radians(degrees[k].to_radians()),
        modulation_index: indices[k],
    };
    Request { scheme, upper: voltage(0), lower: voltage(1), shoot_through }
}

fn nothing(_: &Model) {}

/// A pause's end in cycles, to the nearest.
fn cycles(steps: u32) -> f64 {
    f64::from(steps * CYCLES_PER_TICK) / f64::from(COMPARE_STEPS)
}

#[test]
fn every_scheme_is_played_cycle_by_cycle() {
    let dead = DEAD_CYCLES as u16;
    for scheme in SCHEMES {
        for (degrees, shoot_through) in [([10.0, 100.0], 0.2), ([200.0, 333.0], 0.25), ([75.0, 75.0], 0.0)] {
            let mut rig = Rig::new();
            let played = period(&request(scheme, degrees, [0.35, 0.3], shoot_through));
            assert!(PeriodCompares::new(&played, dead).is_some(), "{scheme:?}");
            rig.play(&played, &mut nothing);
            rig.play(&played, &mut nothing);
            // From this peak on both halves are the period's; two peaks later every cycle has been compared.
            let mut compared = 0;
            rig.until_peak(&mut |model| {
                compared += 1;
                let (count, down) = model.position();
                // The cycle's middle, as far from the valley as in the rising half.
                let middle = f64::from(count) + if down { -0.5 } else { 0.5 };
                for ((gate, on), name) in played.gates.iter().zip(model.references()).zip(nine_switch::GATES)
                {
                    let (from, to) = (cycles(gate.off_from), cycles(gate.off_to));
                    let near = |edge: f64| (middle - edge).abs() <= 1.0;
                    let wanted = gate.off_from == gate.off_to || middle < from || middle > to;
                    assert!(on == wanted || near(from) || near(to), "{scheme:?} {name} at {count} {down}");
                }
            });
            assert_eq!(compared, 2 * u32::from(HALF_CYCLES));
        }
    }
}

#[test]
fn the_second_half_is_the_exact_mirror_image() {
    let mut rig = Rig::new();
    let played = period(&request(Scheme::S, [37.0, 211.0], [0.4, 0.2], 0.2));
    rig.play(&played, &mut nothing);
    rig.play(&played, &mut nothing);
    let mut levels = Vec::new();
    rig.until_peak(&mut |model| levels.push(model.references()));
    // From peak to peak: falling half, rising half.
    let half = usize::from(HALF_CYCLES);
    for t in 0..half - 1 {
        assert_eq!(levels[t], levels[2 * half - 3 - t], "{t}");
    }
}

#[test]
fn shoot_through_is_shorter_by_the_dead_time() {
    // All of it lies at V14 and V15 in this scheme: one piece a motor and half.
    let shorted = |shoot_through: f32| {
        let mut rig = Rig::new();
        let played = period(&request(Scheme::Rthd, [10.0, 100.0], [0.35, 0.3], shoot_through));
        rig.play(&played, &mut nothing);
        rig.play(&played, &mut nothing);
        rig.model.shorted = [0; 2];
        rig.until_peak(&mut nothing);
        rig.model.shorted
    };
    let [by_compares, by_devices] = shorted(0.2);
    let wanted = (0.2 * 2.0 * f64::from(HALF_CYCLES)) as u64;
    assert!(by_compares.abs_diff(wanted) <= 4, "{by_compares} {wanted}");
    assert_eq!(by_devices, by_compares - 4 * DEAD_CYCLES);
    // Shorter than the dead time: none, and no overlap is asked for.
    assert_eq!(shorted(0.03), [0, 0]);
}

#[test]
fn a_period_takes_over_at_the_valley_and_not_before() {
    let mut rig = Rig::new();
    let first = period(&request(Scheme::Rs, [10.0, 100.0], [0.35, 0.3], 0.0));
    let second = period(&request(Scheme::Rs, [190.0, 280.0], [0.35, 0.3], 0.0));
    rig.play(&first, &mut nothing);
    rig.play(&second, &mut nothing);
    let mut until_valley = 0;
    let [first, second] =
        [first, second].map(|period| PeriodCompares::new(&period, DEAD_CYCLES as u16).unwrap());
    assert_ne!(first, second);
    rig.until_peak(&mut |model| {
        let (count, down) = model.position();
        let expected = if down && count > 0 && count < HALF_CYCLES { &first } else { &second };
        until_valley += u32::from(expected == &first);
        for (leg, compares) in expected.legs.iter().enumerate() {
            let high = if down { count <= compares.high } else { count < compares.high };
            assert_eq!(model.references()[leg], high, "leg {leg} at {count} {down}");
        }
    });
    assert_eq!(until_valley, u32::from(HALF_CYCLES) - 1);
}

#[test]
fn the_gates_go_on_at_a_valley_and_off_at_a_valley() {
    let mut rig = Rig::new();
    let on = period(&request(Scheme::Rthd, [10.0, 100.0], [0.35, 0.3], 0.2));
    rig.play(&on, &mut nothing);
    assert!(rig.model.registers.legs.tim1.bdtr().read().moe());
    rig.run(u32::from(HALF_CYCLES) - 1);
    assert_eq!(rig.model.devices(), [false; 9], "outputs on, compares off");
    rig.run(1_000);
    assert!(rig.model.devices().contains(&true));
    rig.play(&off(), &mut nothing);
    rig.run(u32::from(HALF_CYCLES) - 1);
    assert!(rig.model.devices().contains(&true), "the last period ends with its valley");
    rig.run(2);
    assert_eq!(rig.model.devices(), [false; 9]);
    rig.play(&off(), &mut nothing);
    assert!(!rig.model.registers.legs.tim1.bdtr().read().moe());
}

#[test]
fn a_break_of_any_timer_ends_all_nine_by_the_next_peak_and_for_good() {
    for timer in 0..3 {
        let mut rig = Rig::new();
        let on = period(&request(Scheme::Rthd, [10.0, 100.0], [0.35, 0.3], 0.2));
        for _ in 0..3 {
            rig.play(&on, &mut nothing);
        }
        rig.run(300);
        assert!(rig.model.devices().contains(&true));
        rig.model.fault[timer] = true;
        rig.model.settle();
        let devices = rig.model.devices();
        assert!((0..3).all(|row| !devices[3 * row + timer]), "its own leg at once");
        rig.model.fault[timer] = false;
        rig.play(&on, &mut nothing);
        for _ in 0..3 {
            rig.play(&on, &mut nothing);
            assert_eq!(rig.model.devices(), [false; 9]);
        }
    }
}

#[test]
fn gates_off_is_at_once_and_for_good() {
    let mut rig = Rig::new();
    let on = period(&request(Scheme::Zvo, [10.0, 100.0], [0.35, 0.3], 0.2));
    for _ in 0..3 {
        rig.play(&on, &mut nothing);
    }
    rig.run(300);
    rig.pwm.enter(SafeState::GatesOff, NOW);
    rig.model.settle();
    assert_eq!(rig.model.devices(), [false; 9]);
    rig.play(&on, &mut nothing);
    rig.play(&on, &mut |model| assert_eq!(model.devices(), [false; 9]));
}

#[test]
fn an_answer_that_comes_after_its_valley_turns_the_gates_off() {
    let mut rig = Rig::new();
    let on = period(&request(Scheme::Zvo, [10.0, 100.0], [0.35, 0.3], 0.2));
    for _ in 0..3 {
        rig.play(&on, &mut nothing);
    }
    rig.until_peak(&mut nothing);
    (0..u32::from(HALF_CYCLES) + 50).for_each(|_| _ = rig.model.tick());
    rig.pwm.play(NOW, &on);
    rig.model.settle();
    assert_eq!(rig.model.devices(), [false; 9]);
}

#[test]
fn a_peak_that_was_never_served_turns_the_gates_off() {
    let mut rig = Rig::new();
    let on = period(&request(Scheme::Zvo, [10.0, 100.0], [0.35, 0.3], 0.2));
    for _ in 0..3 {
        rig.play(&on, &mut nothing);
    }
    rig.run(u32::from(HALF_CYCLES) + 50);
    // Two beats pass unserved: the interrupt of the peak is seen at the valley.
    let mut beats = 0;
    while beats < 2 {
        beats += u32::from(rig.model.tick());
    }
    assert!(!rig.serve());
    assert_eq!(rig.model.devices(), [false; 9]);
}

#[test]
fn what_the_timers_cannot_play_turns_the_gates_off() {
    let mut rig = Rig::new();
    let on = period(&request(Scheme::Rthd, [10.0, 100.0], [0.35, 0.3], 0.2));
    for _ in 0..3 {
        rig.play(&on, &mut nothing);
    }
    rig.play(&period(&request(Scheme::RthdCentral, [10.0, 100.0], [0.35, 0.3], 0.2)), &mut nothing);
    assert_eq!(rig.model.devices(), [false; 9]);
}

fn requests() -> impl Strategy<Value = Request> {
    let scheme = (0..SCHEMES.len()).prop_map(|index| SCHEMES[index]);
    // Often on the borders of what there is, and often without voltage or shoot-through.
    let modulation_index = || prop_oneof![3 => 0.0_f32..0.6, 1 => Just(0.0), 1 => 0.55_f32..2.0];
    let duty = prop_oneof![3 => 0.0_f32..0.4, 1 => Just(0.0), 1 => 0.0_f32..0.05, 1 => 0.9_f32..=1.0];
    let angle = || prop_oneof![3 => any::<u32>(), 1 => (0_u32..12).prop_map(|k| (u64::from(k) * (1 << 32) / 12) as u32)];
    (scheme, angle(), angle(), modulation_index(), modulation_index(), duty).prop_map(
        |(scheme, a1, a2, m1, m2, shoot_through)| Request {
            scheme,
            upper: MotorVoltage { angle: Angle(a1), modulation_index: m1 },
            lower: MotorVoltage { angle: Angle(a2), modulation_index: m2 },
            shoot_through,
        },
    )
}

#[derive(Clone, Debug)]
enum Call {
    Play(Request),
    Off,
    GatesOff,
    Break(usize),
}

fn calls() -> impl Strategy<Value = Call> {
    prop_oneof![
        60 => requests().prop_map(Call::Play),
        4 => Just(Call::Off),
        1 => Just(Call::GatesOff),
        1 => (0_usize..3).prop_map(Call::Break),
    ]
}

/// Every leg in a state that gives both its nodes a potential, by its compares.
fn all_legal(references: &[bool; 9]) -> bool {
    (0..3).all(|leg| LegState::of_gates(references[leg], references[leg + 3], references[leg + 6]).is_some())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(60))]

    /// Some two thousand random periods. The model asserts in every cycle that a leg is shorted only where the compares say so,
    /// that this stays so if every device conducts on for the dead time after it went off, and that no node floats longer than
    /// the dead time makes it.
    #[test]
    fn no_sequence_of_calls_makes_an_illegal_state(calls in proptest::collection::vec(calls(), 20..60)) {
        let mut rig = Rig::new();
        let (mut pulsing, mut tripped) = (false, false);
        for call in calls {
            match call {
                Call::Play(request) => {
                    let was = core::mem::replace(&mut pulsing, true);
                    // What was loaded before runs from the valley in between on.
                    rig.play(&period(&request), &mut |model| {
                        let (count, down) = model.position();
                        let running = was && !down && count > 0;
                        assert!(!running || all_legal(&model.references()), "{request:?}");
                    });
                }
                Call::Off => {
                    pulsing = false;
                    rig.play(&off(), &mut nothing);
                }
                Call::GatesOff => {
                    rig.pwm.enter(SafeState::GatesOff, NOW);
                    rig.model.settle();
                    tripped = true;
                }
                Call::Break(timer) => {
                    rig.model.fault[timer] = true;
                    rig.model.settle();
                    rig.model.fault[timer] = false;
                    rig.play(&off(), &mut nothing);
                    pulsing = false;
                    tripped = true;
                }
            }
            prop_assert!(!tripped || rig.model.devices() == [false; 9]);
        }
    }
}
