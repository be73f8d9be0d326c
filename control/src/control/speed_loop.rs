//! The speed loop: PI with anti-windup. Speed error to torque.

use crate::frames::limit;
use crate::machine::Ratings;

/// The quantities that determine the gains.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct SpeedDesign {
    /// Rotor inertia, in kg·m², above 0.
    pub inertia_kg_m2: f32,
    /// Natural frequency ω₀ of the loop, in rad/s, critically damped. A load step ΔT makes an error of
    /// `ΔT/J t e^(−ω₀ t)`: largest after 1/ω₀, gone after a few of these.
    pub natural_rad_s: f32,
    /// Time from one step to the next, in s, above 0.
    pub period_s: f32,
}

impl SpeedDesign {
    /// Largest torque that a speed error of 1 rad/s may ask for, as a multiple of the largest: beyond it the torque would be noise of the speed.
    pub const STIFFEST: f32 = 10.0;

    /// A loop for a machine's rotor, with a natural frequency in rad/s, above 0, and the control period in s. The inertia is `J = n_p T/α`, of the largest
    /// torque and electrical acceleration; a rotor that would need more than [`Self::STIFFEST`], `2 J ω₀ > 10 T`, gets a lower frequency.
    pub const fn of(ratings: &Ratings, natural_rad_s: f32, period_s: f32) -> Self {
        let inertia_kg_m2 = ratings.max_torque_nm * ratings.pole_pairs / ratings.max_acceleration_rad_s2;
        let most_rad_s = 0.5 * Self::STIFFEST * ratings.max_torque_nm / inertia_kg_m2;
        let natural_rad_s = if natural_rad_s < most_rad_s { natural_rad_s } else { most_rad_s };
        Self { inertia_kg_m2, natural_rad_s, period_s }
    }
}

/// The inputs of a step; speeds are mechanical, in rad/s.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct SpeedInput {
    /// Wanted speed.
    pub wanted_rad_s: f32,
    /// Measured speed.
    pub measured_rad_s: f32,
    /// Largest torque either way, in N·m, from 0.
    pub largest_nm: f32,
}

/// The loop's state between two steps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpeedLoop {
    integral_nm: f32,
}

impl SpeedLoop {
    /// The state without torque.
    pub const fn new() -> Self {
        Self { integral_nm: 0.0 }
    }

    /// The state that continues from a torque, in N·m.
    pub const fn at(torque_nm: f32) -> Self {
        Self { integral_nm: torque_nm }
    }

    /// One period: the torque, in N·m, `2 J ω₀ e + ∫ J ω₀² e dt` within the limit.
    pub fn step(&mut self, input: &SpeedInput, design: &SpeedDesign) -> f32 {
        let error = input.wanted_rad_s - input.measured_rad_s;
        let stiffness = design.inertia_kg_m2 * design.natural_rad_s;
        let largest = input.largest_nm;
        let wanted = 2.0 * stiffness * error + self.integral_nm;
        let torque = limit(wanted, -largest, largest);
        // At its limit the integral may only go back.
        let further = (wanted > torque && error > 0.0) || (wanted < torque && error < 0.0);
        if !further {
            let step = stiffness * design.natural_rad_s * design.period_s * error;
            self.integral_nm = limit(self.integral_nm + step, -largest, largest);
        }
        torque
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DESIGN: SpeedDesign = SpeedDesign { inertia_kg_m2: 0.1, natural_rad_s: 300.0, period_s: 1e-4 };

    /// A free rotor under the loop: largest dip after a load step, and the speed's error after 20 ms.
    fn load_step(load_nm: f32) -> (f32, f32) {
        let (mut state, mut speed, mut lowest) = (SpeedLoop::new(), 100.0, 100.0_f32);
        for _ in 0..200 {
            let input = SpeedInput { wanted_rad_s: 100.0, measured_rad_s: speed, largest_nm: 120.0 };
            speed += (state.step(&input, &DESIGN) - load_nm) / 0.1 * 1e-4;
            lowest = lowest.min(speed);
        }
        (100.0 - lowest, 100.0 - speed)
    }

    #[test]
    fn a_load_step_is_taken_up() {
        let (dip, left) = load_step(40.0);
        // ΔT/(J ω₀ e).
        assert!((dip - 0.49).abs() < 0.03, "{dip}");
        assert!(left.abs() < 0.03, "{left}");
    }

    #[test]
    fn the_limit_does_not_wind_up() {
        let mut state = SpeedLoop::new();
        let far = SpeedInput { wanted_rad_s: 100.0, measured_rad_s: 0.0, largest_nm: 120.0 };
        for _ in 0..100_000 {
            assert_eq!(state.step(&far, &DESIGN), 120.0);
        }
        // Past the goal the torque reverses at once.
        let past = SpeedInput { measured_rad_s: 101.0, ..far };
        assert!(state.step(&past, &DESIGN) < 0.0);
        assert_eq!(SpeedLoop::at(7.0).step(&SpeedInput { measured_rad_s: 100.0, ..far }, &DESIGN), 7.0);
    }

    #[test]
    fn what_is_not_finite_shows() {
        let input = SpeedInput { wanted_rad_s: 1.0, measured_rad_s: f32::NAN, largest_nm: 120.0 };
        let torque = SpeedLoop::new().step(&input, &DESIGN);
        assert!(torque.is_nan(), "{torque}");
    }
}
