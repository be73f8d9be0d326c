//! The ripple of a link, observed so that a voltage can be made for the link that will be there.
//!
//! A command acts one to two carrier halves after its sample: 1.2 ms with three pulses a turn. A rectifier's 300 Hz turn over meanwhile, and the
//! 33 to 100 Hz of a single-phase line move by up to 70 % of their amplitude. So one sinusoid is followed, `ẋ = jωx`, beside the mean: a
//! Luenberger observer of which the frequency is adapted by what is left unexplained in quadrature (a frequency-locked loop). A
//! link that stands still moves nothing, to the bit.

use crate::frames::{Angle, limit};

/// Bandwidth of the mean, in rad/s: 33 Hz are 207.
const MEAN_RAD_S: f32 = 25.0;
/// Bandwidth of the sinusoid, in rad/s: of a link that steps, a tenth of the step at 100 Hz is taken for ripple, for some 30 ms.
const RIPPLE_RAD_S: f32 = 60.0;
/// Rate of the frequency's adaption, in 1/s; from 100 Hz it finds 33 and 300 Hz within a tenth of a second.
const ADAPTION_PER_S: f32 = 60.0;
/// Frequency at first, and what it is kept within, in rad/s: 20 to 700 Hz.
const FIRST_RAD_S: f32 = 628.3;
const SLOWEST_RAD_S: f32 = 125.7;
const FASTEST_RAD_S: f32 = 4_398.0;
/// Amplitude squared, as a share of the mean's square, below which the frequency is adapted less and less: of a thousandth.
const SMALL: f32 = 1e-6;
/// Distance from what is expected, as a share of the mean, at which all begins anew.
const LOST: f32 = 0.25;

/// The observer.
#[derive(Clone, Copy, Debug)]
pub struct LinkRipple {
    /// In V.
    mean_v: f32,
    /// The sinusoid and what comes a quarter of a period after it, in V.
    direct_v: f32,
    quarter_v: f32,
    /// Its angular frequency, in rad/s.
    omega: f32,
}

impl LinkRipple {
    /// With a link that has stood at `udc_v`.
    pub const fn at(udc_v: f32) -> Self {
        Self { mean_v: udc_v, direct_v: 0.0, quarter_v: 0.0, omega: FIRST_RAD_S }
    }

    /// A sample of the link, in V, a time in s after the last one.
    #[inline(never)]
    pub fn step(&mut self, udc_v: f32, passed_s: f32) {
        let turn = Angle::from_radians(self.omega * passed_s).sin_cos();
        let direct_v = self.direct_v * turn.cos - self.quarter_v * turn.sin;
        let quarter_v = self.direct_v * turn.sin + self.quarter_v * turn.cos;
        let error_v = udc_v - self.mean_v - direct_v;
        let is_near = error_v.abs() < LOST * self.mean_v;
        if !is_near {
            *self = Self::at(udc_v);
            return;
        }
        let squared = direct_v * direct_v + quarter_v * quarter_v + SMALL * self.mean_v * self.mean_v;
        let behind = error_v * quarter_v / squared;
        let omega = self.omega * (1.0 - ADAPTION_PER_S * passed_s * behind);
        self.omega = limit(omega, SLOWEST_RAD_S, FASTEST_RAD_S);
        self.mean_v += MEAN_RAD_S * passed_s * error_v;
        self.direct_v = direct_v + RIPPLE_RAD_S * passed_s * error_v;
        self.quarter_v = quarter_v;
    }

    /// By how much the link will be above what it is `first_s` after the last sample, each of these times after it, in V. The first is short beside the
    /// ripple's period.
    #[inline(never)]
    pub fn change<const N: usize>(&self, first_s: f32, times_s: [f32; N]) -> [f32; N] {
        let first_v = self.direct_v - self.omega * first_s * self.quarter_v;
        times_s.map(|time_s| {
            let turn = Angle::from_radians(self.omega * time_s).sin_cos();
            self.direct_v * turn.cos - self.quarter_v * turn.sin - first_v
        })
    }
}
