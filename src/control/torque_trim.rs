//! The slow trim of mean torque.
//!
//! The current loop holds the fundamental of the flux. In a saturated machine the ripple around it changes the mean torque by up
//! to some percent, most in the patterns of few pulses. The torque of the measured currents tells; what is missing on
//! average is added to the demand, as a share of it.

use crate::frames::limit;

/// Bandwidth, in rad/s: the torque ripple at six times the stator frequency must not come through.
const BANDWIDTH_RAD_S: f32 = 60.0;
/// Largest trim, as a share of the demand.
const MOST: f32 = 0.06;
/// Torque below which the trim is no longer relative, as a share of the largest.
const SMALL_TORQUE: f32 = 0.1;
/// Rate of change of the demand that counts as a change, as a share of the largest torque, in 1/s.
const STEADY_RATE: f32 = 1.0;
/// Time after a change of the demand in which the current loop is still at work, in s.
const HOLD_S: f32 = 0.01;

#[derive(Clone, Copy, Debug)]
pub struct TorqueTrim {
    share: f32,
    last_demand_nm: f32,
    hold_s: f32,
}

/// What a step of the trim looks at.
pub struct Input {
    /// Torque demanded, in N·m.
    pub demand_nm: f32,
    /// Torque of the measured currents, in N·m.
    pub measured_nm: f32,
    /// Whether more torque is not to be had.
    pub limited: bool,
    pub largest_nm: f32,
    pub period_s: f32,
}

impl TorqueTrim {
    pub const fn new() -> Self {
        Self { share: 0.0, last_demand_nm: 0.0, hold_s: HOLD_S }
    }

    /// The demand with its trim, in N·m.
    pub fn apply(&self, demand_nm: f32) -> f32 {
        demand_nm * (1.0 + self.share)
    }

    pub fn step(&mut self, input: &Input) {
        let change = (input.demand_nm - self.last_demand_nm).abs();
        self.last_demand_nm = input.demand_nm;
        if change > STEADY_RATE * input.largest_nm * input.period_s || input.limited {
            self.hold_s = HOLD_S;
        } else if self.hold_s > 0.0 {
            self.hold_s -= input.period_s;
        } else {
            let magnitude = input.demand_nm.abs();
            let small = SMALL_TORQUE * input.largest_nm;
            let per_torque = 1.0 / if magnitude > small { magnitude } else { small };
            let missing = input.demand_nm - input.measured_nm;
            let missing = if input.demand_nm < 0.0 { -missing } else { missing };
            let step = BANDWIDTH_RAD_S * input.period_s * missing * per_torque;
            self.share = limit(self.share + step, -MOST, MOST);
        }
    }
}
