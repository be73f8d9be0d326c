//! Every reason for which a command is not followed.

use crate::world::{World, trip};
use tractive::operator::{Configuration, Refusal, Request, State};
use tractive::protection::{Fault, SafeState, Trip};

type Set = fn(&mut Request, bool);
type Spoil = fn(&mut World);
const ENABLE: Set = |request, level| request.enable = level;
const CHARGE: Set = |request, level| request.charge = level;
const DISCHARGE: Set = |request, level| request.discharge = level;
const ACKNOWLEDGE: Set = |request, level| request.acknowledge = level;
const CALIBRATE: Set = |request, level| request.calibrate = level;

/// The command's edge is refused for this reason, and nothing else happens.
fn refused(world: &mut World, set: Set, reason: Refusal) {
    set(&mut world.request, false);
    world.slot();
    let (state, count) = (world.state(), world.output().status.refusals);
    set(&mut world.request, true);
    let output = world.slot();
    assert_eq!(output.status.refusal, Some(reason), "in {state:?}");
    assert_eq!(output.status.state, state);
    assert_eq!(output.status.refusals, count + 1);
    world.slot();
    assert_eq!(world.output().status.refusals, count + 1, "a level that stays is no second command");
}

fn in_fault(fault: Trip) -> World {
    let mut world = World::charged();
    world.observed.trip = Some(fault);
    world.slots(100);
    assert_eq!(world.state(), State::Fault);
    world
}

#[test]
fn not_ready_before_the_self_test_is_passed() {
    for set in [ENABLE, CHARGE, DISCHARGE] {
        let mut world = World::new();
        world.feedback.configuration = Configuration::Unchecked;
        world.slots(3);
        refused(&mut world, set, Refusal::NotReady);
        let mut world = World::new();
        world.slots(3);
        assert_eq!(world.state(), State::SelfTest);
        refused(&mut world, set, Refusal::NotReady);
    }
}

#[test]
fn a_level_that_stands_at_power_up_is_no_command() {
    let mut world = World::new();
    (world.request.enable, world.request.charge) = (true, true);
    world.slots(500);
    assert_eq!((world.state(), world.output().status.refusals), (State::Ready, 0));
}

#[test]
fn fault_not_acknowledged() {
    for set in [ENABLE, CHARGE, DISCHARGE] {
        refused(&mut in_fault(trip(Fault::Overcurrent)), set, Refusal::FaultNotAcknowledged);
    }
    // A second acknowledge while the first is being carried out.
    let mut world = in_fault(trip(Fault::Overcurrent));
    world.deaf = true;
    world.edge(ACKNOWLEDGE);
    refused(&mut world, ACKNOWLEDGE, Refusal::FaultNotAcknowledged);
}

#[test]
fn cause_still_present() {
    let causes: [fn(&mut World); 9] = [
        |world| (world.observed.current_a, world.observed.udc_v) = (15.0, 100.0),
        |world| world.feedback.driver_ready = false,
        |world| world.feedback.hardware = Some(Fault::ClockFailure),
        |world| world.feedback.configuration = Configuration::Bad,
        |world| world.feedback.offsets_a.b = -20.0,
        |world| world.observed.udc_v = 2_100.0,
        |world| world.observed.udc_v = f32::NAN,
        |world| world.feedback.sensor_alive = false,
        |world| world.observed.omega = 3_000.0,
    ];
    for cause in causes {
        let mut world = in_fault(trip(Fault::Overcurrent));
        world.source_v = 0.0;
        cause(&mut world);
        refused(&mut world, ACKNOWLEDGE, Refusal::CauseStillPresent);
    }
    let mut world = World::charged();
    world.observed.trip = Some(trip(Fault::Overcurrent));
    world.slot();
    world.stuck = true;
    refused(&mut world, ACKNOWLEDGE, Refusal::CauseStillPresent);
}

#[test]
fn a_short_circuit_stays_while_open_gates_would_rectify() {
    let mut world = in_fault(Trip { safe: SafeState::ShortCircuit, ..trip(Fault::Overspeed) });
    world.observed.omega = 2_000.0;
    refused(&mut world, ACKNOWLEDGE, Refusal::CauseStillPresent);
    world.observed.omega = 1_500.0;
    world.observed.speed_known = false;
    refused(&mut world, ACKNOWLEDGE, Refusal::CauseStillPresent);
    world.observed.speed_known = true;
    // A shorted machine carries the current that takes the magnets' flux away, and no sensor stands still then.
    world.observed.current_a = 193.0;
    world.observed.omega = 0.0;
    refused(&mut world, ACKNOWLEDGE, Refusal::CauseStillPresent);
    world.observed.omega = 1_500.0;
    assert_eq!(world.edge(ACKNOWLEDGE).status.refusal, None);
}

#[test]
fn no_fault_to_acknowledge() {
    for mut world in [World::ready(), World::charged(), World::running()] {
        refused(&mut world, ACKNOWLEDGE, Refusal::NoFault);
    }
}

#[test]
fn link_not_charged() {
    refused(&mut World::ready(), ENABLE, Refusal::LinkNotCharged);
    let mut world = World::ready();
    world.edge(CHARGE);
    world.slots(20);
    refused(&mut world, ENABLE, Refusal::LinkNotCharged);
    // Between the trip level and the lowest operating voltage.
    let mut world = World::charged();
    world.source_v = 900.0;
    refused(&mut world, ENABLE, Refusal::LinkNotCharged);
    let mut world = World::without_line();
    world.until(State::Ready);
    world.observed.udc_v = 999.0;
    refused(&mut world, ENABLE, Refusal::LinkNotCharged);
}

#[test]
fn already_charged() {
    let mut charging = World::ready();
    charging.edge(CHARGE);
    for mut world in [charging, World::charged(), World::running()] {
        refused(&mut world, CHARGE, Refusal::AlreadyCharged);
    }
}

#[test]
fn torque_not_zero() {
    let mut world = World::charged();
    world.request.torque_nm = 1.0;
    refused(&mut world, ENABLE, Refusal::TorqueNotZero);
    world.request.with_torque = true;
    assert_eq!(world.edge(ENABLE).status.state, State::Running);
}

#[test]
fn what_keeps_a_charged_drive_from_being_enabled() {
    let reasons: [(Spoil, Refusal); 7] = [
        (|world| world.observed.current_a = 15.0, Refusal::CauseStillPresent),
        (|world| world.feedback.parameters_open = true, Refusal::ParametersOpen),
        (|world| world.feedback.enable_input = false, Refusal::EnableInputLow),
        (|world| world.request.off = true, Refusal::OffRequested),
        (|world| world.feedback.position_known = false, Refusal::PositionUnknown),
        (|world| world.observed.speed_known = false, Refusal::PositionUnknown),
        (|world| world.request.torque_nm = f32::NAN, Refusal::RequestNotFinite),
    ];
    for (spoil, reason) in reasons {
        let mut world = World::charged();
        spoil(&mut world);
        refused(&mut world, ENABLE, reason);
    }
}

#[test]
fn not_stopped() {
    let mut coasting = World::running();
    coasting.request.coast = true;
    coasting.slots(300);
    for mut world in [World::enabled(), World::running(), coasting] {
        refused(&mut world, DISCHARGE, Refusal::NotStopped);
    }
    let mut world = World::running();
    world.request.enable = false;
    world.slots(2);
    refused(&mut world, ENABLE, Refusal::NotStopped);
}

#[test]
fn discharging() {
    for set in [ENABLE, CHARGE, DISCHARGE] {
        let mut world = World::charged();
        world.edge(DISCHARGE);
        refused(&mut world, set, Refusal::Discharging);
    }
}

#[test]
fn the_link_is_not_discharged_while_the_machine_would_charge_it_again() {
    let mut world = World::charged();
    world.observed.omega = 100.0;
    refused(&mut world, DISCHARGE, Refusal::MachineTurning);
    world.observed.omega = -70.0;
    assert_eq!(world.edge(DISCHARGE).status.state, State::Discharge);
}

#[test]
fn no_contactors() {
    for set in [CHARGE, DISCHARGE] {
        let mut world = World::without_line();
        world.until(State::Ready);
        refused(&mut world, set, Refusal::NoContactors);
    }
}

/// The order is passed on while the gates pulse without torque and the level is set, and at no other time.
#[test]
fn a_zero_is_calibrated_without_torque_alone() {
    for mut world in [World::new(), World::ready(), World::charged()] {
        refused(&mut world, CALIBRATE, Refusal::NotEnabled);
        assert!(!world.output().command.calibrate);
    }
    let mut world = World::running();
    refused(&mut world, CALIBRATE, Refusal::TorqueNotZero);
    assert!(!world.output().command.calibrate);
    let mut world = World::enabled();
    assert!(!world.output().command.calibrate);
    world.request.calibrate = true;
    assert!(world.slot().command.calibrate && world.refusal().is_none());
    world.request.torque_nm = 50.0;
    world.slots(5);
    assert!(!world.output().command.calibrate);
    world.request.torque_nm = 0.0;
    world.slots(500);
    assert!(world.output().command.calibrate);
    world.request.coast = true;
    assert!(!world.slot().command.calibrate);
}

#[test]
fn values_that_cannot_be_used_are_refused_once() {
    type Spoil = fn(&mut Request);
    let values: [(Spoil, Refusal); 10] = [
        (|request| request.torque_nm = f32::NAN, Refusal::RequestNotFinite),
        (|request| request.limits.braking_nm = f32::INFINITY, Refusal::RequestNotFinite),
        (|request| request.limits.motoring_nm = 1_236.0, Refusal::LimitOutOfRange),
        (|request| request.limits.braking_nm = -1.0, Refusal::LimitOutOfRange),
        (|request| request.limits.speed_rad_s = 0.0, Refusal::LimitOutOfRange),
        (|request| request.limits.speed_rad_s = 1e4, Refusal::LimitOutOfRange),
        (|request| request.limits.link_low_v = 800.0, Refusal::LimitOutOfRange),
        (|request| request.limits.link_high_v = 2_050.0, Refusal::LimitOutOfRange),
        (|request| request.limits.link_high_v = 900.0, Refusal::LimitOutOfRange),
        (
            |request| (request.limits.link_low_v, request.limits.link_high_v) = (1_700.0, 1_600.0),
            Refusal::LimitOutOfRange,
        ),
    ];
    for (spoil, reason) in values {
        let mut world = World::running();
        let before = world.output().command;
        spoil(&mut world.request);
        let output = world.slot();
        assert_eq!((output.status.refusal, output.status.refusals), (Some(reason), 1));
        assert_eq!(output.command.window, before.window, "the limits before go on");
        world.slots(300);
        assert_eq!(world.output().status.refusals, 1);
        let torque_nm = if reason == Refusal::RequestNotFinite { 0.0 } else { 400.0 };
        assert_eq!(world.output().status.torque_nm, torque_nm);
    }
}

#[test]
fn limits_hold() {
    let mut world = World::running();
    world.request.limits.motoring_nm = 150.0;
    world.request.limits.braking_nm = 90.0;
    world.request.torque_nm = 1_000.0;
    world.slots(500);
    assert_eq!(world.output().status.torque_nm, 150.0);
    // A start backward is motoring, and braking once the rotor turns forward.
    world.request.torque_nm = -1_000.0;
    world.slots(500);
    assert_eq!(world.output().status.torque_nm, -150.0);
    world.observed.omega = 50.0;
    world.slots(500);
    assert_eq!(world.output().status.torque_nm, -90.0);
    // Backward it is the other way round.
    world.observed.omega = -50.0;
    world.slots(500);
    assert_eq!(world.output().status.torque_nm, -150.0);
    // At the speed limit nothing raises the speed, and all brakes.
    world.request.limits.speed_rad_s = 100.0;
    world.observed.omega = 400.0;
    world.request.torque_nm = 1_000.0;
    world.slots(500);
    assert_eq!(world.output().status.torque_nm, 0.0);
    world.request.torque_nm = -1_000.0;
    world.slots(500);
    assert_eq!(world.output().status.torque_nm, -90.0);
    world.observed.omega = 390.0;
    world.request.torque_nm = 1_000.0;
    world.slots(500);
    assert!((world.output().status.torque_nm - 75.0).abs() < 0.1, "half of it at half of the last 5 %");
}

#[test]
fn every_refusal_has_a_name_and_a_code_of_its_own() {
    let names: std::collections::BTreeSet<_> = Refusal::ALL.iter().map(|refusal| refusal.name()).collect();
    assert_eq!(names.len(), Refusal::ALL.len());
    for refusal in Refusal::ALL {
        assert_eq!(Refusal::from_code(refusal.code().into()), Some(refusal));
    }
    for state in State::ALL {
        assert_eq!(State::from_code(state.code().into()), Some(state));
    }
    assert_eq!(State::from_code(State::ALL.len() as u32), None);
}
