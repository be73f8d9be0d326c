//! The experiment on machines that it has not seen.

use std::path::Path;
use std::sync::LazyLock;
use tractive_control::control::{
    AimInput, Boundary, Committed, ControlLaw, Demand, Gains, Law, ModeLimits, Regulated, RotorSample,
};
use tractive_control::frames::{Abc, AlphaBeta, Angle, Dq};
use tractive_control::identification::{Identification, Observation, Stage};
use tractive_control::machine::Tables;
use tractive_control::time::Clock;
use tractive_tablegen::{MachineFolder, SmoothMap};

/// A machine behind an ideal inverter whose voltage is that of the previous command; its rotor is free.
struct Plant {
    map: SmoothMap,
    flux_scale: f64,
    resistance_ohm: f64,
    pole_pairs: f64,
    inertia_kg_m2: f64,
    current: (f64, f64),
    angle: f64,
    speed: f64,
    seed: u32,
    /// Voltage that each leg lacks, in V.
    lacking_v: f32,
    /// Phase current with ripple of both signs, in A.
    ripple_a: f32,
    sensors: Sensors,
}

/// The flaws of the sensors, and how many times the inertia of its rotor the machine has.
#[derive(Clone, Copy)]
struct Sensors {
    heavier: f64,
    noise_share: f32,
    /// Error of the angle's zero, electrical, in degrees.
    zero_deg: f64,
    /// The reading of phase currents.
    reads: fn(Abc) -> Abc,
}

const HEALTHY: Sensors = Sensors { heavier: 1.0, noise_share: 0.002, zero_deg: 0.0, reads: |read| read };

impl Plant {
    /// A machine at rest.
    fn of(machine: &Machine, flux_scale: f64, sensors: Sensors) -> Self {
        let parameters = &machine.folder.parameters;
        Self {
            map: SmoothMap::new(&machine.folder.map),
            flux_scale,
            resistance_ohm: 1.1 * parameters.stator_resistance_ohm,
            pole_pairs: parameters.pole_pairs.into(),
            inertia_kg_m2: sensors.heavier * machine.inertia_kg_m2,
            current: (0.0, 0.0),
            angle: 0.3,
            speed: 0.0,
            seed: 7,
            // A dead time of 5 µs at 900 Hz.
            ripple_a: 0.02 * parameters.max_current_a as f32,
            lacking_v: 0.0045 * parameters.dc_link_nominal_v as f32,
            sensors,
        }
    }

    /// One half at a voltage in the stationary frame, of which each leg lacks some in the direction of its current.
    fn step(&mut self, voltage: AlphaBeta, half_s: f64) {
        const PARTS: i32 = 20;
        let dt = half_s / f64::from(PARTS);
        for _ in 0..PARTS {
            let (sin, cos) = self.angle.sin_cos();
            let (id, iq) = self.current;
            let here =
                AlphaBeta { alpha: (id * cos - iq * sin) as f32, beta: (id * sin + iq * cos) as f32 }.abc();
            // Near zero the ripple has both signs.
            let lack = |phase: f32| self.lacking_v * (phase / self.ripple_a).clamp(-1.0, 1.0);
            let acts = voltage - Abc { a: lack(here.a), b: lack(here.b), c: lack(here.c) }.clarke();
            let (alpha, beta) = (f64::from(acts.alpha), f64::from(acts.beta));
            let (ud, uq) = (alpha * cos + beta * sin, beta * cos - alpha * sin);
            let at = self.map.at(id, iq);
            let s = self.flux_scale;
            let omega = self.pole_pairs * self.speed;
            let vd = (ud - self.resistance_ohm * id) / s + omega * at.psi_q_wb;
            let vq = (uq - self.resistance_ohm * iq) / s - omega * at.psi_d_wb;
            let det = at.ldd_h * at.lqq_h - at.ldq_h * at.lqd_h;
            self.current.0 += dt * (at.lqq_h * vd - at.ldq_h * vq) / det;
            self.current.1 += dt * (at.ldd_h * vq - at.lqd_h * vd) / det;
            let torque = 1.5 * self.pole_pairs * s * (at.psi_d_wb * iq - at.psi_q_wb * id);
            self.speed += dt * torque / self.inertia_kg_m2;
            self.angle += dt * omega;
        }
    }

    fn noise(&mut self, peak_a: f32) -> f32 {
        self.seed = self.seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        peak_a * ((self.seed >> 8) as f32 / 8_388_608.0 - 1.0)
    }

    fn angle(&self, error_deg: f64) -> Angle {
        let angle = self.angle + error_deg.to_radians();
        Angle::from_turns((angle / core::f64::consts::TAU).rem_euclid(1.0) as f32)
    }

    fn sample(&mut self, peak_a: f32, tables: &Tables) -> RotorSample {
        let (id, iq) = self.current;
        let current = Dq { d: id as f32 + self.noise(peak_a), q: iq as f32 + self.noise(peak_a) };
        let read = (self.sensors.reads)(current.unpark(self.angle(0.0).sin_cos()).abc());
        RotorSample::new(read, self.angle(self.sensors.zero_deg), tables)
    }
}

/// Largest current beyond the bound, as a share, and the largest mechanical turn before the rotor is meant to turn, in degrees.
struct Outcome {
    peak: f64,
    turned_deg: f64,
    pulses_s: f64,
    observations: Vec<Observation>,
}

/// The limits that the experiment runs within.
const LIMITS: ModeLimits = ModeLimits::carrier(0.906);

fn run(machine: &Machine, flux_scale: f64, sensors: Sensors) -> Outcome {
    let Machine { folder, tables, .. } = machine;
    let parameters = &folder.parameters;
    let half_s = 0.5 / parameters.max_switching_hz;
    let clock = Clock::new(25_000_000, 2_500);
    let law = Law { gains: &Gains::DEFAULT, clock: &clock, tables };
    let mut plant = Plant::of(machine, flux_scale, sensors);
    let mut identification = Identification::new();
    let noise_a = sensors.noise_share * tables.ratings.max_current_a;
    let mut committed_v = AlphaBeta::default();
    let mut outcome = Outcome { peak: 0.0, turned_deg: 0.0, pulses_s: 0.0, observations: Vec::new() };
    let mut volt_seconds = None;
    for _ in 0..16_000 {
        let sample = plant.sample(noise_a, tables);
        identification.track(plant.angle(sensors.zero_deg), &Clock { control_s: half_s as f32, ..clock });
        identification.observe(&sample, tables);
        identification.learn(
            &Boundary { volt_seconds, length_s: half_s as f32 },
            &sample,
            Regulated::Mean,
            &law,
        );
        let demand = Demand { torque_nm: 0.0, slew_limited: false };
        let udc_v = tables.ratings.dc_link_nominal_v;
        identification.aim(&AimInput::plain(&demand, udc_v, &LIMITS), &law);
        let committed = Committed {
            horizon_s: half_s as f32,
            volt_seconds: Some(committed_v * half_s as f32),
            ripple_wb: None,
            interval_s: half_s as f32,
        };
        let next = identification.regulate(&sample, &committed, &LIMITS, &law).vector;
        plant.step(committed_v, half_s);
        volt_seconds = Some(committed_v * half_s as f32);
        committed_v = next;
        outcome.observations.extend(identification.take());
        let stage = identification.stage();
        let (id, iq) = plant.current;
        outcome.peak = outcome.peak.max(id.hypot(iq) / parameters.max_current_a);
        if !matches!(stage, Stage::Turn | Stage::Done) {
            outcome.pulses_s += half_s;
            let turned = (plant.angle - 0.3) / plant.pole_pairs;
            outcome.turned_deg = outcome.turned_deg.max(turned.abs().to_degrees());
        }
        if outcome.observations.last().is_some_and(|observation| observation.stage == Stage::Done) {
            break;
        }
    }
    outcome
}

/// Reach of the pulses along q, to one side at least, as the map is even: that of the band along d where it is least, as a share of
/// the circle that the boundaries keep to.
fn reach(observations: &[Observation], bound_a: f64) -> f64 {
    let of_band = |band: i32| {
        let middle = 0.1 * f64::from(band) * bound_a;
        let own = observations.iter().filter(|o| (f64::from(o.current.d) - middle).abs() < 0.06 * bound_a);
        let far_a = own.map(|o| f64::from(o.current.q).abs()).fold(0.0, f64::max);
        let share = far_a / (0.94 * 0.94 * bound_a * bound_a - middle * middle).sqrt();
        println!("id near {middle:.1} A: {share:.3}");
        share
    };
    (-9..=1).map(of_band).fold(1.0, f64::min)
}

/// A machine, with the inertia of its rotor, in kg·m².
struct Machine {
    name: &'static str,
    inertia_kg_m2: f64,
    folder: MachineFolder,
    tables: Tables,
}

/// The machines, one with a rotor that is not the folder's.
static MACHINES: LazyLock<[Machine; 3]> = LazyLock::new(|| {
    [("pmasynrm-180kw", Some(3.0)), ("pmsm-48v-1kw", None), ("ipm-zs9", None)].map(|(name, inertia_kg_m2)| {
        let folder =
            MachineFolder::read(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../tables").join(name)).unwrap();
        let inertia_kg_m2 = inertia_kg_m2.unwrap_or(folder.parameters.rotor_inertia_kg_m2);
        Machine { name, inertia_kg_m2, tables: folder.tables(), folder }
    })
});

/// An experiment that came to its end within its limits.
fn keeps_its_limits(outcome: &Outcome, case: &str) {
    let Outcome { peak, turned_deg, pulses_s, observations } = outcome;
    println!("{case}: |i| up to {peak:.3} of the bound, turned {turned_deg:.2}°, {pulses_s:.3} s");
    assert!(*peak < 1.1 && *peak > 0.95, "{case}: {peak}");
    assert!(*turned_deg < 5.0, "{case}: {turned_deg}°");
    assert!(*pulses_s < 2.0, "{case}: {pulses_s} s");
    let last = observations.last().map(|observation| observation.stage);
    assert_eq!(last, Some(Stage::Done), "{case}");
    assert!(observations.iter().any(|observation| observation.stage == Stage::Turn), "{case}");
}

#[test]
fn the_current_keeps_to_its_bound_and_the_rotor_to_its_place() {
    for machine in &*MACHINES {
        for scale in [1.0, 0.8, 1.3] {
            let outcome = run(machine, scale, HEALTHY);
            let case = format!("{}, flux x {scale}", machine.name);
            keeps_its_limits(&outcome, &case);
            let reached = reach(&outcome.observations, machine.folder.parameters.max_current_a);
            println!("{case}: the plane up to {reached:.3} of the circle");
            assert!(reached > 0.8, "{case}: {reached}");
        }
    }
}

/// Currents along the supposed d axis turn such a rotor: it is brought back.
#[test]
fn a_free_rotor_keeps_its_place_where_the_angles_zero_is_off() {
    for machine in &*MACHINES {
        for (zero_deg, heavier) in
            [(-10.0, 1.0), (-10.0, 3.0), (-3.0, 1.0), (3.0, 1.0), (10.0, 1.0), (10.0, 3.0)]
        {
            let outcome = run(machine, 1.0, Sensors { heavier, zero_deg, ..HEALTHY });
            keeps_its_limits(
                &outcome,
                &format!("{}, {zero_deg}°, {heavier} times the inertia", machine.name),
            );
        }
    }
}

/// Sensors of the wrong sign or order: the experiment ends before any considerable current flows.
#[test]
fn currents_that_answer_against_the_voltage_end_the_experiment() {
    type Reads = fn(Abc) -> Abc;
    let wrong: [(&str, Reads); 5] = [
        ("one of the wrong sign", |Abc { a, b, c }| Abc { a, b: -b, c }),
        ("all of the wrong sign", |Abc { a, b, c }| Abc { a: -a, b: -b, c: -c }),
        ("two exchanged", |Abc { a, b, c }| Abc { a, b: c, c: b }),
        ("two others exchanged", |Abc { a, b, c }| Abc { a: b, b: a, c }),
        ("one after the other", |Abc { a, b, c }| Abc { a: b, b: c, c: a }),
    ];
    for machine @ Machine { name, .. } in &*MACHINES {
        for (case, reads) in wrong {
            let Outcome { peak, observations, .. } = run(machine, 1.0, Sensors { reads, ..HEALTHY });
            println!("{name}, {case}: |i| up to {peak:.3} of the bound");
            let past = observations.iter().any(|o| !matches!(o.stage, Stage::Probe | Stage::Done));
            assert!(!past && peak < 0.3, "{name}, {case}: {peak}");
            assert_eq!(observations.last().map(|o| o.stage), Some(Stage::Done), "{name}, {case}");
        }
    }
}
