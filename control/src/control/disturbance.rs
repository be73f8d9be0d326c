//! The integral part of the current loop.
//!
//! Between two carrier boundaries the flux should change by the volt-seconds that really acted, less the resistive
//! drop. What the committed voltages leave unexplained is integrated into a disturbance voltage in the rotor frame: its mean
//! (resistance, a wrong map) and, under a carrier, its parts at six times the stator frequency, forward and backward
//! (dead time: the fifth and seventh harmonic). Because it compares with voltages that acted, not with voltages that were asked
//! for, limits and reference steps do not wind it up.

use super::{Boundary, Gains, RotorSample};
use crate::frames::{AlphaBeta, Angle, Dq, SinCos};

/// The disturbance voltage and what it is learnt from.
#[derive(Clone, Copy, Debug)]
pub struct Observer {
    /// Flux linkage at the last boundary, stationary frame, in Wb.
    last_flux: Option<AlphaBeta>,
    mean: Dq,
    /// Amplitudes of the cosine and the sine of six times the rotor angle, in V: what turns with it and against it.
    cosine: Dq,
    sine: Dq,
    follows_sixth: bool,
}

/// A boundary, and what was seen there.
pub struct Input<'a> {
    pub boundary: &'a Boundary,
    pub sample: &'a RotorSample,
    /// Electrical, in rad/s.
    pub omega: f32,
    pub resistance: f32,
    /// `true` if the sixth harmonic is slow enough to be followed.
    pub sixth: bool,
}

impl Default for Observer {
    fn default() -> Self {
        Self::new()
    }
}

impl Observer {
    /// No disturbance known yet.
    pub const fn new() -> Self {
        const ZERO: Dq = Dq { d: 0.0, q: 0.0 };
        Self { last_flux: None, mean: ZERO, cosine: ZERO, sine: ZERO, follows_sixth: false }
    }

    /// A mean disturbance, in V, that is known beforehand.
    pub fn expect(&mut self, mean: Dq) {
        self.mean = mean;
    }

    /// The mean disturbance, in V, rotor frame: flux rises by it although nobody asked.
    pub fn mean(&self) -> Dq {
        self.mean
    }

    /// The disturbance with the rotor at the angle of a direction, in V.
    #[inline]
    pub fn voltage(&self, rotor: SinCos) -> Dq {
        if !self.follows_sixth {
            return self.mean;
        }
        self.at(rotor.sixfold())
    }

    fn at(&self, sixth: SinCos) -> Dq {
        self.mean + self.cosine * sixth.cos + self.sine * sixth.sin
    }

    /// A boundary has passed.
    #[inline(always)]
    pub(super) fn step(&mut self, input: &Input, gains: &Gains) {
        let Input { boundary, sample, omega, .. } = *input;
        let flux = sample.flux.unpark(sample.frame);
        let half_turn = Angle::within_half_turn(0.5 * omega * boundary.length_s).sin_cos();
        let per_length = 1.0 / boundary.length_s;
        if let (Some(last), Some(volt_seconds)) = (self.last_flux, boundary.volt_seconds) {
            let middle = sample.frame.turned(half_turn.back());
            let unexplained = (flux - last - volt_seconds).park(middle) * per_length;
            self.learn(unexplained + sample.current * input.resistance, middle, input.sixth, gains.observer);
        }
        self.last_flux = Some(flux);
    }

    #[inline(always)]
    fn learn(&mut self, voltage: Dq, rotor: SinCos, follow_sixth: bool, gain: f32) {
        self.follows_sixth = follow_sixth;
        if !follow_sixth {
            self.cosine = Dq::default();
            self.sine = Dq::default();
            self.mean = self.mean + (voltage - self.mean) * gain;
            return;
        }
        let sixth = rotor.sixfold();
        let error = (voltage - self.at(sixth)) * gain;
        self.mean = self.mean + error;
        // Either part moves by the error: the one that turns with the angle, and the one against it.
        self.cosine = self.cosine + error * (2.0 * sixth.cos);
        self.sine = self.sine + error * (2.0 * sixth.sin);
    }
}
