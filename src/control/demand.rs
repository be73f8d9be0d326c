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
    /// `None` until pulses are made.
    torque_nm: Option<f32>,
}

/// What shapes a demand.
pub struct Input<'a> {
    pub demand: &'a Demand,
    /// Electrical angular speed, in rad/s.
    pub omega: f32,
    /// Torque that flows already, in N·m: where a machine that is caught while turning begins.
    pub flowing_nm: f32,
    /// Whether a carrier follows, which can step.
    pub can_step: bool,
    pub period_s: f32,
}

impl Shaper {
    pub const fn new() -> Self {
        Self { torque_nm: None }
    }

    /// The shaped demand, in N·m.
    pub fn step(&mut self, input: &Input, ratings: &Ratings) -> f32 {
        let largest = envelope_nm(input.omega, ratings);
        let wanted = limit(input.demand.torque_nm, -largest, largest);
        let last = match self.torque_nm {
            Some(last) => last,
            None if input.can_step => 0.0,
            None => input.flowing_nm,
        };
        // A pattern of few pulses cannot follow a step: its flux hexagon has to be turned against the rotor, and faster it would be
        // thrown off its centre.
        let shaped = if input.demand.slew_limited || !input.can_step {
            let step = ratings.torque_slew_nm_s * input.period_s;
            limit(wanted, last - step, last + step)
        } else {
            wanted
        };
        let shaped = limit(shaped, -largest, largest);
        self.torque_nm = Some(shaped);
        shaped
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
