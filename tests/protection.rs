//! Every fault, by name, with value and limit, and the gates in the safe state in the same interrupt.

use tractive::built_in::traction::BUILT_IN;
use tractive::control::{ControlLaw, Controller, Demand, Measurements, SpeedTracker};
use tractive::drive::traction::{ControlTask, PwmTask, Settings, Shared};
use tractive::frames::{Abc, AlphaBeta, Angle, Dq};
use tractive::modulation::{CarrierHalf, Mode, Schedule, SwitchLimits};
use tractive::ports::Report;
use tractive::ports::{ControlPort, DriveCommand, PwmPort, Sample};
use tractive::protection::{
    DiodeWatch, Fault, FrozenWatch, LegFaults, MaskedFaults, OpenGates, SafeState, Trip,
};
use tractive::time::{Clock, Instant};

const CLOCK: Clock = Clock::new(25_000_000, 2_500);

/// A machine that turns steadily and carries a steady current, with what a test does to its measurements.
struct Fake {
    omega: f32,
    current: Dq,
    udc_v: f32,
    spoil: fn(&mut Sample, &mut DriveCommand),
    spoil_from: u32,
    overrun: u32,
    control_entered: Option<(SafeState, u32)>,
    pwm_entered: Option<(SafeState, u32)>,
    played: CarrierHalf,
    report: Report,
    /// The sample that the PWM interrupt gets instead, and its time.
    pwm_currents: Option<(Abc, core::ops::Range<u32>)>,
    /// Instant from which nothing is spoilt any more.
    spoil_until: u32,
    /// The operator acknowledges from this instant on.
    acknowledge_from: u32,
    /// `true` if the board lets the gates go again.
    lets_go: bool,
    /// The entries into the safe state, and the exits, by either interrupt, with their times.
    safe_states: Vec<(Option<SafeState>, u32)>,
    /// Every change of the reported fault.
    faults: Vec<(Option<Fault>, u32)>,
    /// The last half with pulses.
    pulsed: u32,
    /// Instant from which halves are loaded too late, and that of the last one.
    late_from: u32,
    played_at: Instant,
}

impl Fake {
    fn turning(omega: f32) -> Self {
        Self {
            omega,
            current: Dq { d: -30.0, q: 40.0 },
            udc_v: 1500.0,
            spoil: |_, _| {},
            spoil_from: 0,
            overrun: 0,
            control_entered: None,
            pwm_entered: None,
            played: CarrierHalf::default(),
            report: Report::default(),
            pwm_currents: None,
            spoil_until: u32::MAX,
            acknowledge_from: u32::MAX,
            lets_go: true,
            safe_states: Vec::new(),
            faults: Vec::new(),
            pulsed: 0,
            late_from: u32::MAX,
            played_at: Instant(0),
        }
    }

    fn is_spoilt(&self, now: Instant) -> bool {
        (self.spoil_from..self.spoil_until).contains(&now.0)
    }

    fn angle(&self, now: Instant) -> Angle {
        let turns = f64::from(self.omega) * f64::from(now.0) / 25e6 / std::f64::consts::TAU;
        Angle((turns.rem_euclid(1.0) * 4_294_967_296.0) as u64 as u32)
    }

    fn commanded(&self, now: Instant) -> DriveCommand {
        let demand = Demand { torque_nm: 200.0, slew_limited: false };
        let acknowledge = u8::from(now.0 >= self.acknowledge_from);
        DriveCommand { enable: true, demand, acknowledge, ..DriveCommand::NONE }
    }

    /// No current flows before there are pulses.
    fn currents(&self, now: Instant) -> Abc {
        if self.played.mode == Mode::Off {
            return Abc::default();
        }
        // A little ripple, as every inverter makes.
        let ripple = (now.0 % 7919) as f32 * 1e-4;
        (self.current + Dq { d: ripple, q: -ripple }).unpark(self.angle(now).sin_cos()).abc()
    }
}

impl ControlPort for Fake {
    fn sample(&mut self, now: Instant) -> Sample {
        let mut sample = Sample {
            currents_a: self.currents(now),
            udc_v: self.udc_v,
            angle: Some(self.angle(now)),
            may_pulse: true,
            hardware: None,
        };
        if self.is_spoilt(now) {
            (self.spoil)(&mut sample, &mut self.commanded(now));
        }
        sample
    }

    fn command(&mut self, now: Instant, _operator: impl FnOnce() -> DriveCommand) -> DriveCommand {
        let mut command = self.commanded(now);
        if self.is_spoilt(now) {
            (self.spoil)(&mut ControlPort::sample(&mut Self::turning(self.omega), now), &mut command);
        }
        command
    }

    fn enter(&mut self, safe: SafeState, now: Instant) {
        self.control_entered = Some((safe, now.0));
        self.safe_states.push((Some(safe), now.0));
    }

    fn overrun_ticks(&mut self, now: Instant, _deadline_ticks: u32) -> u32 {
        if now.0 >= self.spoil_from { self.overrun } else { 0 }
    }

    fn report(&mut self, now: Instant, report: impl FnOnce() -> Report) {
        let report = report();
        let fault = report.trip.map(|trip| trip.fault);
        if fault != self.report.trip.map(|trip| trip.fault) {
            self.faults.push((fault, now.0));
        }
        self.report = report;
    }
}

impl PwmPort for Fake {
    fn sample(&mut self, now: Instant) -> Abc {
        match &self.pwm_currents {
            Some((currents, when)) if when.contains(&now.0) => *currents,
            _ => self.currents(now),
        }
    }

    fn play(&mut self, now: Instant, next: &CarrierHalf) {
        self.played = *next;
        self.played_at = now;
        if next.mode != Mode::Off {
            self.pulsed = now.0;
        }
    }

    fn is_late(&mut self) -> bool {
        self.late_from <= self.played_at.0
    }

    fn leave(&mut self, now: Instant) -> bool {
        self.safe_states.push((None, now.0));
        self.lets_go
    }

    fn enter(&mut self, safe: SafeState, now: Instant) {
        self.pwm_entered = Some((safe, now.0));
        self.safe_states.push((Some(safe), now.0));
    }
}

/// Both interrupts in their order until `end`; control is lost from `control_until` on.
fn drive(fake: &mut Fake, end: u32, control_until: u32) -> Option<Trip> {
    let devices = SwitchLimits::new(250, 0, 900.0, &CLOCK);
    let settings = Settings::new(CLOCK, devices);
    // The currents of a fake do not follow its voltage.
    let unexplained = MaskedFaults::of(Fault::VoltageUnexplained);
    let mut control = ControlTask::new(&BUILT_IN, settings, Instant(2_500)).without(unexplained);
    driven(fake, &mut control, end, control_until)
}

/// The same with a given control task.
fn driven(fake: &mut Fake, control: &mut ControlTask, end: u32, control_until: u32) -> Option<Trip> {
    let devices = SwitchLimits::new(250, 0, 900.0, &CLOCK);
    let shared = Shared::new();
    let mut pwm =
        PwmTask::new(&BUILT_IN, Settings::new(CLOCK, devices), Instant(devices.shortest_half_ticks));
    loop {
        let (control_at, pwm_at) = (control.next_call(), pwm.next_call());
        let control_lives = control_at.0 < control_until;
        if control_lives && !control_at.reached(pwm_at) {
            if control_at.0 > end {
                break;
            }
            control.run(fake, &shared);
        } else {
            if pwm_at.0 > end {
                break;
            }
            pwm.run(fake, &shared);
        }
    }
    control.trip().or(pwm.trip())
}

const SETTLED: u32 = 2_000_000;
const END: u32 = 3_000_000;

fn healthy(omega: f32) {
    let mut fake = Fake::turning(omega);
    assert_eq!(drive(&mut fake, END, u32::MAX), None);
    assert_ne!(fake.played.mode, Mode::Off, "pulses are made");
}

#[test]
fn a_healthy_drive_does_not_trip() {
    for omega in [0.0, 84.0, -84.0, 400.0, 800.0, -800.0, 2500.0] {
        healthy(omega);
    }
}

/// Spoils the measurements of a healthy drive; the control interrupt must find it.
fn found_by_control(fault: Fault, periods: u32, spoil: fn(&mut Sample, &mut DriveCommand)) -> Trip {
    found_at(400.0, fault, periods, spoil)
}

fn found_at(omega: f32, fault: Fault, periods: u32, spoil: fn(&mut Sample, &mut DriveCommand)) -> Trip {
    let mut fake = Fake { spoil, spoil_from: SETTLED, ..Fake::turning(omega) };
    let trip = drive(&mut fake, END, u32::MAX).unwrap_or_else(|| panic!("{fault:?} was not found"));
    assert_eq!(trip.fault, fault);
    assert!(trip.at.0 >= SETTLED && trip.at.0 < SETTLED + periods * 2_500 + 2_500, "{trip:?}");
    assert_eq!(fake.control_entered, Some((trip.safe, trip.at.0)), "gates in the same interrupt");
    assert_eq!(fake.played.mode, Mode::Off, "and no pulses any more");
    assert_eq!(fake.report.trip.map(|trip| (trip.fault, trip.at)), Some((trip.fault, trip.at)), "latched");
    trip
}

#[test]
fn overcurrent_is_found_in_one_period() {
    let trip = found_by_control(Fault::Overcurrent, 1, |sample, _| {
        sample.currents_a = Abc { a: 320.0, b: -160.0, c: -160.0 };
    });
    assert_eq!((trip.value, trip.limit), (320.0, BUILT_IN.ratings.trip_current_a));
    assert_eq!(trip.safe, SafeState::GatesOff);
}

#[test]
fn the_link_is_watched() {
    let over = found_by_control(Fault::DcOvervoltage, 1, |sample, _| sample.udc_v = 2200.0);
    assert_eq!((over.value, over.limit), (2200.0, BUILT_IN.ratings.trip_dc_over_v));
    found_by_control(Fault::DcUndervoltage, 1, |sample, _| sample.udc_v = 700.0);
}

#[test]
fn what_is_not_finite_is_a_fault() {
    found_by_control(Fault::NotFinite, 1, |sample, _| sample.udc_v = f32::NAN);
    found_by_control(Fault::NotFinite, 1, |sample, _| sample.udc_v = f32::INFINITY);
    found_by_control(Fault::NotFinite, 1, |sample, _| sample.currents_a.b = f32::NAN);
    found_by_control(Fault::NotFinite, 1, |sample, _| sample.currents_a.c = f32::NEG_INFINITY);
    found_by_control(Fault::NotFinite, 1, |_, command| command.demand.torque_nm = f32::NAN);
}

#[test]
fn phases_must_add_up() {
    found_by_control(Fault::PhaseSum, 1, |sample, _| sample.currents_a.a += 30.0);
}

#[test]
fn frozen_measurements_are_found() {
    found_by_control(Fault::Frozen, 21, |sample, _| {
        sample.currents_a = Abc { a: 50.0, b: -20.0, c: -30.0 };
    });
    // Too slow for an innovation.
    found_at(20.0, Fault::Frozen, 140, |sample, _| {
        sample.angle = Some(Fake::turning(20.0).angle(Instant(SETTLED)));
    });
    found_by_control(Fault::AngleLost, 2, |sample, _| {
        sample.angle = Some(Fake::turning(400.0).angle(Instant(SETTLED)));
    });
}

#[test]
fn currents_may_repeat_until_something_should_move_them() {
    let ratings = &BUILT_IN.ratings;
    let period_s = CLOCK.control_s();
    let mut watch = FrozenWatch::new();
    let mut angle = Angle(0);
    let mut repeat = |omega: f32, voltage_v: f32| {
        watch.command(AlphaBeta { alpha: voltage_v, beta: 0.0 });
        angle = angle + Angle::from_radians(omega * period_s);
        let currents_a = Abc { a: 20.0, b: -10.0, c: -10.0 };
        watch.check(&Measurements { currents_a, udc_v: 1500.0, angle }, omega, period_s, ratings)
    };
    // A rotor that stands under a voltage that stays, and one that trembles by a volt.
    for k in 0..100_000_u32 {
        assert_eq!(repeat(0.0, 5.0 + (k % 2) as f32), None, "period {k}");
    }
    let periods = (1..).find(|_| repeat(0.0, 30.0).is_some()).unwrap();
    assert!((20..200).contains(&periods), "25 V more and the same current: {periods} periods");
    let mut watch = FrozenWatch::new();
    let turning = |k: u32| {
        let (omega, currents_a) = (84.0, Abc { a: 20.0, b: -10.0, c: -10.0 });
        let angle = Angle::from_radians(omega * period_s * k as f32);
        let measured = Measurements { currents_a, udc_v: 1500.0, angle };
        watch.check(&measured, omega, period_s, ratings).is_some()
    };
    let periods = (0..).map(turning).position(|found| found).unwrap();
    assert!((20..40).contains(&periods), "200 r/min: {periods} periods");
}

#[test]
fn currents_that_freeze_at_rest_are_found() {
    found_at(0.0, Fault::Frozen, 300, |sample, _| {
        sample.currents_a = Abc { a: 50.0, b: -20.0, c: -30.0 };
    });
}

#[test]
fn an_angle_that_cannot_be_is_found_at_once() {
    let trip = found_by_control(Fault::AngleLost, 1, |sample, _| {
        sample.angle = sample.angle.map(|angle| angle + Angle::from_radians(0.06));
    });
    assert!((trip.value - 0.06).abs() < 1e-3, "{trip:?}");
}

#[test]
fn a_late_control_interrupt_is_found() {
    let mut fake = Fake { overrun: 40, spoil_from: SETTLED, ..Fake::turning(400.0) };
    let trip = drive(&mut fake, END, u32::MAX).unwrap();
    assert_eq!(trip.fault, Fault::ControlDeadline);
    assert!((trip.value - 1.6e-6).abs() < 1e-9, "{trip:?}");
    assert_eq!(fake.control_entered, Some((trip.safe, trip.at.0)));
}

#[test]
fn a_lost_control_interrupt_is_found_by_the_other_one() {
    let mut fake = Fake::turning(400.0);
    let trip = drive(&mut fake, END, SETTLED).unwrap();
    assert_eq!(trip.fault, Fault::StaleCommand);
    assert_eq!(fake.pwm_entered, Some((trip.safe, trip.at.0)), "gates in the same interrupt");
    assert!(trip.value > trip.limit && (1.06e-4..1.07e-4).contains(&trip.limit), "{trip:?}");
    assert!(trip.at.0 < SETTLED + 12_500 + 14_000, "{trip:?}");
    assert_eq!(fake.played.mode, Mode::Off);
}

#[test]
fn the_pwm_interrupt_finds_overcurrent_too() {
    let spoilt = Abc { a: -320.0, b: 160.0, c: 160.0 };
    let mut fake = Fake { pwm_currents: Some((spoilt, SETTLED..u32::MAX)), ..Fake::turning(400.0) };
    let trip = drive(&mut fake, END, u32::MAX).unwrap();
    assert_eq!((trip.fault, trip.value), (Fault::Overcurrent, 320.0));
    assert_eq!(fake.pwm_entered, Some((trip.safe, trip.at.0)));
    assert_eq!(fake.report.trip, Some(trip), "control knows");
}

#[test]
fn overspeed_is_found_and_short_circuits() {
    let fast = BUILT_IN.ratings.trip_speed_rad_s * BUILT_IN.ratings.pole_pairs * 1.01;
    for omega in [fast, -fast] {
        let mut fake = Fake::turning(omega);
        let trip = drive(&mut fake, END, u32::MAX).unwrap();
        assert_eq!((trip.fault, trip.safe), (Fault::Overspeed, SafeState::ShortCircuit), "{omega}");
    }
}

#[test]
fn the_safe_state_follows_the_emf() {
    // 0.9 · 1500 V / (√3 · 0.448 Wb) = 1,738 rad/s electrical.
    for (omega, safe) in [
        (1700.0, SafeState::GatesOff),
        (-1700.0, SafeState::GatesOff),
        (1780.0, SafeState::ShortCircuit),
        (-1780.0, SafeState::ShortCircuit),
    ] {
        assert_eq!(tractive::protection::safe_state(omega, 1500.0, &BUILT_IN.ratings), safe, "{omega}");
    }
    // On a lower link the diodes rectify earlier.
    assert_eq!(tractive::protection::safe_state(1300.0, 1000.0, &BUILT_IN.ratings), SafeState::ShortCircuit);
}

/// Turns until the watch asks for another state, with gates off and `current` through phases u and w, at this share of the rule's speed.
fn watched(current: f32, share: f32, legs: LegFaults) -> Option<(SafeState, f32)> {
    let ratings = &BUILT_IN.ratings;
    let omega = share * 1_500.0 / (3.0_f32.sqrt() * ratings.magnet_flux_wb);
    let currents_a = Abc { a: current, b: f32::NAN, c: -current };
    let open = OpenGates { currents_a, udc_v: 1_500.0, omega, period_s: 1e-4 };
    let mut watch = DiodeWatch::new();
    let mut step = |periods: u32| {
        let safe = watch.step(SafeState::GatesOff, &open, &legs, ratings)?;
        Some((safe, periods as f32 * 1e-4 * omega.abs() / std::f32::consts::TAU))
    };
    (1..1_000).find_map(&mut step)
}

#[test]
fn gates_off_become_a_short_circuit_where_current_stays() {
    let sound = LegFaults::default();
    for share in [0.55, -0.55, 0.85, -0.85, 1.2] {
        let (safe, turns) = watched(100.0, share, sound).unwrap();
        assert_eq!(safe, SafeState::ShortCircuit, "{share}");
        assert!((1.0..1.05).contains(&turns), "{share}: {turns} turns");
    }
    let high = LegFaults { high: 1, ..sound };
    assert_eq!(watched(100.0, 0.85, high).unwrap().0, SafeState::UpperShortCircuit);
    let blocked = LegFaults { blocked: 0b11, ..sound };
    // No current; so slow that a short circuit could brake; a leg that cannot take part; no number.
    for (current, share, legs) in
        [(5.0, 0.85, sound), (300.0, 0.45, sound), (100.0, 0.85, blocked), (f32::NAN, 0.85, sound)]
    {
        assert_eq!(watched(current, share, legs), None, "{current} A, {share}");
    }
}

/// A leg with one blocked driver conducts by its other device: that device's rail is safe at every speed. Bits uh ul vh vl wh wl.
#[test]
fn a_short_circuit_of_devices_decides_the_rail() {
    const UPPER: SafeState = SafeState::UpperShortCircuit;
    const LOWER: SafeState = SafeState::ShortCircuit;
    const OFF: SafeState = SafeState::GatesOff;
    // Slow; so fast that the diodes rectify; so fast that the link does not withstand it.
    let omegas = [500.0, 1_900.0, 2_900.0];
    for (blocked, low, high, safe) in [
        (0, 0, 0, [OFF, LOWER, LOWER]),
        (0b00_0001, 0, 0, [LOWER; 3]),
        (0b00_0100, 0, 0, [LOWER; 3]),
        (0b00_0010, 0, 0, [UPPER; 3]),
        (0b10_0000, 0, 0, [UPPER; 3]),
        (0b00_0011, 0, 0, [OFF, OFF, LOWER]),
        (0, 0, 0b100, [OFF, UPPER, UPPER]),
        (0, 0b001, 0, [OFF, LOWER, LOWER]),
    ] {
        let legs = LegFaults { blocked, low, high };
        let found = omegas.map(|omega| legs.safe_state(omega, 1500.0, &BUILT_IN.ratings));
        assert_eq!(found, safe, "{legs:?}");
    }
}

/// The time at which a passing cause is over.
const HEALED: u32 = SETTLED + 250_000;
/// Both sides agree within a control period and the two halves after it.
const AGREED: u32 = 2_500 + 2 * 20_000;

/// A drive whose measurements are spoilt from `SETTLED` to `HEALED`.
fn passing(spoil: fn(&mut Sample, &mut DriveCommand), acknowledge_from: u32) -> Fake {
    Fake { spoil, spoil_from: SETTLED, spoil_until: HEALED, acknowledge_from, ..Fake::turning(400.0) }
}

fn overvoltage(sample: &mut Sample, _: &mut DriveCommand) {
    sample.udc_v = 2200.0;
}

#[test]
fn without_an_acknowledge_a_fault_stays() {
    let mut fake = passing(overvoltage, u32::MAX);
    let trip = drive(&mut fake, END, u32::MAX);
    assert_eq!(trip.map(|trip| trip.fault), Some(Fault::DcOvervoltage));
    assert_eq!(fake.safe_states.len(), 1, "entered once, never left");
    assert!(fake.pulsed < SETTLED + 20_000);
}

#[test]
fn an_acknowledged_fault_is_forgotten_by_both_sides_and_pulses_are_made_again() {
    let acknowledged = HEALED + 100_000;
    for fake in [
        passing(overvoltage, acknowledged),
        Fake {
            pwm_currents: Some((Abc { a: -320.0, b: 160.0, c: 160.0 }, SETTLED..HEALED)),
            ..passing(|_, _| {}, acknowledged)
        },
    ] {
        let mut fake = fake;
        assert_eq!(drive(&mut fake, END, u32::MAX), None);
        let [(entered, from), (None, until)] = fake.safe_states[..] else { panic!("{:?}", fake.safe_states) };
        assert_eq!(entered, Some(SafeState::GatesOff));
        assert!(from < SETTLED + 20_000 && (acknowledged..acknowledged + AGREED).contains(&until));
        let [(Some(_), _), (None, forgotten)] = fake.faults[..] else { panic!("{:?}", fake.faults) };
        assert!(
            (until..acknowledged + AGREED).contains(&forgotten),
            "control forgets after the PWM interrupt"
        );
        assert!(fake.pulsed > END - 40_000, "the machine is caught");
        assert_eq!(fake.report.acknowledged, 1);
    }
}

#[test]
fn a_fault_whose_cause_is_still_there_is_reported_again() {
    let acknowledged = SETTLED + 100_000;
    let mut fake = passing(overvoltage, acknowledged);
    let trip = drive(&mut fake, END, u32::MAX).unwrap();
    assert_eq!(trip.fault, Fault::DcOvervoltage);
    assert!(trip.at.0 > acknowledged, "a new one: {trip:?}");
    let states: Vec<_> = fake.safe_states.iter().map(|(state, _)| state.is_some()).collect();
    assert_eq!(states, [true, false, true], "left and entered again: {:?}", fake.safe_states);
    assert!(fake.pulsed < SETTLED + 20_000, "and no pulse in between");
}

#[test]
fn an_acknowledge_counts_once() {
    // It comes first, the fault later.
    let mut fake = passing(overvoltage, SETTLED - 500_000);
    let trip = drive(&mut fake, END, u32::MAX);
    assert_eq!(trip.map(|trip| trip.fault), Some(Fault::DcOvervoltage));
    assert_eq!(fake.safe_states.len(), 1);
}

#[test]
fn a_board_that_holds_the_gates_is_a_fault_of_its_own() {
    let mut fake = Fake { lets_go: false, ..passing(overvoltage, HEALED + 100_000) };
    let trip = drive(&mut fake, END, u32::MAX).unwrap();
    assert_eq!(trip.fault, Fault::GatesHeld);
    assert!(fake.pulsed < SETTLED + 20_000);
}

#[test]
fn what_holds_the_gates_in_hardware_has_its_name() {
    for fault in [Fault::GateDriver, Fault::HardwareOvercurrent, Fault::ClockFailure, Fault::PwmDeadline] {
        let spoil: fn(&mut Sample, &mut DriveCommand) = match fault {
            Fault::GateDriver => |sample, _| sample.hardware = Some(Fault::GateDriver),
            Fault::HardwareOvercurrent => |sample, _| sample.hardware = Some(Fault::HardwareOvercurrent),
            Fault::ClockFailure => |sample, _| sample.hardware = Some(Fault::ClockFailure),
            _ => |sample, _| sample.hardware = Some(Fault::PwmDeadline),
        };
        found_by_control(fault, 1, spoil);
    }
}

#[test]
fn an_empty_link_is_a_fault_only_where_the_gates_may_be_on() {
    let mut fake = Fake {
        spoil: |sample, command| {
            sample.udc_v = 3.0;
            command.enable = false;
        },
        ..Fake::turning(0.0)
    };
    assert_eq!(drive(&mut fake, END, u32::MAX), None);
}

#[test]
fn every_fault_has_a_code_and_a_name_of_its_own() {
    let names: std::collections::BTreeSet<_> = Fault::ALL.iter().map(|fault| fault.name()).collect();
    assert_eq!(names.len(), Fault::ALL.len());
    for fault in Fault::ALL {
        assert_eq!(Fault::from_code(fault as u32), Some(fault));
    }
    assert_eq!(Fault::from_code(0), None);
    assert_eq!(Fault::from_code(Fault::ALL.len() as u32 + 1), None);
}

#[test]
fn a_half_that_is_loaded_too_late_is_a_fault_and_control_knows() {
    let mut fake = Fake { late_from: SETTLED, ..Fake::turning(400.0) };
    let trip = drive(&mut fake, END, u32::MAX).unwrap();
    assert_eq!(trip.fault, Fault::PwmDeadline);
    assert!((SETTLED..SETTLED + 20_000).contains(&trip.at.0));
    assert_eq!(fake.report.trip, Some(trip));
    assert_eq!(fake.played.mode, Mode::Off);
}

#[test]
fn a_cause_in_hardware_names_the_fault_where_the_gates_are_held() {
    let mut fake = Fake {
        lets_go: false,
        spoil: |sample, _| sample.hardware = Some(Fault::GateDriver),
        spoil_from: SETTLED,
        acknowledge_from: SETTLED + 100_000,
        ..Fake::turning(400.0)
    };
    let trip = drive(&mut fake, END, u32::MAX).unwrap();
    assert_eq!(trip.fault, Fault::GateDriver);
    assert!(trip.at.0 >= SETTLED + 100_000, "the one after the acknowledge");
}

/// Long enough for a speed to be followed until it is used, and for pulses to follow.
const FOLLOWED: u32 = 600_000;

#[test]
fn an_angle_that_has_jumped_is_lost_once_and_followed_anew_after_an_acknowledge() {
    let jumped: fn(&mut Sample, &mut DriveCommand) =
        |sample, _| sample.angle = sample.angle.map(|angle| angle + Angle::from_radians(1.571));
    let forever = |acknowledge_from| Fake { spoil_until: u32::MAX, ..passing(jumped, acknowledge_from) };
    let trip = drive(&mut forever(u32::MAX), END, u32::MAX);
    assert_eq!(trip.map(|trip| trip.fault), Some(Fault::AngleLost));
    let acknowledged = SETTLED + 100_000;
    let mut fake = forever(acknowledged);
    assert_eq!(drive(&mut fake, acknowledged + FOLLOWED, u32::MAX), None);
    assert_eq!(
        fake.faults.iter().map(|(fault, _)| *fault).collect::<Vec<_>>(),
        [Some(Fault::AngleLost), None]
    );
    assert!(fake.pulsed > acknowledged + FOLLOWED - 40_000, "the machine is caught");
}

#[test]
fn a_lost_angle_is_followed_anew_before_the_acknowledge_and_chooses_no_safe_state() {
    let told_omega = |fake: &Fake| fake.report.omega;
    // From a speed that asks for the short circuit to half of it, by a jump.
    let lost = |pwm_from| Fake {
        spoil: |sample, _| sample.angle = sample.angle.map(|angle| angle + angle),
        spoil_from: 0,
        spoil_until: SETTLED,
        pwm_currents: Some((Abc { a: 320.0, b: -160.0, c: -160.0 }, pwm_from..u32::MAX)),
        ..Fake::turning(1_050.0)
    };
    for told_after in [2_500, FOLLOWED] {
        let mut fake = lost(u32::MAX);
        let trip = drive(&mut fake, SETTLED + told_after, u32::MAX).unwrap();
        assert_eq!((trip.fault, trip.safe), (Fault::AngleLost, SafeState::ShortCircuit));
        assert_eq!(fake.report.speed_known, told_after == FOLLOWED);
        // What the PWM interrupt finds meanwhile does not open the gates of a machine that may still be fast.
        let mut fake = lost(SETTLED + told_after);
        drive(&mut fake, SETTLED + told_after + 100_000, u32::MAX);
        assert_eq!(fake.pwm_entered.map(|(safe, _)| safe), Some(SafeState::ShortCircuit));
    }
    let mut fake = lost(u32::MAX);
    drive(&mut fake, SETTLED + FOLLOWED, u32::MAX);
    assert!((told_omega(&fake) - 1_050.0).abs() < 1.0, "{}", told_omega(&fake));
}

#[test]
fn an_angle_that_is_not_known_yet_is_no_fault_until_pulses_are_wanted() {
    let unknown: fn(&mut Sample, &mut DriveCommand) =
        |sample, command| (sample.angle, command.enable) = (None, false);
    let mut fake = Fake { spoil: unknown, spoil_from: 0, spoil_until: SETTLED, ..Fake::turning(400.0) };
    assert_eq!(drive(&mut fake, SETTLED - 1, u32::MAX), None);
    assert!(!fake.report.speed_known && fake.pulsed == 0);
    let mut fake = Fake { spoil_from: 0, ..fake };
    assert_eq!(drive(&mut fake, SETTLED + FOLLOWED, u32::MAX), None, "it is followed from where it is");
    assert!(fake.report.speed_known && fake.pulsed > SETTLED + FOLLOWED - 40_000);
    // Wanted, or known before.
    for (from, spoil) in [
        (
            0,
            (|sample: &mut Sample, _: &mut DriveCommand| sample.angle = None)
                as fn(&mut Sample, &mut DriveCommand),
        ),
        (SETTLED, unknown),
    ] {
        let mut fake = Fake { spoil, spoil_from: from, ..Fake::turning(400.0) };
        let trip = drive(&mut fake, END, u32::MAX);
        assert_eq!(trip.map(|trip| trip.fault), Some(Fault::PositionSensor));
        assert!(fake.pulsed < from + 20_000, "and no pulse");
    }
}

/// Before its first call a task takes another schedule, other settings and another law.
#[test]
fn a_task_goes_by_what_it_was_set_up_with() {
    let settings = Settings::new(CLOCK, SwitchLimits::new(250, 0, 900.0, &CLOCK));
    for mode in [Mode::Async, Mode::Sync15] {
        let mut control = ControlTask::new(&BUILT_IN, settings, Instant(2_500));
        control.set_schedule(Schedule::fixed(mode, &CLOCK));
        let mut fake = Fake::turning(200.0);
        assert_eq!(driven(&mut fake, &mut control, SETTLED, u32::MAX), None);
        assert_eq!(fake.played.mode, mode);
    }
    let mut control = ControlTask::new(&BUILT_IN, settings, Instant(2_500));
    control.set_up(settings, Instant(5_000));
    assert_eq!(control.next_call(), Instant(5_000));
    let mut law = Controller::new();
    *law.tracker_mut() = SpeedTracker::with_natural(123.0);
    control.set_law(law);
    assert_eq!(control.law_mut().tracker().natural_rad_s(), 123.0);
}
