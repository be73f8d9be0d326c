//! The power stage that is wired to the board: every scale and time of the ZS9's, from `power_stage_zs9.toml`.

use crate::power_stage::PowerStage;
use tractive::drive::traction::Drops;
use tractive::frames::Angle;
use tractive::operator::LineTimes;

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

/// The ZS9's, `power_stage_zs9.toml`, which the build script has checked against the machine.
pub const STAGE: Zs9Stage = include!(concat!(env!("OUT_DIR"), "/power_stage_zs9.rs"));
