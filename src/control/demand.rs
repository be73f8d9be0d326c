//! The torque demand: envelope first, then slew, so that the demand never asks for what the drive may not give.

use crate::frames::limit;
use crate::machine::Ratings;

/// What the operator asks for.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Demand {
    /// Torque, in N·m; positive turns the rotor forward.
    pub torque_nm: f32,
    /// Whether the demand's rate of change is limited to the machine's slew rate.
    pub slew_limited: bool,
}

#[derive(Clone, Copy, Debug)]
pub struct Shaper {
    torque_nm: f32,
}

impl Shaper {
    pub const fn new() -> Self {
        Self { torque_nm: 0.0 }
    }

    /// The shaped demand, in N·m, at an electrical angular speed in rad/s.
    pub fn step(&mut self, demand: &Demand, omega: f32, period_s: f32, ratings: &Ratings) -> f32 {
        let largest = envelope_nm(omega, ratings);
        let wanted = limit(demand.torque_nm, -largest, largest);
        let step = ratings.torque_slew_nm_s * period_s;
        self.torque_nm = if demand.slew_limited {
            let slewed = limit(wanted, self.torque_nm - step, self.torque_nm + step);
            limit(slewed, -largest, largest)
        } else {
            wanted
        };
        self.torque_nm
    }
}

/// Largest torque of the rating's envelope, in N·m: constant torque, then constant power.
fn envelope_nm(omega: f32, ratings: &Ratings) -> f32 {
    let mechanical = omega.abs() / ratings.pole_pairs;
    if ratings.max_torque_nm * mechanical > ratings.max_power_w {
        ratings.max_power_w / mechanical
    } else {
        ratings.max_torque_nm
    }
}
