//! The compensation of dead time looks ahead to the middle of the half that it acts in.

use core::f32::consts::TAU;
use std::sync::atomic::Ordering;
use tractive::built_in::traction::BUILT_IN;
use tractive::drive::PlannedHalf;
use tractive::drive::traction::{Drops, PwmTask, Settings, Shared};
use tractive::frames::{Abc, Angle};
use tractive::modulation::{CarrierHalf, Mode, Modulator, Reference, Schedule, SwitchLimits};
use tractive::ports::PwmPort;
use tractive::protection::SafeState;
use tractive::time::{Clock, Instant};

const CLOCK: Clock = Clock::new(25_000_000, 2_500);
const DEAD_TICKS: u32 = 125;
/// A current whose sign changes quickly: 25 Hz, 60 A.
const HZ: f32 = 25.0;
const PEAK_A: f32 = 60.0;
/// Current up to which the compensation is proportional, in A: a twentieth of the largest.
const SMALL_A: f32 = 0.05 * 233.345;

/// The true phase currents.
fn currents_a(ticks: f32) -> [f32; 3] {
    let turn = TAU * HZ * ticks / 25e6;
    [0.0, 1.0, 2.0].map(|phase| PEAK_A * (turn - phase * TAU / 3.0).sin())
}

#[derive(Default)]
struct Machine(Vec<(Instant, CarrierHalf)>);

impl PwmPort for Machine {
    fn sample(&mut self, now: Instant) -> Abc {
        let [a, b, c] = currents_a(now.0 as f32);
        Abc { a, b, c }
    }

    fn play(&mut self, now: Instant, next: &CarrierHalf) {
        self.0.push((now, *next));
    }

    fn enter(&mut self, _safe: SafeState, _now: Instant) {
        unreachable!("nothing is wrong");
    }
}

/// The halves that are played with a dead time and drops, and their boundaries.
fn played(dead_time_ticks: u32, drops: Drops) -> Vec<(Instant, CarrierHalf)> {
    let devices = SwitchLimits::new(250, dead_time_ticks, 900.0, &CLOCK);
    let half_ticks = devices.shortest_half_ticks;
    let settings = Settings { drops, ..Settings::new(CLOCK, devices) };
    let mut pwm = PwmTask::new(&BUILT_IN, settings, Instant(half_ticks));
    let mut modulator = Modulator::new(devices, Schedule::new(&CLOCK));
    let (shared, mut machine) = (Shared::new(), Machine::default());
    for boundary in 1..160 {
        let at = pwm.next_call();
        assert_eq!(at.0, boundary * half_ticks, "a free carrier");
        let valid_from = at.before(2_500);
        // Little voltage, so that no pulse is swallowed.
        let rate = HZ * 4_294_967_296.0 / 25e6;
        let sampled = valid_from.before(2_500);
        let reference =
            Reference::turning(100.0, Angle((rate * sampled.0 as f32) as u32), rate, sampled, 1_500.0);
        shared.began.store(valid_from.0, Ordering::Relaxed);
        let half = modulator.step(at.after(half_ticks), Some(&reference));
        shared.planned.publish(PlannedHalf { at, half, release: 0, rate, udc_v: 1_500.0 });
        pwm.run(&mut machine, &shared);
    }
    machine.0
}

#[test]
fn every_edge_is_moved_by_what_the_current_in_its_own_half_takes() {
    let [plain, compensated] = [0, DEAD_TICKS].map(|ticks| played(ticks, Drops::NONE));
    let (mut moved, mut changes) = (0, 0);
    for ((at, half), (_, with)) in plain.iter().zip(&compensated) {
        if half.mode == Mode::Off {
            continue;
        }
        assert_eq!((half.period_ticks, half.start_levels), (with.period_ticks, with.start_levels));
        let middle = at.0 as f32 + 1.5 * half.period_ticks as f32;
        let (now, then) = (currents_a(at.0 as f32), currents_a(middle));
        for phase in 0..3 {
            let against = if half.start_levels[phase] { -then[phase] } else { then[phase] };
            let wanted = DEAD_TICKS as f32 * (against / SMALL_A).clamp(0.0, 1.0);
            let by = half.compare_ticks[phase] as f32 - with.compare_ticks[phase] as f32;
            // The current is taken as a straight line over two halves: a sixteenth of the dead time.
            assert!((by - wanted).abs() < 8.0, "phase {phase} at {}: {by} ticks, not {wanted}", at.0);
            moved += u32::from(wanted > 0.0);
            changes += u32::from(now[phase] * then[phase] < 0.0);
        }
    }
    assert!(moved > 100 && changes > 10, "{moved} edges moved, {changes} signs changed on the way");
}

/// A threshold of 0 says that the drops are not known, whatever their slope.
#[test]
fn drops_without_a_threshold_are_not_made_up_for() {
    let [none, slope, both] = [(0.0, 0.0), (0.0, 0.05), (1.5, 0.05)]
        .map(|(threshold_v, slope_ohm)| played(DEAD_TICKS, Drops { threshold_v, slope_ohm }));
    assert!(none == slope && none != both);
}
