//! The safe states, and which of them the speed asks for.

use crate::frames::SQRT_3;
use crate::machine::Ratings;

/// The inverter's safe states.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(u8)]
pub enum SafeState {
    /// All gates off.
    GatesOff,
    /// The three lower devices on: the machine's short-circuit current stays inside its limit, and its EMF does not
    /// reach the link through the diodes.
    ShortCircuit,
    /// The three upper devices on: the same where a leg is stuck at the upper rail.
    UpperShortCircuit,
}

impl SafeState {
    /// The state with this discriminant; gates off for any other number.
    pub const fn from_code(code: u32) -> Self {
        match code {
            1 => Self::ShortCircuit,
            2 => Self::UpperShortCircuit,
            _ => Self::GatesOff,
        }
    }
}

/// Margin below the speed where the diodes begin to rectify.
const RECTIFYING_MARGIN: f32 = 0.9;

/// The safe state for an electrical angular speed in rad/s: gates off below `0.9 udc/(√3 ψ_f)`, short circuit above. What is not
/// finite counts as slow, because a short circuit at speed zero would be safe as well, but open gates need no gate supply.
/// A link above its nominal voltage counts as nominal: it will not stay there.
#[inline(never)]
pub fn safe_state(omega: f32, udc_v: f32, ratings: &Ratings) -> SafeState {
    let nominal_v = ratings.dc_link_nominal_v;
    let udc_v = if udc_v < nominal_v { udc_v } else { nominal_v };
    if emf_v(omega, ratings) > RECTIFYING_MARGIN * udc_v {
        SafeState::ShortCircuit
    } else {
        SafeState::GatesOff
    }
}

/// Peak of the EMF between two phases without current, in V.
pub(super) fn emf_v(omega: f32, ratings: &Ratings) -> f32 {
    omega.abs() * SQRT_3 * ratings.magnet_flux_wb
}
