//! A demand that jumps revises the half that is already committed, and nothing else does.

use tractive::built_in::traction::BUILT_IN;
use tractive::drive::traction::{PwmTask, Settings, Shared};
use tractive::drive::{CommittalRecord, Gates, VoltageCommand, volt_ticks};
use tractive::frames::{Abc, AlphaBeta, Angle};
use tractive::modulation::{CarrierHalf, Mode, Modulator, Reference, Schedule, SwitchLimits};
use tractive::ports::PwmPort;
use tractive::protection::SafeState;
use tractive::time::{Clock, Instant};

const CLOCK: Clock = Clock::new(25_000_000, 2_500);

fn settings() -> Settings {
    Settings::new(CLOCK, SwitchLimits::new(250, 0, 900.0, &CLOCK))
}

fn half_ticks() -> u32 {
    settings().devices.shortest_half_ticks
}

/// A slow fundamental, forward or backward.
fn reference(voltage_v: f32, direction: f32, at: Instant) -> Reference {
    let angle = Angle(0x2345_6789);
    let rate = direction * 13.0 * 4_294_967_296.0 / 25e6;
    Reference::turning(voltage_v, angle, rate, at, 1_500.0)
}

#[test]
fn a_half_made_anew_from_the_same_reference_is_the_same() {
    for direction in [1.0, -1.0] {
        let mut modulator = Modulator::new(settings().devices, Schedule::new(&CLOCK));
        let mut start = Instant(0);
        for step in 0..40 {
            let reference = reference(10.0 * step as f32, direction, start);
            let half = modulator.step(start, Some(&reference));
            assert!(half.is_free(), "{half:?}");
            assert_eq!(modulator.revised(&half, start, &reference), half);
            start = start.after(half.period_ticks);
        }
    }
}

/// The halves that the PWM interrupt plays.
#[derive(Default)]
struct Played(Vec<(Instant, CarrierHalf)>);

impl PwmPort for Played {
    fn sample(&mut self, _now: Instant) -> Abc {
        Abc::default()
    }

    fn play(&mut self, now: Instant, next: &CarrierHalf) {
        self.0.push((now, *next));
    }

    fn enter(&mut self, _safe: SafeState, _now: Instant) {
        unreachable!("nothing is wrong");
    }
}

/// A drive whose PWM interrupt has come at three boundaries, with pulses since the second.
struct Pulsing {
    pwm: PwmTask,
    shared: Shared<'static>,
    played: Played,
}

impl Pulsing {
    fn new() -> Self {
        let mut pulsing = Self::at_two_boundaries();
        pulsing.publish(100.0, 3 * half_ticks() - 2_500, false);
        pulsing.run();
        pulsing
    }

    fn at_two_boundaries() -> Self {
        let first = Instant(half_ticks());
        let mut pulsing = Self {
            pwm: PwmTask::new(&BUILT_IN, settings(), first),
            shared: Shared::new(),
            played: Played::default(),
        };
        for boundary in 1..=2 {
            pulsing.publish(100.0, boundary * half_ticks() - 2_500, false);
            pulsing.run();
        }
        pulsing
    }

    fn run(&mut self) -> CarrierHalf {
        self.pwm.run(&mut self.played, &self.shared);
        self.played.0.last().unwrap().1
    }

    /// Publishes a command that is valid from this tick on, one control period after its sample.
    fn publish(&self, voltage_v: f32, valid_from: u32, revises: bool) {
        self.publish_of(valid_from - 2_500, voltage_v, valid_from, revises);
    }

    /// The same for a sample of any tick.
    fn publish_of(&self, at: u32, voltage_v: f32, valid_from: u32, revises: bool) {
        let reference = reference(voltage_v, 1.0, Instant(at));
        self.shared.began.store(valid_from, std::sync::atomic::Ordering::Relaxed);
        let valid_from = Instant(valid_from);
        self.shared.command.publish(VoltageCommand {
            reference,
            valid_from,
            gates: Gates::Pulse,
            revises,
            release: 0,
        });
    }

    /// Boundaries and what their halves give, as control reads them: of the next half, and of the running one.
    fn told(&self) -> [(Instant, AlphaBeta); 2] {
        let applied = &self.shared.applied;
        let newest = applied.find(1, |_| true).unwrap();
        let told = applied.read(newest, |records: [_; 2]| {
            let [newest, running] = records.map(CommittalRecord);
            [(newest.at(), newest.volt_ticks()), (running.at(), running.volt_ticks_from(0))]
        });
        told.unwrap()
    }

    fn revise(&mut self) -> Option<CarrierHalf> {
        let before = self.played.0.len();
        self.pwm.revise(&mut self.played, &self.shared);
        self.played.0.get(before).map(|(at, half)| {
            assert_eq!(at.0, 3 * half_ticks(), "in the name of the last boundary");
            *half
        })
    }
}

#[test]
fn a_revised_half_has_the_newer_voltage_and_is_told_to_control() {
    let mut drive = Pulsing::new();
    let committed = drive.played.0.last().unwrap().1;
    drive.publish(700.0, 3 * half_ticks() + 2_500, true);
    let revised = drive.revise().unwrap();
    assert_ne!(revised, committed);
    // What the boundary would have made of the same reference, had it known it.
    let mut knowing = Pulsing::at_two_boundaries();
    knowing.publish_of(3 * half_ticks(), 700.0, 3 * half_ticks() - 1, false);
    assert_eq!(revised, knowing.run());
    let [newest, _] = drive.told();
    assert_eq!(newest, (Instant(3 * half_ticks()), volt_ticks(revised.on_ticks(0))));
    // What control is told of the running half is what was played last.
    drive.publish(700.0, 4 * half_ticks() - 2_500, false);
    drive.run();
    let [_, running] = drive.told();
    assert_eq!(running.1, volt_ticks(revised.on_ticks(0)));
}

#[test]
fn only_a_command_that_asks_for_it_revises() {
    let mut drive = Pulsing::new();
    drive.publish(700.0, 3 * half_ticks() + 2_500, false);
    assert_eq!(drive.revise(), None);
}

#[test]
fn a_revision_that_a_boundary_has_overtaken_is_dropped() {
    let mut drive = Pulsing::new();
    drive.publish(700.0, 3 * half_ticks() - 1, true);
    assert_eq!(drive.revise(), None);
}

#[test]
fn a_half_that_gives_way_to_another_mode_is_not_revised() {
    let mut half = Pulsing::new().played.0.last().unwrap().1;
    assert!(half.is_free());
    half.ahead = [Mode::Async, Mode::Sync15];
    assert!(!half.is_free());
    half.ahead = [Mode::Async; 2];
    half.mode = Mode::Off;
    assert!(!half.is_free());
}
