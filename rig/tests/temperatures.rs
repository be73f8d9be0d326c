//! Temperatures in closed loop, machine and inverter warming by their losses: derating holds any part that would get too hot, a lost
//! sensor stops the drive by name and in time, and the magnets' estimate is judged. Time constants are scaled to seconds, some hundredth
//! of a machine's.

mod stiff;

use tractive::operator::{Line, Request, State};
use tractive::protection::Fault;
use tractive::thermal::{Derating, Magnets, PERSISTENCE_S, Rise, Temperatures, Thermal};
use tractive::time::Instant;
use tractive_rig::bench::{LinePlan, Simulated};
use tractive_rig::machine::Machine;
use tractive_rig::plant::{
    DcLinkSettings, Heat, HeatSettings, Node, Plant, PlantSettings, Source, SpeedSource, Wire,
};
use tractive_rig::run::Interrupts;
use tractive_rig::trace::{Recorded, Recording, SlotRow};
use tractive_rig::warmth::{LOSSES, NTC, PT1000};

const WINDING: (f64, f64) = (5e-3, 0.5);
const JUNCTION: (f64, f64) = (0.06, 0.1);

const THERMAL: Thermal = Thermal {
    winding_sensor: PT1000,
    heat_sink_sensor: NTC,
    resistance_ohm: 0.1,
    winding: Rise { k_per_w: WINDING.0 as f32, time_s: WINDING.1 as f32 },
    junction: Rise { k_per_w: JUNCTION.0 as f32, time_s: JUNCTION.1 as f32 },
    losses: LOSSES,
    winding_derating: Derating { from_c: 140.0, none_c: 160.0 },
    winding_trip_c: 175.0,
    junction_derating: Derating { from_c: 110.0, none_c: 125.0 },
    junction_trip_c: 140.0,
    magnets: Some(Magnets { per_k: -1e-3, map_c: 20.0, derating: Derating { from_c: 150.0, none_c: 180.0 } }),
};

/// A winding that may be hotter than any here.
const BEARING: Thermal =
    Thermal { winding_derating: Derating { from_c: 240.0, none_c: 260.0 }, winding_trip_c: 280.0, ..THERMAL };

/// A stator that the largest current would warm by 250 K, and a heat sink that it would hardly warm.
const HEAT: HeatSettings = HeatSettings {
    coolant_c: 40.0,
    hottest: Node { j_per_k: WINDING.1 / WINDING.0, k_per_w: WINDING.0 },
    stator: Node { j_per_k: 100.0, k_per_w: 0.02 },
    junction: Node { j_per_k: JUNCTION.1 / JUNCTION.0, k_per_w: JUNCTION.0 },
    heat_sink: Node { j_per_k: 200.0, k_per_w: 5e-3 },
    losses: LOSSES,
    magnets_per_k: 0.0,
    magnets_c: 20.0,
    sensors: [PT1000, NTC],
};

const LINK: DcLinkSettings = DcLinkSettings {
    capacitance_f: 6e-3,
    source: Source {
        voltage_v: 1_500.0,
        resistance_ohm: 0.05,
        inductance_h: 0.0,
        reversible: true,
        live: true,
    },
    precharge_ohm: 50.0,
    discharge_ohm: 100.0,
    auxiliary_ohm: f64::INFINITY,
    chopper_ohm: 12.0,
};
/// Step of the trace, in s: rows a millisecond apart fall on five places of the torque's ripple at 2,000 r/min, and their mean is 3 % off.
const TRACE_STEP_S: f64 = 1e-4;
/// Charged, enabled, torque asked for, in s.
const TORQUE_S: f64 = 0.4;

struct Run {
    rpm: f64,
    torque_nm: f64,
    /// Time from which on the torque is asked for, in s.
    from_s: f64,
    duration_s: f64,
    heat: Heat,
    thermal: Option<&'static Thermal>,
    /// True flux linkage over the map's, whatever the temperature.
    flux_scale: f64,
}

/// The run's recording, its warmth at the end, and the operator's temperatures in each slot.
fn run(run: Run) -> (Recording, Heat) {
    let Run { rpm, torque_nm, from_s, duration_s, heat, thermal, flux_scale } = run;
    let machine = Machine::load("pmasynrm-180kw").unwrap();
    let ratings = &machine.tables.ratings;
    let speed = SpeedSource::profile(vec![(0.0, rpm)]);
    let plant = Plant::new(&machine.folder, speed, &PlantSettings { flux_scale, ..PlantSettings::default() });
    let request = move |t_s: f64| Request {
        charge: (0.1..0.2).contains(&t_s),
        enable: t_s >= 0.3,
        torque_nm: if t_s >= from_s { torque_nm as f32 } else { 0.0 },
        ..Request::idle(ratings)
    };
    let plan = LinePlan { starts_charged: true, heat: Some(heat), ..LinePlan::new(LINK, Box::new(request)) };
    let nothing = |_: f64| (tractive::control::Demand::default(), true);
    let timing = stiff::Run { lead_s: 0.0, duration_s, trace_step_s: TRACE_STEP_S, udc_v: 1_500.0 };
    let mut bench = stiff::bench(&machine, plant, nothing, timing).without_edges().with_line(Some(plan));
    let line = Line::rated(ratings, (50.0 * 6e-3) as f32, (100.0 * 6e-3) as f32);
    let mut tasks = stiff::tasks(&machine, Instant(0)).operated_on(Some(line)).warmed_by(thermal);
    tasks.drive(&mut bench, |_| true).unwrap();
    let heat = bench.heat().unwrap().clone();
    (bench.into_recording(Vec::new()), heat)
}

fn told(recording: &Recording) -> Temperatures {
    recording.slots.last().unwrap().status.temperatures.unwrap()
}

/// Mean torque over the last tenth of a second, in N·m.
fn last_nm(recording: &Recording) -> f64 {
    let last = &recording.rows[recording.rows.len() - 1_000..];
    last.iter().map(|row| row.te_nm).sum::<f64>() / last.len() as f64
}

/// Mean reported share of torque over the same time: a sensor's conversion has steps, and the share goes to and fro between two of them.
fn last_share(recording: &Recording) -> f64 {
    let last = &recording.slots[recording.slots.len() - 1_000..];
    let shares = last.iter().map(|slot| f64::from(slot.status.temperatures.unwrap().torque_share));
    shares.sum::<f64>() / last.len() as f64
}

/// Full torque for twenty of the stator's time constants.
fn overload(thermal: Option<&'static Thermal>) -> (Recording, Heat) {
    let heat = Heat::new(HEAT);
    run(Run {
        rpm: 500.0,
        torque_nm: 1_235.0,
        from_s: TORQUE_S,
        duration_s: 15.0,
        heat,
        thermal,
        flux_scale: 1.0,
    })
}

#[test]
fn a_long_overload_derates_and_trips_nothing() {
    let (hot, heat) = overload(None);
    let [unheeded_c, _] = heat.highest_c;
    assert!(hot.trip().is_none() && unheeded_c > 250.0, "nobody looks: {unheeded_c} °C");
    let (recording, heat) = overload(Some(&THERMAL));
    let told_c = told(&recording).winding_c;
    let ([winding_c, junction_c], torque_nm) = (heat.highest_c, last_nm(&recording));
    let torque_share = last_share(&recording);
    println!(
        "without derating {unheeded_c:.0} °C; with it {winding_c:.1} °C at most, junctions {junction_c:.1} °C, in the end {:.1} °C, told {told_c:.1} °C, {torque_nm:.0} N·m, a share of {torque_share:.3}",
        heat.hottest_c
    );
    assert!(recording.trip().is_none());
    assert!(recording.slots.last().unwrap().status.state == State::Running);
    assert!(winding_c < f64::from(THERMAL.winding_derating.none_c), "{winding_c} °C");
    assert!((f64::from(told_c) - heat.hottest_c).abs() < 2.0, "{told_c} °C told of {} °C", heat.hottest_c);
    assert!((torque_nm / 1_235.0 - torque_share).abs() < 0.01 && torque_share > 0.3);
}

/// With the rotor blocked at full torque, one phase carries the peak of the current: its junction is the one that is reported.
#[test]
fn a_blocked_rotor_is_held_by_its_hottest_junction() {
    // No stator that gets hot, and a heat sink that does.
    let stator = Node { k_per_w: 1e-3, ..HEAT.stator };
    let heat_sink = Node { k_per_w: 0.04, ..HEAT.heat_sink };
    let heat = Heat::new(HeatSettings { stator, heat_sink, ..HEAT });
    let blocked = Run {
        rpm: 0.0,
        torque_nm: 1_235.0,
        from_s: TORQUE_S,
        duration_s: 15.0,
        heat,
        thermal: Some(&THERMAL),
        flux_scale: 1.0,
    };
    let (recording, heat) = run(blocked);
    let Temperatures { junction_c: told_c, torque_share, .. } = told(&recording);
    let [_, junction_c] = heat.highest_c;
    println!("junction {junction_c:.1} °C at most, told {told_c:.1} °C, a share of {torque_share:.3}");
    assert!(recording.trip().is_none() && torque_share < 0.9);
    assert!(junction_c < f64::from(THERMAL.junction_derating.none_c));
    let hottest_c = heat.junctions_c.into_iter().fold(f64::MIN, f64::max);
    assert!((f64::from(told_c) - hottest_c).abs() < 3.0, "{told_c} °C told of {hottest_c} °C");
}

/// Each sensor unplugged, shorted and beyond both ends of its range, while the drive runs at full torque.
#[test]
fn a_lost_sensor_stops_the_drive_by_its_own_name_in_time() {
    const LOST_S: f64 = 0.6;
    for wire in [Wire::Unplugged, Wire::Shorted, Wire::Shows(-45.0), Wire::Shows(230.0)] {
        for (place, fault) in [(0, Fault::WindingSensor), (1, Fault::HeatSinkSensor)] {
            let mut wires = [Wire::Sound; 2];
            wires[place] = wire;
            let heat = Heat::new(HEAT).wired(vec![(LOST_S, wires)]);
            let lost = Run {
                rpm: 1_000.0,
                torque_nm: 1_235.0,
                from_s: TORQUE_S,
                duration_s: 0.8,
                heat,
                thermal: Some(&THERMAL),
                flux_scale: 1.0,
            };
            let (recording, _) = run(lost);
            let tripped = |row: &&SlotRow| row.status.trip.is_some();
            let SlotRow { t_s, status } = recording.slots.iter().find(tripped).expect("a trip");
            assert_eq!(status.trip.unwrap().fault, fault, "{wire:?}");
            let after_s = t_s - LOST_S;
            assert!(after_s > 0.0 && after_s < f64::from(PERSISTENCE_S) + 3e-3, "{wire:?}: {after_s} s");
            let last = recording.edges.iter().rfind(|edge| edge.on);
            assert!(last.is_none_or(|edge| recording.seconds(edge.tick) < t_s + 2e-3));
            assert!(last_nm(&recording).abs() < 1.0);
        }
    }
}

/// The reported temperature of the magnets and the torque, with the gates on at 2,000 r/min and the magnets at a temperature.
fn magnets(magnets_c: f64, torque_nm: f64, flux_scale: f64) -> (Option<f32>, f64) {
    let heat = Heat::new(HeatSettings { magnets_c, magnets_per_k: -1e-3, ..HEAT });
    let (recording, _) = run(Run {
        rpm: 2_000.0,
        torque_nm,
        from_s: TORQUE_S,
        duration_s: 3.0,
        heat,
        thermal: Some(&THERMAL),
        flux_scale,
    });
    assert!(recording.trip().is_none());
    (told(&recording).magnets_c, last_nm(&recording))
}

#[test]
fn magnets_are_told_without_a_current_and_not_with_one() {
    for magnets_c in [-20.0, 20.0, 80.0, 140.0] {
        let (told_c, _) = magnets(magnets_c, 0.0, 1.0);
        let told_c = f64::from(told_c.expect("an estimate"));
        println!("magnets at {magnets_c} °C: told {told_c:.1} °C");
        assert!((told_c - magnets_c).abs() < 5.0);
    }
    assert_eq!(magnets(80.0, 600.0, 1.0).0, None);
    // A flux linkage that is 1 % off for another reason shows as 10 K.
    let told_c = magnets(80.0, 0.0, 0.99).0.expect("an estimate");
    println!("magnets at 80 °C with 1 % less flux linkage: told {told_c:.1} °C");
    assert!((told_c - 90.0).abs() < 3.0, "{told_c} °C");
}

/// Torque in N·m after two seconds without torque, in which the drive has learned the magnets' temperature; the winding is as warm as they are.
fn warm_nm(celsius: f64, rpm: f64, torque_nm: f64) -> f64 {
    let stator = Node { j_per_k: 1e9, ..HEAT.stator };
    let mut heat = Heat::new(HeatSettings { magnets_c: celsius, magnets_per_k: -1e-3, stator, ..HEAT });
    (heat.stator_c, heat.hottest_c) = (celsius, celsius);
    let (recording, _) = run(Run {
        rpm,
        torque_nm,
        from_s: 2.4,
        duration_s: 5.0,
        heat,
        thermal: Some(&BEARING),
        flux_scale: 1.0,
    });
    assert!(recording.trip().is_none());
    last_nm(&recording)
}

/// Control knows resistance and magnets at their temperatures once the drive has coasted: torque is as demanded at any temperature, motoring and braking.
#[test]
fn torque_is_within_two_percent_at_every_temperature_that_is_known() {
    let mut worst = 0.0_f64;
    for (rpm, torque_nm) in
        [(2_000.0, 300.0), (2_000.0, 800.0), (1_000.0, -600.0), (1_000.0, 1_200.0), (4_000.0, 250.0)]
    {
        for celsius in [-20.0, 20.0, 80.0, 140.0] {
            let given_nm = warm_nm(celsius, rpm, torque_nm);
            let error = given_nm / torque_nm - 1.0;
            println!(
                "{torque_nm} N·m at {rpm} r/min and {celsius} °C: {given_nm:.1}, {:.2} %",
                100.0 * error
            );
            worst = worst.max(error.abs());
        }
    }
    assert!(worst < 0.02, "{worst}");
}

/// Magnets that have lost an eighth are known by the voltage, also where the drive has not coasted.
#[test]
fn magnets_that_have_lost_an_eighth_take_hardly_any_torque() {
    for torque_nm in [300.0, 800.0] {
        let [(_, cold_nm), (_, hot_nm)] = [20.0, 140.0].map(|magnets_c| magnets(magnets_c, torque_nm, 1.0));
        println!("{torque_nm} N·m asked: {cold_nm:.1} with cold magnets, {hot_nm:.1} with hot ones");
        assert!((hot_nm - torque_nm).abs() < 0.005 * 1_235.0 && (cold_nm - torque_nm).abs() < 0.01 * 1_235.0);
    }
}
