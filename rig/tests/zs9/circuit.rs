//! The ZS9's circuit once more, by nodes: nine switches and the source's as resistors, on or off, and two motors of round rotors, with currents in
//! the stationary frame. It shares nothing with the plant.

use nalgebra::{SMatrix, SVector};
use std::f64::consts::TAU;
use tractive_rig::plant::zs9::LegGates;

pub const ON_OHM: f64 = 5e-3;
const OFF_OHM: f64 = 1e6;
const SOURCE_V: f64 = 400.0;
const L_H: f64 = 0.5e-3;
const R_OHM: f64 = 10e-3;
const C_F: f64 = 500e-6;
/// Inductance in both axes, resistance and magnets' flux linkage of a motor, pole pairs.
pub const ROUND_H: f64 = 2.5e-3;
const MOTOR_OHM: f64 = 0.12;
const MAGNETS_WB: f64 = 0.33;
/// Longest step.
const STEP_S: f64 = 5e-6;

type Nodes = SVector<f64, 7>;

/// i1, i2, v1, v2, and of the upper motor and of the lower one α and β.
pub type State = SVector<f64, 8>;

pub struct Circuit {
    pub state: State,
    pub time_s: f64,
    pub rpm: [f64; 2],
}

/// Phase currents of a vector.
fn phases(alpha: f64, beta: f64) -> [f64; 3] {
    let half = 0.75_f64.sqrt() * beta;
    [alpha, -0.5 * alpha + half, -0.5 * alpha - half]
}

/// The vector of three voltages.
fn vector(v: [f64; 3]) -> [f64; 2] {
    [(2.0 * v[0] - v[1] - v[2]) / 3.0, (v[1] - v[2]) / 3.0_f64.sqrt()]
}

impl Circuit {
    /// Lets time pass with the gates as they are.
    pub fn advance(&mut self, gates: &[LegGates; 3], dt_s: f64) {
        let short = gates.contains(&LegGates::SHOOT_THROUGH);
        let inverse = admittance(gates, short).try_inverse().unwrap();
        let steps = (dt_s / STEP_S).ceil().max(1.0);
        let h = dt_s / steps;
        for _ in 0..steps as u32 {
            let slope = |y: &State, t_s: f64| self.slope(y, self.time_s + t_s, &inverse, short);
            let y = self.state;
            let k1 = slope(&y, 0.0);
            let k2 = slope(&(y + 0.5 * h * k1), 0.5 * h);
            let k3 = slope(&(y + 0.5 * h * k2), 0.5 * h);
            let k4 = slope(&(y + h * k3), h);
            self.state = y + h / 6.0 * (k1 + 2.0 * (k2 + k3) + k4);
            self.time_s += h;
        }
    }

    fn slope(&self, y: &State, t_s: f64, inverse: &SMatrix<f64, 7, 7>, short: bool) -> State {
        let (upper, lower) = (phases(y[4], y[5]), phases(y[6], y[7]));
        // Currents into the nodes: the positive rail, the upper motor's terminals, the lower one's. The source's switch stands between U_dc and u_s = v1 + v2 − U.
        let from_source = if short { 0.0 } else { (SOURCE_V - y[2] - y[3]) / ON_OHM };
        let mut into = Nodes::zeros();
        into[0] = y[0] + y[1] - from_source;
        for leg in 0..3 {
            (into[1 + leg], into[4 + leg]) = (-upper[leg], -lower[leg]);
        }
        let nodes = inverse * into;
        let link_v = nodes[0];
        let feed_v = y[2] + y[3] - link_v;
        let source_a = if short { 0.0 } else { (SOURCE_V - feed_v) / ON_OHM };
        let bridge_a = y[0] + y[1] - source_a;
        let [upper, lower] = [1, 4].map(|first| vector([nodes[first], nodes[first + 1], nodes[first + 2]]));
        let motor = |k: usize, volts: [f64; 2]| {
            let omega = self.rpm[k] / 60.0 * TAU * 4.0;
            let (sin, cos) = (omega * t_s).sin_cos();
            let emf = [-omega * MAGNETS_WB * sin, omega * MAGNETS_WB * cos];
            [0, 1].map(|axis| (volts[axis] - MOTOR_OHM * y[4 + 2 * k + axis] - emf[axis]) / ROUND_H)
        };
        let ([ua, ub], [la, lb]) = (motor(0, upper), motor(1, lower));
        State::from([
            (feed_v - y[3] - R_OHM * y[0]) / L_H,
            (feed_v - y[2] - R_OHM * y[1]) / L_H,
            (y[1] - bridge_a) / C_F,
            (y[0] - bridge_a) / C_F,
            ua,
            ub,
            la,
            lb,
        ])
    }
}

/// Conductances between the nodes; the negative rail is the ground.
fn admittance(gates: &[LegGates; 3], short: bool) -> SMatrix<f64, 7, 7> {
    let mut matrix = SMatrix::<f64, 7, 7>::zeros();
    if !short {
        matrix[(0, 0)] += 1.0 / ON_OHM;
    }
    for (leg, gates) in gates.iter().enumerate() {
        let (a, b) = (1 + leg, 4 + leg);
        for (from, to, on) in [(0, Some(a), gates.high), (a, Some(b), gates.middle), (b, None, gates.low)] {
            let siemens = 1.0 / if on { ON_OHM } else { OFF_OHM };
            matrix[(from, from)] += siemens;
            if let Some(to) = to {
                matrix[(to, to)] += siemens;
                matrix[(from, to)] -= siemens;
                matrix[(to, from)] -= siemens;
            }
        }
    }
    matrix
}
