//! Every way from one state to another.

use crate::world::{World, trip};
use tractive::operator::{Configuration, Refusal, State};
use tractive::protection::Fault;

#[test]
fn from_power_up_to_running_and_back_to_an_empty_link() {
    let mut world = World::new();
    let mut seen = Vec::new();
    let mut note = |state: State| {
        if seen.last() != Some(&state) {
            seen.push(state);
        }
    };
    for slot in 0..6_000 {
        world.request.charge = slot >= 200;
        world.request.enable = (1_500..3_000).contains(&slot);
        world.request.torque_nm = if (1_600..2_500).contains(&slot) { 300.0 } else { 0.0 };
        world.request.discharge = slot >= 3_500;
        let output = world.slot();
        note(output.status.state);
        assert_eq!(output.status.refusal, None);
    }
    use State::{Charged, Discharge, Enabled, Precharge, Ready, Running, SelfTest};
    assert_eq!(
        seen,
        [
            SelfTest,
            Ready,
            Precharge,
            Charged,
            Enabled,
            Running,
            Enabled,
            State::Stopping,
            Charged,
            Discharge,
            Ready
        ]
    );
    assert!(world.observed.udc_v < 60.0);
}

#[test]
fn init_waits_for_the_configurations_check() {
    let mut world = World::new();
    world.feedback.configuration = Configuration::Unchecked;
    world.slots(500);
    assert_eq!(world.state(), State::Init);
    world.feedback.configuration = Configuration::Good;
    world.slot();
    assert_eq!(world.state(), State::SelfTest);
}

#[test]
fn the_self_test_takes_fifty_slots() {
    let mut world = World::new();
    world.slots(50);
    assert_eq!(world.state(), State::SelfTest);
    world.slot();
    assert_eq!(world.state(), State::Ready);
}

#[test]
fn precharge_closes_the_relay_then_the_main_contactor_then_opens_the_relay() {
    let mut world = World::ready();
    world.edge(|request, level| request.charge = level);
    let mut seen = Vec::new();
    while world.state() != State::Charged {
        let switches = world.slot().status.switches;
        if seen.last() != Some(&(switches.precharge, switches.main)) {
            if switches.main && switches.precharge {
                let gap_v = world.source_v - world.observed.udc_v;
                assert!(gap_v < 0.025 * 1_500.0, "{gap_v} V left when the main contactor closes");
            }
            seen.push((switches.precharge, switches.main));
        }
    }
    assert_eq!(seen, [(true, false), (true, true), (false, true)]);
}

#[test]
fn a_link_that_is_alive_by_itself_needs_no_precharge() {
    let mut world = World::without_line();
    world.until(State::Ready);
    world.edge(|request, level| request.enable = level);
    assert_eq!(world.state(), State::Enabled);
    world.request.enable = false;
    world.slots(3);
    assert_eq!(world.state(), State::Ready);
}

#[test]
fn running_is_a_torque_that_is_not_zero() {
    let mut world = World::enabled();
    world.request.torque_nm = -100.0;
    world.slot();
    assert_eq!(world.state(), State::Running);
    world.request.torque_nm = 0.0;
    world.until(State::Enabled);
}

#[test]
fn a_stop_ramps_torque_down_before_the_gates_go_off() {
    let mut world = World::running();
    world.request.enable = false;
    let mut least_nm = f32::MAX;
    let mut slots = 0;
    while world.slot().command.enable {
        assert_eq!(world.state(), State::Stopping);
        least_nm = world.output().status.torque_nm;
        slots += 1;
    }
    assert!(slots > 30 && least_nm == 0.0, "{slots} slots, {least_nm} N·m");
    assert_eq!(world.state(), State::Charged);
}

#[test]
fn at_a_speed_where_the_emf_would_be_rectified_a_stop_keeps_pulsing_without_torque() {
    let mut world = World::running();
    world.observed.omega = 2_000.0;
    world.request.enable = false;
    world.slots(1_000);
    assert_eq!((world.state(), world.output().status.torque_nm), (State::Stopping, 0.0));
    assert!(world.output().command.enable);
    world.observed.omega = 1_500.0;
    world.slot();
    assert_eq!((world.state(), world.output().command.enable), (State::Charged, false));
}

#[test]
fn off_and_the_enable_input_turn_the_gates_off_at_once() {
    for stop in [(|world: &mut World| world.request.off = true) as fn(&mut World), |world| {
        world.feedback.enable_input = false
    }] {
        let mut world = World::running();
        stop(&mut world);
        let output = world.slot();
        assert_eq!((output.command.enable, output.status.state), (false, State::Charged));
        world.request.off = false;
        world.feedback.enable_input = true;
        world.slots(100);
        assert_eq!(world.state(), State::Charged, "the level that still stands is no command");
        world.request.torque_nm = 0.0;
        assert_eq!(world.edge(|request, level| request.enable = level).status.state, State::Enabled);
    }
}

#[test]
fn coasting_ramps_down_opens_the_gates_and_catches_the_machine_without_a_new_command() {
    let mut world = World::running();
    world.observed.omega = 800.0;
    world.request.coast = true;
    world.slot();
    assert_eq!((world.state(), world.output().command.enable), (State::Coasting, true));
    world.slots(300);
    assert_eq!((world.state(), world.output().command.enable), (State::Coasting, false));
    world.request.coast = false;
    world.slot();
    assert!(world.output().command.enable);
    world.slots(300);
    assert_eq!((world.state(), world.output().status.torque_nm), (State::Running, 400.0));
}

#[test]
fn coasting_ends_with_a_stop() {
    let mut world = World::running();
    world.request.coast = true;
    world.slots(300);
    world.request.enable = false;
    world.slot();
    assert_eq!(world.state(), State::Charged);
    // From before the gates went off, the stop goes on ramping.
    let mut world = World::running();
    world.request.coast = true;
    world.slot();
    world.request.enable = false;
    world.slot();
    assert_eq!(world.state(), State::Stopping);
}

#[test]
fn precharge_may_be_broken_off_by_a_discharge() {
    let mut world = World::ready();
    world.edge(|request, level| request.charge = level);
    world.slots(100);
    assert_eq!(world.state(), State::Precharge);
    world.edge(|request, level| request.discharge = level);
    assert_eq!(world.state(), State::Discharge);
    world.until(State::Ready);
}

#[test]
fn discharge_waits_for_the_contactors_own_contacts() {
    let mut world = World::charged();
    world.edge(|request, level| request.discharge = level);
    let mut waited = 0;
    while !world.switches().discharge {
        assert!(!world.switches().main);
        waited += 1;
        world.slot();
    }
    assert!(waited > 10 && !world.feedback.main_closed);
}

#[test]
fn a_fault_is_left_by_an_acknowledge_through_the_self_test() {
    let mut world = World::running();
    world.observed.trip = Some(trip(Fault::Overcurrent));
    let output = world.slot();
    assert_eq!(output.status.state, State::Fault);
    assert_eq!((output.command.enable, world.switches().main), (false, false));
    world.slots(500);
    assert_eq!((world.state(), world.fault()), (State::Fault, Some(Fault::Overcurrent)));
    let number = world.output().command.acknowledge;
    world.edge(|request, level| request.acknowledge = level);
    assert_eq!(world.output().command.acknowledge, number + 1);
    world.until(State::SelfTest);
    assert_eq!(world.fault(), None);
    world.until(State::Ready);
    world.slots(100);
    assert_eq!(world.state(), State::Ready, "the enable level from before the fault is no command");
}

#[test]
fn a_fault_that_returns_at_once_is_reported_again() {
    let mut world = World::running();
    world.observed.trip = Some(trip(Fault::Overcurrent));
    world.persistent = Some(trip(Fault::PhaseSum));
    world.slots(100);
    world.edge(|request, level| request.acknowledge = level);
    world.slots(5);
    assert_eq!((world.state(), world.fault()), (State::Fault, Some(Fault::PhaseSum)));
    assert_eq!(world.refusal(), Some(Refusal::CauseStillPresent));
}
