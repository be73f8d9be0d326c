//! The modulator's input.

use crate::frames::{AlphaBeta, Angle};
use crate::time::Instant;

/// The modulator's input: a fundamental that turns on by itself from one control period to the next.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Reference {
    /// Fundamental phase voltage, peak, in V.
    pub voltage_v: f32,
    /// The same as a vector at `at`, in V.
    pub vector: AlphaBeta,
    /// Angle, at `at`, of the vector that a locked carrier keeps to: without the part that regulation adds for one half only.
    pub carrier_angle: Angle,
    /// Angle units (2⁻³² turn) per tick by which it turns; negative backward.
    pub rate: f32,
    /// The instant of `vector`.
    pub at: Instant,
    /// DC-link voltage, in V, greater than zero.
    pub udc_v: f32,
    /// Fundamental that the operating point asks for, as a share of the six-step voltage 2 udc/π: chooses the mode.
    pub modulation_index: f32,
}

impl Reference {
    /// No voltage, on a link without voltage.
    pub const NONE: Self = Self {
        voltage_v: 0.0,
        vector: AlphaBeta { alpha: 0.0, beta: 0.0 },
        carrier_angle: Angle::ZERO,
        rate: 0.0,
        at: Instant(0),
        udc_v: 0.0,
        modulation_index: 0.0,
    };

    /// A fundamental with its vector and its carrier at one angle, and a mode by its own modulation index.
    pub fn turning(voltage_v: f32, angle: Angle, rate: f32, at: Instant, udc_v: f32) -> Self {
        let direction = angle.sin_cos();
        let vector = AlphaBeta { alpha: direction.cos, beta: direction.sin } * voltage_v;
        let modulation_index = voltage_v / (udc_v * (2.0 * core::f32::consts::FRAC_1_PI));
        Self { voltage_v, vector, carrier_angle: angle, rate, at, udc_v, modulation_index }
    }

    /// The vector at an instant, in V, turned at constant rate.
    pub fn vector_at(&self, instant: Instant) -> AlphaBeta {
        self.vector.turned(self.turned(instant).sin_cos())
    }

    /// The vector in the middle of a half, as a share of the link's voltage: a turning vector has its mean there.
    #[inline(never)]
    pub(super) fn share_within(&self, start: Instant, period_ticks: u32) -> AlphaBeta {
        self.vector_at(start.after(period_ticks / 2)) * (1.0 / self.udc_v)
    }

    /// The pulse angle at an instant: that of the carrier's vector and 90°.
    pub(super) fn pulse_at(&self, instant: Instant) -> Angle {
        self.carrier_angle + self.turned(instant) + Angle::DEG_90
    }

    fn turned(&self, instant: Instant) -> Angle {
        Angle((self.rate * instant.since(self.at) as f32) as i32 as u32)
    }

    /// The same fundamental in the mirror: turning forward.
    pub(super) fn mirrored(self) -> Self {
        let vector = AlphaBeta { beta: -self.vector.beta, ..self.vector };
        Self { vector, carrier_angle: -self.carrier_angle, rate: -self.rate, ..self }
    }
}
