//! The board's power stage, against the machine that it is to feed.

use crate::board::nucleo_g474re::power_stage::PowerStage;
use crate::machine::Ratings;
use tractive_control::configuration::{Bound, Refused, within};

/// Codes of the 12-bit converters, and those of either sign around the middle.
const CODES: f32 = 4_095.0;
const HALF_CODES: f32 = 2_047.0;
/// How far a converter's range may exceed what it must hold, as a multiple: beyond, it resolves nothing.
const RANGE: f32 = 20.0;

impl PowerStage {
    /// Whether it makes sense and can measure this machine.
    ///
    /// # Errors
    /// The first scalar that does not.
    pub fn check(&self, ratings: &Ratings) -> Result<(), Refused> {
        let Self {
            dead_time_ns,
            min_pulse_ns,
            current_a_per_code,
            zero_code,
            zero_tolerance,
            udc_v_per_code,
            break_current_a,
            encoder_counts,
            // Any angle is one.
            encoder_zero: _,
        } = *self;
        let (trip_a, trip_v) = (ratings.trip_current_a, ratings.trip_dc_over_v);
        within(&[
            Bound("power_stage.dead_time_ns", dead_time_ns as f32, 1.0, 2e4),
            Bound("power_stage.min_pulse_ns", min_pulse_ns as f32, dead_time_ns as f32, 1e6),
            Bound(
                "power_stage.current_a_per_code",
                current_a_per_code,
                trip_a / HALF_CODES,
                RANGE * trip_a / HALF_CODES,
            ),
            Bound("power_stage.zero_code", f32::from(zero_code), 1_024.0, 3_072.0),
            Bound("power_stage.zero_tolerance", f32::from(zero_tolerance), 1.0, 512.0),
            Bound("power_stage.udc_v_per_code", udc_v_per_code, trip_v / CODES, RANGE * trip_v / CODES),
            // Above what software catches by name, below what the converters hold.
            Bound("power_stage.break_current_a", break_current_a, trip_a, HALF_CODES * current_a_per_code),
            Bound("power_stage.encoder_counts", encoder_counts as f32, 4.0, 65_536.0),
        ])
    }
}
