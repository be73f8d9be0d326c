//! What is wired to the board: every scale and time of the ZS9's power stage, in this one place.

use crate::board::nucleo_g474re::power_stage::PowerStage;
use crate::frames::Angle;

/// The power stage and its sensors.
#[derive(Clone, Copy, Debug)]
pub struct Zs9Stage {
    /// Dead time, both motors' current sensors, the capacitors' divider (as the link's), and the encoders.
    pub common: PowerStage,
    /// Electrical angle of the d axis at each encoder's index.
    pub encoder_zeros: [Angle; 2],
    /// Inductor current sensor: A per code, positive from the source to the bridge; its zero as the motors'.
    pub inductor_a_per_code: f32,
    /// Source voltage divider: V per code; code 0 is 0 V.
    pub source_v_per_code: f32,
    /// Link voltage wanted outside shoot-through until the operator says otherwise, in V.
    pub link_ref_v: f32,
}

/// The power stage that this board file is for: ±150 A current sensors that give 1.65 V ± 1.65 V, dividers of 1,000 V to 3.3 V,
/// encoders of 1,024 lines.
pub const STAGE: Zs9Stage = Zs9Stage {
    common: PowerStage {
        dead_time_ns: 1_000,
        // The modulator of the nine switches has no shortest pulse.
        min_pulse_ns: 0,
        current_a_per_code: 150.0 / 2_048.0,
        zero_code: 2_048,
        zero_tolerance: 64,
        udc_v_per_code: 1_000.0 / 4_095.0,
        break_current_a: 130.0,
        encoder_counts: 4_096,
        encoder_zero: Angle::ZERO,
    },
    encoder_zeros: [Angle::ZERO; 2],
    inductor_a_per_code: 150.0 / 2_048.0,
    source_v_per_code: 1_000.0 / 4_095.0,
    link_ref_v: 667.0,
};
