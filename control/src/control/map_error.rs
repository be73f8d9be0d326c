//! The error of the flux map, and its use.
//!
//! If the machine's flux linkage is (1 + ε) times the map's, −ε jωψ of the EMF stays unexplained. The estimate is reported;
//! beyond what a wrong resistance can feign, the operating point takes it into account: such a machine needs for a torque the
//! current that the map gives for T/(1 + ε), and the voltage that it gives on a link of udc/(1 + ε).

use crate::frames::{Dq, limit_magnitude};

/// Electrical speed from which the disturbance tells something of the map, in rad/s: the EMF is then well above the resistive
/// drop.
const FROM_RAD_S: f32 = 200.0;
/// Bandwidth of the estimate, in rad/s.
const BANDWIDTH_RAD_S: f32 = 5.0;
/// Error that is left alone: half as much resistance again looks like up to 3 %.
const LEFT_ALONE: f32 = 0.03;
/// Largest correction.
const MOST: f32 = 0.15;

#[derive(Clone, Copy, Debug)]
pub struct MapError {
    share: f32,
    /// Of `share`: made where that changes, since it is wanted far more often.
    scale: f32,
}

impl MapError {
    pub const fn new() -> Self {
        Self { share: 0.0, scale: 1.0 }
    }

    /// ε, as far as it is known.
    pub fn share(&self) -> f32 {
        self.share
    }

    /// 1 + ε, as far as it is believed.
    pub fn scale(&self) -> f32 {
        self.scale
    }

    /// 1 + ε with nothing of a believed ε left alone: for the flux linkage of the magnets in a machine that is caught.
    pub fn caught_scale(&self) -> f32 {
        if self.scale == 1.0 { 1.0 } else { 1.0 + limit_magnitude(self.share, MOST) }
    }

    /// So much time has passed, with the mean disturbance in V and the flux linkage aimed at in Wb.
    pub fn step(&mut self, disturbance: Dq, flux: Dq, omega: f32, period_s: f32) {
        if omega.abs() < FROM_RAD_S {
            return;
        }
        let emf = flux.j();
        let seen = -(disturbance.d * emf.d + disturbance.q * emf.q) / (omega * flux.squared());
        self.share += BANDWIDTH_RAD_S * period_s * (seen - self.share);
        self.scale = if self.share.abs() > LEFT_ALONE {
            1.0 + limit_magnitude(self.share - LEFT_ALONE.copysign(self.share), MOST)
        } else {
            1.0
        };
    }
}
