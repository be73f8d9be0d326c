//! The same state machine over the ZS9's two motors.

use tractive::built_in::zs9::BUILT_IN;
use tractive::drive::Observation;
use tractive::drive::dual::{self};
use tractive::machine::Ratings;
use tractive::operator::{
    Configuration, DualOperator, DualRequest, DualStatus, Feedback, Input, Line, MotorLimits, Output,
    Refusal, Settings, State, Wanted,
};

use tractive::ports::{DualDriveCommand, DualReport, MotorDemand};
use tractive::protection::{Fault, SafeState, Trip};
use tractive::time::Instant;

struct World {
    operator: DualOperator,
    ratings: Ratings,
    request: DualRequest,
    observed: Observation<DualReport>,
    feedback: Feedback,
    last: Option<Output<DualDriveCommand, [MotorDemand; 2]>>,
}

impl World {
    fn new() -> Self {
        let ratings = dual::Settings::operator_ratings(&BUILT_IN.ratings);
        let report = DualReport { source_v: 400.0, speed_known: true, ..DualReport::default() };
        Self {
            operator: DualOperator::new(),
            request: DualRequest::idle(&ratings, 667.0),
            ratings,
            observed: Observation { at: Instant(0), report },
            feedback: Feedback {
                driver_ready: true,
                enable_input: true,
                sensor_alive: true,
                position_known: true,
                configuration: Configuration::Good,
                ..Feedback::default()
            },
            last: None,
        }
    }

    /// A slot in which contactors, capacitors and drive do what they are told.
    fn slot(&mut self) -> DualStatus {
        let line = Line::rated(&self.ratings, 0.05, 0.5).without_chopper();
        let settings = Settings::rated(&self.ratings, 1e-3, Some(line));
        let input =
            Input { request: &self.request, observed: &self.observed, feedback: &self.feedback, fresh: true };
        let output = self.operator.step(&input, &settings);
        let (switches, report) = (output.status.switches, &mut self.observed.report);
        assert_eq!(switches.chopper, 0.0);
        (self.feedback.precharge_closed, self.feedback.main_closed) = (switches.precharge, switches.main);
        if switches.precharge || switches.main {
            let towards =
                if output.command.enable { 0.5 * (output.command.link_ref_v + 400.0) } else { 400.0 };
            report.capacitor_v += (towards - report.capacitor_v) * 0.02;
        }
        if let Some(last) = self.last.replace(output)
            && last.command.acknowledge != report.acknowledged
        {
            (report.acknowledged, report.trip) = (last.command.acknowledge, None);
        }
        for (torque_nm, demand) in report.torque_nm.iter_mut().zip(output.command.demands) {
            if let MotorDemand::Torque(demand) = demand {
                *torque_nm = demand.torque_nm;
            }
        }
        self.observed.at = self.observed.at.after(25_000);
        output.status
    }

    fn slots(&mut self, count: u32) -> DualStatus {
        (0..count).map(|_| self.slot()).last().unwrap()
    }

    fn until(&mut self, state: State) {
        assert!((0..5_000).any(|_| self.slot().state == state), "{state:?}: {:?}", self.last);
    }

    fn command(&self) -> DualDriveCommand {
        self.last.unwrap().command
    }

    fn torques_nm(&self) -> [f32; 2] {
        self.command().demands.map(|demand| match demand {
            MotorDemand::Torque(demand) => demand.torque_nm,
            MotorDemand::Speed(speed) => panic!("a speed: {speed}"),
        })
    }

    fn enabled() -> Self {
        let mut world = Self::new();
        world.until(State::Ready);
        world.request.levels.charge = true;
        world.until(State::Charged);
        world.request.levels.enable = true;
        assert_eq!(world.slot().state, State::Enabled, "{:?}", world.last);
        world
    }

    fn want(&mut self, wanted: [Wanted; 2]) {
        for (motor, wanted) in self.request.motors.iter_mut().zip(wanted) {
            motor.wanted = wanted;
        }
    }
}

#[test]
fn precharge_enable_run_stop_discharge() {
    let mut world = World::new();
    assert_eq!(world.slot().state, State::SelfTest);
    world.until(State::Ready);
    world.request.levels.enable = true;
    assert_eq!(world.slot().refusal, Some(Refusal::LinkNotCharged));
    let mut world = World::enabled();
    world.want([Wanted::Torque(60.0), Wanted::Torque(-20.0)]);
    let mut before = [0.0; 2];
    for _ in 0..400 {
        world.slot();
        let now = world.torques_nm();
        // 80 % of 4,000 N.m/s.
        assert!(
            now.iter().zip(before).all(|(now, before)| (now - before).abs() <= 3.2001),
            "{now:?} {before:?}"
        );
        before = now;
    }
    assert_eq!((world.torques_nm(), world.operator.state()), ([60.0, -20.0], State::Running));
    assert_eq!(world.command().link_ref_v, 667.0);
    world.request.levels.enable = false;
    assert_eq!(world.slot().state, State::Stopping);
    // The link goes down to the source's voltage before the gates go off.
    while world.slot().state == State::Stopping {
        assert!(world.command().enable && world.command().link_ref_v == 400.0);
    }
    assert_eq!((world.operator.state(), world.command().enable), (State::Charged, false));
    assert!(world.observed.report.link_v() < 420.0);
    world.request.levels.discharge = true;
    world.until(State::Discharge);
    world.slots(3);
    assert!(world.last.unwrap().status.switches.discharge);
    world.observed.report.capacitor_v = 50.0;
    world.until(State::Ready);
}

#[test]
fn a_speed_begins_where_the_motor_is_and_a_torque_at_what_held_its_speed() {
    let mut world = World::enabled();
    world.observed.report.omega = [4.0 * 10.0, 0.0];
    world.want([Wanted::Speed(100.0), Wanted::Torque(10.0)]);
    let rise = world.ratings.max_speed_rad_s / 500.0;
    world.slot();
    let [MotorDemand::Speed(speed), MotorDemand::Torque(_)] = world.command().demands else { panic!() };
    assert!((speed - 10.0 - rise).abs() < 1e-3, "{speed}");
    world.observed.report.torque_nm[0] = 30.0;
    assert_eq!(world.slots(2_000).state, State::Running);
    assert_eq!(world.command().demands[0], MotorDemand::Speed(100.0));
    // Of a speed that is told in steps the speed loop makes this at an instant.
    world.observed.report.torque_nm[0] = -90.0;
    world.want([Wanted::Torque(0.0); 2]);
    world.slot();
    let [first, _] = world.torques_nm();
    assert!((26.0..30.0).contains(&first), "{first}");
    assert_eq!(world.slots(500).state, State::Enabled);
}

#[test]
fn limits_are_each_motors_own() {
    let mut world = World::enabled();
    let rated = MotorLimits::rated(&world.ratings);
    world.request.motors[1].limits = MotorLimits { motoring_nm: 15.0, braking_nm: 12.0, speed_rad_s: 50.0 };
    world.want([Wanted::Torque(60.0), Wanted::Torque(60.0)]);
    world.slots(500);
    assert_eq!(world.torques_nm(), [60.0, 15.0]);
    assert_eq!(world.command().speed_torque_nm, [rated.motoring_nm, 12.0]);
    world.want([Wanted::Speed(100.0), Wanted::Speed(100.0)]);
    world.slots(1_000);
    assert_eq!(world.command().demands, [MotorDemand::Speed(100.0), MotorDemand::Speed(50.0)]);
    // Beyond the ratings: refused once, those before go on.
    world.request.motors[0].limits.motoring_nm = 121.0;
    assert_eq!(world.slots(3).refusal, Some(Refusal::LimitOutOfRange));
    assert_eq!(world.command().speed_torque_nm, [rated.motoring_nm, 12.0]);
    world.request.motors[0].limits = rated;
    world.slot();
    for link_ref_v in [350.0, 801.0] {
        world.request.link_ref_v = link_ref_v;
        let refusals = world.last.unwrap().status.refusals;
        assert_eq!(world.slot().refusals, refusals + 1, "{link_ref_v}");
        assert_eq!(world.command().link_ref_v, 667.0);
        world.request.link_ref_v = 667.0;
        world.slot();
    }
}

#[test]
fn what_is_no_number_asks_for_nothing() {
    let mut world = World::enabled();
    world.want([Wanted::Torque(20.0), Wanted::Torque(20.0)]);
    world.slots(300);
    world.want([Wanted::Torque(20.0), Wanted::Torque(f32::NAN)]);
    assert_eq!(world.slots(300).refusal, Some(Refusal::RequestNotFinite));
    assert_eq!(world.torques_nm(), [0.0; 2]);
}

#[test]
fn one_fault_stops_both_motors_and_is_left_by_an_acknowledge() {
    let mut world = World::enabled();
    world.want([Wanted::Speed(50.0), Wanted::Torque(20.0)]);
    world.slots(300);
    let trip = Trip {
        fault: Fault::SensorLost2,
        value: 1.0,
        limit: 0.0,
        at: world.observed.at,
        safe: SafeState::GatesOff,
    };
    world.observed.report.trip = Some(trip);
    let status = world.slot();
    assert_eq!((status.state, status.trip), (State::Fault, Some(trip)));
    assert_eq!((world.command().enable, world.torques_nm()), (false, [0.0; 2]));
    assert!(!status.switches.main);
    world.request.levels.enable = false;
    world.slots(5);
    world.request.levels.acknowledge = true;
    world.until(State::SelfTest);
    world.until(State::Ready);
    assert_eq!(world.last.unwrap().status.trip, None);
}

/// Both motors' EMFs are in series for the diodes: each alone would be slow enough.
#[test]
fn two_turning_motors_keep_the_gates_on_without_torque() {
    let mut world = World::enabled();
    let pole_pairs = world.ratings.pole_pairs;
    let omega = 0.7 * world.ratings.max_speed_rad_s * pole_pairs;
    world.observed.report.omega = [omega, -omega];
    world.request.levels.enable = false;
    assert_eq!(world.slots(1_000).state, State::Stopping);
    world.observed.report.omega = [omega, 0.0];
    world.until(State::Charged);
}

/// The link may be a twentieth above its source when the gates go off.
#[test]
fn the_gates_go_off_once_the_link_is_near_its_source() {
    for (capacitor_v, state) in [(410.0_f32, State::Stopping), (410.0_f32.next_down(), State::Charged)] {
        let mut world = World::enabled();
        world.request.levels.enable = false;
        world.slot();
        world.observed.report.capacitor_v = capacitor_v;
        assert_eq!(world.slot().state, state, "{capacitor_v}");
    }
}

/// Each value of each motor by itself: as rated, and not beyond it; and no number in any of them.
#[test]
fn every_value_of_either_motor_is_judged() {
    type Field = fn(&mut MotorLimits) -> &mut f32;
    let rated = MotorLimits::rated(&World::new().ratings);
    let fields: [(Field, [f32; 2], [f32; 2]); 3] = [
        (|limits| &mut limits.motoring_nm, [0.0, rated.motoring_nm], [-1e-9, rated.motoring_nm.next_up()]),
        (|limits| &mut limits.braking_nm, [0.0, rated.braking_nm], [-1e-9, rated.braking_nm.next_up()]),
        (|limits| &mut limits.speed_rad_s, [1e-9, rated.speed_rad_s], [0.0, rated.speed_rad_s.next_up()]),
    ];
    let refusal = |set: &dyn Fn(&mut DualRequest)| {
        let mut world = World::new();
        world.until(State::Ready);
        set(&mut world.request);
        world.slot().refusal
    };
    for motor in 0..2 {
        for (field, allowed, refused) in &fields {
            let found = |value: f32| refusal(&|request| *field(&mut request.motors[motor].limits) = value);
            assert_eq!(allowed.map(found), [None; 2]);
            assert_eq!(refused.map(found), [Some(Refusal::LimitOutOfRange); 2]);
            assert_eq!(found(f32::NAN), Some(Refusal::RequestNotFinite));
        }
        for wanted in [Wanted::Torque(f32::NAN), Wanted::Speed(f32::INFINITY)] {
            let found = refusal(&|request| request.motors[motor].wanted = wanted);
            assert_eq!(found, Some(Refusal::RequestNotFinite));
        }
    }
    let [low_v, high_v, _] = dual::Settings::link_range_v(&World::new().ratings);
    let found = |link_ref_v: f32| refusal(&|request| request.link_ref_v = link_ref_v);
    assert_eq!([low_v, high_v].map(found), [None; 2]);
    assert_eq!([low_v.next_down(), high_v.next_up()].map(found), [Some(Refusal::LimitOutOfRange); 2]);
    assert_eq!(found(f32::NAN), Some(Refusal::RequestNotFinite));
}

/// The larger current of the two motors counts, and the faster one's speed; what is no number, of whichever motor, is beyond every limit.
#[test]
fn either_motors_current_and_speed_count() {
    let ratings = World::new().ratings;
    let resting_a = 0.05 * ratings.max_current_a;
    let trip = ratings.trip_speed_rad_s * ratings.pole_pairs;
    let fault = |currents_a: [f32; 2], omega: [f32; 2]| {
        let mut world = World::new();
        (world.observed.report.current_a, world.observed.report.omega) = (currents_a, omega);
        world.observed.report.capacitor_v = 400.0;
        world.slots(60).trip.map(|trip| trip.fault)
    };
    assert_eq!(fault([resting_a; 2], [0.0; 2]), None);
    for beyond in [resting_a.next_up(), f32::NAN] {
        assert_eq!(fault([beyond, 0.0], [0.0; 2]), Some(Fault::CurrentOffset), "{beyond}");
        assert_eq!(fault([0.0, beyond], [0.0; 2]), Some(Fault::CurrentOffset), "{beyond}");
    }
    for omega in [[1.01 * trip, 0.0], [0.0, 1.01 * trip], [-1.01 * trip, 0.0], [0.0, -1.01 * trip]] {
        assert_eq!(fault([0.0; 2], omega), Some(Fault::Overspeed), "{omega:?}");
    }
}

/// The torque that has held a speed is a mean: each slot takes up a part in 51 of the rest of a step.
#[test]
fn the_torque_that_holds_a_speed_is_a_mean() {
    let mut world = World::enabled();
    world.observed.report.torque_nm = [0.0, 0.0];
    world.want([Wanted::Speed(0.0), Wanted::Torque(0.0)]);
    world.slots(3);
    world.observed.report.torque_nm[0] = 30.0;
    for _ in 0..50 {
        world.slot();
    }
    world.want([Wanted::Torque(30.0), Wanted::Torque(0.0)]);
    world.slot();
    let [first, _] = world.torques_nm();
    let mean = 30.0 * (1.0 - (50.0_f32 / 51.0).powi(50));
    // And the ramp's first step from there.
    assert!((0.0..0.1).contains(&(first - mean)), "{first} {mean}");
}

/// A speed is held with the smaller of both torques, whichever that is.
#[test]
fn a_speed_has_the_smaller_of_both_torques() {
    let mut world = World::enabled();
    let rated = MotorLimits::rated(&world.ratings);
    world.request.motors[0].limits = MotorLimits { motoring_nm: 15.0, ..rated };
    world.request.motors[1].limits = MotorLimits { braking_nm: 14.0, ..rated };
    world.slot();
    assert_eq!(world.command().speed_torque_nm, [15.0, 14.0]);
}
