//! A wheel set on its rail: the rotor turns the wheels, adhesion drives the train. All quantities are referred to the motor's shaft.
//!
//! `J dω/dt = T − T_grip`, `J_train dv/dt = T_grip`, with `T_grip = T_most 2x/(1 + x²)` at a creep of `x` times the best one: it rises to a peak and falls
//! beyond it, so that a wheel driven harder than the rail bears runs away.

/// Creep at which the rail bears most, as a share of the train's speed.
const BEST_CREEP: f64 = 0.02;
/// Least speed to which creep is related, in rad/s.
const LEAST_RAD_S: f64 = 5.0;

/// A wheel set, its rail and its train.
#[derive(Clone, Debug)]
pub struct Wheel {
    /// Inertia of rotor and wheel set, in kg·m².
    pub inertia_kg_m2: f64,
    /// The train's mass as an inertia, in kg·m².
    pub train_kg_m2: f64,
    /// Largest torque that a dry rail bears, in N·m.
    pub most_nm: f64,
    /// Stretches of bad rail: start and end (s from the run's beginning), share of the dry rail's grip.
    pub bad: Vec<(f64, f64, f64)>,
    /// The train's speed, mechanical, in rad/s.
    pub train_rad_s: f64,
}

impl Wheel {
    /// The rail's torque against a wheel at a speed in rad/s, in N·m.
    pub fn grip_nm(&self, speed_rad_s: f64, t_s: f64) -> f64 {
        let bad = self.bad.iter().find(|(from, until, _)| (*from..*until).contains(&t_s));
        let share = bad.map_or(1.0, |(.., share)| *share);
        let creep = (speed_rad_s - self.train_rad_s) / self.train_rad_s.abs().max(LEAST_RAD_S);
        let x = creep / BEST_CREEP;
        share * self.most_nm * 2.0 * x / (1.0 + x * x)
    }

    /// Lets the train be driven for a time by a wheel at a speed in rad/s.
    pub(super) fn drive(&mut self, speed_rad_s: f64, t_s: f64, dt_s: f64) {
        self.train_rad_s += self.grip_nm(speed_rad_s, t_s) * dt_s / self.train_kg_m2;
    }
}
