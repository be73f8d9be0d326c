//! Limits and times of the operator: the last value that is allowed and the first that is not, and the slot in which a time has run out.

use crate::world::{DISCHARGE_S, PRECHARGE_S, SLOT_S, World, trip};
use tractive::built_in::traction::BUILT_IN;
use tractive::machine::Ratings;
use tractive::operator::{
    Configuration, Demands, Limits, Line, Operator, Refusal, Request, State, Status, TorqueDemand,
};
use tractive::protection::{Fault, SafeState, Trip};
use tractive::time::Clock;

const RATINGS: &Ratings = &BUILT_IN.ratings;

type Set = fn(&mut World, f32);

/// The self-test passes with the limit, and fails with the next number, which its fault tells.
fn tested(limit: f32, beyond: f32, fault: Fault, set: Set) {
    let end = |value: f32| {
        let mut world = World::new();
        set(&mut world, value);
        world.slots(60);
        world.output().status
    };
    assert_eq!((end(limit).state, end(limit).trip), (State::Ready, None), "{limit}");
    let Trip { fault: found, value, limit: told, .. } = end(beyond).trip.expect("a fault");
    assert_eq!((found, value.abs(), told.abs()), (fault, beyond.abs(), limit.abs()));
}

#[test]
fn the_self_tests_limits_to_the_last_bit() {
    let offset_a = 0.02 * RATINGS.max_current_a;
    let offsets: [Set; 3] = [
        |world, a| world.feedback.offsets_a.a = a,
        |world, b| world.feedback.offsets_a.b = b,
        |world, c| world.feedback.offsets_a.c = c,
    ];
    for set in offsets {
        tested(offset_a, offset_a.next_up(), Fault::CurrentOffset, set);
        tested(-offset_a, -offset_a.next_up(), Fault::CurrentOffset, set);
    }
    let resting_a = 0.05 * RATINGS.max_current_a;
    let slow: Set = |world, a| (world.observed.current_a, world.observed.udc_v) = (a, 1_500.0);
    tested(resting_a, resting_a.next_up(), Fault::CurrentOffset, slow);
    // Where the diodes rectify, a current may flow up to its trip level.
    let fast: Set = |world, a| {
        (world.observed.current_a, world.observed.udc_v) = (a, 1_500.0);
        world.observed.omega = 2_000.0;
    };
    tested(RATINGS.trip_current_a, RATINGS.trip_current_a.next_up(), Fault::CurrentOffset, fast);
    let link: Set = |world, udc_v| world.observed.udc_v = udc_v;
    let (lowest_v, highest_v) = (-0.02 * RATINGS.dc_link_nominal_v, RATINGS.trip_dc_over_v);
    tested(lowest_v, lowest_v.next_down(), Fault::LinkImplausible, link);
    tested(highest_v, highest_v.next_up(), Fault::DcOvervoltage, link);
    let speed: Set = |world, speed| world.observed.omega = speed * RATINGS.pole_pairs;
    tested(RATINGS.trip_speed_rad_s, RATINGS.trip_speed_rad_s.next_up(), Fault::Overspeed, speed);
    tested(-RATINGS.trip_speed_rad_s, -RATINGS.trip_speed_rad_s.next_up(), Fault::Overspeed, speed);
}

/// Slots until the fault comes, and the fault.
fn slots_to_fault(world: &mut World) -> (u32, Trip) {
    (1..5_000).find_map(|slot| Some((slot, world.slot().status.trip?))).expect("a fault")
}

/// Slots that pass until a time has run out: the first one after it.
fn beyond(time_s: f32) -> u32 {
    (time_s / SLOT_S).round() as u32 + 1
}

#[test]
fn contactors_have_their_time_and_no_slot_more() {
    let contactor_s = World::new().settings.line.unwrap().contactor_s;
    let mut relay = World::ready();
    relay.stuck = true;
    relay.edge(|request, level| request.charge = level);
    let mut main = World::ready();
    main.edge(|request, level| request.charge = level);
    while !main.switches().main {
        main.slot();
    }
    main.stuck = true;
    let mut released = World::ready();
    released.edge(|request, level| request.charge = level);
    while released.switches().precharge {
        released.slot();
    }
    released.stuck = true;
    let mut opened = World::charged();
    opened.stuck = true;
    opened.edge(|request, level| request.discharge = level);
    for (mut world, value) in [(relay, 2.0), (main, 1.0), (released, 2.0), (opened, 1.0)] {
        let (slots, Trip { fault, value: found, limit, .. }) = slots_to_fault(&mut world);
        assert_eq!((slots, fault, found, limit), (beyond(contactor_s), Fault::Contactor, value, 0.0));
    }
}

#[test]
fn charging_and_discharging_have_ten_time_constants() {
    let mut world = World::ready();
    world.source_v = 300.0;
    world.edge(|request, level| request.charge = level);
    while !world.feedback.precharge_closed {
        world.slot();
    }
    // The slot that sees the relay closed, and those after it.
    let (slots, Trip { fault, value, limit, .. }) = slots_to_fault(&mut world);
    assert_eq!((slots, fault), (1 + beyond(10.0 * PRECHARGE_S), Fault::PrechargeTimeout));
    assert_eq!(limit, RATINGS.dc_link_min_v);
    assert!((value - 300.0).abs() < 1.0);
    let mut world = World::charged();
    world.edge(|request, level| request.discharge = level);
    while !world.switches().discharge {
        world.slot();
    }
    let mut slots = 0;
    while world.fault().is_none() {
        world.observed.udc_v = 61.0;
        world.slot();
        slots += 1;
    }
    assert_eq!((slots, world.fault()), (beyond(10.0 * DISCHARGE_S), Some(Fault::DischargeTimeout)));
    let Trip { value, limit, .. } = world.output().status.trip.unwrap();
    assert_eq!((value, limit), (61.0, 60.0));
}

/// The link is a fiftieth of the nominal voltage from its source, by its rate over 20 ms: between that rate's gap and the gap at its end.
#[test]
fn the_main_contactor_closes_once_the_source_is_near() {
    let mut world = World::ready();
    world.edge(|request, level| request.charge = level);
    while !world.switches().main {
        world.slot();
    }
    let gap_v = world.source_v - world.observed.udc_v;
    assert!((21.0..28.0).contains(&gap_v), "{gap_v} V");
}

#[test]
fn a_link_is_empty_below_extra_low_voltage() {
    let mut world = World::charged();
    world.edge(|request, level| request.discharge = level);
    while !world.switches().discharge {
        world.slot();
    }
    world.observed.udc_v = 60.0;
    world.slot();
    assert_eq!(world.state(), State::Discharge);
    world.observed.udc_v = 60.0_f32.next_down();
    world.slot();
    assert_eq!(world.state(), State::Ready);
}

#[test]
fn an_acknowledge_has_fifty_milliseconds() {
    let mut world = World::charged();
    world.observed.trip = Some(trip(Fault::Overcurrent));
    world.deaf = true;
    world.slots(100);
    world.edge(|request, level| request.acknowledge = level);
    assert_eq!(world.refusal(), None);
    world.slots(50);
    assert_eq!((world.fault(), world.refusal()), (Some(Fault::Overcurrent), None));
    world.slot();
    let Trip { fault, value, limit, .. } = world.output().status.trip.unwrap();
    assert_eq!((fault, limit, world.refusal()), (Fault::GatesHeld, 0.05, Some(Refusal::CauseStillPresent)));
    assert!((value - 0.051).abs() < 1e-6, "{value}");
}

/// A drive that has forgotten its fault but not carried out the acknowledge is waited for, like one that answers nothing.
#[test]
fn a_fault_that_has_gone_is_left_by_its_acknowledge_alone() {
    let mut world = World::charged();
    world.observed.trip = Some(trip(Fault::Overcurrent));
    world.deaf = true;
    world.slots(100);
    world.observed.trip = None;
    world.edge(|request, level| request.acknowledge = level);
    world.slots(50);
    assert_eq!((world.state(), world.fault()), (State::Fault, Some(Fault::Overcurrent)));
    world.slot();
    assert_eq!((world.state(), world.fault()), (State::Fault, Some(Fault::GatesHeld)));
}

/// The gates stay on until the torque has gone, and go off in the slot after that.
#[test]
fn coasting_waits_for_the_torque_to_go() {
    let mut world = World::running();
    world.request.coast = true;
    world.slot();
    let mut slots = 0;
    while world.output().status.torque_nm != 0.0 {
        assert_eq!((world.state(), world.output().command.enable), (State::Coasting, true));
        world.slot();
        slots += 1;
    }
    assert!(slots > 50, "{slots}");
    assert!(world.output().command.enable);
    world.slot();
    assert_eq!((world.state(), world.output().command.enable), (State::Coasting, false));
}

/// A link that has its voltage from elsewhere is not charged: the main contactor is open.
#[test]
fn a_link_with_a_voltage_is_not_charged_without_its_contactor() {
    let mut world = World::ready();
    world.observed.udc_v = 1_500.0;
    assert_eq!(
        world.edge(|request, level| request.enable = level).status.refusal,
        Some(Refusal::LinkNotCharged)
    );
    assert_eq!(world.state(), State::Ready);
}

#[test]
fn an_operator_begins_at_its_beginning() {
    assert_eq!((Operator::new().state(), Configuration::default()), (State::Init, Configuration::Unchecked));
}

#[test]
fn a_drive_is_enabled_from_the_lowest_operating_voltage_on_and_trips_below_its_limit() {
    let lowest_v = RATINGS.dc_link_min_v;
    for (source_v, refusal) in [(lowest_v, None), (lowest_v.next_down(), Some(Refusal::LinkNotCharged))] {
        let mut world = World::charged();
        world.source_v = source_v;
        world.slots(2);
        assert_eq!(world.edge(|request, level| request.enable = level).status.refusal, refusal);
    }
    let trips_v = RATINGS.trip_dc_under_v;
    for begin in [World::charged as fn() -> World, World::enabled] {
        let mut world = begin();
        world.source_v = trips_v;
        world.slots(10);
        assert_eq!(world.fault(), None);
        world.source_v = trips_v.next_down();
        world.slots(2);
        let Trip { fault, value, limit, .. } = world.output().status.trip.unwrap();
        assert_eq!((fault, value, limit), (Fault::DcUndervoltage, trips_v.next_down(), trips_v));
    }
}

#[test]
fn a_machine_that_turns_is_not_discharged_nor_stopped_beyond_its_emf() {
    // With an EMF of exactly an empty link's voltage, it may still be discharged.
    let slow = 70.0_f32;
    for (omega, refusal) in [(slow, None), (-slow, None), (slow.next_up(), Some(Refusal::MachineTurning))] {
        let mut world = World::charged();
        let empty_v = tractive::frames::SQRT_3 * slow * RATINGS.magnet_flux_wb;
        world.settings.line = world.settings.line.map(|line| Line { empty_v, ..line });
        world.observed.omega = omega;
        assert_eq!(world.edge(|request, level| request.discharge = level).status.refusal, refusal, "{omega}");
    }
    // At 0.9 of the nominal link voltage, open gates are still safe, whatever the link's voltage is.
    let emf_v = |omega: f32| omega * tractive::frames::SQRT_3 * RATINGS.magnet_flux_wb;
    let all = (1_700.0_f32.to_bits()..1_800.0_f32.to_bits()).map(f32::from_bits);
    let open = all.filter(|omega| emf_v(*omega) <= 0.9 * RATINGS.dc_link_nominal_v).fold(0.0, f32::max);
    for (omega, source_v, state) in [
        (open, 1_500.0, State::Charged),
        (open, 1_800.0, State::Charged),
        (open, 1_100.0, State::Charged),
        (-open, 1_500.0, State::Charged),
        (open.next_up(), 1_500.0, State::Stopping),
        (open.next_up(), 1_800.0, State::Stopping),
        (open.next_up(), 1_100.0, State::Stopping),
    ] {
        let mut world = World::enabled();
        (world.observed.omega, world.source_v) = (omega, source_v);
        world.request.enable = false;
        world.slots(3);
        assert_eq!(world.state(), state, "{omega} {source_v}");
    }
}

/// A shorted machine may carry what its EMF drives through its resistance, and the current that may flow at rest.
#[test]
fn a_shorted_machines_current_to_the_last_bit() {
    let omega = 30.0;
    let driven_a = omega * RATINGS.magnet_flux_wb / RATINGS.stator_resistance_ohm;
    let limit_a = driven_a + 0.05 * RATINGS.max_current_a;
    for (omega, current_a, refusal) in [
        (omega, limit_a, None),
        (-omega, limit_a, None),
        (omega, limit_a.next_up(), Some(Refusal::CauseStillPresent)),
        (omega, f32::NAN, Some(Refusal::CauseStillPresent)),
    ] {
        let mut world = World::charged();
        world.observed.trip = Some(Trip { safe: SafeState::ShortCircuit, ..trip(Fault::Overspeed) });
        world.slots(100);
        (world.observed.omega, world.observed.current_a) = (omega, current_a);
        let found = world.edge(|request, level| request.acknowledge = level).status.refusal;
        assert_eq!(found, refusal, "{omega} {current_a}");
    }
}

#[test]
fn every_limit_of_a_request_may_be_as_rated_and_no_more() {
    type Field = fn(&mut Limits) -> &mut f32;
    let rated = Limits::rated(RATINGS);
    let least = f32::from_bits(1);
    let fields: [(Field, [f32; 2], [f32; 2]); 5] = [
        (|limits| &mut limits.motoring_nm, [0.0, rated.motoring_nm], [-least, rated.motoring_nm.next_up()]),
        (|limits| &mut limits.braking_nm, [0.0, rated.braking_nm], [-least, rated.braking_nm.next_up()]),
        (|limits| &mut limits.speed_rad_s, [least, rated.speed_rad_s], [0.0, rated.speed_rad_s.next_up()]),
        (
            |limits| &mut limits.link_low_v,
            [rated.link_low_v, rated.link_high_v.next_down()],
            [rated.link_low_v.next_down(), rated.link_high_v],
        ),
        (
            |limits| &mut limits.link_high_v,
            [rated.link_low_v.next_up(), rated.link_high_v],
            [rated.link_low_v, rated.link_high_v.next_up()],
        ),
    ];
    for (field, allowed, refused) in fields {
        for (value, refusals) in
            allowed.into_iter().map(|value| (value, 0)).chain(refused.map(|value| (value, 1)))
        {
            let mut world = World::charged();
            *field(&mut world.request.limits) = value;
            world.slot();
            assert_eq!(world.output().status.refusals, refusals, "{value}");
        }
    }
    // Not a number, in each value by itself.
    let all: [fn(&mut Request) -> &mut f32; 6] = [
        |request| &mut request.torque_nm,
        |request| &mut request.limits.motoring_nm,
        |request| &mut request.limits.braking_nm,
        |request| &mut request.limits.speed_rad_s,
        |request| &mut request.limits.link_low_v,
        |request| &mut request.limits.link_high_v,
    ];
    for field in all {
        let mut world = World::charged();
        *field(&mut world.request) = f32::NAN;
        world.slot();
        assert_eq!(world.refusal(), Some(Refusal::RequestNotFinite));
    }
}

/// Levels of a link of 1,000 to 1,800 V that trips at 850 and 2,070 V: motoring ends half way to the lower one; braking ends at 0.6 of the way
/// to the upper one and fades over half of that; the line's voltage ends motoring sooner.
#[test]
fn the_window_of_the_link_is_that_of_the_ratings_and_of_the_line() {
    let mut world = World::enabled();
    world.source_v = 1_000.0;
    world.slots(30_000);
    let Ratings { dc_link_min_v, dc_link_max_v, trip_dc_under_v, trip_dc_over_v, .. } = *RATINGS;
    let (below, above) = (dc_link_min_v - trip_dc_under_v, trip_dc_over_v - dc_link_max_v);
    let window = world.output().command.window;
    let near = |found: f32, wanted: f32| assert!((found - wanted).abs() < 0.01, "{found} {wanted}");
    near(window.motoring_none_v, dc_link_min_v - 0.5 * below);
    near(window.motoring_full_v, dc_link_min_v);
    near(window.braking_none_v, dc_link_max_v + 0.6 * above);
    near(window.braking_full_v, dc_link_max_v + 0.3 * above);
    let mut world = World::enabled();
    world.slots(10);
    let window = world.output().command.window;
    near(window.motoring_none_v, 0.85 * 1_500.0);
    near(window.motoring_full_v, 0.95 * 1_500.0);
    // What was found at rest may have been the capacitor's own; once power has been taken, the line is forgotten with three seconds.
    take_power(&mut world);
    world.source_v = 1_400.0;
    world.slots(3_000);
    let line_v = 1_400.0 + 100.0 * (-1.0_f32).exp();
    assert!((world.output().command.window.motoring_none_v - 0.85 * line_v).abs() < 0.05);
    // It rises only while the drive takes power: by torque and speed of one sign.
    for (torque_nm, omega, rises) in
        [(10.0, 100.0, true), (-10.0, -100.0, true), (-10.0, 100.0, false), (0.0, 100.0, false)]
    {
        let mut world = World::enabled();
        take_power(&mut world);
        (world.observed.torque_nm, world.observed.omega, world.source_v) = (torque_nm, omega, 1_600.0);
        world.slots(1_000);
        let found = world.output().command.window.motoring_none_v;
        assert_eq!(found > 0.85 * 1_501.0, rises, "{torque_nm} {omega}: {found}");
    }
}

/// Power that is taken for as long as a line is doubted.
fn take_power(world: &mut World) {
    (world.observed.torque_nm, world.observed.omega) = (10.0, 100.0);
    world.slots(210);
    (world.observed.torque_nm, world.observed.omega) = (0.0, 0.0);
}

/// Half way between the two ends, half of the largest torque is left.
#[test]
fn motoring_fades_along_a_straight_line() {
    let mut world = World::enabled();
    take_power(&mut world);
    (world.observed.omega, world.request.torque_nm) = (100.0, RATINGS.max_torque_nm);
    world.slots(400);
    assert_eq!(world.output().command.demand.torque_nm, RATINGS.max_torque_nm);
    let window = world.output().command.window;
    world.source_v = 0.5 * (window.motoring_none_v + window.motoring_full_v);
    world.slots(150);
    let now = world.output().command.window;
    let share = (world.source_v - now.motoring_none_v) / (now.motoring_full_v - now.motoring_none_v);
    let wanted_nm = share * RATINGS.max_torque_nm;
    assert!((0.5..0.6).contains(&share));
    assert!((world.output().command.demand.torque_nm - wanted_nm).abs() < 2.0, "{wanted_nm}");
    // For the limits, a rotor at rest turns forward. Backward torque then brakes, yet gives nothing: the link limits it as well.
    (world.observed.omega, world.request.torque_nm) = (0.0, -1_000.0);
    world.slots(500);
    let now = world.output().command.window;
    let share = (world.source_v - now.motoring_none_v) / (now.motoring_full_v - now.motoring_none_v);
    let found_nm = world.output().command.demand.torque_nm;
    assert!((found_nm + share * RATINGS.max_torque_nm).abs() < 2.0 && found_nm > -1_000.0, "{found_nm}");
}

/// The limits in force stay in force if the values of a request are no numbers, also while the gates are off.
#[test]
fn limits_outlast_what_is_refused() {
    let mut world = World::charged();
    world.request.limits.link_high_v = 1_700.0;
    world.slots(3);
    assert_eq!(world.output().command.window.braking_none_v, 1_700.0);
    world.request.limits.motoring_nm = 1e4;
    world.slots(3);
    assert_eq!(world.output().command.window.braking_none_v, 1_700.0);
}

/// A millisecond is a slot, of whole control periods; a drive that has not started says why.
#[test]
fn a_slot_is_a_millisecond_and_a_refused_drive_says_why() {
    for control_ticks in [2_500, 1_250] {
        let slot_s = tractive::operator::slot_s(&Clock::new(25_000_000, control_ticks));
        assert!((slot_s - 1e-3).abs() < 1e-9, "{slot_s}");
    }
    let why = trip(Fault::StartRefused);
    assert_eq!(<TorqueDemand as Demands>::refused(why).trip, Some(why));
}

/// The settings' rates: 80 % of the drive's slew rate, taken up in 50 ms.
#[test]
fn the_rates_are_those_of_the_ratings() {
    let settings = World::new().settings;
    assert!((settings.slew_nm_s - 0.8 * RATINGS.torque_slew_nm_s).abs() < 1e-2);
    assert!((settings.jerk_nm_s2 / settings.slew_nm_s - 20.0).abs() < 1e-3);
    let line = settings.line.unwrap();
    assert_eq!((line.contactor_s, line.empty_v, line.precharge_s, line.discharge_s), (0.2, 60.0, 0.1, 0.1));
    let above = RATINGS.trip_dc_over_v - RATINGS.dc_link_max_v;
    assert!((line.chopper_from_v - RATINGS.dc_link_max_v - 0.05 * above).abs() < 0.01);
    assert!((line.chopper_full_v - RATINGS.dc_link_max_v - 0.25 * above).abs() < 0.01);
    // Of a small machine a fifth of its lowest voltage counts as empty, not 60 V.
    let small = Ratings { dc_link_min_v: 48.0, ..*RATINGS };
    assert!((Line::rated(&small, 0.1, 0.1).empty_v - 9.6).abs() < 1e-5);
    let without = line.without_chopper();
    assert_eq!((without.chopper_from_v, without.chopper_full_v), (f32::INFINITY, f32::INFINITY));
    assert_eq!(
        Line { chopper_from_v: line.chopper_from_v, chopper_full_v: line.chopper_full_v, ..without },
        line
    );
}

/// A world whose comfort rates are slow, at 400 N·m and on its way up.
fn comfortable() -> World {
    let mut world = World::running();
    world.observed.omega = 300.0;
    (world.settings.slew_nm_s, world.settings.jerk_nm_s2) = (500.0, 500.0);
    world.request.torque_nm = 1_200.0;
    world.slots(600);
    world
}

/// Slots until the torque of the command is 0; it never rises on the way.
fn slots_to_zero(mut world: World) -> u32 {
    let mut last_nm = world.output().command.demand.torque_nm;
    assert!(last_nm > 450.0, "{last_nm}");
    (1..10_000)
        .find(|_| {
            let output = world.slot();
            let torque_nm = if output.command.enable { output.command.demand.torque_nm } else { 0.0 };
            assert!(torque_nm <= last_nm, "{torque_nm} after {last_nm}");
            last_nm = torque_nm;
            torque_nm == 0.0
        })
        .expect("no torque in the end")
}

#[test]
fn a_torque_that_is_taken_back_never_rises_and_a_stop_needs_no_comfort() {
    let (mut released, mut coasting, mut stopping) = (comfortable(), comfortable(), comfortable());
    released.request.torque_nm = 0.0;
    coasting.request.coast = true;
    stopping.request.enable = false;
    let comfort = slots_to_zero(released);
    assert!((1_500..3_000).contains(&comfort), "{comfort}");
    assert_eq!(slots_to_zero(coasting), comfort);
    let stop = slots_to_zero(stopping);
    assert!(stop <= 120, "{stop}");
}

/// However slow the comfort rates are, no torque is left at the speed limit.
#[test]
fn the_speed_limit_holds_whatever_the_ramp() {
    for direction in [1.0, -1.0] {
        let mut world = comfortable();
        world.request.limits.speed_rad_s = 100.0;
        world.request.torque_nm *= direction;
        world.observed.omega *= direction;
        world.slots(5_000);
        assert!(world.output().status.torque_nm * direction > 1_000.0);
        for _ in 0..100 {
            world.observed.omega += direction;
            world.slot();
        }
        assert_eq!(world.output().status.torque_nm, 0.0);
    }
}

/// Each message's limits are judged by themselves, and a refusal stays named as long as its cause is there.
#[test]
fn limits_that_are_refused_keep_no_others_from_being_taken() {
    let mut world = World::charged();
    let before = world.output().command.window;
    world.request.limits.link_high_v = 3_000.0;
    world.slot();
    world.request.limits.motoring_nm = 100.0;
    world.request.limits.link_low_v = 1_200.0;
    world.request.with_torque = true;
    world.request.torque_nm = 600.0;
    world.edge(|request, level| request.enable = level);
    world.slots(300);
    let Status { torque_nm, refusal, state, .. } = world.output().status;
    assert_eq!((torque_nm, state), (100.0, State::Running));
    assert_eq!((refusal, world.output().command.window), (Some(Refusal::LimitOutOfRange), before));
    world.request.limits.motoring_nm = f32::NAN;
    world.slot();
    world.request.limits = Limits { motoring_nm: -1.0, link_low_v: 1_200.0, ..Limits::rated(RATINGS) };
    world.slots(300);
    assert_eq!(world.output().status.torque_nm, 100.0, "the last good one");
    assert_eq!(world.output().command.window.motoring_none_v, 1_275.0);
    world.request.limits.motoring_nm = 200.0;
    world.edge(|request, level| request.calibrate = level);
    assert_eq!(world.refusal(), Some(Refusal::TorqueNotZero), "of a command, until the next");
}
