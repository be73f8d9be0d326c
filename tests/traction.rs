//! The traction drive with one thing out of the ordinary: a motor that turns steadily, and a setting, a sample or a command that other drives do not have.

use std::f32::consts::TAU;
use tractive::built_in::traction::BUILT_IN;
use tractive::control::{Demand, Gains, Warmth};
use tractive::drive::traction::{ControlTask, PwmTask, Settings, Shared};
use tractive::frames::{Abc, Angle, Dq, six_step_v};
use tractive::modulation::{CarrierHalf, Mode, SwitchLimits, index_limit};
use tractive::ports::{ControlPort, DriveCommand, PwmPort, Report, Sample};
use tractive::protection::{Fault, MaskedFaults, SafeState, Trip};
use tractive::recorder::{Record, Recorder};
use tractive::start_up::PULSE_SHARE;
use tractive::time::{Clock, Instant};

const CLOCK: Clock = Clock::new(25_000_000, 2_500);
const SETTLED: u32 = 2_000_000;
/// Current that goes on to flow through the diodes in the tests that ask for one.
const DIODES_A: Abc = Abc { a: 100.0, b: -50.0, c: -50.0 };

fn settings(max_hz: f32) -> Settings {
    Settings::new(CLOCK, SwitchLimits::new(250, 0, max_hz, &CLOCK))
}

/// A motor that turns steadily and carries a steady current, and what a test does to a sample and its command.
struct Motor<'a> {
    omega: f32,
    spoil: &'a dyn Fn(u32, &mut Sample, &mut DriveCommand),
    /// Current while the gates are off, from [`SETTLED`] on.
    open_a: Abc,
    /// An instant, and by how many ticks control ends too late there.
    late: Option<(u32, u32)>,
    command: DriveCommand,
    /// `true` if the sensor only counts, of a rotor that stands.
    counts: bool,
    /// `true` if an operator is asked, whose command is then this motor's all the same.
    operated: bool,
    played: CarrierHalf,
    entered: Vec<(SafeState, u32)>,
    report: Report,
    largest_v: f32,
}

impl<'a> Motor<'a> {
    fn new(omega: f32, spoil: &'a dyn Fn(u32, &mut Sample, &mut DriveCommand)) -> Self {
        Self {
            omega,
            spoil,
            open_a: Abc::default(),
            late: None,
            command: DriveCommand::NONE,
            counts: false,
            operated: false,
            played: CarrierHalf::default(),
            entered: Vec::new(),
            report: Report::default(),
            largest_v: 0.0,
        }
    }

    fn angle(&self, now: Instant) -> Angle {
        let turns = f64::from(self.omega) * f64::from(now.0) / 25e6 / f64::from(TAU);
        Angle((turns.rem_euclid(1.0) * 4_294_967_296.0) as u64 as u32)
    }

    fn currents(&self, now: Instant) -> Abc {
        match self.played.mode {
            Mode::Off if now.0 < SETTLED => Abc::default(),
            Mode::Off => self.open_a,
            _ => {
                let ripple = (now.0 % 7_919) as f32 * 1e-4;
                (Dq { d: ripple - 30.0, q: 40.0 - ripple }).unpark(self.angle(now).sin_cos()).abc()
            }
        }
    }

    /// Runs both interrupts in their order until an instant; from another one on, control no longer comes. Returns the trip.
    fn drive(&mut self, settings: Settings, shared: &Shared, end: u32, lost: u32) -> Option<Trip> {
        let first = Instant(settings.devices.shortest_half_ticks);
        let mut pwm = PwmTask::new(&BUILT_IN, settings, first);
        // The currents of this motor do not follow its voltage.
        let unexplained = MaskedFaults::of(Fault::VoltageUnexplained);
        let mut control = ControlTask::new(&BUILT_IN, settings, Instant(2_500)).without(unexplained);
        loop {
            let (control_at, pwm_at) = (control.next_call(), pwm.next_call());
            let is_control = control_at.0 < lost && !control_at.reached(pwm_at);
            if (if is_control { control_at } else { pwm_at }).0 >= end {
                return control.trip().or(pwm.trip());
            }
            if is_control {
                control.run(self, shared);
            } else {
                pwm.run(self, shared);
            }
        }
    }

    /// The same with control for ever.
    fn runs(&mut self, settings: Settings, end: u32) -> Option<Trip> {
        self.drive(settings, &Shared::new(), end, u32::MAX)
    }
}

impl ControlPort for Motor<'_> {
    fn sample(&mut self, now: Instant) -> Sample {
        let (currents_a, angle) = (self.currents(now), Some(self.angle(now)));
        let mut sample = Sample { currents_a, udc_v: 1_500.0, angle, may_pulse: true, hardware: None };
        let demand = Demand { torque_nm: 200.0, slew_limited: true };
        self.command = DriveCommand { enable: true, demand, ..DriveCommand::NONE };
        (self.spoil)(now.0, &mut sample, &mut self.command);
        self.counts = sample.angle.is_none();
        sample
    }

    fn command(&mut self, _now: Instant, operator: impl FnOnce() -> DriveCommand) -> DriveCommand {
        if self.operated {
            operator();
        }
        self.command
    }

    fn enter(&mut self, safe: SafeState, now: Instant) {
        self.entered.push((safe, now.0));
    }

    fn overrun_ticks(&mut self, now: Instant, _deadline_ticks: u32) -> u32 {
        self.late.filter(|(at, _)| now.0 == *at).map_or(0, |(_, ticks)| ticks)
    }

    fn report(&mut self, _now: Instant, report: impl FnOnce() -> Report) {
        self.report = report();
        self.largest_v = self.largest_v.max(self.report.voltage_v);
    }

    fn turned(&mut self) -> Option<Angle> {
        self.counts.then_some(Angle::ZERO)
    }
}

impl PwmPort for Motor<'_> {
    fn sample(&mut self, now: Instant) -> Abc {
        self.currents(now)
    }

    fn play(&mut self, _now: Instant, next: &CarrierHalf) {
        self.played = *next;
    }

    fn enter(&mut self, safe: SafeState, now: Instant) {
        self.entered.push((safe, now.0));
    }
}

/// Electrical speed between half of the one from which diodes rectify and the one from which they would be shorted at once.
const HOLDING: f32 = 1_200.0;

/// Gates off first, and the short circuit once the rotor has turned around, which the trip says from then on.
fn is_shorted_after_a_turn(motor: &Motor, trip: Option<Trip>, fault: Fault, period_ticks: u32) {
    let trip = trip.expect("a fault");
    let [(SafeState::GatesOff, off), (SafeState::ShortCircuit, short)] = motor.entered[..] else {
        panic!("{:?}", motor.entered)
    };
    assert_eq!((trip.fault, trip.safe, trip.at.0), (fault, SafeState::ShortCircuit, off));
    let turn = (TAU / HOLDING * 25e6) as u32;
    assert!((short - off).abs_diff(turn) < period_ticks, "after {} ticks, not {turn}", short - off);
}

#[test]
fn a_current_that_stays_after_a_trip_of_control_is_shorted() {
    let over = |at: u32, sample: &mut Sample, _: &mut DriveCommand| {
        if at >= SETTLED {
            sample.udc_v = 2_200.0;
        }
    };
    let mut motor = Motor { open_a: DIODES_A, ..Motor::new(HOLDING, &over) };
    let trip = motor.runs(settings(900.0), SETTLED + 400_000);
    is_shorted_after_a_turn(&motor, trip, Fault::DcOvervoltage, 2_500);
}

#[test]
fn a_current_that_stays_where_control_is_lost_is_shorted_by_the_other_interrupt() {
    let mut motor = Motor { open_a: DIODES_A, ..Motor::new(HOLDING, &|_, _, _| {}) };
    let trip = motor.drive(settings(900.0), &Shared::new(), SETTLED + 600_000, SETTLED);
    is_shorted_after_a_turn(&motor, trip, Fault::StaleCommand, 13_889);
}

#[test]
fn without_pulses_nobody_misses_control() {
    let off = |_: u32, _: &mut Sample, command: &mut DriveCommand| command.enable = false;
    let mut motor = Motor::new(HOLDING, &off);
    assert_eq!(motor.drive(settings(900.0), &Shared::new(), SETTLED + 400_000, SETTLED), None);
    assert!(motor.entered.is_empty());
}

/// Control's own angle moves on with the speed where the sensor's stands.
#[test]
fn an_angle_that_stands_is_found_as_the_sensor_shows_it() {
    let stuck = Motor::new(20.0, &|_, _, _| {}).angle(Instant(SETTLED));
    let freeze = |at: u32, sample: &mut Sample, _: &mut DriveCommand| {
        if at >= SETTLED {
            sample.angle = Some(stuck);
        }
    };
    let late = Settings { angle_late_s: 60e-6, ..settings(900.0) };
    let trip = Motor::new(20.0, &freeze).runs(late, SETTLED + 140 * 2_500);
    assert_eq!(trip.map(|trip| trip.fault), Some(Fault::Frozen));
}

fn recorded(motor: &mut Motor) -> Vec<Record> {
    let recorder = Recorder::new();
    motor.drive(settings(900.0), &Shared::recorded_by(&recorder), SETTLED + 100_000, u32::MAX);
    (0..).map_while(|index| recorder.read(index)).collect()
}

#[test]
fn the_flight_recorder_knows_whether_control_asked_for_pulses() {
    let off = |at: u32, sample: &mut Sample, command: &mut DriveCommand| {
        command.enable = false;
        sample.udc_v = if at >= SETTLED { 2_200.0 } else { 1_500.0 };
    };
    let records = recorded(&mut Motor::new(400.0, &off));
    assert!(records.len() == 256 && records.iter().all(|record| !record.state.pulsing));
    let mut late = Motor { late: Some((SETTLED, 40)), ..Motor::new(400.0, &|_, _, _| {}) };
    for record in recorded(&mut late) {
        let (state, faulty) = (record.state, record.at.0 >= SETTLED);
        let fault = faulty.then_some(Fault::ControlDeadline);
        assert_eq!((state.pulsing, state.fault), (!faulty, fault), "{}", record.at.0);
    }
}

#[test]
fn a_machine_whose_temperatures_are_no_longer_known_is_as_rated() {
    const WARM: core::ops::Range<u32> = 4 * SETTLED..5 * SETTLED;
    let warm = |at: u32, _: &mut Sample, command: &mut DriveCommand| {
        command.warmth = if WARM.contains(&at) { Warmth::new(1.4) } else { Warmth::NONE };
    };
    let cold = |_: u32, _: &mut Sample, _: &mut DriveCommand| {};
    let current = |hook: &dyn Fn(u32, &mut Sample, &mut DriveCommand), end| {
        let mut motor = Motor::new(200.0, hook);
        assert_eq!(motor.runs(settings(900.0), end), None);
        Dq { d: motor.report.id_a, q: motor.report.iq_a }
    };
    // Difference of a warm machine's reference from a cold machine's: hardly any, as only its voltage differs.
    let apart = |end| (current(&warm, end) - current(&cold, end)).length();
    let [before, warm, after] = [WARM.start, WARM.start + SETTLED / 8, WARM.end + 2 * SETTLED].map(apart);
    assert!(before == 0.0 && warm > 1e-3 && after < 1e-3, "{before} {warm} {after}");
}

/// The zero moves in every slot in which it is to be calibrated, and stays afterwards.
#[test]
fn a_zero_is_calibrated_as_long_as_it_is_ordered() {
    const ORDERED: core::ops::Range<u32> = 2 * SETTLED..3 * SETTLED;
    let order = |at: u32, _: &mut Sample, command: &mut DriveCommand| {
        (command.calibrate, command.demand.torque_nm) = (ORDERED.contains(&at), 0.0);
    };
    let at = |end| {
        let mut motor = Motor { operated: true, ..Motor::new(400.0, &order) };
        assert_eq!(motor.runs(settings(900.0), end), None);
        (motor.report.calibrating, motor.report.angle_zero)
    };
    let ends =
        [ORDERED.start, ORDERED.end - SETTLED / 2, ORDERED.end, ORDERED.end + SETTLED / 8, 4 * SETTLED];
    let [before, amid, last, after, later] = ends.map(at);
    assert_eq!(before, (false, Angle::ZERO));
    assert!(amid.0 && last.0 && amid.1 != Angle::ZERO && amid.1 != last.1, "{amid:?} {last:?}");
    assert!(!after.0 && after == later, "{after:?} {later:?}");
}

/// Largest change of the torque's reference that a swinging link makes.
fn swung_nm(link_damping: f32) -> f32 {
    let swing = |at: u32, sample: &mut Sample, _: &mut DriveCommand| {
        sample.udc_v = 1_500.0 + 30.0 * (TAU * 40.0 * at as f32 / 25e6).sin();
    };
    let settings = Settings { gains: Gains { link_damping, ..Gains::DEFAULT }, ..settings(900.0) };
    let torque = |periods: u32| {
        let mut motor = Motor::new(400.0, &swing);
        assert_eq!(motor.runs(settings, SETTLED + periods * 2_500), None);
        motor.report.torque_nm
    };
    let torques: Vec<_> = (0..10).map(|tenth| torque(25 * tenth)).collect();
    torques.iter().copied().fold(f32::MIN, f32::max) - torques.iter().copied().fold(f32::MAX, f32::min)
}

/// Mean torque over a link's swing by a tenth, in N·m, of a machine that turns at an electrical speed in rad/s.
fn mean_in_a_wide_swing_nm(omega: f32) -> f32 {
    let swing = |at: u32, sample: &mut Sample, _: &mut DriveCommand| {
        sample.udc_v = 1_500.0 + 150.0 * (TAU * 40.0 * at as f32 / 25e6).sin();
    };
    let settings = Settings { gains: Gains { link_damping: 3.0, ..Gains::DEFAULT }, ..settings(900.0) };
    let torque = |periods: u32| {
        let mut motor = Motor::new(omega, &swing);
        assert_eq!(motor.runs(settings, SETTLED + periods * 2_500), None);
        motor.report.torque_nm
    };
    (0..25).map(|tenth| torque(10 * tenth)).sum::<f32>() / 25.0
}

/// Room for the swing is made where the field is weakened; below, the largest torque leaves enough.
#[test]
fn a_wide_swing_takes_torque_in_weakening_alone() {
    let [below, beyond] = [400.0, 1_600.0].map(mean_in_a_wide_swing_nm);
    assert!(below > 195.0 && beyond < 185.0, "{below} {beyond}");
}

#[test]
fn a_link_that_swings_is_damped_by_torque_where_it_is_wanted() {
    let [without, with] = [0.0, 1.0].map(swung_nm);
    assert!(without < 0.1 && with > 2.0, "{without} N·m without, {with} N·m with");
}

/// The start of a sensor that only counts: a pulse takes as many commands as its volt-seconds need at the largest voltage. Making up for what earlier
/// halves made too much does not exceed that voltage either.
#[test]
fn pulses_of_the_start_keep_within_the_largest_voltage_of_a_carrier() {
    let quick = settings(9_000.0);
    let at = |id_a: f32| BUILT_IN.flux.at(id_a, 0.0)[0];
    let pulse_wb = at(0.0) - at(-PULSE_SHARE * BUILT_IN.ratings.max_current_a);
    for (udc_v, commands) in [(900.0, 2.0), (1_200.0, 2.0), (1_250.0, 2.0), (1_280.0, 1.0), (1_500.0, 1.0)] {
        let counts = |_: u32, sample: &mut Sample, _: &mut DriveCommand| {
            (sample.angle, sample.udc_v) = (None, udc_v);
        };
        let mut motor = Motor::new(0.0, &counts);
        motor.runs(quick, 2 * SETTLED);
        let pulse_v = pulse_wb / CLOCK.control_s() / commands;
        let limit_v = 0.95 * index_limit(Mode::Async, 0.0, &quick.devices) * six_step_v(udc_v);
        let within = pulse_v - 0.1..limit_v + 0.1;
        assert!(within.contains(&motor.largest_v), "{udc_v} V: {} V, not {within:?}", motor.largest_v);
    }
}
