//! The drive with what a board may have beside the usual: coarse counts, late angles, filtered currents, drops, quick switches; with currents'
//! zeros and a sensor's harmonics to learn, pauses, jumps of torque, faults and their acknowledges.

use super::file::{BASIS, hash, holds};
use super::{BUILT_IN, Board, CLOCK, UNEXPLAINED, Walk};
use std::f32::consts::TAU;
use std::fmt::Write;
use tractive::cell::Words;
use tractive::control::{Demand, Warmth};
use tractive::drive::traction::{ControlTask, Drops, PwmTask, Settings, Shared};
use tractive::frames::{Abc, Angle};
use tractive::modulation::{CarrierHalf, SwitchLimits};
use tractive::ports::{ControlPort, DriveCommand, PwmPort, Report, Sample};
use tractive::protection::{Fault, LegFaults, SafeState};
use tractive::time::Instant;

/// Control periods of each drive.
const PERIODS: u32 = 12_000;

/// A board whose sensors have errors, and what is done to it.
struct Flawed {
    board: Board,
    period: u32,
    /// Step of the angle, in angle units.
    step: u32,
    /// The hash of what the drive did beside its pulses.
    sum: u64,
    /// `true` if the angle is not known before the drive has found it.
    unknown: bool,
}

impl Flawed {
    fn currents(&mut self) -> Abc {
        let noise = 0.2 * self.board.walk.random.next();
        let Abc { a, b, c } = self.board.currents();
        Abc { a: 1.01 * a + 1.5 + noise, b: b - 0.7 - noise, c: 0.99 * c - 0.6 }
    }

    fn angle(&self) -> Angle {
        let angle = self.board.walk.angle;
        let counted = if self.step > 1 { Angle(angle.0 / self.step * self.step) } else { angle };
        counted + Angle::within_half_turn(0.02 * (angle.signed_radians() + 0.5).sin())
    }

    fn note(&mut self, what: &str) {
        self.sum = hash(self.sum, format!("{}: {what}", self.period).as_bytes());
    }

    /// `true` in so many periods of each 2,000, from one on.
    fn within(&self, from: u32, periods: u32) -> bool {
        (from..from + periods).contains(&(self.period % 2_000))
    }
}

impl ControlPort for Flawed {
    fn sample(&mut self, _now: Instant) -> Sample {
        let (currents_a, udc_v) = (self.currents(), self.board.walk.udc_v);
        let hardware = (self.period / 2_000 == 2 && self.within(900, 5)).then_some(Fault::GateDriver);
        let angle = (!self.unknown).then(|| self.angle());
        Sample { currents_a, udc_v, angle, may_pulse: !self.within(1_300, 40), hardware }
    }

    fn command(&mut self, _now: Instant, _operator: impl FnOnce() -> DriveCommand) -> DriveCommand {
        let warm = Warmth::new(1.0 + 0.1 * (self.period / 3_000) as f32);
        let jump = Demand { slew_limited: false, ..self.board.walk.demand };
        DriveCommand {
            enable: !self.within(1_500, 200),
            demand: if self.within(600, 400) { jump } else { self.board.walk.demand },
            acknowledge: (self.period / 1_000) as u8,
            warmth: if self.period < 3_000 { Warmth::NONE } else { warm },
            ..DriveCommand::NONE
        }
    }

    fn enter(&mut self, safe: SafeState, _now: Instant) {
        self.note(&format!("control enters {safe:?}"));
    }

    fn overrun_ticks(&mut self, _now: Instant, _deadline_ticks: u32) -> u32 {
        u32::from(self.period == 9_100) * 3_000
    }

    fn report(&mut self, _now: Instant, report: impl FnOnce() -> Report) {
        self.board.report = report();
    }

    fn leg_faults(&mut self) -> LegFaults {
        LegFaults { blocked: u8::from(self.period == 7_100) << 2, ..LegFaults::default() }
    }

    fn turned(&mut self) -> Option<Angle> {
        Some(self.angle())
    }

    fn align(&mut self, _now: Instant, zero: Angle) {
        self.note(&format!("zero at {zero:?}"));
        self.unknown = false;
    }
}

impl PwmPort for Flawed {
    fn sample(&mut self, _now: Instant) -> Abc {
        let over = if self.period == 3_100 { 900.0 } else { 0.0 };
        let Abc { a, b, c } = self.currents();
        Abc { a: a + over, b: b - over, c }
    }

    fn play(&mut self, _now: Instant, next: &CarrierHalf) {
        self.board.shadow = *next;
    }

    fn enter(&mut self, safe: SafeState, _now: Instant) {
        self.note(&format!("PWM enters {safe:?}"));
    }

    fn leave(&mut self, _now: Instant) -> bool {
        self.note("leaves");
        true
    }
}

/// A drive's run: a line each 500 periods.
fn drive(name: &str, seed: u32, settings: Settings, unknown: bool, out: &mut String) {
    let first = settings.devices.shortest_half_ticks;
    let shared = Shared::new();
    let mut control =
        ControlTask::new(&BUILT_IN, settings, Instant(CLOCK.control_ticks)).without(UNEXPLAINED);
    let mut pwm = PwmTask::new(&BUILT_IN, settings, Instant(first));
    let (walk, shadow) = (Walk::new(200 + seed), CarrierHalf::off(first));
    let board = Board { walk, now: 0, shadow, report: Report::default() };
    let step = (settings.angle_step_rad / TAU * 4_294_967_296.0) as u32;
    let mut flawed = Flawed { board, period: 0, step, sum: BASIS, unknown };
    let [mut control_at, mut pwm_at] = [CLOCK.control_ticks, first];
    let mut sum = BASIS;
    while flawed.period < PERIODS {
        if pwm_at <= control_at {
            flawed.board.pass(pwm_at);
            pwm_at += flawed.board.shadow.period_ticks;
            pwm.run(&mut flawed, &shared);
            sum = hash(sum, format!("{:?}", flawed.board.shadow).as_bytes());
            continue;
        }
        flawed.board.pass(control_at);
        control_at += CLOCK.control_ticks;
        flawed.period += 1;
        if !flawed.unknown {
            let way = if flawed.period < PERIODS / 2 { 4_500.0 } else { -4_500.0 };
            flawed.board.walk.rpm += way * 1e-4;
        }
        if flawed.period.is_multiple_of(300) {
            flawed.board.walk.demand.torque_nm = flawed.board.walk.random.within(-1_000.0, 1_000.0);
        }
        control.run(&mut flawed, &shared);
        let words = flawed.board.report.to_words();
        sum = words.iter().fold(sum, |sum, word| hash(sum, &word.to_le_bytes()));
        if flawed.period.is_multiple_of(500) {
            let (mode, did) = (flawed.board.shadow.mode, flawed.sum);
            let trip = flawed.board.report.trip.map(|trip| trip.fault);
            writeln!(out, "{name} period {}: {sum:016x} {did:016x}, {mode:?}, {trip:?}", flawed.period)
                .unwrap();
        }
    }
}

#[test]
fn every_pulse_and_every_report_with_a_boards_options_is_as_it_was() {
    let devices = |hz, dead_ticks| SwitchLimits::new(250, dead_ticks, hz, &CLOCK);
    let usual = Settings::new(CLOCK, devices(900.0, 0));
    let poles = BUILT_IN.ratings.pole_pairs;
    let drops = Drops { threshold_v: 1.3, slope_ohm: 4e-3 };
    let mut out = String::new();
    let boards = [
        ("usual", usual, false),
        ("coarse", Settings { angle_step_rad: Settings::step_rad(1_024, poles), ..usual }, false),
        ("fine", Settings { angle_step_rad: Settings::step_rad(16_384, poles), ..usual }, false),
        ("late", Settings { angle_late_s: 60e-6, current_filter_ticks: 300, ..usual }, false),
        ("drops", Settings { drops, devices: devices(900.0, 120), ..usual }, false),
        ("quick", Settings { devices: devices(4_000.0, 60), ..usual }, false),
        ("quicker", Settings { devices: devices(9_000.0, 0), current_filter_ticks: 120, ..usual }, false),
        ("unknown", usual, true),
        ("unknown and quick", Settings { devices: devices(9_000.0, 0), ..usual }, true),
    ];
    for (seed, (name, settings, unknown)) in boards.into_iter().enumerate() {
        drive(name, seed as u32, settings, unknown, &mut out);
    }
    for fault in ["Overcurrent", "GateDriver", "None"] {
        assert!(out.contains(fault), "{fault}: {out}");
    }
    holds("options", &out);
}
