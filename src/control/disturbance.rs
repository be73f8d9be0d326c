//! The integral part of the current loop.
//!
//! Between two carrier boundaries the flux should change by the volt-seconds that really acted, less the resistive
//! drop. What the committed voltages leave unexplained is integrated into a disturbance voltage in the rotor frame: its mean
//! (resistance, a wrong map) and, under a carrier, its parts at six times the stator frequency, forward and backward
//! (dead time: the fifth and seventh harmonic). Because it compares with voltages that acted, not with voltages that were asked
//! for, limits and reference steps do not wind it up.

use super::{Boundary, Gains, flux_linkage};
use crate::frames::{AlphaBeta, Angle, Dq, SinCos};
use crate::machine::Tables;

#[derive(Clone, Copy, Debug)]
pub struct Observer {
    /// Flux linkage at the last boundary, stationary frame, in Wb.
    last_flux: Option<AlphaBeta>,
    mean: Dq,
    /// Amplitudes that turn with and against six times the rotor angle, in V.
    with_sixth: Dq,
    against_sixth: Dq,
    follows_sixth: bool,
}

/// A boundary, and where the rotor was.
pub struct Input<'a> {
    pub boundary: &'a Boundary,
    /// At the boundary.
    pub angle: Angle,
    /// Electrical, in rad/s.
    pub omega: f32,
    /// Whether the sixth harmonic is slow enough to be followed.
    pub sixth: bool,
}

impl Observer {
    pub const fn new() -> Self {
        const ZERO: Dq = Dq { d: 0.0, q: 0.0 };
        Self { last_flux: None, mean: ZERO, with_sixth: ZERO, against_sixth: ZERO, follows_sixth: false }
    }

    /// The mean disturbance, in V, rotor frame: flux rises by it although nobody asked.
    pub fn mean(&self) -> Dq {
        self.mean
    }

    /// The disturbance with the rotor at an angle, in V.
    pub fn voltage(&self, angle: Angle) -> Dq {
        if !self.follows_sixth {
            return self.mean;
        }
        let sixth = sixth(angle);
        self.mean + turned(self.with_sixth, sixth) + turned(self.against_sixth, back(sixth))
    }

    /// A boundary has passed.
    pub fn step(&mut self, input: &Input, gains: &Gains, tables: &Tables) {
        let Input { boundary, angle, omega, .. } = *input;
        let frame = angle.sin_cos();
        let current = boundary.currents_a.clarke().park(frame);
        let flux = flux_linkage(tables, current).unpark(frame);
        if let (Some(last), Some(volt_seconds)) = (self.last_flux, boundary.volt_seconds) {
            let middle = angle - Angle::from_radians(0.5 * omega * boundary.length_s);
            let unexplained = (flux - last - volt_seconds).park(middle.sin_cos()) * (1.0 / boundary.length_s);
            let drop = current * tables.ratings.stator_resistance_ohm;
            self.learn(unexplained + drop, middle, input.sixth, gains.observer);
        }
        self.last_flux = Some(flux);
    }

    fn learn(&mut self, voltage: Dq, angle: Angle, follow_sixth: bool, gain: f32) {
        self.follows_sixth = follow_sixth;
        if !follow_sixth {
            self.with_sixth = Dq::default();
            self.against_sixth = Dq::default();
            self.mean = self.mean + (voltage - self.mean) * gain;
            return;
        }
        let sixth = sixth(angle);
        let expected = self.mean + turned(self.with_sixth, sixth) + turned(self.against_sixth, back(sixth));
        let error = (voltage - expected) * gain;
        self.mean = self.mean + error;
        self.with_sixth = self.with_sixth + turned(error, back(sixth));
        self.against_sixth = self.against_sixth + turned(error, sixth);
    }
}

/// Direction of six times an angle.
fn sixth(angle: Angle) -> SinCos {
    Angle(angle.0.wrapping_mul(6)).sin_cos()
}

/// The direction turned the other way.
fn back(direction: SinCos) -> SinCos {
    SinCos { sin: -direction.sin, ..direction }
}

/// A vector turned by a direction.
fn turned(vector: Dq, by: SinCos) -> Dq {
    Dq { d: vector.d * by.cos - vector.q * by.sin, q: vector.d * by.sin + vector.q * by.cos }
}
