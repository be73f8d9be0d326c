//! The settings of a bench, and the sender of its commands.

use super::{Flaws, Limits, Supply};
use crate::inject::Injection;
use crate::inject::traction::Kind;
use tractive::control::Demand;
use tractive::time::Clock;

/// The operator's demand as a function of time.
pub trait Operator {
    /// Demand and enable at `t_s` seconds after the recording begins (negative before).
    fn demand(&self, t_s: f64) -> (Demand, bool);
}

impl<F: Fn(f64) -> (Demand, bool)> Operator for F {
    fn demand(&self, t_s: f64) -> (Demand, bool) {
        self(t_s)
    }
}

/// Fixed properties of a bench.
pub struct Settings {
    /// The firmware's clock.
    pub clock: Clock,
    /// The first half that the PWM timer plays, gates off.
    pub first_half_ticks: u32,
    /// Dead time, in ticks.
    pub dead_time_ticks: u32,
    /// Settling time of the drive before the recording, in s.
    pub lead_s: f64,
    /// Length of the recording, in s.
    pub duration_s: f64,
    /// Step of the trace, in s.
    pub trace_step_s: f64,
    /// DC-link voltage, in V.
    pub udc_v: f64,
    /// Other DC-link voltages: (time from the recording's beginning in s, V), each from its time on.
    pub link_steps: Vec<(f64, f64)>,
    /// Imperfections of the sensors.
    pub flaws: Flaws,
    /// The supply of the inverter.
    pub supply: Supply,
    /// The fault that is injected.
    pub injection: Option<Injection<Kind>>,
    /// Limits beyond which it counts as making a difference.
    pub limits: Limits,
}
