//! The plant against what physics says.

use std::f64::consts::{PI, TAU};
use std::path::Path;
use tractive_rig::plant::{Leg, Plant, PlantSettings, SpeedSource, Stator};
use tractive_tablegen::{MachineFolder, SmoothMap};

const UDC_V: f64 = 1500.0;

fn machine() -> MachineFolder {
    MachineFolder::read(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../tables/pmasynrm-180kw")).unwrap()
}

fn plant_at(speed_rpm: f64) -> Plant {
    Plant::new(&machine(), SpeedSource::profile(vec![(0.0, speed_rpm)]), &PlantSettings::default())
}

/// Levels of a square wave whose voltage vector stands at `turns`.
fn square(turns: f64) -> [Leg; 3] {
    [0.0, 1.0 / 3.0, 2.0 / 3.0].map(|lag| {
        let phase = (turns - lag).rem_euclid(1.0);
        if !(0.25..0.75).contains(&phase) { Leg::Upper } else { Leg::Lower }
    })
}

/// Currents and angle of the voltage vector (from the d axis, in turns) of a square wave, neglecting resistance: the flux
/// linkage has magnitude 2/π udc/ω, lags the voltage by a quarter of a turn, and leads the d axis by `load_turns`.
fn square_point(map: &SmoothMap, speed_rpm: f64, load_turns: f64) -> ((f64, f64), f64) {
    let flux = UDC_V * 2.0 / PI / (speed_rpm * TAU / 60.0 * 4.0);
    let (sin, cos) = (load_turns * TAU).sin_cos();
    let currents = map.inverse(flux * cos, flux * sin, (-100.0, 100.0)).unwrap();
    (currents, load_turns + 0.25)
}

/// Energy stored in the field at a current: ∮ i dψ along a straight line from zero current.
fn stored_j(map: &SmoothMap, id: f64, iq: f64) -> f64 {
    const STEPS: usize = 4000;
    let mut sum = 0.0;
    for k in 0..STEPS {
        let (a, b) = (k as f64 / STEPS as f64, (k + 1) as f64 / STEPS as f64);
        let (from, to) = (map.at(id * a, iq * a), map.at(id * b, iq * b));
        let middle = 0.5 * (a + b);
        sum += id * middle * (to.psi_d_wb - from.psi_d_wb) + iq * middle * (to.psi_q_wb - from.psi_q_wb);
    }
    1.5 * sum
}

#[test]
fn energy_is_kept() {
    keeps_energy(&PlantSettings::default());
}

/// Torque and voltage of slots belong together: what the one gives the other takes.
#[test]
fn energy_is_kept_over_slots() {
    let with = PlantSettings { slots_share: 0.3, ..PlantSettings::default() };
    assert!((keeps_energy(&with) - keeps_energy(&PlantSettings::default())).abs() > 5.0);
}

/// Returns the energy that the rotor got, in J.
fn keeps_energy(settings: &PlantSettings) -> f64 {
    let speed_rpm = 2500.0;
    let map = SmoothMap::new(&machine().map);
    let ((id0, iq0), voltage_turns) = square_point(&map, speed_rpm, 0.2);
    let mut plant = Plant::new(&machine(), SpeedSource::profile(vec![(0.0, speed_rpm)]), settings);
    plant.motor.set_currents(id0, iq0);
    let before = stored_j(&map, id0, iq0);
    let dt_s = 1.0 / (speed_rpm / 15.0 * 1200.0);
    let mut largest: f64 = 0.0;
    for k in 0..6000 {
        plant.advance(square((f64::from(k) + 0.5) / 1200.0 + voltage_turns), UDC_V, dt_s);
        let (id, iq) = plant.motor.currents_dq();
        largest = largest.max(id.hypot(iq));
    }
    let (id, iq) = plant.motor.currents_dq();
    let energies = plant.motor.energies;
    let change = stored_j(&map, id, iq) - before;
    let residual = energies.electrical_j - energies.copper_j - energies.mechanical_j - change;
    println!("{energies:?}, field {change:.4} J, residual {residual:.2e} J, at most {largest} A");
    assert!(energies.mechanical_j > 1000.0 && largest < 250.0, "{energies:?} {largest} A");
    // The splines of ψd and ψq are not exactly the gradient of one energy.
    assert!(residual.abs() < 1e-6 * energies.electrical_j, "{residual} J");
    energies.mechanical_j
}

#[test]
fn steady_state_is_that_of_the_algebraic_equations() {
    // A finely switched voltage vector, mean value by duty; here legs alternate fast between two states.
    let speed_rpm = 1000.0;
    let omega = speed_rpm * TAU / 60.0 * 4.0;
    let map = SmoothMap::new(&machine().map);
    let (id, iq) = (-100.0, 120.0);
    let flux = map.at(id, iq);
    let (ud, uq) = (0.1 * id - omega * flux.psi_q_wb, 0.1 * iq + omega * flux.psi_d_wb);
    let mut plant = plant_at(speed_rpm);
    plant.motor.set_currents(id, iq);
    let period_s = 20e-6;
    for _ in 0..3000 {
        let angle = plant.motor.angle_turns() * TAU + 0.5 * omega * period_s;
        let (alpha, beta) = (ud * angle.cos() - uq * angle.sin(), ud * angle.sin() + uq * angle.cos());
        let phases = [alpha, -0.5 * alpha + 0.75_f64.sqrt() * beta, -0.5 * alpha - 0.75_f64.sqrt() * beta];
        let shares = phases.map(|volts| 0.5 + volts / UDC_V);
        let mut times: Vec<f64> = shares.iter().map(|share| 0.5 * (1.0 - share) * period_s).collect();
        times.extend(shares.iter().map(|share| 0.5 * (1.0 + share) * period_s));
        times.extend([0.0, period_s]);
        times.sort_by(f64::total_cmp);
        for pair in times.windows(2) {
            let middle = 0.5 * (pair[0] + pair[1]) / period_s;
            let legs =
                shares.map(|share| if (middle - 0.5).abs() < 0.5 * share { Leg::Upper } else { Leg::Lower });
            if pair[1] > pair[0] {
                plant.advance(legs, UDC_V, pair[1] - pair[0]);
            }
        }
    }
    let (got_d, got_q) = plant.motor.currents_dq();
    assert!((got_d - id).abs() < 0.5 && (got_q - iq).abs() < 0.5, "{got_d} {got_q}");
}

#[test]
fn the_short_circuit_settles_at_its_operating_point() {
    let stator = Stator::new(&machine(), &PlantSettings::default());
    for speed_rpm in [3000.0, 6000.0, -6000.0] {
        let mut plant = plant_at(speed_rpm);
        for _ in 0..60_000 {
            plant.advance([Leg::Lower; 3], UDC_V, 50e-6);
        }
        let (id, iq) = plant.motor.currents_dq();
        let omega = speed_rpm * TAU / 60.0 * 4.0;
        let flux = SmoothMap::new(&machine().map).at(id, iq);
        assert!((0.1 * id - omega * flux.psi_q_wb).abs() < 0.01, "d axis at {speed_rpm}");
        assert!((0.1 * iq + omega * flux.psi_d_wb).abs() < 0.01, "q axis at {speed_rpm}");
        assert!((id.hypot(iq) - 193.0).abs() < 2.0, "{} A", id.hypot(iq));
        let wanted = stator.short_circuit_a(omega);
        assert!((id - wanted.0).hypot(iq - wanted.1) < 0.05, "{id}, {iq} A: {wanted:?}");
    }
}

/// The torque of a linear machine's short circuit by its closed form, at speeds on both sides of its peak.
#[test]
fn the_short_circuit_of_a_linear_machine_is_that_of_its_equations() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tables/ipm-zs9");
    let machine = MachineFolder::read(&folder).unwrap();
    let stator = Stator::new(&machine, &PlantSettings::default());
    let (at, parameters) = (SmoothMap::new(&machine.map).at(0.0, 0.0), &machine.parameters);
    let (rs, ld, lq, psi) = (parameters.stator_resistance_ohm, at.ldd_h, at.lqq_h, at.psi_d_wb);
    let pole_pairs = f64::from(parameters.pole_pairs);
    for omega in [10.0, 100.0, rs / ld, 1e3, -1e3, 1e4] {
        let square = rs * rs + omega * omega * ld * lq;
        let (id, iq) = (-omega * omega * lq * psi / square, -omega * rs * psi / square);
        let wanted_nm = 1.5 * pole_pairs * (psi * iq + (ld - lq) * id * iq);
        let (found_d, found_q) = stator.short_circuit_a(omega);
        let found_nm = stator.torque_nm(found_d, found_q);
        assert!((found_nm / wanted_nm - 1.0).abs() < 1e-4, "{omega} rad/s: {found_nm} and {wanted_nm} N·m");
    }
}

#[test]
fn with_the_gates_off_current_dies_below_and_flows_above_the_link() {
    let run = |speed_rpm: f64, id: f64, iq: f64, seconds: f64| {
        let mut plant = plant_at(speed_rpm);
        plant.motor.set_currents(id, iq);
        let mut worst: f64 = 0.0;
        let steps = (seconds / 20e-6) as usize;
        for k in 0..steps {
            plant.advance([Leg::Open; 3], UDC_V, 20e-6);
            if k > steps / 2 {
                worst = worst.max(
                    plant.motor.currents_abc().iter().fold(0.0, |most, current| most.max(current.abs())),
                );
            }
        }
        (worst, plant.motor.energies.electrical_j)
    };
    // Line EMF at 4,000 r/min: 1,301 V, below the link: what flows dies away.
    let (left_a, _) = run(4000.0, -100.0, 150.0, 0.1);
    assert!(left_a < 2.0, "{left_a} A");
    // At 6,000 r/min: 1,952 V. The diodes rectify, and energy flows into the link.
    let (rectified_a, energy_j) = run(6000.0, 0.0, 0.0, 0.2);
    assert!(rectified_a > 20.0, "{rectified_a} A");
    assert!(energy_j < 0.0, "{energy_j} J");
}

#[test]
fn dead_time_costs_voltage_against_the_current() {
    let mut plant = plant_at(0.0);
    plant.motor.set_currents(50.0, 0.0);
    // Current out of leg u: while both its devices are off, the lower diode carries it.
    let mut reference = plant_at(0.0);
    reference.motor.set_currents(50.0, 0.0);
    plant.advance([Leg::Open, Leg::Lower, Leg::Lower], UDC_V, 5e-6);
    reference.advance([Leg::Lower, Leg::Lower, Leg::Lower], UDC_V, 5e-6);
    assert!((plant.motor.currents_dq().0 - reference.motor.currents_dq().0).abs() < 1e-9);
}

#[test]
fn finer_calls_change_nothing() {
    let speed_rpm = 6000.0;
    let ((id0, iq0), voltage_turns) = square_point(&SmoothMap::new(&machine().map), speed_rpm, 0.15);
    let run = |pieces: u32| {
        let mut plant = plant_at(speed_rpm);
        plant.motor.set_currents(id0, iq0);
        // A multiple of six, so that the levels change between two calls.
        const CALLS: u32 = 66;
        let dt_s = 15.0 / speed_rpm / f64::from(CALLS);
        for k in 0..5 * CALLS {
            let legs = square((f64::from(k) + 0.5) / f64::from(CALLS) + voltage_turns);
            for _ in 0..pieces {
                plant.advance(legs, UDC_V, dt_s / f64::from(pieces));
            }
        }
        plant.motor.currents_dq()
    };
    let ((d1, q1), (d8, q8)) = (run(1), run(8));
    println!("{d1} {q1}, {:.1e} {:.1e}", d1 - d8, q1 - q8);
    assert!(d1.hypot(q1) < 250.0, "{d1} {q1}");
    assert!((d1 - d8).hypot(q1 - q8) < 1e-3, "{d1} {q1} {d8} {q8}");
}

#[test]
fn a_free_rotor_takes_up_the_mechanical_energy() {
    const INERTIA_KG_M2: f64 = 2.0;
    let source = SpeedSource::Inertia { inertia_kg_m2: INERTIA_KG_M2, load_nm: 0.0 };
    let mut plant = Plant::new(&machine(), source, &PlantSettings::default());
    for _ in 0..500 {
        // 2 % of the link's voltage, 108° ahead of the d axis.
        plant.advance(square(plant.motor.angle_turns() + 0.3), UDC_V, 2e-6);
        plant.advance([Leg::Lower; 3], UDC_V, 98e-6);
    }
    let speed = plant.motor.speed_rpm() * TAU / 60.0;
    let kinetic = 0.5 * INERTIA_KG_M2 * speed * speed;
    let mechanical = plant.motor.energies.mechanical_j;
    let (id, iq) = plant.motor.currents_dq();
    let field = stored_j(&SmoothMap::new(&machine().map), id, iq);
    let given = plant.motor.energies.electrical_j - plant.motor.energies.copper_j - field;
    println!("{speed} rad/s, {kinetic} J, {mechanical} J, {given} J");
    assert!(kinetic > 5.0, "{kinetic} J");
    assert!((given - mechanical).abs() < 1e-5 * mechanical, "{given} J, {mechanical} J");
    assert!((kinetic - mechanical).abs() < 1e-9 * mechanical, "{kinetic} J, {mechanical} J");
}
