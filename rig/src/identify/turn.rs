//! The turning rotor: inertia and friction.

use super::fit::Fit;
use core::f64::consts::TAU;
use nalgebra::{Matrix3, Vector3};
use tractive::identification::{Observation, Stage};

/// The mechanics of the rotor turning under a known torque.
#[derive(Clone, Copy, Debug)]
pub struct Rotor {
    /// Inertia, in kg·m².
    pub inertia_kg_m2: f64,
    /// Torque of friction against either direction, in N·m.
    pub friction_nm: f64,
}

/// The largest mechanical turn from the beginning until the rotor is to turn, in degrees.
pub fn turned_deg(observations: &[Observation], pole_pairs: f64) -> f64 {
    let still = observations.iter().take_while(|o| o.stage != Stage::Turn);
    let angles = turns(still.copied().collect::<Vec<_>>().as_slice());
    angles.iter().fold(0.0_f64, |most, angle| most.max(angle.abs())) / pole_pairs * 360.0 / TAU
}

/// Electrical angle since the first boundary, in rad, not wrapped.
fn turns(observations: &[Observation]) -> Vec<f64> {
    let mut sum = 0.0;
    let mut angles = vec![0.0; usize::from(!observations.is_empty())];
    for pair in observations.windows(2) {
        let [a, b] = [pair[0].frame, pair[1].frame].map(|frame| (f64::from(frame.sin), f64::from(frame.cos)));
        sum += (b.0 * a.1 - b.1 * a.0).atan2(b.1 * a.1 + b.0 * a.0);
        angles.push(sum);
    }
    angles
}

impl Rotor {
    /// Made from the observations and the machine found from them: while the rotor is sped up, coasts and is braked, the torque's impulse is `J ω`,
    /// plus friction times the time for which it has acted, plus a constant. By least squares.
    pub fn of(observations: &[Observation], fit: &Fit, pole_pairs: f64) -> Self {
        let own: Vec<_> = observations.iter().filter(|o| o.stage == Stage::Turn).copied().collect();
        let angles = turns(&own);
        let torque_nm = |o: &Observation| {
            let (id, iq) = (f64::from(o.current.d), f64::from(o.current.q));
            let (psi_d, psi_q) = fit.flux(id, iq);
            1.5 * pole_pairs * (psi_d * iq - psi_q * id)
        };
        let (mut impulse, mut acted_s) = (0.0, 0.0);
        let (mut squares, mut sides) = (Matrix3::zeros(), Vector3::zeros());
        for k in 1..own.len() {
            let length_s = f64::from(own[k].length_s);
            let mean_nm = 0.5 * (torque_nm(&own[k]) + torque_nm(&own[k - 1]));
            // The mean speed of a half applies at its middle.
            let speed = (angles[k] - angles[k - 1]) / length_s / pole_pairs;
            let own_s = if speed == 0.0 { 0.0 } else { speed.signum() * length_s };
            let row = Vector3::new(speed, acted_s + 0.5 * own_s, 1.0);
            squares += row * row.transpose();
            sides += row * (impulse + 0.5 * mean_nm * length_s);
            impulse += mean_nm * length_s;
            acted_s += own_s;
        }
        let found = squares.lu().solve(&sides).unwrap_or_else(|| Vector3::repeat(f64::NAN));
        Self { inertia_kg_m2: found[0], friction_nm: found[1] }
    }
}
