//! The integral part of the current loop.
//!
//! Between two carrier boundaries the flux should change by the volt-seconds that really acted, less the resistive
//! drop. What the committed voltages leave unexplained (resistance, dead time, a wrong map) is integrated into a
//! disturbance voltage in the rotor frame. Because it compares with voltages that acted, not with
//! voltages that were asked for, limits and reference steps do not wind it up.

use super::{Boundary, Gains, flux_linkage};
use crate::frames::{AlphaBeta, Angle, Dq};
use crate::machine::Tables;

#[derive(Clone, Copy, Debug)]
pub struct Observer {
    /// Flux linkage at the last boundary, stationary frame, in Wb.
    last_flux: Option<AlphaBeta>,
    voltage: Dq,
}

impl Observer {
    pub const fn new() -> Self {
        Self { last_flux: None, voltage: Dq { d: 0.0, q: 0.0 } }
    }

    /// The disturbance, in V, rotor frame: flux rises by it although nobody asked.
    pub fn voltage(&self) -> Dq {
        self.voltage
    }

    /// A boundary has passed, with the rotor at `angle`.
    pub fn step(&mut self, boundary: &Boundary, angle: Angle, omega: f32, gains: &Gains, tables: &Tables) {
        let frame = angle.sin_cos();
        let current = boundary.currents_a.clarke().park(frame);
        let flux = flux_linkage(tables, current).unpark(frame);
        if let (Some(last), Some(volt_seconds)) = (self.last_flux, boundary.volt_seconds) {
            let middle = (angle - Angle::from_radians(0.5 * omega * boundary.length_s)).sin_cos();
            let unexplained = (flux - last - volt_seconds).park(middle) * (1.0 / boundary.length_s);
            let drop = current * tables.ratings.stator_resistance_ohm;
            self.voltage = self.voltage + (unexplained + drop - self.voltage) * gains.observer;
        }
        self.last_flux = Some(flux);
    }
}
