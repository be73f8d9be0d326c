//! In which order the vectors come: where each scheme puts the zero vectors.
//!
//! Rising half with both motors in sector I; the falling half is its mirror image:
//!
//! | scheme | vectors | zero time |
//! |---|---|---|
//! | S | V15 V8 V7 V13 V2 V1 V14 | half to V14 and V15, half to V13 |
//! | RS | V8 V7 V13 V2 V1 | all to V13 |
//! | RTHD | V15 V8 V7 V2 V1 V14 | all to V14 and V15 |
//! | ZVO | each motor as RTHD or as RS | by the half-sector of its angle |

use super::shares::Boundary;
use super::vectors::{Leg, Phases};
use super::{MotorVoltage, Request};
use crate::frames::Angle;

/// Where the zero vectors and the shoot-through lie. Toggles a period in brackets, with shoot-through or without.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(u8)]
pub enum Scheme {
    /// S-SVPWM: all three zero vectors (24); the least ripple in the Z-source's inductors.
    S,
    /// RS-SVPWM: V13 only (16), the fewest losses.
    Rs,
    /// RTHD-SVPWM: V14 and V15 (20 or 24), the least harmonics in the motors' currents.
    #[default]
    Rthd,
    /// ZVO-SVPWM: each motor by its angle (19.7 in the mean).
    Zvo,
    /// RTHD with the shoot-through in the centres of V14 and V15: for comparison, four toggles more.
    RthdCentral,
    /// RTHD with a boundary that slides, so that both motors have the same zero time.
    RthdSlide,
}

impl Scheme {
    /// Every scheme, in the order of its discriminant.
    pub const ALL: [Self; 6] = [Self::S, Self::Rs, Self::Rthd, Self::Zvo, Self::RthdCentral, Self::RthdSlide];

    /// The name in traces and on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::S => "s",
            Self::Rs => "rs",
            Self::Rthd => "rthd",
            Self::Zvo => "zvo",
            Self::RthdCentral => "rthd-central",
            Self::RthdSlide => "rthd-slide",
        }
    }
}

/// Which zero vectors a motor uses.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Zeros {
    /// V13, next to the boundary.
    Inner,
    /// V14 around the peak (upper motor), V15 around the valley (lower motor).
    Outer,
    /// Half of each.
    Both,
}

impl Zeros {
    /// By the angle's half-sector: outer for −30° ≤ θ < 30° and so on every 120°, where a phase is at its positive
    /// peak; inner between.
    #[inline]
    fn by_angle(angle: Angle) -> Self {
        // A unit more than 30°, because 60° and 120° are no whole numbers of units: what is rounded down to a border
        // still counts as beyond it.
        let shifted = angle + Angle::DEG_30 + Angle(1);
        let half_sectors = (u64::from(shifted.0) * 6) >> 32;
        if half_sectors & 1 == 0 { Self::Outer } else { Self::Inner }
    }

    /// The part of the zero time that lies next to the boundary, 0 ..= 1.
    #[inline]
    pub const fn inner_part(self) -> f32 {
        match self {
            Self::Inner => 1.0,
            Self::Outer => 0.0,
            Self::Both => 0.5,
        }
    }
}

/// Where in a zero vector the shoot-through lies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Site {
    Sides,
    Centre,
}

/// A scheme at given angles.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sequence {
    pub upper: Zeros,
    pub lower: Zeros,
    pub boundary: Boundary,
    pub site: Site,
}

impl Sequence {
    #[inline]
    pub fn of(request: &Request) -> Self {
        let (boundary, site) = match request.scheme {
            Scheme::RthdSlide => (Boundary::Sliding, Site::Sides),
            Scheme::RthdCentral => (Boundary::Fixed, Site::Centre),
            _ => (Boundary::Fixed, Site::Sides),
        };
        let zeros = |motor: &MotorVoltage| match request.scheme {
            Scheme::S => Zeros::Both,
            Scheme::Rs => Zeros::Inner,
            Scheme::Zvo => Zeros::by_angle(motor.angle),
            Scheme::Rthd | Scheme::RthdCentral | Scheme::RthdSlide => Zeros::Outer,
        };
        Self { upper: zeros(&request.upper), lower: zeros(&request.lower), boundary, site }
    }
}

/// On which side of the boundary a motor has its turn.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sides {
    /// The end of the turn that is not the boundary: 1/2, the peak, or 0, the valley.
    pub end: f32,
    /// Direction from the boundary to the end.
    pub outward: f32,
}

/// A motor's compare instants in the rising half, in periods.
#[derive(Clone, Copy, Debug)]
pub(super) struct Compare {
    /// Of the legs U, V, W.
    pub instants: [f32; 3],
    /// The leg that steps next to the boundary, and when.
    pub near: (Leg, f32),
    /// The leg that steps next to the end, and when.
    pub far: (Leg, f32),
}

impl Sides {
    /// The motor at the H–M nodes: its legs step 1 → 0, the smallest phase first.
    pub const UPPER: Self = Self { end: 0.5, outward: 1.0 };
    /// The motor at the M–L nodes: its legs step −1 → 1, the smallest phase first.
    pub const LOWER: Self = Self { end: 0.0, outward: -1.0 };

    /// The compare instants. `depth` times the phases' span is at most four times the turn's length.
    #[inline]
    pub fn place(&self, phases: &Phases, depth: f32, zeros: Zeros, boundary: f32) -> Compare {
        let (near, far) = if self.outward > 0.0 {
            (phases.smallest, phases.largest)
        } else {
            (phases.largest, phases.smallest)
        };
        let quarter = 0.25 * depth;
        // Counted from the leg whose instant is known, so that this one is met exactly: a step on the boundary or
        // at the end must not become two.
        let (anchor, phase) = match zeros {
            Zeros::Outer => (boundary, near.1),
            Zeros::Inner => (self.end, far.1),
            Zeros::Both => {
                let zero = (self.end - boundary) - quarter * (far.1 - near.1);
                (boundary + 0.5 * zero, near.1)
            }
        };
        let instant = |value: f32| anchor + quarter * (value - phase);
        Compare {
            instants: phases.values.map(instant),
            near: (near.0, instant(near.1)),
            far: (far.0, instant(far.1)),
        }
    }
}
