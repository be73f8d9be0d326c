//! The order of the vectors: the place that each scheme gives the zero vectors.
//!
//! Rising half with both motors in sector I; the falling half is its mirror image:
//!
//! | scheme | vectors | zero time |
//! |---|---|---|
//! | S | V15 V8 V7 V13 V2 V1 V14 | half to V14 and V15, half to V13 |
//! | RS | V8 V7 V13 V2 V1 | all to V13 |
//! | RTHD | V15 V8 V7 V2 V1 V14 | all to V14 and V15 |
//! | ZVO | each motor as RTHD or as RS | by the half-sector of its angle |

use super::shares::Share;
use super::vectors::Direction;
use crate::named;

named! {
    /// The place of the zero vectors and of the shoot-through. Toggles a period in brackets, with shoot-through or without.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
    #[cfg_attr(feature = "defmt", derive(defmt::Format))]
    #[repr(u8)]
    #[non_exhaustive]
    pub enum Scheme {
        /// S-SVPWM: all three zero vectors (24); the least ripple in the Z-source's inductors.
        S => "s",
        /// RS-SVPWM: V13 only (16), the fewest losses.
        Rs => "rs",
        /// RTHD-SVPWM: V14 and V15 (20 or 24), the least harmonics in the motors' currents.
        #[default]
        Rthd => "rthd",
        /// ZVO-SVPWM: each motor by its angle (19.7 in the mean).
        Zvo => "zvo",
        /// RTHD with the shoot-through in the centres of V14 and V15: for comparison, four toggles more.
        RthdCentral => "rthd-central",
        /// RTHD with a boundary that slides, so that both motors have the same zero time.
        RthdSlide => "rthd-slide",
    }
}

impl Scheme {
    /// The scheme with this discriminant; the default one for an unknown number.
    pub fn from_code(code: u32) -> Self {
        Self::ALL.get(code as usize).copied().unwrap_or_default()
    }
}

/// A scheme at given angles.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sequence {
    /// The part of the upper motor's zero time that is V13 and not V14, 0 ..= 1.
    pub upper_inner: f32,
    /// The part of the lower motor's zero time that is V13 and not V15, 0 ..= 1.
    pub lower_inner: f32,
    /// Both have the same zero time: the boundary slides.
    pub slides: bool,
    /// The shoot-through lies in the centres of V14 and V15.
    pub central: bool,
}

impl Sequence {
    #[inline]
    pub fn of(scheme: Scheme, upper: &Direction, lower: &Direction) -> Self {
        // A phase at its positive peak: V14 and V15 let that phase's leg rest.
        let by_angle = |direction: &Direction| if direction.peak { 0.0 } else { 1.0 };
        let (upper_inner, lower_inner) = match scheme {
            Scheme::S => (0.5, 0.5),
            Scheme::Rs => (1.0, 1.0),
            Scheme::Zvo => (by_angle(upper), by_angle(lower)),
            Scheme::Rthd | Scheme::RthdCentral | Scheme::RthdSlide => (0.0, 0.0),
        };
        let (slides, central) = (scheme == Scheme::RthdSlide, scheme == Scheme::RthdCentral);
        Self { upper_inner, lower_inner, slides, central }
    }
}

/// A motor's steps in the rising half, each as a distance from the boundary, in periods: from 0 to the share's length,
/// `near` ≤ `between` ≤ `far`.
///
/// The upper motor's legs step 1 → 0 on the way from the boundary to the peak; the lower motor's, looked at backward, 1 → −1
/// on the way from the boundary to the valley.
#[derive(Clone, Copy, Debug)]
pub(super) struct Steps {
    pub near: f32,
    pub between: f32,
    pub far: f32,
}

/// The steps in a share, with the part `inner` of its zero time next to the boundary; `gap`, in periods, is the time of the
/// active vector next to the boundary.
#[inline]
pub(super) fn steps(share: &Share, inner: f32, gap: f32) -> Steps {
    let length = share.outward * (share.end - share.boundary);
    // Exactly 0 without an inner zero vector; and without an outer one `far` is exactly the share's length. So no step at the
    // boundary or at the end is split into two.
    let near = inner * (length - share.span);
    Steps { near, between: near + gap, far: near + share.span }
}
