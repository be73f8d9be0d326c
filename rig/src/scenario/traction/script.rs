//! A run written as a list of events and their times.

use super::plan::{LEAD_S, Plan};
use crate::steps::held;
use tractive::control::Demand;

/// Time before the first event, in s.
pub const BEGIN_S: f64 = 0.1;

/// Events; times in s from the recording's beginning.
#[derive(Clone, Debug, Default)]
pub struct Script {
    /// Speeds in r/min, straight lines between.
    pub speed: Vec<(f64, f64)>,
    /// Torques demanded in N·m, each from its time on; 0 before the first.
    pub torque: Vec<(f64, f64)>,
    /// Enables, each from its time on; enabled before the first.
    pub enable: Vec<(f64, bool)>,
    /// DC-link voltages in V, each from its time on; the run's own before the first.
    pub link: Vec<(f64, f64)>,
    /// The demand's rate of change is limited.
    pub slew_limited: bool,
    /// Length, in s.
    pub duration_s: f64,
}

impl Script {
    /// The plan of a scenario that follows the script.
    pub fn plan(self) -> Plan {
        let Self { speed, torque, enable, link, slew_limited, duration_s } = self;
        let operator = move |t_s: f64| {
            let torque_nm = held(&torque, t_s).unwrap_or(0.0) as f32;
            (Demand { torque_nm, slew_limited }, held(&enable, t_s).unwrap_or(true))
        };
        Plan { link, ..Plan::driven(LEAD_S, duration_s, speed, operator) }
    }
}
