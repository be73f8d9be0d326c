//! The ZS9's two tasks by themselves: faults, words, and what they play when the measurements make no sense.

#[path = "pinned/file.rs"]
mod file;

use std::cell::Cell;
use std::fmt::Write;
use tractive::built_in::zs9::BUILT_IN;
use tractive::cell::Words;
use tractive::control::Demand;
use tractive::drive::Gates;
use tractive::drive::dual::{
    ControlTask, DualApplied, DualCommand, MotorCommand, MotorShare, PwmTask, Settings, Shared,
};
use tractive::frames::{Abc, Angle, Dq};
use tractive::nine_switch::{LegState, Scheme};
use tractive::ports::DualReport;
use tractive::ports::{
    ControlPort, Dual, DualDriveCommand, DualSample, GateFeedback, HardwareBreak, MotorDemand, PlayedPeriod,
    PowerSample, PwmPort,
};
use tractive::protection::{Fault, MaskedFaults, SafeState, Trip};
use tractive::recorder::DualRecorder;
use tractive::time::{Clock, Instant};

const CLOCK: Clock = Clock::new(25_000_000, 2_500);
const CARRIER_TICKS: u32 = 2_500;
const SETTINGS: Settings = Settings::new(CLOCK, CARRIER_TICKS, &BUILT_IN);
/// Electrical, in rad/s: 600 r/min.
const OMEGA: f32 = 251.3;

/// Two motors that turn steadily and carry a steady current, with what a test does to the samples.
struct Fake {
    spoil: Spoil,
    /// The command beside the newest sample.
    command: DualDriveCommand,
    spoil_power: fn(&mut PowerSample),
    overrun: u32,
    off_at: Option<Instant>,
    running: PlayedPeriod,
    next: PlayedPeriod,
    before: PlayedPeriod,
    report: DualReport,
    acknowledge: u8,
    /// The number of times that the gates were let go, and whether something holds them.
    left: u32,
    held: bool,
    /// Delay after a peak, in compare steps, before the board begins to look at the gates anew.
    late_steps: u32,
    /// `true` if control asks the operator, who is told then.
    operated: bool,
}

/// The control task without its check of the voltage, which the currents of a fake do not follow.
fn control() -> ControlTask {
    ControlTask::new(&BUILT_IN, SETTINGS).without(MaskedFaults::of(Fault::VoltageUnexplained))
}

impl Fake {
    fn new() -> Self {
        let off = PlayedPeriod::off(SETTINGS.half_steps());
        Self {
            spoil: |_, _| {},
            command: DualDriveCommand::NONE,
            spoil_power: |_| {},
            overrun: 0,
            off_at: None,
            running: off,
            next: off,
            before: off,
            report: DualReport::default(),
            acknowledge: 0,
            left: 0,
            held: false,
            late_steps: 0,
            operated: false,
        }
    }

    fn angle(now: Instant) -> Angle {
        Angle(
            (f64::from(OMEGA) * f64::from(now.0) / 25e6 / std::f64::consts::TAU * 4_294_967_296.0) as u64
                as u32,
        )
    }

    fn currents(now: Instant) -> [Abc; 2] {
        let ripple = (now.0 % 7919) as f32 * 1e-4;
        let current = Dq { d: -5.0 + ripple, q: 25.0 };
        [current.unpark(Self::angle(now).sin_cos()).abc(); 2]
    }

    /// The latches at a peak.
    fn feedback(&self) -> GateFeedback {
        let half = SETTINGS.half_steps();
        let mut seen = GateFeedback::default();
        for period in [&self.before, &self.running] {
            for (bit, gate) in period.gates.iter().enumerate() {
                seen.on |= u16::from(gate.off_from > 0 || gate.off_to < half) << bit;
                let over = std::ptr::eq(period, &self.before) && half - gate.off_from < self.late_steps;
                seen.off |= u16::from(gate.off_from < gate.off_to && !over) << bit;
            }
        }
        seen
    }
}

impl ControlPort<Dual> for Fake {
    fn sample(&mut self, now: Instant) -> DualSample {
        let mut sample = DualSample {
            currents_a: Self::currents(now),
            angles: [Some(Self::angle(now)); 2],
            capacitor_v: 533.5,
            inductor_a: 20.0,
            source_v: 400.0,
            may_pulse: true,
            hardware: None,
        };
        self.command = DualDriveCommand {
            enable: true,
            demands: [MotorDemand::Torque(Demand { torque_nm: 50.0, slew_limited: true }); 2],
            speed_torque_nm: DualDriveCommand::UNLIMITED_NM,
            link_ref_v: 667.0,
            acknowledge: self.acknowledge,
            ..DualDriveCommand::NONE
        };
        (self.spoil)(&mut sample, &mut self.command);
        sample
    }

    fn command(&mut self, _now: Instant, operator: impl FnOnce() -> DualDriveCommand) -> DualDriveCommand {
        if self.operated { operator() } else { self.command }
    }

    fn enter(&mut self, _safe: SafeState, now: Instant) {
        self.off_at = self.off_at.or(Some(now));
    }

    fn overrun_ticks(&mut self, _now: Instant, _deadline_ticks: u32) -> u32 {
        self.overrun
    }

    fn report(&mut self, _now: Instant, report: impl FnOnce() -> DualReport) {
        self.report = report();
    }
}

impl PwmPort<Dual> for Fake {
    fn sample(&mut self, now: Instant) -> PowerSample {
        let mut sample = PowerSample {
            currents_a: Self::currents(now),
            capacitor_v: 533.5,
            source_v: 400.0,
            gates: self.feedback(),
        };
        (self.spoil_power)(&mut sample);
        sample
    }

    fn play(&mut self, _now: Instant, next: &PlayedPeriod) {
        self.before = self.running;
        self.running = *next;
        self.next = *next;
    }

    fn enter(&mut self, _safe: SafeState, now: Instant) {
        self.off_at = self.off_at.or(Some(now));
    }

    fn leave(&mut self, _now: Instant) -> bool {
        self.left += 1;
        !self.held
    }
}

struct Drive {
    fake: Fake,
    shared: Shared<'static>,
    control: ControlTask,
    pwm: PwmTask,
}

impl Drive {
    /// Pulses, for a while.
    fn pulsing() -> Self {
        let mut drive = Self {
            fake: Fake::new(),
            shared: Shared::new(),
            control: control(),
            pwm: PwmTask::new(&BUILT_IN, SETTINGS),
        };
        drive.run(600);
        assert_eq!((drive.fake.report.trip, drive.pwm.trip()), (None, None));
        assert!(!drive.is_off(), "pulses are made");
        drive
    }

    fn run(&mut self, periods: u32) {
        for _ in 0..periods {
            self.pwm.run(&mut self.fake, &self.shared);
            self.control.run(&mut self.fake, &self.shared);
        }
    }

    fn is_off(&self) -> bool {
        self.fake.next == PlayedPeriod::off(SETTINGS.half_steps())
    }

    /// Runs on until the trip, which must be in the first interrupt that can see its cause.
    fn trips(&mut self, fault: Fault) -> Trip {
        let now = self.control.next_call();
        self.run(3);
        let trip = self.fake.report.trip.unwrap_or_else(|| panic!("no trip: {fault:?}"));
        assert_eq!((trip.fault, trip.safe), (fault, SafeState::GatesOff));
        assert_eq!(self.fake.off_at, Some(trip.at), "gates off in the interrupt that found it");
        assert!(trip.at.since(now).unsigned_abs() <= CARRIER_TICKS, "{trip:?} {now:?}");
        assert!(self.is_off(), "and never on again");
        self.fake.spoil = |_, _| {};
        self.fake.spoil_power = |_| {};
        self.run(20);
        let after = self.fake.report.trip.map(|trip| (trip.fault, trip.at));
        assert_eq!(after, Some((trip.fault, trip.at)), "latched");
        assert!(self.is_off());
        trip
    }
}

/// The injury of a test to a sample, and the fault that it should be.
type Case<S> = (S, Fault);
/// The change that a test makes to a sample and its command.
type Spoil = fn(&mut DualSample, &mut DualDriveCommand);

#[test]
fn what_is_sampled_wrong_trips_by_name() {
    let cases: [Case<Spoil>; 20] = [
        (|sample, _| sample.source_v = 200.0, Fault::SourceUndervoltage),
        (|sample, _| sample.source_v = f32::NAN, Fault::NotFinite),
        (|sample, _| sample.capacitor_v = 721.0, Fault::CapacitorOvervoltage),
        (|sample, _| sample.capacitor_v = f32::NAN, Fault::NotFinite),
        (|sample, _| sample.capacitor_v = f32::INFINITY, Fault::NotFinite),
        (|sample, _| sample.inductor_a = f32::NAN, Fault::NotFinite),
        (|sample, _| sample.inductor_a = f32::NEG_INFINITY, Fault::NotFinite),
        (|sample, _| sample.currents_a[0].a = 150.0, Fault::Overcurrent),
        (|sample, _| sample.currents_a[1].c = -150.0, Fault::Overcurrent),
        (|sample, _| sample.currents_a[1].c += 12.0, Fault::PhaseSum),
        (|sample, _| sample.currents_a[0].b = f32::NAN, Fault::NotFinite),
        (|sample, _| sample.angles[0] = None, Fault::SensorLost1),
        (|sample, _| sample.angles[1] = None, Fault::SensorLost2),
        (|sample, _| sample.angles[0] = Some(Angle(0)), Fault::SensorLost1),
        (|_, command| command.link_ref_v = 1020.0, Fault::DutyRange),
        (|_, command| command.link_ref_v = f32::NAN, Fault::NotFinite),
        (|_, command| command.demands[0] = MotorDemand::Speed(f32::NAN), Fault::NotFinite),
        (|_, command| command.demands[1] = MotorDemand::Speed(f32::INFINITY), Fault::NotFinite),
        (
            |_, command| {
                command.demands[1] = MotorDemand::Torque(Demand { torque_nm: f32::NAN, slew_limited: false });
            },
            Fault::NotFinite,
        ),
        (|sample, _| sample.source_v = -400.0, Fault::SourceUndervoltage),
    ];
    for (spoil, fault) in cases {
        let mut drive = Drive::pulsing();
        drive.fake.spoil = spoil;
        let trip = drive.trips(fault);
        println!("{}: {} (limit {})", fault.name(), trip.value, trip.limit);
    }
}

/// The voltages of capacitor and source that a duty cannot make of each other: a reading that is off, and one that is frozen while the duty goes on.
#[test]
fn voltages_of_the_link_that_cannot_be_are_found() {
    let cases: [(Spoil, u32); 3] = [
        (|sample, _| sample.source_v = 600.0, 100),
        (|sample, _| sample.capacitor_v = 420.0, 400),
        (|_, command| command.link_ref_v = 680.0, 3_000),
    ];
    for (spoil, periods) in cases {
        let mut drive = Drive::pulsing();
        drive.fake.spoil = spoil;
        drive.run(periods);
        assert!(drive.fake.report.trip.is_some());
        drive.run(3);
        let trip = drive.fake.report.trip.expect("a fault");
        assert_eq!((trip.fault, drive.is_off()), (Fault::LinkImplausible, true));
        assert!(trip.value < trip.limit, "{trip:?}");
    }
}

/// Currents of either motor that stay the same while its rotor turns.
#[test]
fn currents_that_freeze_are_found() {
    const STILL: Abc = Abc { a: 40.0, b: -25.0, c: -15.0 };
    let cases: [Spoil; 2] =
        [|sample, _| sample.currents_a[0] = STILL, |sample, _| sample.currents_a[1] = STILL];
    for (motor, spoil) in cases.into_iter().enumerate() {
        let mut drive = Drive::pulsing();
        drive.fake.spoil = spoil;
        drive.run(100);
        let trip = drive.fake.report.trip.map(|trip| trip.fault);
        assert_eq!((trip, drive.is_off()), (Some(Fault::Frozen), true), "motor {motor}");
    }
}

#[test]
fn the_pwm_interrupt_finds_what_is_quick() {
    let cases: [Case<fn(&mut PowerSample)>; 7] = [
        (|sample| sample.currents_a[0].b = 150.0, Fault::Overcurrent),
        (|sample| sample.currents_a[1].a = f32::NAN, Fault::NotFinite),
        (|sample| sample.source_v = 0.0, Fault::SourceUndervoltage),
        (|sample| sample.capacitor_v = 800.0, Fault::CapacitorOvervoltage),
        (|sample| sample.capacitor_v = f32::NAN, Fault::NotFinite),
        (|sample| sample.gates.on &= !1, Fault::LegStuck),
        (|sample| sample.gates.off &= !(1 << 8), Fault::LegStuck),
    ];
    for (spoil, fault) in cases {
        let mut drive = Drive::pulsing();
        drive.fake.spoil_power = spoil;
        let trip = drive.trips(fault);
        assert!(trip.at.0 % CARRIER_TICKS == CARRIER_TICKS / 2, "at a peak: {trip:?}");
    }
}

#[test]
fn each_stuck_gate_is_told() {
    for gate in 0..9 {
        let mut drive = Drive::pulsing();
        drive.fake.spoil_power = [
            |sample: &mut PowerSample| sample.gates.on ^= 1,
            |sample: &mut PowerSample| sample.gates.on ^= 1 << 1,
            |sample: &mut PowerSample| sample.gates.on ^= 1 << 2,
            |sample: &mut PowerSample| sample.gates.on ^= 1 << 3,
            |sample: &mut PowerSample| sample.gates.on ^= 1 << 4,
            |sample: &mut PowerSample| sample.gates.on ^= 1 << 5,
            |sample: &mut PowerSample| sample.gates.off ^= 1 << 6,
            |sample: &mut PowerSample| sample.gates.off ^= 1 << 7,
            |sample: &mut PowerSample| sample.gates.off ^= 1 << 8,
        ][gate];
        assert_eq!(drive.trips(Fault::LegStuck).value, (1_u32 << gate) as f32);
    }
}

#[test]
fn a_short_pause_around_the_peak_is_seen_before_it_alone() {
    let mut drive = Drive::pulsing();
    drive.fake.late_steps = SETTINGS.half_steps() / 2;
    drive.run(300);
    assert_eq!(drive.fake.report.trip, None);
    assert!(!drive.is_off());
}

#[test]
fn a_late_control_interrupt_trips() {
    let mut drive = Drive::pulsing();
    drive.fake.overrun = 25;
    let trip = drive.trips(Fault::ControlDeadline);
    assert!((trip.value - 1e-6).abs() < 1e-9, "{trip:?}");
}

#[test]
fn without_control_the_pwm_interrupt_stops() {
    let mut drive = Drive::pulsing();
    for _ in 0..10 {
        drive.pwm.run(&mut drive.fake, &drive.shared);
    }
    let trip = drive.pwm.trip().unwrap();
    assert_eq!(trip.fault, Fault::StaleCommand);
    assert!(trip.value >= trip.limit && drive.is_off(), "{trip:?}");
    assert_eq!(drive.fake.off_at, Some(trip.at));
}

#[test]
fn disabled_it_makes_no_pulses_and_no_fault() {
    let mut drive = Drive::pulsing();
    drive.fake.spoil = |_, command| command.enable = false;
    drive.run(3);
    assert!(drive.is_off() && drive.fake.report.trip.is_none());
    drive.fake.spoil = |_, _| {};
    drive.run(3);
    assert!(!drive.is_off() && drive.fake.report.trip.is_none());
}

/// Each motor's speed counts: neither may be caught before.
#[test]
fn speeds_are_known_once_both_are() {
    let cases: [(Spoil, bool); 3] = [
        (|_, command| command.enable = false, true),
        (|sample, command| (sample.angles[0], command.enable) = (None, false), false),
        (|sample, command| (sample.angles[1], command.enable) = (None, false), false),
    ];
    for (spoil, known) in cases {
        let (mut fake, mut control) = (Fake::new(), control());
        let (mut pwm, shared) = (PwmTask::new(&BUILT_IN, SETTINGS), Shared::new());
        fake.spoil = spoil;
        for _ in 0..600 {
            pwm.run(&mut fake, &shared);
            control.run(&mut fake, &shared);
        }
        assert_eq!((fake.report.speed_known, fake.report.trip), (known, None));
    }
}

/// The operator is told in every tenth period, from the first one on in which it was asked; on a board that another one commands, never.
#[test]
fn the_operator_is_told_once_a_slot_and_only_where_it_commands() {
    for operated in [false, true] {
        let mut drive = Drive::pulsing();
        drive.fake.operated = operated;
        let told = (0..100).filter(|_| {
            let now = drive.control.next_call();
            drive.run(1);
            drive.shared.operator.has_told(now)
        });
        assert_eq!(told.count(), if operated { 10 } else { 0 });
    }
}

/// Both zeros are found in every slot in which the operator wants it while the gates pulse, and no longer.
#[test]
fn zeros_are_calibrated_in_every_slot_as_long_as_the_operator_wants_it() {
    let mut drive = Drive::pulsing();
    drive.fake.operated = true;
    let wanted = |calibrate| DualDriveCommand {
        enable: true,
        link_ref_v: 667.0,
        acknowledge: 0,
        calibrate,
        ..DualDriveCommand::NONE
    };
    drive.shared.operator.publish(wanted(true), drive.control.next_call());
    drive.run(20);
    assert_eq!(drive.fake.report.calibrating, [true; 2]);
    let mut zeros = vec![drive.fake.report.angle_zeros];
    for _ in 0..5 {
        drive.run(10);
        assert_eq!(drive.fake.report.trip, None);
        zeros.push(drive.fake.report.angle_zeros);
    }
    assert!(zeros.windows(2).all(|pair| pair[0][0] != pair[1][0] && pair[0][1] != pair[1][1]), "{zeros:?}");
    drive.shared.operator.publish(wanted(false), drive.control.next_call());
    drive.run(20);
    let ended = drive.fake.report.angle_zeros;
    drive.run(20);
    assert_eq!((drive.fake.report.calibrating, drive.fake.report.angle_zeros), ([false; 2], ended));
}

/// A generator of words, good enough to look everywhere.
struct Dice(u64);

impl Dice {
    fn word(&mut self) -> u32 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 32) as u32
    }
}

thread_local! {
    static DICE: std::cell::RefCell<Dice> = const { std::cell::RefCell::new(Dice(1)) };
}

fn any() -> u32 {
    DICE.with_borrow_mut(Dice::word)
}

#[test]
fn whatever_is_sampled_the_gates_are_legal() {
    let half = SETTINGS.half_steps();
    for seed in 0..200 {
        DICE.set(Dice(seed));
        let mut drive = Drive::pulsing();
        // One value a period is any bit pattern at all.
        drive.fake.spoil = |sample, command| {
            let value = f32::from_bits(any());
            match any() % 8 {
                0 => sample.capacitor_v = value,
                1 => sample.inductor_a = value,
                2 => sample.source_v = value,
                3 => command.link_ref_v = value,
                4 => command.demands[0] = MotorDemand::Speed(value),
                5 => {
                    command.demands[1] = MotorDemand::Torque(Demand { torque_nm: value, slew_limited: false })
                }
                6 => sample.angles[0] = Some(Angle(any())),
                _ => sample.currents_a[1].a = value,
            }
        };
        for _ in 0..10 {
            drive.run(1);
            if drive.is_off() {
                continue;
            }
            let gates = &drive.fake.next.gates;
            for step in (0..half).step_by(97) {
                for leg in 0..3 {
                    let [high, middle, low] = [0, 3, 6].map(|row| gates[row + leg].is_on(step));
                    assert!(LegState::of_gates(high, middle, low).is_some(), "{seed}: {high} {middle} {low}");
                }
            }
        }
    }
}

#[test]
fn messages_arrive_as_they_were_sent() {
    let trip =
        Trip { fault: Fault::LegStuck, value: 16.0, limit: 0.0, at: Instant(77), safe: SafeState::GatesOff };
    let motor = MotorCommand { voltage_v: 140.0, angle: Angle(5), rate: -7.5 };
    let command = DualCommand {
        motors: [motor, MotorCommand { voltage_v: 1.0, ..motor }],
        at: Instant(9),
        valid_from: Instant(10),
        duty: 0.2,
        scheme: Scheme::RthdSlide,
        gates: Gates::Pulse,
        release: 200,
    };
    assert_eq!(DualCommand::from_words(command.to_words()), command);
    let share = MotorShare { modulation_index: 0.4, angle: Angle(6) };
    for next in [None, Some([share, MotorShare { modulation_index: 0.3, ..share }])] {
        let applied = DualApplied { at: Instant(3), next, trip: Some(trip), released: 7 };
        assert_eq!(DualApplied::from_words(applied.to_words()), applied);
    }
    let report = DualReport {
        torque_nm: [1.0, 2.0],
        voltage_v: [3.0, 4.0],
        weakening: [true, false],
        duty: 0.25,
        inductor_ref_a: -4.0,
        scheme: Scheme::RthdSlide,
        trip: Some(trip),
        omega: [100.0, -200.0],
        current_a: [56.0, 20.0],
        capacitor_v: 533.0,
        source_v: 400.0,
        speed_known: true,
        acknowledged: 9,
        angle_zeros: [Angle(0x8000_0001), Angle(0x7FFF_FFFF)],
        calibrating: [false, true],
    };
    assert_eq!(DualReport::from_words(report.to_words()), report);
}

/// The injury of a test to both interrupts' samples.
type Spoiled = (Spoil, fn(&mut PowerSample));

/// One fault stops both motors. An acknowledge lets both go on if the cause is gone, and trips anew if it is there.
#[test]
fn a_fault_is_left_by_an_acknowledge_of_both_interrupts() {
    let cases: [Spoiled; 2] = [
        (|sample, _| sample.currents_a[1].a = 150.0, |_| {}),
        (|_, _| {}, |sample| sample.currents_a[0].b = 150.0),
    ];
    for (spoil, spoil_power) in cases {
        let mut drive = Drive::pulsing();
        (drive.fake.spoil, drive.fake.spoil_power) = (spoil, spoil_power);
        let trip = drive.trips(Fault::Overcurrent);
        assert_eq!(drive.fake.left, 0);
        // The cause is there again: the acknowledge is carried out, and a fault of its own is found.
        (drive.fake.spoil, drive.fake.spoil_power) = (spoil, spoil_power);
        drive.fake.acknowledge = 1;
        drive.run(10);
        let again = drive.fake.report.trip.expect("again");
        assert_eq!((again.fault, drive.fake.report.acknowledged), (Fault::Overcurrent, 1));
        assert!(again.at.since(trip.at) > 0 && drive.is_off());
        // Gone.
        drive.fake.spoil = |_, _| {};
        drive.fake.spoil_power = |_| {};
        drive.run(5);
        drive.fake.acknowledge = 2;
        drive.run(10);
        assert_eq!(
            (drive.fake.report.trip, drive.pwm.trip(), drive.fake.report.acknowledged),
            (None, None, 2)
        );
        assert_eq!(drive.fake.left, 2);
        assert!(!drive.is_off(), "pulses again");
    }
}

#[test]
fn gates_that_are_held_are_a_fault() {
    let mut drive = Drive::pulsing();
    drive.fake.spoil = |sample, _| sample.currents_a[1].a = 150.0;
    drive.trips(Fault::Overcurrent);
    (drive.fake.held, drive.fake.acknowledge) = (true, 1);
    drive.run(10);
    assert_eq!(drive.fake.report.trip.map(|trip| trip.fault), Some(Fault::GatesHeld));
    assert!(drive.is_off());
}

#[test]
fn a_break_in_hardware_has_its_name_and_where_it_was_seen() {
    let mut drive = Drive::pulsing();
    drive.fake.spoil = |sample, _| {
        sample.hardware = Some(HardwareBreak { fault: Fault::HardwareOvercurrent, seen: 0b1010 });
    };
    assert_eq!(drive.trips(Fault::HardwareOvercurrent).value, 10.0);
}

#[test]
fn the_flight_recorder_keeps_what_led_to_a_fault() {
    let recorder = DualRecorder::new();
    let shared = Shared::recorded_by(&recorder);
    let (mut fake, mut control) = (Fake::new(), control());
    let mut pwm = PwmTask::new(&BUILT_IN, SETTINGS);
    let mut faulty_at = None;
    for period in 0..700 {
        if period == 600 {
            fake.spoil = |sample, _| sample.currents_a[1].c = -150.0;
            faulty_at = Some(control.next_call());
            assert!(!recorder.is_frozen());
        }
        pwm.run(&mut fake, &shared);
        control.run(&mut fake, &shared);
    }
    let records: Vec<_> = (0..).map_while(|index| recorder.read(index)).collect();
    assert_eq!(records.len(), 256);
    let first = records.iter().position(|record| record.state.fault.is_some()).unwrap();
    assert_eq!((first, Some(records[first].at)), (256 - 32, faulty_at));
    let (before, faulty) = (&records[first - 1], &records[first]);
    assert_eq!((faulty.state.fault, faulty.currents_a[1].c), (Some(Fault::Overcurrent), -150.0));
    assert!(before.state.pulsing && before.duty > 0.0);
    assert!(!faulty.state.pulsing && faulty.duty == 0.0);
    assert_eq!(before.link_v(), 667.0);
    assert!(before.torque_nm.iter().all(|torque_nm| (torque_nm - 50.0).abs() < 1.0), "{before:?}");
}

thread_local! {
    static WANDERING: Cell<u64> = const { Cell::new(1) };
}

/// A number below so many, the next of a sequence.
fn wandered(below: u32) -> u32 {
    let next =
        WANDERING.get().wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
    WANDERING.set(next);
    ((next >> 33) % u64::from(below)) as u32
}

/// Between -1 and 1, in 2,001 steps.
fn wandered_share() -> f32 {
    wandered(2_001) as f32 / 1_000.0 - 1.0
}

/// Noise on whatever is sampled, and a command that is another one every hundred periods, thirteen periods after the first.
fn wander(sample: &mut DualSample, command: &mut DualDriveCommand) {
    thread_local! {
        static HELD: Cell<(u32, DualDriveCommand)> = const { Cell::new((0, DualDriveCommand::NONE)) };
    }
    for current in &mut sample.currents_a {
        let off = Dq { d: 3.0 * wandered_share(), q: 3.0 * wandered_share() };
        let off = off.unpark(Angle(wandered(u32::MAX)).sin_cos()).abc();
        (current.a, current.b, current.c) = (current.a + off.a, current.b + off.b, current.c + off.c);
    }
    sample.capacitor_v += 15.0 * wandered_share();
    sample.inductor_a += 5.0 * wandered_share();
    sample.source_v += 5.0 * wandered_share();
    let (periods, mut held) = HELD.get();
    if periods % 100 == 0 {
        held = *command;
        held.demands = [0, 1].map(|_| match wandered(2) {
            0 => MotorDemand::Torque(Demand { torque_nm: 80.0 * wandered_share(), slew_limited: true }),
            _ => MotorDemand::Speed(150.0 * wandered_share()),
        });
        held.scheme = Scheme::from_code(wandered(7));
        held.link_ref_v = 600.0 + 80.0 * wandered_share();
        held.speed_torque_nm = [0, 1].map(|_| 60.0 + 40.0 * wandered_share());
    }
    HELD.set((periods + 1, held));
    *command = held;
}

/// A change of any pulse or word of the report changes `tests/pinned/zs9.txt`: as in `tests/pinned.rs`.
#[test]
fn every_pulse_and_every_report_is_as_it_was() {
    let mut drive = Drive::pulsing();
    drive.fake.spoil = wander;
    let (mut out, mut sum) = (String::new(), file::BASIS);
    for period in 0..3_000 {
        drive.run(1);
        let words = drive.fake.report.to_words();
        sum = words.iter().fold(sum, |sum, word| file::hash(sum, &word.to_le_bytes()));
        for gate in &drive.fake.next.gates {
            let halves = [gate.off_from, gate.off_to].map(|step| step.to_le_bytes());
            sum = halves.iter().fold(sum, |sum, bytes| file::hash(sum, bytes));
        }
        if period % 100 == 99 {
            writeln!(out, "period {period}: {sum:016x}, trip {:?}", drive.fake.report.trip).unwrap();
        }
    }
    assert_eq!(drive.fake.report.trip, None, "{out}");
    file::holds("zs9", &out);
}
