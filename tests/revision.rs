//! A demand that jumps revises the half that is already committed, and nothing else does.

use std::sync::atomic::Ordering;
use tractive::built_in::traction::BUILT_IN;
use tractive::control::Demand;
use tractive::drive::PlannedHalf;
use tractive::drive::traction::{ControlTask, PwmTask, Settings, Shared};
use tractive::frames::{Abc, Angle};
use tractive::modulation::{CarrierHalf, Mode, Modulator, Reference, Schedule, SwitchLimits};
use tractive::ports::{ControlPort, DriveCommand, PwmPort, Report, Sample};
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

/// A PWM interrupt that has come at three boundaries, each time with the same half planned.
struct Pulsing {
    pwm: PwmTask,
    shared: Shared<'static>,
    played: Played,
}

impl Pulsing {
    fn new() -> Self {
        let first = Instant(half_ticks());
        let mut pulsing = Self {
            pwm: PwmTask::new(&BUILT_IN, settings(), first),
            shared: Shared::new(),
            played: Played::default(),
        };
        for boundary in 1..=3 {
            pulsing.plan(boundary, half(100.0));
            pulsing.run();
        }
        pulsing
    }

    fn run(&mut self) -> CarrierHalf {
        self.shared.began.store(self.pwm.next_call().0, Ordering::Relaxed);
        self.pwm.run(&mut self.played, &self.shared);
        self.played.0.last().unwrap().1
    }

    fn plan(&self, boundary: u32, half: CarrierHalf) {
        let at = Instant(boundary * half_ticks());
        self.shared.planned.publish(PlannedHalf { at, half, release: 0, rate: 0.0, udc_v: 1_500.0 });
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

/// A free half of so much voltage.
fn half(voltage_v: f32) -> CarrierHalf {
    let mut modulator = Modulator::new(settings().devices, Schedule::new(&CLOCK));
    modulator.step(Instant(0), Some(&reference(voltage_v, 1.0, Instant(0))))
}

/// The same as a board plays it, which is not told what follows.
fn played(voltage_v: f32) -> CarrierHalf {
    CarrierHalf { ahead: [Mode::Off; 2], ..half(voltage_v) }
}

#[test]
fn a_half_that_is_planned_anew_is_loaded_before_its_boundary() {
    let mut drive = Pulsing::new();
    assert_eq!(drive.played.0.last().unwrap().1, played(100.0));
    drive.plan(3, half(700.0));
    assert_eq!(drive.revise(), Some(played(700.0)));
    drive.plan(4, half(200.0));
    assert_eq!(drive.run(), played(200.0), "the next boundary loads its own");
}

#[test]
fn a_half_that_is_planned_for_another_boundary_waits_for_it() {
    let mut drive = Pulsing::new();
    drive.plan(4, half(700.0));
    assert_eq!(drive.revise(), None);
    assert_eq!(drive.run(), played(700.0));
}

/// A drive at rest whose demand jumps, on a board without anything, and the instant at which it revises.
struct Jumping<'a> {
    torque_nm: f32,
    played: Played,
    pwm: PwmTask,
    shared: &'a Shared<'a>,
    revised: Vec<Instant>,
}

impl Jumping<'_> {
    fn boundary(&mut self) {
        let mut played = core::mem::take(&mut self.played);
        self.pwm.run(&mut played, self.shared);
        self.played = played;
    }
}

const SPEED_RAD_S: f32 = 20.0;

impl ControlPort for Jumping<'_> {
    fn begin(&mut self, revises: bool) {
        if revises {
            self.pwm.revise(&mut self.played, self.shared);
            self.revised.push(Instant(self.shared.began.load(Ordering::Relaxed)).after(2_500));
        }
    }

    fn sample(&mut self, now: Instant) -> Sample {
        let turns = f64::from(SPEED_RAD_S) * f64::from(now.0) / 25e6 / std::f64::consts::TAU;
        let angle = Angle((turns.rem_euclid(1.0) * 4_294_967_296.0) as u32);
        let ripple = (now.0 % 7_919) as f32 * 1e-4;
        let currents_a = Abc { a: ripple, b: -ripple, c: 0.0 };
        Sample { currents_a, udc_v: 1_500.0, angle: Some(angle), may_pulse: true, hardware: None }
    }

    fn command(&mut self, _now: Instant, _operator: impl FnOnce() -> DriveCommand) -> DriveCommand {
        let demand = Demand { torque_nm: self.torque_nm, slew_limited: false };
        DriveCommand { enable: true, demand, ..DriveCommand::NONE }
    }

    fn enter(&mut self, _safe: SafeState, _now: Instant) {
        unreachable!("nothing is wrong");
    }

    fn overrun_ticks(&mut self, _now: Instant, _deadline_ticks: u32) -> u32 {
        0
    }

    fn report(&mut self, _now: Instant, _report: impl FnOnce() -> Report) {}
}

/// The halves that a drive loads whose demand jumps at a control instant, and at which instants it revises them.
fn jumped(period: u32) -> (Vec<(Instant, CarrierHalf)>, Vec<Instant>) {
    let shared = Shared::new();
    let pwm = PwmTask::new(&BUILT_IN, settings(), Instant(half_ticks()));
    let (torque_nm, played, revised) = (0.0, Played::default(), Vec::new());
    let mut board = Jumping { torque_nm, played, pwm, shared: &shared, revised };
    let mut control = ControlTask::new(&BUILT_IN, settings(), Instant(2_500));
    while control.next_call().0 < 2_500 * (period + 40) {
        if control.next_call().reached(board.pwm.next_call()) {
            board.boundary();
            continue;
        }
        board.torque_nm = if control.next_call().0 < 2_500 * period { 0.0 } else { 600.0 };
        control.run(&mut board, &shared);
    }
    (board.played.0, board.revised)
}

/// Wherever the jump falls, one half is loaded twice, with the same place and another voltage, and at least a control period before it
/// begins: the next one, or the one after it where that begins too soon.
#[test]
fn a_jump_of_the_demand_revises_the_half_that_is_loaded() {
    let mut later = 0;
    for period in 300..330 {
        let (played, revised) = jumped(period);
        let twice: Vec<_> = played.windows(2).filter(|pair| pair[0].0 == pair[1].0).collect();
        assert_eq!((twice.len(), revised.len()), (1, 1), "{period}: {revised:?}");
        for (pair, at) in twice.iter().zip(&revised) {
            let [(boundary, before), (_, after)] = pair else { unreachable!() };
            let waited = at.0 - 2_500 * (period + 1);
            assert!(waited <= 2 * 2_500, "{period}: {waited} ticks");
            later += u32::from(waited > 0);
            assert!(boundary.0 + half_ticks() - at.0 >= 2_500, "{period}");
            assert_eq!((before.mode, before.half), (Mode::Async, after.half), "{period}");
            assert_ne!(before.compare_ticks, after.compare_ticks, "{period}");
        }
    }
    assert!((1..15).contains(&later), "{later} of 30 jumps waited");
}

#[test]
fn a_half_that_gives_way_to_another_mode_is_not_revised() {
    let mut half = half(100.0);
    assert!(half.is_free());
    half.ahead = [Mode::Async, Mode::Sync15];
    assert!(!half.is_free());
    half.ahead = [Mode::Async; 2];
    half.mode = Mode::Off;
    assert!(!half.is_free());
}
