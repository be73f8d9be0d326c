//! The demands of the operator, and the loads.

use tractive::ports::MotorDemand;

/// Orders for one control period. Motors in the order upper, lower.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Orders {
    /// The demands on the motors.
    pub demands: [MotorDemand; 2],
    /// Load torques against forward rotation, in N·m.
    pub loads_nm: [f64; 2],
    /// The permission for the gates to be on.
    pub enable: bool,
}

/// The motors' true speeds, in r/min.
pub type SeenMotors = [f64; 2];

/// Gives the demands in every control period.
pub trait Operator {
    /// Orders at `t_s` seconds after the recording begins (negative before).
    fn orders(&mut self, t_s: f64, speeds_rpm: SeenMotors) -> Orders;
}

impl<F: FnMut(f64, SeenMotors) -> Orders> Operator for F {
    fn orders(&mut self, t_s: f64, speeds_rpm: SeenMotors) -> Orders {
        self(t_s, speeds_rpm)
    }
}
