//! The checks of a configuration at start-up: whatever made it, a drive does not start with a scalar that makes no sense.
//!
//! Each `check` takes its structure apart completely, so that a new field does not compile before it is checked. First every scalar is checked by
//! itself, then their relations; the first wrong one is reported by its name. A configuration that passes divides nothing by zero. The
//! checks are constant functions: the compiler checks what an image holds as constants.

#![forbid(unsafe_code)]

mod gains;
mod machine;

use crate::modulation::SwitchLimits;
use crate::time::Clock;

/// A scalar that makes no sense, and what is allowed.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Refused {
    /// The scalar, by its path in the configuration.
    pub name: &'static str,
    /// Its value.
    pub value: f32,
    /// The least that is allowed.
    pub least: f32,
    /// The most that is allowed.
    pub most: f32,
}

impl core::fmt::Display for Refused {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "{}: {}: must be from {} to {}", self.name, self.value, self.least, self.most)
    }
}

/// The least number that counts as above 0.
pub const ABOVE_ZERO: f32 = 1e-9;
/// The rounding allowed in a relation, as a share.
pub const ROUNDING: f32 = 1e-3;

/// A scalar by its name, its value, and the least and the most that it may be.
pub struct Bound(pub &'static str, pub f32, pub f32, pub f32);

/// The first scalar out of its bounds. NaN is out of any bounds.
pub const fn within(bounds: &[Bound]) -> Result<(), Refused> {
    let mut rest = bounds;
    while let [Bound(name, value, least, most), others @ ..] = rest {
        if !(*least <= *value && *value <= *most) {
            return Err(Refused { name, value: *value, least: *least, most: *most });
        }
        rest = others;
    }
    Ok(())
}

/// Returns from a constant function what a check has refused: the `?` that such a function lacks.
#[macro_export]
macro_rules! checked {
    ($check:expr) => {
        if let Err(refused) = $check {
            return Err(refused);
        }
    };
}
use checked;

impl Clock {
    /// The check that a drive can run on this clock.
    ///
    /// # Errors
    /// The first scalar that makes no sense.
    pub const fn check(&self) -> Result<(), Refused> {
        let Self { tick_s, ticks_per_s, control_ticks, control_s } = *self;
        let period_s = control_ticks as f32 / ticks_per_s;
        within(&[
            Bound("clock.ticks_per_s", ticks_per_s, 1e5, 1e9),
            Bound("clock.tick_s", tick_s, (1.0 - ROUNDING) / ticks_per_s, (1.0 + ROUNDING) / ticks_per_s),
            // From 100 kHz to 1 kHz.
            Bound("clock.control_ticks", control_ticks as f32, 1e-5 * ticks_per_s, 1e-3 * ticks_per_s),
            Bound("clock.control_s", control_s, (1.0 - ROUNDING) * period_s, (1.0 + ROUNDING) * period_s),
        ])
    }
}

impl SwitchLimits {
    /// The check that the limits suit a clock.
    ///
    /// # Errors
    /// The first scalar that makes no sense.
    pub const fn check(&self, clock: &Clock) -> Result<(), Refused> {
        let Self { min_pulse_ticks, dead_time_ticks, shortest_half_ticks } = *self;
        let half = shortest_half_ticks as f32;
        within(&[
            // From half a control period, a command a carrier, to a carrier of 50 Hz.
            Bound(
                "devices.shortest_half_ticks",
                half,
                0.5 * clock.control_ticks as f32,
                0.01 * clock.ticks_per_s + 1.0,
            ),
            Bound("devices.min_pulse_ticks", min_pulse_ticks as f32, 0.0, 0.5 * half),
            Bound("devices.dead_time_ticks", dead_time_ticks as f32, 0.0, 0.25 * half),
        ])
    }
}
