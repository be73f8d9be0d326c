//! Outputs of both control laws, over random walks of every input, and of the drive through all its modes, pinned bit for bit: a change of any output
//! changes a line of a file in `tests/pinned/`. For an intended change, write the file anew with `TRACTIVE_PINNED=write`, and say what the change buys.

#[path = "pinned/file.rs"]
mod file;
#[path = "pinned/options.rs"]
mod options;

use file::{BASIS, hash, holds};
use std::fmt::Write;
use tractive::built_in::traction::BUILT_IN;
use tractive::cell::Words;
use tractive::control::{
    AimInput, Boundary, Committed, ControlLaw, Controller, DeadTime, Demand, Gains, Law, LinkDamper,
    LinkWindow, ModeLimits, PiLaw, Regulated, RotorSample, Warmth,
};
use tractive::drive::traction::{ControlTask, PwmTask, Settings, Shared};
use tractive::frames::{Abc, AlphaBeta, Angle, Dq};
use tractive::machine::{Ratings, Tables};
use tractive::modulation::{CarrierHalf, Ladder, Mode, Schedule, SwitchLimits};
use tractive::ports::{ControlPort, DriveCommand, PwmPort, Report, Sample};
use tractive::protection::{Fault, MaskedFaults, SafeState};
use tractive::time::{Clock, Instant};

/// That of the 180 kW drive, and what it takes on 1,500 V.
const DEAD_TIME: DeadTime = DeadTime { voltage_v: 6.75, left_share: 0.2, time_s: 5e-6 };

/// Control periods of a walk.
const PERIODS: u32 = 4_000;
/// Walks of each law; every other one has a damped link, and the last two a machine whose magnets are kept.
const WALKS: u32 = 10;
const KEPT: Tables = Tables { ratings: Ratings { min_id_a: -120.0, ..BUILT_IN.ratings }, ..BUILT_IN };

/// The currents of a walk do not follow its voltage.
const UNEXPLAINED: MaskedFaults = MaskedFaults::of(Fault::VoltageUnexplained);

/// Random numbers, the same on every machine.
struct Random(u64);

impl Random {
    /// Between -1 and 1.
    fn next(&mut self) -> f32 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((self.0 >> 40) as f32) / (1 << 23) as f32 - 1.0
    }

    /// Between two values.
    fn within(&mut self, low: f32, high: f32) -> f32 {
        low + 0.5 * (self.next() + 1.0) * (high - low)
    }

    fn is(&mut self, share: f32) -> bool {
        self.within(0.0, 1.0) < share
    }

    fn vector(&mut self, length: f32) -> AlphaBeta {
        AlphaBeta { alpha: length * self.next(), beta: length * self.next() }
    }
}

/// The state of a walk's inputs.
struct Walk {
    random: Random,
    rpm: f32,
    rpm_wanted: f32,
    udc_v: f32,
    angle: Angle,
    demand: Demand,
    limits: ModeLimits,
    window: Option<LinkWindow>,
    warmth: Warmth,
}

impl Walk {
    fn new(number: u32) -> Self {
        let limits = ModeLimits { steady_limit: 0.9 * 0.95, ..ModeLimits::carrier(0.9) };
        Self {
            random: Random(u64::from(number) + 1),
            rpm: 0.0,
            rpm_wanted: 0.0,
            udc_v: 1_500.0,
            angle: Angle::default(),
            demand: Demand { torque_nm: 0.0, slew_limited: true },
            limits,
            window: None,
            warmth: Warmth::NONE,
        }
    }

    /// A control period later.
    fn step(&mut self, clock: &Clock) {
        let random = &mut self.random;
        if random.is(0.004) {
            self.rpm_wanted = random.within(-4_500.0, 4_500.0);
        }
        if random.is(0.01) {
            let torque_nm = random.within(-1_300.0, 1_300.0);
            self.demand = Demand { torque_nm, slew_limited: random.is(0.5) };
        }
        if random.is(0.01) {
            self.limits.follows = match random.within(0.0, 3.0) {
                0.0..1.0 => Regulated::Mean,
                1.0..2.0 => Regulated::Fundamental,
                _ => Regulated::Angle,
            };
            self.limits.index_limit = random.within(0.7, 1.0);
            self.limits.steady_limit = self.limits.index_limit * random.within(0.9, 1.0);
            self.limits.ripple_share = random.within(0.01, 0.2);
            self.limits.ripple_s2 =
                random.is(0.7).then(|| [random.within(0.0, 5e-9), random.within(0.0, 2e-8)]);
            (self.limits.filled, self.limits.settled) = (random.is(0.3), random.is(0.7));
        }
        if random.is(0.002) {
            self.window = random.is(0.5).then_some(LinkWindow {
                motoring_none_v: 1_000.0,
                motoring_full_v: 1_400.0,
                braking_full_v: 1_600.0,
                braking_none_v: 1_900.0,
            });
            self.warmth = Warmth::new(random.within(0.8, 1.5));
        }
        self.rpm += (self.rpm_wanted - self.rpm) * 0.01;
        self.udc_v = (self.udc_v + 5.0 * random.next()).clamp(900.0, 2_000.0);
        let turns = self.rpm / 60.0 * BUILT_IN.ratings.pole_pairs * clock.control_s();
        self.angle = self.angle + Angle::from_turns(turns);
    }

    fn committed(&mut self) -> Committed {
        let random = &mut self.random;
        let ripple_wb = random.is(0.5).then(|| random.vector(0.05));
        let volt_seconds = (!random.is(0.02)).then(|| random.vector(0.3));
        let (horizon_s, interval_s) = (random.within(0.0, 1e-3), random.within(1e-4, 1e-3));
        Committed { horizon_s, volt_seconds, ripple_wb, interval_s }
    }
}

/// The hash with numbers behind it, by their bits.
fn pin(sum: u64, numbers: &[f32]) -> u64 {
    numbers.iter().fold(sum, |sum, number| hash(sum, &number.to_bits().to_le_bytes()))
}

/// Temperatures now and then, and what nothing explains in each period.
fn know(law: &mut impl ControlLaw, period: u32, warmth: Warmth, law_of: &Law) {
    if period.is_multiple_of(64) {
        law.warm(warmth);
    }
    law.explain(DEAD_TIME, law_of);
}

/// The walk of a law: a line each eighth of it, with the hash of all outputs until then.
fn walk<L: ControlLaw>(mut law: L, name: &str, number: u32, out: &mut String) {
    let (clock, mut walk, mut sum) = (Clock::new(25_000_000, 2_500), Walk::new(number), BASIS);
    let gains = Gains::of(number & 2 != 0, number & 1 != 0);
    let tables = if number < WALKS - 2 { &BUILT_IN } else { &KEPT };
    let law_of = Law { gains: &gains, clock: &clock, tables };
    let mut damper = LinkDamper::at(1_500.0);
    for period in 0..PERIODS {
        walk.step(&clock);
        let omega = law.track(walk.angle, &clock);
        let current =
            law.target().current + Dq { d: 15.0 * walk.random.next(), q: 15.0 * walk.random.next() };
        let sample = RotorSample::new(current.unpark(walk.angle.sin_cos()).abc(), walk.angle, tables);
        law.observe(&sample, tables);
        know(&mut law, period, walk.warmth, &law_of);
        if period % 3 == 0 {
            let volt_seconds = (!walk.random.is(0.02)).then(|| walk.random.vector(0.3));
            let boundary = Boundary { volt_seconds, length_s: walk.random.within(1e-4, 1e-3) };
            law.learn(&boundary, &sample, walk.limits.follows, &law_of);
        } else {
            law.pass(&sample);
        }
        if walk.random.is(0.001) {
            law.idle();
            law.observe(&sample, tables);
        }
        if walk.random.is(0.001) {
            law.begin_without_torque();
        }
        if period % 5 == 4 {
            let passed_s = law.passed_s(&clock);
            let swing = (number & 1 != 0)
                .then(|| damper.step(walk.udc_v, passed_s, omega, (walk.limits.follows, false)));
            let plain = AimInput::plain(&walk.demand, walk.udc_v, &walk.limits);
            law.aim(&AimInput { window: walk.window.as_ref(), swing, ..plain }, &law_of);
            let committed = walk.committed();
            let made = law.regulate(&sample, &committed, &walk.limits, &law_of);
            let target = *law.target();
            assert!(made.voltage_v.is_finite(), "{name} {number}, period {period}: {made:?}");
            sum = pin(sum, &[made.voltage_v, made.vector.alpha, made.vector.beta, made.steady_v]);
            sum =
                pin(sum, &[made.carrier.alpha, made.carrier.beta, target.torque_nm, target.modulation_index]);
            sum = pin(sum, &[target.current.d, target.current.q, target.flux.d, target.flux.q]);
            sum = pin(sum, &[target.voltage_limit_v, target.region as u8 as f32]);
            sum = pin(sum, &[law.map_error(), law.flowing_nm(), omega, passed_s]);
        }
        if (period + 1) % (PERIODS / 8) == 0 {
            writeln!(out, "{name} walk {number} period {period}: {sum:016x}").unwrap();
        }
    }
}

#[test]
fn every_output_of_the_laws_is_as_it_was() {
    let mut out = String::new();
    for number in 0..WALKS {
        walk(Controller::new(), "tractive", number, &mut out);
        walk(PiLaw::new(), "pi", number, &mut out);
    }
    holds("laws", &out);
}

/// Carrier frequency of the free pulses, shortest half and the like are those of [`SwitchLimits`]; this is the clock.
const CLOCK: Clock = Clock::new(25_000_000, 2_500);

/// Two ports between which a motor turns as a walk has it, with the currents of its demand, whatever the pulses are.
struct Board {
    walk: Walk,
    now: u32,
    shadow: CarrierHalf,
    report: Report,
}

impl Board {
    /// Up to this instant.
    fn pass(&mut self, at: u32) {
        let turns = self.walk.rpm / 60.0 * BUILT_IN.ratings.pole_pairs * (at - self.now) as f32 / 25e6;
        self.walk.angle = self.walk.angle + Angle::from_turns(turns);
        self.now = at;
    }

    fn currents(&mut self) -> Abc {
        if self.shadow.mode == Mode::Off {
            return Abc::default();
        }
        let noise = [0, 1].map(|_| 4.0 * self.walk.random.next());
        let share = self.walk.demand.torque_nm / BUILT_IN.ratings.max_torque_nm;
        let current = Dq { d: -60.0 * share.abs() + noise[0], q: 70.0 * share + noise[1] };
        current.unpark(self.walk.angle.sin_cos()).abc()
    }
}

impl ControlPort for Board {
    fn sample(&mut self, _now: Instant) -> Sample {
        let (currents_a, udc_v) = (self.currents(), self.walk.udc_v);
        Sample { currents_a, udc_v, angle: Some(self.walk.angle), may_pulse: true, hardware: None }
    }

    fn command(&mut self, _now: Instant, _operator: impl FnOnce() -> DriveCommand) -> DriveCommand {
        DriveCommand { enable: true, demand: self.walk.demand, ..DriveCommand::NONE }
    }

    fn enter(&mut self, _safe: SafeState, _now: Instant) {}

    fn overrun_ticks(&mut self, _now: Instant, _deadline_ticks: u32) -> u32 {
        0
    }

    fn report(&mut self, _now: Instant, report: impl FnOnce() -> Report) {
        self.report = report();
    }
}

impl PwmPort for Board {
    fn sample(&mut self, _now: Instant) -> Abc {
        self.currents()
    }

    fn play(&mut self, _now: Instant, next: &CarrierHalf) {
        self.shadow = *next;
    }

    fn enter(&mut self, _safe: SafeState, _now: Instant) {}
}

/// Up to a speed and back, torque wandering: every mode of the ladder comes by.
fn sweep(number: u32, dead_ticks: u32, (ladder, fastest_rpm): (Ladder, f32), out: &mut String) {
    let settings = Settings::new(CLOCK, SwitchLimits::new(250, dead_ticks, 900.0, &CLOCK));
    let first = SwitchLimits::new(250, dead_ticks, 900.0, &CLOCK).shortest_half_ticks;
    let shared = Shared::new();
    let mut control = ControlTask::new(&BUILT_IN, settings, Instant(CLOCK.control_ticks))
        .scheduled(Schedule::on(ladder, &CLOCK))
        .without(UNEXPLAINED);
    let mut pwm = PwmTask::new(&BUILT_IN, settings, Instant(first));
    let (walk, shadow) = (Walk::new(100 + number), CarrierHalf::off(first));
    let mut board = Board { walk, now: 0, shadow, report: Report::default() };
    let [mut control_at, mut pwm_at] = [CLOCK.control_ticks, first];
    let (mut sum, mut periods) = (BASIS, 0);
    let mut modes = std::collections::BTreeSet::new();
    while periods < 20_000 {
        if pwm_at <= control_at {
            board.pass(pwm_at);
            pwm_at += board.shadow.period_ticks;
            pwm.run(&mut board, &shared);
            sum = hash(sum, format!("{:?}", board.shadow).as_bytes());
            modes.insert(board.shadow.mode.name());
            continue;
        }
        board.pass(control_at);
        control_at += CLOCK.control_ticks;
        periods += 1;
        let way = if periods < 10_000 { fastest_rpm } else { -fastest_rpm };
        board.walk.rpm += way * 1e-4;
        board.walk.udc_v = (board.walk.udc_v + 2.0 * board.walk.random.next()).clamp(1_300.0, 1_700.0);
        if periods % 500 == 0 {
            board.walk.demand.torque_nm = board.walk.random.within(-1_000.0, 1_000.0);
        }
        control.run(&mut board, &shared);
        let words = board.report.to_words();
        sum = words.iter().fold(sum, |sum, word| hash(sum, &word.to_le_bytes()));
        if periods % 500 == 0 {
            let (mode, trip) = (board.shadow.mode, board.report.trip);
            writeln!(out, "sweep {number} period {periods}: {sum:016x}, {mode:?}, trip {trip:?}").unwrap();
        }
    }
    writeln!(out, "sweep {number} modes: {modes:?}").unwrap();
    assert_eq!((board.report.trip, pwm.trip()), (None, None), "{out}");
}

#[test]
fn every_pulse_and_every_report_of_a_sweep_is_as_it_was() {
    let mut out = String::new();
    for (number, dead_ticks) in [(0, 0), (1, 100)] {
        sweep(number, dead_ticks, (Ladder::PAPER, 4_500.0), &mut out);
    }
    for mode in ["async", "sync15", "sync12", "mid7", "mid3", "square"] {
        assert!(out.contains(mode), "{mode}: {out}");
    }
    holds("sweep", &out);
}

/// With `--features optimal`.
#[cfg(feature = "optimal")]
#[test]
fn every_pulse_and_every_report_of_a_sweep_of_optimised_patterns_is_as_it_was() {
    let mut out = String::new();
    for (number, dead_ticks) in [(0, 0), (1, 100)] {
        sweep(number, dead_ticks, (Ladder::OPTIMAL, 5_000.0), &mut out);
    }
    for mode in ["async", "opp15", "opp7", "opp3", "square"] {
        assert!(out.contains(mode), "{mode}: {out}");
    }
    holds("optimal", &out);
}
