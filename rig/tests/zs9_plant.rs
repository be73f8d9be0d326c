//! The ZS9's plant against what physics says.

mod zs9;

use std::f64::consts::TAU;
use tractive_rig::plant::SpeedSource;
use tractive_rig::plant::zs9::{LegGates, NetworkState, Zs9Plant, Zs9Settings};
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
        plant.set_network(NetworkState::even(0.0, capacitor_v(duty, 0.0)));
        let currents = if loaded { [(-10.0, 30.0), (-15.0, 40.0)] } else { [(0.0, 0.0); 2] };
        let depths = if loaded {
            [0, 1].map(|k| depth_for(currents[k], rpm[k], link_v))
        } else {
            // Without voltage at no speed there is no current at all.
            plant = plant_at([0.0; 2], &Zs9Settings::default());
            plant.set_network(NetworkState::even(0.0, capacitor_v(duty, 0.0)));
            [(0.0, 0.0); 2]
        };
        for (motor, (id, iq)) in plant.motors_mut().iter_mut().zip(currents) {
            motor.set_currents(id, iq);
        }
        // Depths that stay: the motors are a passive load, and the network comes to rest with its resistance.
        for _ in 0..8000 {
            period(&mut plant, depths, duty).unwrap();
        }
        plant.take_means();
        for _ in 0..2000 {
            period(&mut plant, depths, duty).unwrap();
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

#[test]
fn energy_is_kept() {
    let machine = machine();
    let free = |load_nm| SpeedSource::Inertia { inertia_kg_m2: 0.1, load_nm };
    let mut plant = Zs9Plant::new([&machine, &machine], [free(40.0), free(-20.0)], &Zs9Settings::default());
    for (motor, rpm) in plant.motors_mut().iter_mut().zip([500.0, -350.0]) {
        motor.set_speed_rpm(rpm);
    }
    plant.set_network(NetworkState::even(0.0, capacitor_v(0.2, 0.0)));
    let stored = plant.stored_j();
    for k in 0..2000 {
        let motoring = [(-15.0, 40.0), (-10.0, if k < 1000 { 30.0 } else { -20.0 })];
        let depths = regulated(&plant, motoring);
        period(&mut plant, depths, 0.2).unwrap();
    }
    // The gates off for a while, then on again.
    for _ in 0..40 {
        plant.advance([LegGates::OFF; 3], PERIOD_S).unwrap();
    }
    let energies = plant.energies();
    let residual = plant.residual_j(stored);
    let [upper, lower] = plant.motors().each_ref().map(|motor| motor.energies());
    let turned_over =
        energies.source_j.abs() + upper.mechanical_j.abs() + lower.mechanical_j.abs() + upper.copper_j;
    println!("{energies:?}, {upper:?}, {lower:?}, residual {:.1e}", residual / turned_over);
    assert!(upper.mechanical_j > 100.0, "{upper:?}");
    assert!(residual.abs() < 1e-6 * turned_over, "{residual} J of {turned_over} J");
    let speed = plant.motors()[0].speed_rpm() * TAU / 60.0;
    assert!(speed > 0.0 && plant.time_s() > 0.2);
}

#[test]
fn an_illegal_state_is_refused_and_nothing_happens() {
    let mut plant = plant_at([500.0; 2], &Zs9Settings::default());
    plant.advance([LegGates::ZERO; 3], 30e-6).unwrap();
    let before = (plant.time_s(), plant.network(), plant.motors()[0].currents_dq());
    let lonely = LegGates { low: true, ..LegGates::OFF };
    let refused = plant.advance([LegGates::ONE, LegGates::ZERO, lonely], 30e-6).unwrap_err();
    assert_eq!((refused.leg, refused.gates, refused.time_s), ('w', lonely, plant.time_s()));
    assert_eq!(before, (plant.time_s(), plant.network(), plant.motors()[0].currents_dq()));
}
