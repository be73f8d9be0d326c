//! The operator's own faults, by name, with value and limit.

use crate::world::{World, trip};
use tractive::operator::{Configuration, State};
use tractive::protection::Fault;

type Spoil = fn(&mut World);

/// Ends in this fault, everything off.
fn fails(mut world: World, spoil: Spoil, fault: Fault) {
    spoil(&mut world);
    for _ in 0..3_000 {
        world.slot();
        if world.state() == State::Fault {
            break;
        }
    }
    assert_eq!(world.fault(), Some(fault));
    let switches = world.switches();
    assert!(!world.output().command.enable && !switches.main && !switches.precharge && !switches.discharge);
}

#[test]
fn the_self_test_finds_what_is_not_in_order() {
    let spoils: [(Spoil, Fault); 13] = [
        (|world| world.feedback.offsets_a.c = 5.0, Fault::CurrentOffset),
        (|world| world.feedback.offsets_a.a = f32::NAN, Fault::CurrentOffset),
        (|world| (world.observed.current_a, world.observed.udc_v) = (15.0, 100.0), Fault::CurrentOffset),
        (|world| world.observed.udc_v = -40.0, Fault::LinkImplausible),
        (|world| world.observed.udc_v = f32::NAN, Fault::LinkImplausible),
        (|world| world.observed.udc_v = 2_100.0, Fault::DcOvervoltage),
        (|world| world.feedback.sensor_alive = false, Fault::PositionSensor),
        (|world| world.observed.speed_known = false, Fault::PositionSensor),
        (|world| world.feedback.driver_ready = false, Fault::GateDriver),
        (|world| world.feedback.hardware = Some(Fault::HardwareOvercurrent), Fault::HardwareOvercurrent),
        (|world| world.feedback.configuration = Configuration::Bad, Fault::Configuration),
        (|world| world.observed.omega = 3_000.0, Fault::Overspeed),
        (|world| (world.feedback.main_closed, world.stuck) = (true, true), Fault::Contactor),
    ];
    for (spoil, fault) in spoils {
        fails(World::new(), spoil, fault);
    }
}

#[test]
fn the_drives_faults_are_shown() {
    for fault in [Fault::Overcurrent, Fault::StaleCommand] {
        let mut world = World::running();
        world.observed.trip = Some(trip(fault));
        world.slot();
        assert_eq!(world.output().status.trip, Some(trip(fault)));
    }
}

#[test]
fn a_source_that_is_not_there_is_a_precharge_timeout() {
    let mut world = World::ready();
    world.request.charge = true;
    // A short circuit on the link: it stays far below.
    fails(world, |world| world.source_v = 300.0, Fault::PrechargeTimeout);
}

#[test]
fn contactors_that_do_not_move_are_found() {
    let stick: Spoil = |world| world.stuck = true;
    let mut charging = World::ready();
    charging.request.charge = true;
    fails(charging, stick, Fault::Contactor);
    let mut closing = World::ready();
    closing.request.charge = true;
    while !closing.slot().status.switches.main {}
    fails(closing, stick, Fault::Contactor);
    let mut releasing = World::ready();
    releasing.request.charge = true;
    while !releasing.feedback.main_closed {
        releasing.slot();
    }
    fails(releasing, stick, Fault::Contactor);
    let mut discharging = World::charged();
    discharging.request.discharge = true;
    fails(discharging, stick, Fault::Contactor);
}

#[test]
fn contactors_that_move_by_themselves_are_found() {
    let open: Spoil = |world| (world.feedback.main_closed, world.stuck) = (false, true);
    fails(World::charged(), open, Fault::Contactor);
    fails(World::running(), open, Fault::Contactor);
    fails(
        World::ready(),
        |world| (world.feedback.precharge_closed, world.stuck) = (true, true),
        Fault::Contactor,
    );
    let mut discharging = World::charged();
    discharging.request.discharge = true;
    discharging.slots(50);
    fails(discharging, |world| (world.feedback.main_closed, world.stuck) = (true, true), Fault::Contactor);
}

#[test]
fn a_link_that_keeps_its_voltage_is_a_discharge_timeout() {
    let mut world = World::charged();
    world.request.discharge = true;
    world.until(State::Discharge);
    for _ in 0..2_000 {
        world.observed.udc_v = 1_400.0;
        world.slot();
    }
    assert_eq!(world.fault(), Some(Fault::DischargeTimeout));
}

#[test]
fn a_source_that_is_lost_opens_the_main_contactor_before_it_can_come_back() {
    for world in [World::charged(), World::running()] {
        fails(world, |world| world.source_v = 800.0, Fault::DcUndervoltage);
    }
}

#[test]
fn what_must_stay_in_order_while_the_gates_pulse() {
    let spoils: [(Spoil, Fault); 4] = [
        (|world| world.feedback.driver_ready = false, Fault::GateDriver),
        (|world| world.feedback.hardware = Some(Fault::ClockFailure), Fault::ClockFailure),
        (|world| world.feedback.sensor_alive = false, Fault::PositionSensor),
        (|world| world.feedback.position_known = false, Fault::PositionSensor),
    ];
    for (spoil, fault) in spoils {
        fails(World::running(), spoil, fault);
        fails(World::enabled(), spoil, fault);
    }
}

#[test]
fn a_drive_that_does_not_carry_out_the_acknowledge_is_a_fault_of_its_own() {
    let mut world = World::charged();
    world.observed.trip = Some(trip(Fault::Overcurrent));
    world.deaf = true;
    world.slots(100);
    world.edge(|request, level| request.acknowledge = level);
    world.slots(60);
    assert_eq!((world.state(), world.fault()), (State::Fault, Some(Fault::GatesHeld)));
}

#[test]
fn the_chopper_follows_the_link_in_every_state() {
    let mut world = World::charged();
    // 1,800 V is the highest operating voltage, 2,070 V trips: the chopper works from 5 % to 25 % between.
    for (udc_v, duty) in [(1_800.0, 0.0), (1_813.0, 0.0), (1_840.5, 0.5), (1_868.0, 1.0), (2_060.0, 1.0)] {
        world.source_v = udc_v;
        world.slots(2);
        assert!((world.switches().chopper - duty).abs() < 1e-3, "{udc_v} V: {}", world.switches().chopper);
    }
    world.source_v = 2_100.0;
    world.slots(2);
    assert_eq!((world.state(), world.switches().chopper), (State::Fault, 1.0));
    world.observed.udc_v = f32::NAN;
    world.stuck = true;
    world.slot();
    assert_eq!(world.switches().chopper, 0.0, "not a number calls for nothing");
}

/// An idle loop that is away while the link charges has seen no rate since: the main contactor still closes within 2 % of the source.
#[test]
fn slots_that_were_missed_do_not_close_the_main_contactor_early() {
    for (before, missed) in (0..40).flat_map(|before| [21, 45, 49].map(|missed| (before, missed))) {
        let mut world = World::ready();
        world.edge(|request, level| request.charge = level);
        while world.observed.udc_v < 1_010.0 {
            world.slot();
        }
        world.slots(before);
        world.missed(missed);
        while !world.slot().status.switches.main {
            assert_eq!(world.state(), State::Precharge);
        }
        let gap_v = world.source_v - world.observed.udc_v;
        assert!(gap_v < 1.01 * 0.02 * 1_500.0, "{before} slots, {missed} missed: {gap_v} V");
    }
}

/// A contact may bounce for 10 ms on its way and be disturbed while the gates pulse; one that has let go is a fault.
#[test]
fn a_contact_that_bounces_is_no_fault_and_one_that_stays_away_is() {
    let mut world = World::ready();
    world.edge(|request, level| request.charge = level);
    while !world.feedback.precharge_closed {
        world.slot();
    }
    for closed in [true, false, true, false, false, true] {
        world.feedback.precharge_closed = closed;
        world.slot();
    }
    world.feedback.precharge_closed = true;
    world.until(State::Charged);
    world.edge(|request, level| request.enable = level);
    for (slots, fault) in [(9, None), (9, None), (12, Some(Fault::Contactor))] {
        for _ in 0..slots {
            world.feedback.main_closed = false;
            world.slot();
        }
        assert_eq!(world.fault(), fault);
        world.feedback.main_closed = true;
        world.slot();
    }
}
