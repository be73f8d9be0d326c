//! The ZS9's plant against what physics says.

#[path = "zs9/circuit.rs"]
mod circuit;
mod zs9;

use circuit::{Circuit, ON_OHM, ROUND_H};
use std::f64::consts::TAU;
use tractive_rig::plant::zs9::{LegGates, NetworkState, Source, Zs9Plant, Zs9Settings};
use tractive_rig::plant::{DeviceDrops, SpeedSource};
use zs9::{PERIOD_S, SOURCE_V, depth_for, machine, period, plant_at, regulated};

/// Capacitor voltage of the averaged equations: `U_c = ((1 − D) U_dc − r i_L)/(1 − 2D)`.
fn capacitor_v(duty: f64, inductor_a: f64) -> f64 {
    ((1.0 - duty) * SOURCE_V - 0.01 * inductor_a) / (1.0 - 2.0 * duty)
}

#[test]
fn steady_state_is_that_of_the_averaged_network() {
    for (loaded, duty) in [false, true].into_iter().flat_map(|l| [0.05, 0.1, 0.15, 0.2, 0.25].map(|d| (l, d)))
    {
        let rpm = [600.0, 450.0];
        let link_v = SOURCE_V / (1.0 - 2.0 * duty);
        let mut plant = plant_at(rpm, &Zs9Settings::default());
        plant.network = NetworkState::even(0.0, capacitor_v(duty, 0.0));
        let currents = if loaded { [(-10.0, 30.0), (-15.0, 40.0)] } else { [(0.0, 0.0); 2] };
        let indices = if loaded {
            [0, 1].map(|k| depth_for(currents[k], rpm[k], link_v))
        } else {
            // Without voltage at no speed there is no current at all.
            plant = plant_at([0.0; 2], &Zs9Settings::default());
            plant.network = NetworkState::even(0.0, capacitor_v(duty, 0.0));
            [(0.0, 0.0); 2]
        };
        for (motor, (id, iq)) in plant.motors.iter_mut().zip(currents) {
            motor.set_currents(id, iq);
        }
        // Depths that stay: the motors are a passive load, and the network comes to rest with its resistance.
        for _ in 0..8000 {
            period(&mut plant, indices, duty).unwrap();
        }
        plant.take_means();
        for _ in 0..2000 {
            period(&mut plant, indices, duty).unwrap();
        }
        let means = plant.take_means().unwrap();
        let expected = capacitor_v(duty, means.inductor_a);
        let error = means.capacitor_v / expected - 1.0;
        let ideal = means.link_v / link_v - 1.0;
        println!(
            "D {duty}: U_c {:.3} V, {error:+.1e} of formula; U_in {:.2} V, {ideal:+.1e} of ideal; i_L {:.2} A",
            means.capacitor_v, means.link_v, means.inductor_a
        );
        assert!(error.abs() < 1e-3 && (loaded || ideal.abs() < 1e-3));
        assert!(!loaded || means.inductor_a > 10.0, "{} A", means.inductor_a);
    }
}

/// The diodes of a bridge whose gates are off hold the link at zero if the source is gone: the motors are shorted, and no energy comes
/// from nowhere.
#[test]
fn a_shorted_source_shorts_the_motors() {
    let mut plant = plant_at([1300.0, 1000.0], &Zs9Settings::default());
    plant.network = NetworkState::even(30.0, 533.0);
    for motor in &mut plant.motors {
        motor.set_currents(-10.0, 30.0);
    }
    plant.source_v = 1.0;
    let stored = plant.stored_j();
    let peak_a = plant.motors.iter().map(|motor| motor.later_short_circuit_peak_a()).fold(0.0, f64::max);
    let (mut lowest_v, mut most_a, mut clamped) = (f64::INFINITY, 0.0_f64, false);
    for _ in 0..4_000 {
        plant.advance([LegGates::OFF; 3], 10e-6).unwrap();
        lowest_v = lowest_v.min(plant.link_v());
        clamped |= plant.link_v() < 1e-3;
        let currents = plant.motors.iter().flat_map(|motor| motor.currents_abc());
        most_a = currents.fold(most_a, |most, current| most.max(current.abs()));
    }
    let residual = plant.residual_j(stored);
    println!("{lowest_v:.1e} V, {most_a:.0} A of {peak_a:.0} A, {residual:.1e} of {stored:.0} J");
    assert!(clamped && lowest_v > -1e-3, "{lowest_v}");
    assert!(most_a > 100.0 && most_a < 1.01 * peak_a, "{most_a} of {peak_a}");
    assert!(residual.abs() < 1e-3 * stored, "{residual} of {stored}");
}

#[test]
fn energy_is_kept() {
    let machine = machine();
    let free = |load_nm| SpeedSource::Inertia { inertia_kg_m2: 0.1, load_nm };
    let mut plant = Zs9Plant::new([&machine, &machine], [free(40.0), free(-20.0)], &Zs9Settings::default());
    for (motor, rpm) in plant.motors.iter_mut().zip([500.0, -350.0]) {
        motor.set_speed_rpm(rpm);
    }
    plant.network = NetworkState::even(0.0, capacitor_v(0.2, 0.0));
    let stored = plant.stored_j();
    for k in 0..2000 {
        let motoring = [(-15.0, 40.0), (-10.0, if k < 1000 { 30.0 } else { -20.0 })];
        let indices = regulated(&plant, motoring);
        period(&mut plant, indices, 0.2).unwrap();
    }
    // The gates off for a while, then on again.
    for _ in 0..40 {
        plant.advance([LegGates::OFF; 3], PERIOD_S).unwrap();
    }
    let energies = plant.energies;
    let residual = plant.residual_j(stored);
    let [upper, lower] = plant.motors.each_ref().map(|motor| motor.energies);
    let turned_over =
        energies.source_j.abs() + upper.mechanical_j.abs() + lower.mechanical_j.abs() + upper.copper_j;
    println!("{energies:?}, {upper:?}, {lower:?}, residual {:.1e}", residual / turned_over);
    assert!(upper.mechanical_j > 100.0, "{upper:?}");
    assert!(residual.abs() < 1e-6 * turned_over, "{residual} J of {turned_over} J");
    let speed = plant.motors[0].speed_rpm() * TAU / 60.0;
    assert!(speed > 0.0 && plant.time_s() > 0.2);
}

#[test]
fn an_illegal_state_is_refused_and_nothing_happens() {
    let mut plant = plant_at([500.0; 2], &Zs9Settings::default());
    plant.advance([LegGates::ZERO; 3], 30e-6).unwrap();
    let before = (plant.time_s(), plant.network, plant.motors[0].currents_dq());
    let lonely = LegGates { low: true, ..LegGates::OFF };
    let refused = plant.advance([LegGates::ONE, LegGates::ZERO, lonely], 30e-6).unwrap_err();
    assert_eq!((refused.leg, refused.gates, refused.time_s), ('w', lonely, plant.time_s()));
    assert_eq!(before, (plant.time_s(), plant.network, plant.motors[0].currents_dq()));
}

#[test]
fn with_all_gates_off_the_load_gives_its_energy_back() {
    let mut plant = plant_at([0.0; 2], &Zs9Settings::default());
    for (motor, current) in plant.motors.iter_mut().zip([(40.0, 60.0), (-30.0, 50.0)]) {
        motor.set_currents(current.0, current.1);
    }
    let (stored, field) = (plant.stored_j(), plant.motors.iter().map(|motor| motor.field_j()).sum::<f64>());
    for _ in 0..30 {
        plant.advance([LegGates::OFF; 3], PERIOD_S).unwrap();
    }
    let left =
        plant.motors.iter().flat_map(|motor| motor.currents_abc()).fold(0.0_f64, |m, i| m.max(i.abs()));
    // The link takes it in; the network gives it to the source.
    let given: f64 = plant.motors.iter().map(|motor| -motor.energies.electrical_j).sum();
    let residual = plant.residual_j(stored);
    println!(
        "{field:.3} J in the fields, {given:.3} J given back, {left:.2} A left, residual {residual:.1e} J"
    );
    assert!(left < 1.0 && given > 0.95 * field && given < field, "{left} A, {given} J of {field} J");
    assert!(residual.abs() < 1e-6 * field, "{residual} J");
    for _ in 0..2000 {
        plant.advance([LegGates::OFF; 3], PERIOD_S).unwrap();
    }
    assert!(plant.energies.source_j < -0.8 * given, "{:?}", plant.energies);
}

#[test]
fn with_all_gates_off_nothing_flows_below_the_link_and_something_above() {
    let flowing = |rpm: [f64; 2]| {
        let mut plant = plant_at(rpm, &Zs9Settings::default());
        for _ in 0..2000 {
            plant.advance([LegGates::OFF; 3], PERIOD_S).unwrap();
        }
        let peak = |k: usize| plant.motors[k].currents_abc().into_iter().fold(0.0_f64, |m, i| m.max(i.abs()));
        ([peak(0), peak(1)], plant.energies.source_j)
    };
    // Line EMF of a motor at its highest speed: 359 V, below 400 V.
    let (below, _) = flowing([1500.0, 0.0]);
    let (above, source_j) = flowing([0.0, 2500.0]);
    // Through the middle diodes the motors are in series; together they exceed the link.
    let (together, together_j) = flowing([1500.0, -1500.0]);
    println!(
        "{below:.2?} A below; {above:.2?} A above, {source_j:.0} J; {together:.2?} A together, {together_j:.0} J"
    );
    assert!(below.iter().all(|peak| *peak < 1.5), "{below:?}");
    assert!(above[1] > 10.0 && source_j < -10.0, "{above:?} {source_j}");
    assert!(together.iter().all(|peak| *peak > 5.0) && together_j < -10.0, "{together:?} {together_j}");
}

#[test]
fn finer_calls_change_nothing() {
    let run = |pieces: u32| {
        let mut plant = plant_at([1300.0, -900.0], &Zs9Settings::default());
        plant.network = NetworkState::even(20.0, capacitor_v(0.2, 20.0));
        let link_v = plant.link_v();
        let currents = [(-40.0, 30.0), (-20.0, -45.0)];
        let indices = [0, 1].map(|k| depth_for(currents[k], [1300.0, -900.0][k], link_v));
        for (motor, (id, iq)) in plant.motors.iter_mut().zip(currents) {
            motor.set_currents(id, iq);
        }
        for k in 0..500 {
            let turns = f64::from(k) * PERIOD_S * 4.0 / 60.0 * TAU;
            let at = |motor: usize, rpm: f64| {
                let (d, q) = indices[motor];
                (d.hypot(q), q.atan2(d) + turns * rpm)
            };
            for (gates, share) in zs9::pattern(at(0, 1300.0), at(1, -900.0), 0.2) {
                for _ in 0..pieces {
                    plant.advance(gates, share * PERIOD_S / f64::from(pieces)).unwrap();
                }
            }
        }
        let [upper, lower] = plant.motors.each_ref().map(|motor| motor.currents_dq());
        [upper.0, upper.1, lower.0, lower.1, plant.network.capacitor_v(), plant.network.inductor_a()]
    };
    let (coarse, fine) = (run(1), run(8));
    let worst = coarse.iter().zip(fine).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    println!("{coarse:.3?}, worst difference {worst:.1e}");
    // A ten-millionth of the voltage; it shrinks with the fourth power of the pieces.
    assert!(worst < 1e-4, "{coarse:?} {fine:?}");
}

#[test]
fn a_saturated_machine_keeps_its_energy_too() {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../tables/pmasynrm-180kw");
    let saturated = tractive_tablegen::MachineFolder::read(&folder).unwrap();
    let speeds = [600.0, -300.0].map(zs9::turning);
    let mut plant = Zs9Plant::new([&saturated, &machine()], speeds, &Zs9Settings::default());
    plant.network = NetworkState::even(0.0, capacitor_v(0.15, 0.0));
    let stored = plant.stored_j();
    for _ in 0..2000 {
        period(&mut plant, [(-0.28, 0.2), (-0.01, -0.14)], 0.15).unwrap();
    }
    let (residual, upper) = (plant.residual_j(stored), plant.motors[0].energies);
    println!("{upper:?}, {:?}, residual {residual:.1e} J", plant.motors[0].currents_dq());
    assert!(upper.mechanical_j.abs() > 100.0 && residual.abs() < 1e-4 * upper.mechanical_j.abs());
}

#[test]
fn means_are_those_of_the_span() {
    let rpm = [800.0, 500.0];
    let mut plant = plant_at(rpm, &Zs9Settings::default());
    assert_eq!(plant.take_means(), None);
    plant.network = NetworkState::even(10.0, 530.0);
    for motor in &mut plant.motors {
        motor.set_currents(-10.0, 30.0);
    }
    let mut sums = [0.0; 3];
    const PIECES: u32 = 2000;
    for _ in 0..PIECES {
        plant.advance([LegGates::ONE, LegGates::ONE, LegGates::ZERO], 20e-6 / f64::from(PIECES)).unwrap();
        let motor = &plant.motors[0];
        sums[0] += motor.currents_abc()[1];
        sums[1] += motor.currents_dq().1;
        sums[2] += plant.link_v();
    }
    let mut at_once = plant_at(rpm, &Zs9Settings::default());
    at_once.network = NetworkState::even(10.0, 530.0);
    for motor in &mut at_once.motors {
        motor.set_currents(-10.0, 30.0);
    }
    at_once.advance([LegGates::ONE, LegGates::ONE, LegGates::ZERO], 20e-6).unwrap();
    let means = at_once.take_means().unwrap();
    let motor = means.motors[0];
    for (mean, sum) in [motor.phases_a[1], motor.iq_a, means.link_v].into_iter().zip(sums) {
        // The sum is over the pieces' ends.
        assert!((mean - sum / f64::from(PIECES)).abs() < 2e-3, "{mean} {sum}");
    }
    let worked = at_once.motors[0].energies.mechanical_j;
    assert!((motor.torque_nm * motor.speed_rpm * TAU / 60.0 * 20e-6 / worked - 1.0).abs() < 1e-9);
    assert_eq!(at_once.take_means(), None);
}

#[test]
fn unevenness_of_the_network_rings_by_itself() {
    // L dΔi/dt = Δv − r Δi, C dΔv/dt = −Δi, in shoot-through and outside.
    let mut plant = plant_at([400.0; 2], &Zs9Settings::default());
    plant.network = NetworkState { inductors_a: [3.0, 1.0], capacitors_v: [560.0, 500.0] };
    let stored = plant.stored_j();
    let decay = 0.5_f64 * 0.01 / 0.5e-3;
    let omega = f64::sqrt(1.0 / (0.5e-3 * 500e-6) - decay * decay);
    let mut worst = 0.0_f64;
    for _ in 0..200 {
        period(&mut plant, [(0.05, 0.1), (0.0, 0.15)], 0.2).unwrap();
        let t = plant.time_s();
        // Δv̇(0) = −Δi/C.
        let (sin, cos) = (omega * t).sin_cos();
        let expected = (-decay * t).exp() * (60.0 * cos + (60.0 * decay - 2.0 / 500e-6) / omega * sin);
        let [v1, v2] = plant.network.capacitors_v;
        worst = worst.max((v1 - v2 - expected).abs());
    }
    let residual = plant.residual_j(stored) / plant.energies.source_j;
    println!("off by {worst:.1e} V, residual {residual:.1e}");
    assert!(worst < 1e-3 && residual.abs() < 1e-6, "{worst} V, {residual}");
}

#[test]
fn the_folder_weakens_the_field_where_the_inverter_runs_out_of_voltage() {
    use tractive::control::{Region, VoltageLimit, operating_point};
    let tables = tractive_rig::machine::Machine::load("ipm-zs9").unwrap().tables;
    let ratings = &tables.ratings;
    // U_c of 400 V and 533 V: base speed at 120 N·m is 677 and 906 r/min.
    for (link_v, base_rpm) in [(ratings.dc_link_min_v, 677.0), (ratings.dc_link_nominal_v, 906.0)] {
        let limit = VoltageLimit { udc_v: link_v, modulation_index: 1.0, filled: false };
        let region = |rpm: f32| operating_point(120.0, rpm * 4.0 * 0.104_72, &limit, tables).region;
        let from = (500_u16..1100).find(|rpm| region(f32::from(*rpm)) != Region::Mtpa).unwrap();
        println!("{link_v} V: weakened from {from} r/min");
        assert!((f32::from(from) - base_rpm).abs() < 0.015 * base_rpm, "{from}");
    }
    // The equivalent of U_c/(2 √3) in six-step.
    let capacitor_v = [400.0, 533.333, 600.0_f32];
    let links_v = [ratings.dc_link_min_v, ratings.dc_link_nominal_v, ratings.dc_link_max_v];
    for (link_v, capacitor_v) in links_v.into_iter().zip(capacitor_v) {
        let (six_step_v, available_v) = (tractive::frames::six_step_v(link_v), capacitor_v / 12.0_f32.sqrt());
        assert!((six_step_v / available_v - 1.0).abs() < 1e-3, "{six_step_v} {available_v}");
    }
}

/// Resistances of the switches, and nothing else.
const OHMIC: DeviceDrops = DeviceDrops { igbt_v: 0.0, igbt_ohm: ON_OHM, diode_v: 0.0, diode_ohm: ON_OHM };

/// Motors of round rotors at prescribed speeds, with devices of these drops.
fn round_plant(rpm: [f64; 2], drops: DeviceDrops) -> Zs9Plant {
    let mut machine = machine();
    let columns = machine.map.iq_a.clone();
    let rows = machine.map.id_a.len();
    machine.map.psi_q_wb = (0..rows).flat_map(|_| columns.iter().map(|iq_a| ROUND_H * iq_a)).collect();
    let settings = Zs9Settings { drops, ..Zs9Settings::default() };
    Zs9Plant::new([&machine, &machine], rpm.map(zs9::turning), &settings)
}

/// Against a nodal simulation with every switch a resistor of 5 mΩ, from the same pulses and the same beginning. Without these resistances the
/// capacitors' voltage is 0.3 % off.
#[test]
fn with_resistive_switches_the_network_is_that_of_the_circuit() {
    const RPM: [f64; 2] = [500.0, 420.0];
    let duty = 0.2;
    let (id, iq) = (-10.0, 55.0);
    let indices = RPM.map(|rpm| {
        let omega = rpm * TAU / 60.0 * 4.0;
        let (ud, uq) = (0.12 * id - omega * ROUND_H * iq, 0.12 * iq + omega * (0.33 + ROUND_H * id));
        (ud.hypot(uq) * 2.0 / 667.0, uq.atan2(ud))
    });
    let start = NetworkState::even(45.0, 533.0);
    let [mut ideal, mut plant] = [DeviceDrops::NONE, OHMIC].map(|drops| round_plant(RPM, drops));
    for plant in [&mut ideal, &mut plant] {
        plant.network = start;
        plant.motors.iter_mut().for_each(|motor| motor.set_currents(id, iq));
    }
    let state = circuit::State::from([45.0, 45.0, 533.0, 533.0, id, iq, id, iq]);
    let mut circuit = Circuit { state, time_s: 0.0, rpm: RPM };
    let (mut sums, mut periods) = ([0.0; 3], 0.0);
    for k in 0..4_000_u32 {
        let middle_s = (f64::from(k) + 0.5) * PERIOD_S;
        let at = |motor: usize| {
            let (m, ahead) = indices[motor];
            (m, ahead + RPM[motor] * TAU / 60.0 * 4.0 * middle_s)
        };
        for (gates, share) in zs9::pattern(at(0), at(1), duty) {
            circuit.advance(&gates, share * PERIOD_S);
            plant.advance(gates, share * PERIOD_S).unwrap();
            ideal.advance(gates, share * PERIOD_S).unwrap();
        }
        if k >= 2_000 {
            let found = [circuit.state[2], plant.network.capacitors_v[0], ideal.network.capacitors_v[0]];
            sums.iter_mut().zip(found).for_each(|(sum, found)| *sum += found);
            periods += 1.0;
        }
    }
    let [by_nodes, found, ideal] = sums.map(|sum| sum / periods);
    println!("U_c {by_nodes:.3} V by nodes, {found:.3} V, without resistances {ideal:.3} V");
    assert!((found / by_nodes - 1.0).abs() < 1e-4, "{found} V, {by_nodes} V");
    assert!((ideal / by_nodes - 1.0).abs() > 1e-3, "{ideal} V, {by_nodes} V");
    for (k, motor) in plant.motors.iter().enumerate() {
        let (alpha, beta) = (circuit.state[4 + 2 * k], circuit.state[5 + 2 * k]);
        let [a, b, _] = motor.currents_abc();
        let wanted = [alpha, -0.5 * alpha + 0.75_f64.sqrt() * beta];
        println!("motor {k}: {a:.3} A, {b:.3} A; by nodes {wanted:.3?} A");
        assert!((a - wanted[0]).abs() < 0.02 && (b - wanted[1]).abs() < 0.02, "{a} A, {b} A, {wanted:?} A");
    }
    let inductors = plant.network.inductors_a;
    assert!((inductors[0] - circuit.state[0]).abs() < 0.02, "{inductors:?} A, {} A", circuit.state[0]);
}

/// With thresholds and slopes, and several legs that short the link at once: the power taken by the devices is heat, and none is lost.
#[test]
fn energy_is_kept_with_drops() {
    let drops = DeviceDrops { igbt_v: 1.5, igbt_ohm: 0.01, diode_v: 1.0, diode_ohm: 0.006 };
    let mut plant = round_plant([800.0, -500.0], drops);
    plant.network = NetworkState::even(0.0, capacitor_v(0.2, 0.0));
    let stored = plant.stored_j();
    for k in 0..2_000 {
        let indices = regulated(&plant, [(-10.0, 40.0), (-5.0, if k < 1_000 { 30.0 } else { -20.0 })]);
        period(&mut plant, indices, 0.2).unwrap();
        if k % 10 == 0 {
            plant.advance([LegGates::SHOOT_THROUGH, LegGates::SHOOT_THROUGH, LegGates::ONE], 1e-6).unwrap();
        }
    }
    let (residual, energies) = (plant.residual_j(stored), plant.energies);
    println!("{energies:?}, residual {residual:.1e} J");
    assert!(energies.devices_j > 10.0 && energies.devices_j < 0.05 * energies.source_j.abs().max(2_000.0));
    assert!(residual.abs() < 1e-4 * energies.devices_j, "{residual} J");
}

/// While the source's diode blocks, the link stands at the voltage of the network's own equation: `U_in = v1 + v2 − u_s`, `2 u_s = L d(i1 + i2)/dt +
/// v1 + v2 + r (i1 + i2)`.
#[test]
fn while_the_sources_diode_blocks_the_link_is_the_networks() {
    let mut plant = plant_at([0.0; 2], &Zs9Settings { source: Source::Diode, ..Zs9Settings::default() });
    plant.network = NetworkState::even(17.0, 533.0);
    plant.motors[0].set_currents(40.0, 0.0);
    let gates = [LegGates::ONE, LegGates::ZERO, LegGates::ZERO];
    const STEP_S: f64 = 1e-6;
    let sum = |plant: &Zs9Plant| plant.network.inductors_a.iter().sum::<f64>();
    let (mut blocked, mut shorted) = (0, 0);
    for _ in 0..40 {
        let before_a = sum(&plant);
        plant.advance(gates, 0.5 * STEP_S).unwrap();
        let (link_v, capacitors_v) = (plant.bridge_v(), 2.0 * plant.network.capacitor_v());
        let middle_a = sum(&plant);
        plant.advance(gates, 0.5 * STEP_S).unwrap();
        let rate_v = 0.5e-3 * (sum(&plant) - before_a) / STEP_S;
        let by_network_v = capacitors_v - 0.5 * (rate_v + capacitors_v + 0.01 * middle_a);
        if link_v == 0.0 {
            shorted += 1;
        } else if blocked > 0 || (link_v - by_network_v).abs() < 1.0 {
            blocked += 1;
            assert!((link_v - by_network_v).abs() < 0.1, "{link_v} V, {by_network_v} V");
            // As far below what capacitors and source say as the diode takes.
            assert!(link_v < plant.link_v() - 10.0, "{link_v} V, {} V", plant.link_v());
        }
    }
    println!("{shorted} steps shorted by diodes, {blocked} blocked, the link at {:.1} V", plant.bridge_v());
    assert!(shorted > 0 && blocked > 30, "{shorted}, {blocked}");
}
