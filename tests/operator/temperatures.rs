//! Temperatures: sensors that are lost, torque that is reduced as parts get hot, and the trips in the end.

use crate::world::{SLOT_S, World};
use proptest::prelude::*;
use tractive::control::Warmth;
use tractive::operator::{Refusal, State};
use tractive::protection::{Fault, Trip};
use tractive::thermal::{
    Derating, DeviceLosses, Element, Load, Magnets, PERSISTENCE_S, Ratios, Rise, Sensor, Temperatures,
    Thermal, ThermalState, copper_factor,
};

const NTC_AT_25_OHM: f32 = 10e3;
const NTC_BETA_K: f32 = 3_435.0;
const SERIES_OHM: f32 = 4.7e3;

/// A PT1000 in the winding, a thermistor on the heat sink.
const THERMAL: Thermal = Thermal {
    winding_sensor: Sensor { element: Element::Pt1000, series_ohm: 1e3, range_c: [-40.0, 220.0] },
    heat_sink_sensor: Sensor {
        element: Element::Ntc { at_25_ohm: NTC_AT_25_OHM, beta_k: NTC_BETA_K },
        series_ohm: SERIES_OHM,
        range_c: [-40.0, 130.0],
    },
    resistance_ohm: 0.1,
    winding: Rise { k_per_w: 4e-3, time_s: 1.0 },
    junction: Rise { k_per_w: 0.06, time_s: 0.1 },
    losses: DeviceLosses { threshold_v: 1.0, slope_ohm: 5e-3, switching_share: 1e-3 },
    winding_derating: Derating { from_c: 140.0, none_c: 160.0 },
    winding_trip_c: 175.0,
    junction_derating: Derating { from_c: 110.0, none_c: 125.0 },
    junction_trip_c: 140.0,
    magnets: Some(Magnets { per_k: -1e-3, map_c: 20.0, derating: Derating { from_c: 120.0, none_c: 150.0 } }),
};

/// The converters' counts at these temperatures of winding and heat sink, in °C.
fn ratios(winding_c: f32, heat_sink_c: f32) -> Ratios {
    let count = |ohm: f32, series_ohm: f32| (ohm / (ohm + series_ohm) * 65_536.0).round() as u16;
    let platinum = 1e3 * (1.0 + 3.9083e-3 * winding_c - 5.775e-7 * winding_c * winding_c);
    let law = NTC_BETA_K * (1.0 / (heat_sink_c + 273.15) - 1.0 / 298.15);
    Ratios { winding: count(platinum, 1e3), heat_sink: count(NTC_AT_25_OHM * law.exp(), SERIES_OHM) }
}

fn warm(mut world: World) -> World {
    world.settings.thermal = Some(&THERMAL);
    world.feedback.temperatures = ratios(60.0, 40.0);
    world.slots(5);
    world
}

fn told(world: &World) -> Temperatures {
    world.output().status.temperatures.expect("both sensors have been read")
}

fn torque_nm(world: &World) -> f32 {
    world.output().command.demand.torque_nm
}

fn shows(world: &mut World, winding: Option<u16>, heat_sink: Option<u16>) {
    let sound = ratios(60.0, 40.0);
    world.feedback.temperatures =
        Ratios { winding: winding.unwrap_or(sound.winding), heat_sink: heat_sink.unwrap_or(sound.heat_sink) };
}

#[test]
fn without_settings_nobody_looks_at_the_sensors() {
    let mut world = World::running();
    assert_eq!((world.output().status.temperatures, torque_nm(&world)), (None, 400.0));
    shows(&mut world, Some(0), Some(u16::MAX));
    world.slots(1_000);
    assert_eq!((world.state(), torque_nm(&world)), (State::Running, 400.0));
}

/// Unplugged, shorted, too cold, too hot: each of either sensor.
#[test]
fn a_sensor_that_is_lost_is_its_own_fault_in_time_and_told_with_its_limit() {
    let slots = (PERSISTENCE_S / SLOT_S).ceil() as u32;
    let of = |winding_c, heat_sink_c| ratios(winding_c, heat_sink_c);
    let cases = [
        (Some(u16::MAX), None, Fault::WindingSensor, 220.0),
        (Some(0), None, Fault::WindingSensor, -40.0),
        (Some(of(-43.0, 40.0).winding), None, Fault::WindingSensor, -40.0),
        (Some(of(223.0, 40.0).winding), None, Fault::WindingSensor, 220.0),
        (None, Some(u16::MAX), Fault::HeatSinkSensor, -40.0),
        (None, Some(0), Fault::HeatSinkSensor, 130.0),
        (None, Some(of(60.0, -43.0).heat_sink), Fault::HeatSinkSensor, -40.0),
        (None, Some(of(60.0, 133.0).heat_sink), Fault::HeatSinkSensor, 130.0),
    ];
    for (winding, heat_sink, fault, wanted_c) in cases {
        for begin in [World::new as fn() -> World, World::ready, World::charged, World::running] {
            let mut world = warm(begin());
            shows(&mut world, winding, heat_sink);
            world.slots(slots - 1);
            assert_ne!(world.state(), State::Fault, "{fault:?}");
            world.slots(2);
            let Trip { fault: found, value, limit, .. } = world.output().status.trip.expect("a trip");
            assert_eq!((found, limit), (fault, wanted_c));
            assert!(if wanted_c < 0.0 { value < limit } else { value > limit }, "{value} of {limit}");
            let switches = world.switches();
            assert!(!world.output().command.enable && !switches.main && !switches.precharge);
            // It stays until the sensor is back.
            world.edge(|request, level| request.acknowledge = level);
            assert_eq!((world.state(), world.refusal()), (State::Fault, Some(Refusal::CauseStillPresent)));
            shows(&mut world, None, None);
            // Contactors open meanwhile.
            world.slots(50);
            world.edge(|request, level| request.acknowledge = level);
            world.until(State::Ready);
        }
    }
}

#[test]
fn a_reading_that_is_disturbed_for_a_moment_trips_nothing() {
    let mut world = warm(World::running());
    for _ in 0..100 {
        shows(&mut world, Some(u16::MAX), Some(0));
        world.slots(5);
        let before = told(&world);
        shows(&mut world, None, None);
        world.slots(1);
        assert!((told(&world).winding_c - before.winding_c).abs() < 1.0);
    }
    assert_eq!((world.state(), torque_nm(&world)), (State::Running, 400.0));
}

#[test]
fn torque_goes_with_the_winding_and_with_the_devices_in_both_directions_and_comes_back() {
    let hot: [(Ratios, f32); 4] = [
        (ratios(150.0, 40.0), 0.5),
        (ratios(155.0, 40.0), 0.25),
        (ratios(60.0, 117.5), 0.5),
        (ratios(158.0, 117.5), 0.1),
    ];
    for (shown, share) in hot {
        for sign in [1.0, -1.0] {
            let mut world = warm(World::running());
            world.request.torque_nm = sign * 1e4;
            world.slots(500);
            let full_nm = world.settings.ratings.max_torque_nm;
            assert_eq!(torque_nm(&world), sign * full_nm);
            world.feedback.temperatures = shown;
            world.slots(500);
            let left = torque_nm(&world) / (sign * full_nm);
            assert!((left - share).abs() < 0.02, "{left} of {share}");
            assert!((told(&world).torque_share - left).abs() < 1e-5);
            assert_eq!(world.state(), State::Running);
            world.feedback.temperatures = ratios(60.0, 40.0);
            world.slots(500);
            assert_eq!(torque_nm(&world), sign * full_nm);
        }
    }
}

#[test]
fn only_past_the_end_of_derating_it_trips_by_name() {
    for (shown, fault, limit_c) in [
        (ratios(177.0, 40.0), Fault::WindingTemperature, 175.0),
        (ratios(60.0, 129.0), Fault::JunctionTemperature, 140.0),
    ] {
        let mut world = warm(World::running());
        // The junction is warmer than its sink by the devices' loss.
        world.observed.current_a = if fault == Fault::JunctionTemperature { 120.0 } else { 0.0 };
        world.feedback.temperatures = shown;
        world.slots(1_000);
        let Trip { fault: found, value, limit, .. } = world.output().status.trip.expect("a trip");
        assert_eq!((found, limit), (fault, limit_c));
        assert!(value > limit);
    }
    let mut world = warm(World::running());
    world.feedback.temperatures = ratios(174.0, 125.0);
    world.slots(1_000);
    assert_eq!(told(&world).torque_share, 0.0);
    assert_ne!(world.state(), State::Fault);
}

/// The hot spot ends where copper loss and its own resistance's rise meet.
#[test]
fn losses_warm_what_has_no_sensor() {
    let mut world = warm(World::running());
    (world.observed.current_a, world.observed.squares_a2) = (150.0, 1.5 * 150.0 * 150.0);
    world.slots(20_000);
    let Temperatures { winding_c, heat_sink_c, junction_c, .. } = told(&world);
    let loss_w = 1.5 * 0.1 * copper_factor(winding_c) * 150.0 * 150.0;
    assert!((winding_c - 60.0 - 4e-3 * loss_w).abs() < 0.2, "{winding_c} °C");
    let device_w = 150.0 * (0.5 * (1.0 + 5e-3 * 150.0) + 1e-3 * world.observed.udc_v);
    assert!((heat_sink_c - 40.0).abs() < 0.1 && (junction_c - heat_sink_c - 0.06 * device_w).abs() < 0.2);
}

#[test]
fn hot_magnets_take_torque_and_trip_nothing() {
    let mut world = warm(World::running());
    (world.observed.iq_a, world.observed.map_error) = (1.0, -0.115);
    world.slots(2_000);
    let Temperatures { magnets_c, torque_share, .. } = told(&world);
    assert!((magnets_c.unwrap() - 135.0).abs() < 0.1 && (torque_share - 0.5).abs() < 0.01);
    world.observed.map_error = -0.9;
    world.slots(2_000);
    assert_eq!((world.state(), told(&world).torque_share), (State::Enabled, 0.0));
}

#[test]
fn settings_that_make_no_sense_are_refused_by_name() {
    assert_eq!(THERMAL.check(), Ok(()));
    type Spoil = fn(&mut Thermal);
    let spoils: [(Spoil, &str); 14] = [
        (|thermal| thermal.winding_sensor.series_ohm = 0.0, "thermal.sensor.series_ohm"),
        (|thermal| thermal.heat_sink_sensor.range_c = [130.0, -40.0], "thermal.sensor.lowest_c"),
        (|thermal| thermal.heat_sink_sensor.range_c[1] = 600.0, "thermal.sensor.highest_c"),
        (
            |thermal| thermal.heat_sink_sensor.element = Element::Ntc { at_25_ohm: 0.0, beta_k: 3e3 },
            "thermal.sensor.at_25_ohm",
        ),
        (
            |thermal| thermal.heat_sink_sensor.element = Element::Ntc { at_25_ohm: 1e4, beta_k: 0.0 },
            "thermal.sensor.beta_k",
        ),
        (|thermal| thermal.resistance_ohm = f32::NAN, "thermal.resistance_ohm"),
        (|thermal| thermal.winding.time_s = 0.0, "thermal.rise.time_s"),
        (|thermal| thermal.junction.k_per_w = -1.0, "thermal.rise.k_per_w"),
        (|thermal| thermal.losses.slope_ohm = -1.0, "thermal.losses.slope_ohm"),
        (|thermal| thermal.winding_derating.from_c = 160.0, "thermal.derating.from_c"),
        (|thermal| thermal.junction_derating.none_c = 1e3, "thermal.derating.none_c"),
        (|thermal| thermal.winding_trip_c = 160.0, "thermal.winding_trip_c"),
        (|thermal| thermal.junction_trip_c = f32::NAN, "thermal.junction_trip_c"),
        (|thermal| thermal.magnets.as_mut().unwrap().per_k = 1e-3, "thermal.magnets.per_k"),
    ];
    for (spoil, name) in spoils {
        let mut thermal = THERMAL;
        spoil(&mut thermal);
        assert_eq!(thermal.check().unwrap_err().name, name);
    }
}

#[test]
fn the_command_tells_the_drive_how_warm_the_machine_is() {
    let cold = World::running();
    assert_eq!(cold.output().command.warmth, Warmth::NONE, "without settings");
    let mut world = warm(World::running());
    let near =
        |found: f32, wanted: f32, step: f32| assert!((found - wanted).abs() < step, "{found}, {wanted}");
    let rated_ohm = world.settings.ratings.stator_resistance_ohm;
    let warmth = world.output().command.warmth;
    near(warmth.resistance_ratio(), 0.1 * copper_factor(told(&world).winding_c) / rated_ohm, 0.01);
    (world.observed.id_a, world.observed.iq_a, world.observed.map_error) = (0.0, 1.0, -0.1);
    world.slots(1_100);
    near(told(&world).magnets_c.expect("an estimate"), 120.0, 0.1);
    // Words of a mailbox take it along.
    assert_eq!(Warmth::from_word(warmth.word()), warmth);
}

/// Numbers as they come from broken sensors, too.
fn number(most: f32) -> impl Strategy<Value = f32> {
    prop_oneof![8 => -most..most, 1 => Just(f32::NAN), 1 => Just(f32::INFINITY)]
}

proptest! {
    /// Whatever the sensors show and the drive reports, the result is a share of the torque and temperatures that are numbers, and a sensor that
    /// is wrong for long enough is told.
    #[test]
    fn no_sequence_of_readings_leaves_what_is_promised(
        slots in proptest::collection::vec((any::<u16>(), any::<u16>(), number(1e3), number(1.0)), 1..40),
    ) {
        let mut state = ThermalState::new();
        for (winding, heat_sink, current_a, map_error) in slots {
            let load =
                Load { current_a, squares_a2: current_a * current_a, reference_a: current_a, udc_v: 1_500.0, map_error, max_current_a: 233.0 };
            for slot in 1..=10 {
                let (told, failed) = state.step(&load, Ratios { winding, heat_sink }, &THERMAL, SLOT_S);
                if let Some(Temperatures { winding_c, heat_sink_c, junction_c, torque_share, .. }) = told {
                    prop_assert!((0.0..=1.0).contains(&torque_share));
                    prop_assert!([winding_c, heat_sink_c, junction_c].into_iter().all(f32::is_finite));
                }
                let lost = THERMAL.winding_sensor.read(winding).is_err();
                if slot as f32 * SLOT_S >= PERSISTENCE_S && lost {
                    prop_assert_eq!(failed.map(|(fault, ..)| fault), Some(Fault::WindingSensor));
                }
            }
        }
    }
}
