//! The motors in the rotor frame against the same motors in phase quantities.
//!
//! The phase model is the paper's, mended: `ψ = L(θ) i + ψ_f [cos θ, cos(θ − 120°), cos(θ + 120°)]`, with self inductances
//! `L0 + L2 cos 2(θ − own axis)`, mutual ones `M + L2 cos 2(θ − axis between)`, `L0 − M = (Ld + Lq)/2`, `L2 = (Ld − Lq)/3`.
//! Torque by virtual work.

mod zs9;

use std::f64::consts::TAU;
use tractive_rig::plant::zs9::{LegGates, NetworkState, Vector, ZNetwork, Zs9Settings};
use zs9::{PERIOD_S, depth_for, pattern, plant_at};

const R: f64 = 0.12;
const MAGNET_WB: f64 = 0.33;
const LD: f64 = 2.5e-3;
const LQ: f64 = 5e-3;
/// Of L0 and M only the difference acts on three wires.
const L0: f64 = 3e-3;
const M: f64 = L0 - 0.5 * (LD + LQ);
const L2: f64 = (LD - LQ) / 3.0;
const THIRD: f64 = TAU / 3.0;

/// Inductance matrix, or its derivative by θ.
fn inductances(theta: f64, derivative: bool) -> [[f64; 3]; 3] {
    let mut matrix = [[0.0; 3]; 3];
    for (j, row) in matrix.iter_mut().enumerate() {
        for (k, entry) in row.iter_mut().enumerate() {
            // The axis of a phase, or the one between two; the mean of two axes, doubled, is their sum.
            let double = 2.0 * theta - THIRD * (j + k) as f64;
            let mean = if j == k { L0 } else { M };
            *entry = if derivative { -2.0 * L2 * double.sin() } else { mean + L2 * double.cos() };
        }
    }
    matrix
}

fn times(matrix: [[f64; 3]; 3], x: [f64; 3]) -> [f64; 3] {
    matrix.map(|row| row[0] * x[0] + row[1] * x[1] + row[2] * x[2])
}

/// Currents of a flux linkage: Cramer's rule.
fn currents(theta: f64, flux: [f64; 3]) -> [f64; 3] {
    let l = inductances(theta, false);
    let armature = [0, 1, 2].map(|k| flux[k] - MAGNET_WB * (theta - THIRD * k as f64).cos());
    let det = |m: [[f64; 3]; 3]| {
        m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) - m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0])
            + m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0])
    };
    [0, 1, 2].map(|column| {
        let mut replaced = l;
        for row in 0..3 {
            replaced[row][column] = armature[row];
        }
        det(replaced) / det(l)
    })
}

struct PhaseMotor {
    /// Electrical, in rad/s.
    omega: f64,
    theta: f64,
    flux: [f64; 3],
}

impl PhaseMotor {
    fn new(omega: f64) -> Self {
        Self { omega, theta: 0.0, flux: [0, 1, 2].map(|k| MAGNET_WB * (THIRD * k as f64).cos()) }
    }

    fn currents(&self) -> [f64; 3] {
        currents(self.theta, self.flux)
    }

    fn torque_nm(&self) -> f64 {
        let i = self.currents();
        let turned = times(inductances(self.theta, true), i);
        (0..3)
            .map(|k| i[k] * (0.5 * turned[k] - MAGNET_WB * (self.theta - THIRD * k as f64).sin()))
            .sum::<f64>()
            * 4.0
    }

    /// Terminal potentials for a time: `dψ/dt = u − u_star − R i`, the star point at the terminals' mean.
    fn advance(&mut self, terminals_v: [f64; 3], dt_s: f64) {
        const PIECES: u32 = 8;
        let star = terminals_v.iter().sum::<f64>() / 3.0;
        let h = dt_s / f64::from(PIECES);
        for _ in 0..PIECES {
            let slope = |flux: [f64; 3], t: f64| {
                let i = currents(self.theta + self.omega * t, flux);
                [0, 1, 2].map(|k| terminals_v[k] - star - R * i[k])
            };
            let along = |k: [f64; 3], h: f64| [0, 1, 2].map(|n| self.flux[n] + h * k[n]);
            let k1 = slope(self.flux, 0.0);
            let k2 = slope(along(k1, 0.5 * h), 0.5 * h);
            let k3 = slope(along(k2, 0.5 * h), 0.5 * h);
            let k4 = slope(along(k3, h), h);
            self.flux = [0, 1, 2].map(|n| self.flux[n] + h / 6.0 * (k1[n] + 2.0 * (k2[n] + k3[n]) + k4[n]));
            self.theta += self.omega * h;
        }
    }
}

/// Potentials of the upper or lower terminals, from gates: up through H (and M), otherwise down.
fn terminals(gates: [LegGates; 3], lower: bool, link_v: f64) -> [f64; 3] {
    if gates.iter().any(|leg| leg.high && leg.middle && leg.low) {
        return [0.0; 3];
    }
    gates.map(|leg| if leg.high && (!lower || leg.middle) { link_v } else { 0.0 })
}

#[test]
fn both_motors_agree_with_the_phase_model() {
    const LINK_V: f64 = 2000.0 / 3.0;
    let rpm = [700.0, -500.0];
    // Infinite capacitors: the link stays constant, and the motors alone are compared.
    let settings =
        Zs9Settings { network: ZNetwork { capacitance_f: 1e9, ..ZNetwork::ZS9 }, ..Zs9Settings::default() };
    let mut plant = plant_at(rpm, &settings);
    plant.network = NetworkState::even(0.0, 0.5 * (LINK_V + 400.0));
    let mut phases = rpm.map(|rpm| PhaseMotor::new(rpm * TAU / 60.0 * 4.0));
    let indices = [depth_for((-20.0, 50.0), rpm[0], LINK_V), depth_for((-5.0, -35.0), rpm[1], LINK_V)];
    let (mut worst_a, mut worst_nm, mut largest_a) = (0.0_f64, 0.0_f64, 0.0_f64);
    for _ in 0..1500 {
        let [upper, lower] = [0, 1].map(|k| {
            let (d, q) = indices[k];
            (d.hypot(q), q.atan2(d) + phases[k].theta + phases[k].omega * PERIOD_S * [0.2, 0.7][k])
        });
        for (gates, share) in pattern(upper, lower, 0.2) {
            if share <= 0.0 {
                continue;
            }
            plant.advance(gates, share * PERIOD_S).unwrap();
            for (motor, lower) in phases.iter_mut().zip([false, true]) {
                motor.advance(terminals(gates, lower, LINK_V), share * PERIOD_S);
            }
            for (dq, abc) in plant.motors.iter().zip(&phases) {
                let pairs = dq.currents_abc().into_iter().zip(abc.currents());
                worst_a = pairs.map(|(a, b)| (a - b).abs()).fold(worst_a, f64::max);
                worst_nm = worst_nm.max((dq.torque_nm() - abc.torque_nm()).abs());
                largest_a = dq.currents_abc().into_iter().fold(largest_a, |most, a| most.max(a.abs()));
            }
        }
    }
    println!(
        "currents up to {largest_a:.1} A agree within {worst_a:.1e} A, torque within {worst_nm:.1e} N·m"
    );
    assert!(largest_a > 50.0 && worst_a < 1e-5 && worst_nm < 1e-5, "{worst_a} A, {worst_nm} N·m");
}

#[test]
fn the_phase_model_has_the_inductances_of_both_axes() {
    let theta = 0.7_f64;
    for (d, q, inductance) in [(1.0, 0.0, LD), (0.0, 1.0, LQ)] {
        let current = Vector::from_rotor((d, q), theta.sin_cos()).phases();
        let flux = Vector::clarke(times(inductances(theta, false), current)).to_rotor(theta.sin_cos());
        assert!((flux.0 - inductance * d).abs() < 1e-12 && (flux.1 - inductance * q).abs() < 1e-12);
    }
}
