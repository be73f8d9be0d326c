//! The ZS9's drive on walks of two motors whose speeds change, with dead time, a quick carrier, pauses, a gate that is stuck, faults and their
//! acknowledges: pinned as in `tests/pinned.rs`.

#[path = "pinned/file.rs"]
mod file;

use file::{BASIS, hash, holds};
use std::f32::consts::TAU;
use std::fmt::Write;
use tractive::built_in::zs9::BUILT_IN;
use tractive::cell::Words;
use tractive::control::Demand;
use tractive::drive::dual::{ControlTask, PwmTask, Settings, Shared};
use tractive::frames::{Abc, Angle, Dq};
use tractive::nine_switch::Scheme;
use tractive::ports::{
    ControlPort, Dual, DualDriveCommand, DualReport, DualSample, GateFeedback, HardwareBreak, MotorDemand,
    PlayedPeriod, PowerSample, PwmPort,
};
use tractive::protection::{Fault, MaskedFaults, SafeState};
use tractive::time::{Clock, Instant};

const CLOCK: Clock = Clock::new(25_000_000, 2_500);
const PERIODS: u32 = 4_000;

struct Board {
    random: u64,
    settings: Settings,
    period: u32,
    /// Electrical, in rad/s, and what it tends to.
    omega: [f32; 2],
    wanted: [f32; 2],
    angles: [Angle; 2],
    now: u32,
    command: DualDriveCommand,
    played: [PlayedPeriod; 2],
    report: DualReport,
    /// The hash of what the drive did beside its pulses.
    sum: u64,
}

impl Board {
    /// Between -1 and 1.
    fn random(&mut self) -> f32 {
        self.random =
            self.random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((self.random >> 40) as f32) / (1 << 23) as f32 - 1.0
    }

    fn pass(&mut self, at: u32) {
        let passed_s = (at - self.now) as f32 / 25e6;
        for ((omega, wanted), angle) in self.omega.iter_mut().zip(self.wanted).zip(&mut self.angles) {
            *omega += (wanted - *omega).clamp(-4_000.0 * passed_s, 4_000.0 * passed_s);
            *angle = *angle + Angle::from_turns(*omega * passed_s / TAU);
        }
        self.now = at;
    }

    fn currents(&mut self) -> [Abc; 2] {
        let little = if self.period % 900 < 300 { 0.02 } else { 1.0 };
        [0, 1].map(|motor| {
            let noise = [self.random(), self.random()];
            let current =
                Dq { d: little * -6.0 + noise[0], q: little * 20.0 * (1.0 - motor as f32 * 1.7) + noise[1] };
            current.unpark(self.angles[motor].sin_cos()).abc()
        })
    }

    fn note(&mut self, what: &str) {
        self.sum = hash(self.sum, format!("{}: {what}", self.period).as_bytes());
    }
}

impl ControlPort<Dual> for Board {
    fn sample(&mut self, _now: Instant) -> DualSample {
        let mut currents_a = self.currents();
        if self.period == 1_700 {
            currents_a[1].b += 200.0;
        }
        let angles = self.angles.map(Some);
        let [capacitor, inductor, source] = [0; 3].map(|_| self.random());
        let hardware = HardwareBreak { fault: Fault::HardwareOvercurrent, seen: 0b10 };
        DualSample {
            currents_a,
            angles,
            capacitor_v: 533.5 + 10.0 * capacitor,
            inductor_a: 20.0 + 5.0 * inductor,
            source_v: 400.0 + 5.0 * source,
            may_pulse: !(1_200..1_230).contains(&self.period),
            hardware: (self.period == 2_600).then_some(hardware),
        }
    }

    fn command(&mut self, _now: Instant, _operator: impl FnOnce() -> DualDriveCommand) -> DualDriveCommand {
        if self.period.is_multiple_of(150) {
            self.wanted = [0; 2].map(|_| 500.0 * self.random());
            self.command.demands = [0; 2].map(|_| match self.random() > 0.0 {
                true => MotorDemand::Torque(Demand {
                    torque_nm: 80.0 * self.random(),
                    slew_limited: self.period.is_multiple_of(300),
                }),
                false => MotorDemand::Speed(200.0 * self.random()),
            });
            self.command.link_ref_v = 580.0 + 80.0 * self.random();
            self.command.speed_torque_nm = [0; 2].map(|_| 60.0 + 40.0 * self.random());
            self.command.scheme = Scheme::from_code(self.period / 150 % 7);
        }
        self.command.enable = !(800..900).contains(&self.period);
        self.command.acknowledge = (self.period / 500) as u8;
        self.command
    }

    fn enter(&mut self, safe: SafeState, _now: Instant) {
        self.note(&format!("control enters {safe:?}"));
    }

    fn overrun_ticks(&mut self, _now: Instant, _deadline_ticks: u32) -> u32 {
        u32::from(self.period == 3_100) * 40
    }

    fn report(&mut self, _now: Instant, report: impl FnOnce() -> DualReport) {
        self.report = report();
    }
}

impl PwmPort<Dual> for Board {
    fn sample(&mut self, _now: Instant) -> PowerSample {
        let half = self.settings.half_steps();
        let mut gates = GateFeedback::default();
        for period in &self.played {
            for (bit, gate) in period.gates.iter().enumerate() {
                gates.on |= u16::from(gate.off_from > 0 || gate.off_to < half) << bit;
                gates.off |= u16::from(gate.off_from < gate.off_to) << bit;
            }
        }
        if self.period == 3_700 {
            gates.off &= !(1 << 4);
        }
        let currents_a = self.currents();
        PowerSample { currents_a, capacitor_v: 533.5 + 5.0 * self.random(), source_v: 400.0, gates }
    }

    fn play(&mut self, _now: Instant, next: &PlayedPeriod) {
        self.played = [self.played[1], *next];
        for gate in &next.gates {
            let ends = [gate.off_from, gate.off_to].map(u32::to_le_bytes);
            self.sum = ends.iter().fold(self.sum, |sum, bytes| hash(sum, bytes));
        }
    }

    fn enter(&mut self, safe: SafeState, _now: Instant) {
        self.note(&format!("PWM enters {safe:?}"));
    }

    fn leave(&mut self, _now: Instant) -> bool {
        self.note("leaves");
        true
    }
}

/// A walk: a line each 200 periods.
fn walk(carrier_ticks: u32, dead_time_ticks: u32, seed: u64, out: &mut String) {
    let usual = Settings::new(CLOCK, 2_500, &BUILT_IN);
    // The currents of a walk do not follow its voltage.
    let unexplained = MaskedFaults::of(Fault::VoltageUnexplained);
    let mut control = ControlTask::new(&BUILT_IN, usual).without(unexplained);
    let mut pwm = PwmTask::new(&BUILT_IN, usual);
    let settings = Settings { carrier_ticks, dead_time_ticks, ..usual };
    control.set_up(Settings { dead_time_ticks: 0, ..settings });
    pwm.set_up(settings);
    let off = PlayedPeriod::off(settings.half_steps());
    let mut board = Board {
        random: seed,
        settings,
        period: 0,
        omega: [0.0; 2],
        wanted: [250.0, -100.0],
        angles: [Angle::ZERO; 2],
        now: 0,
        command: DualDriveCommand { link_ref_v: 620.0, ..DualDriveCommand::NONE },
        played: [off; 2],
        report: DualReport::default(),
        sum: BASIS,
    };
    let shared = Shared::new();
    let [mut pwm_at, mut control_at] = [settings.first_peak_ticks(), CLOCK.control_ticks];
    let mut sum = BASIS;
    while board.period < PERIODS {
        if pwm_at <= control_at {
            board.pass(pwm_at);
            pwm_at += carrier_ticks;
            pwm.run(&mut board, &shared);
            continue;
        }
        board.pass(control_at);
        control_at += CLOCK.control_ticks;
        board.period += 1;
        control.run(&mut board, &shared);
        let words = board.report.to_words();
        sum = words.iter().fold(sum, |sum, word| hash(sum, &word.to_le_bytes()));
        if board.period.is_multiple_of(200) {
            let (did, trip) = (board.sum, board.report.trip.map(|trip| trip.fault));
            writeln!(
                out,
                "{carrier_ticks} {dead_time_ticks} period {}: {sum:016x} {did:016x}, {trip:?}",
                board.period
            )
            .unwrap();
        }
    }
}

#[test]
fn every_pulse_and_every_report_of_two_motors_is_as_it_was() {
    let mut out = String::new();
    for (seed, (carrier_ticks, dead_time_ticks)) in
        [(2_500, 0), (2_500, 60), (1_250, 40)].into_iter().enumerate()
    {
        walk(carrier_ticks, dead_time_ticks, seed as u64, &mut out);
    }
    for fault in ["Overcurrent", "HardwareOvercurrent", "LegStuck", "None"] {
        assert!(out.contains(fault), "{fault}: {out}");
    }
    holds("zs9-walks", &out);
}
