//! Angles that wrap by themselves.

use core::ops::{Add, Neg, Sub};

use super::direction::{DIRECTIONS, STEP_BITS, STEPS, SinCos};

/// Angle units in one turn, 2³².
const UNITS_PER_TURN: f32 = 4_294_967_296.0;
/// Angle units (2⁻³² turn) in one radian.
pub const UNITS_PER_RADIAN: f32 = UNITS_PER_TURN / core::f32::consts::TAU;

/// An angle, or a difference of two, as a fraction of a turn in units of 2⁻³² turn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Angle(pub u32);

impl Angle {
    /// The zero angle.
    pub const ZERO: Self = Self(0);
    /// 30°, rounded to the nearest unit.
    pub const DEG_30: Self = Self(357_913_941);
    /// 90°.
    pub const DEG_90: Self = Self(1 << 30);

    /// From a number of turns, any sign, |turns| < 2²⁴; NaN gives zero.
    #[inline]
    pub fn from_turns(turns: f32) -> Self {
        let fraction = turns - (turns as i32) as f32;
        // Half units, because a fraction in (−1, 1) of 2³² overflows an i32.
        Self((((fraction * (UNITS_PER_TURN / 2.0)) as i32) as u32) << 1)
    }

    /// From radians, any sign, |radians| < 10⁸.
    #[inline]
    pub fn from_radians(radians: f32) -> Self {
        Self::from_turns(radians * core::f32::consts::FRAC_1_PI * 0.5)
    }

    /// From radians, −π ≤ radians < π; beyond that the nearer end. NaN gives zero.
    #[inline]
    pub fn within_half_turn(radians: f32) -> Self {
        Self((radians * UNITS_PER_RADIAN) as i32 as u32)
    }

    /// The angle of the vector (`x`, `y`); error below 3e-7 rad. The zero vector gives zero.
    #[inline]
    pub fn of_vector(x: f32, y: f32) -> Self {
        let (ax, ay) = (x.abs(), y.abs());
        let steep = ay > ax;
        let (large, small) = if steep { (ay, ax) } else { (ax, ay) };
        if large == 0.0 {
            return Self::ZERO;
        }
        let first = (octant_atan(small, large) * UNITS_PER_RADIAN) as u32;
        let upper = if steep { (1 << 30) - first } else { first };
        let ahead = if x < 0.0 { (1 << 31) - upper } else { upper };
        Self(if y < 0.0 { ahead.wrapping_neg() } else { ahead })
    }

    /// In turns, 0 ≤ turns < 1 (rounding may give 1).
    #[inline]
    pub fn turns(self) -> f32 {
        self.0 as f32 / UNITS_PER_TURN
    }

    /// As a signed difference in radians, −π ≤ x < π.
    #[inline]
    pub fn signed_radians(self) -> f32 {
        self.signed() as f32 * (core::f32::consts::PI / (UNITS_PER_TURN / 2.0))
    }

    /// As a signed difference in units of 2⁻³² turn: the short way round.
    #[inline]
    pub fn signed(self) -> i32 {
        self.0 as i32
    }

    /// Sine and cosine, absolute error below 1.5e-7: the nearest direction of a table, turned by the remainder. No branch.
    #[inline]
    pub fn sin_cos(self) -> SinCos {
        const RAD_PER_UNIT: f32 = core::f32::consts::PI / (UNITS_PER_TURN / 2.0) / STEPS as f32;
        let node = DIRECTIONS[(self.0 >> (32 - STEP_BITS)) as usize];
        // The directions stand in the middle of their steps.
        let x = ((self.0 << STEP_BITS) ^ (1 << 31)) as i32 as f32 * RAD_PER_UNIT;
        let z = x * x;
        node.turned(SinCos { sin: x + x * z * (-1.0 / 6.0), cos: 1.0 - 0.5 * z })
    }
}

/// atan(small / large) for 0 ≤ small ≤ large, large > 0, in radians.
#[inline]
fn octant_atan(small: f32, large: f32) -> f32 {
    const TAN_PI_8: f32 = 0.414_213_57;
    let (offset, x) = if small > TAN_PI_8 * large {
        (core::f32::consts::FRAC_PI_4, (small - large) / (small + large))
    } else {
        (0.0, small / large)
    };
    let z = x * x;
    let series = ((8.053_744_6e-2 * z - 1.387_768_6e-1) * z + 1.997_771_1e-1) * z - 3.333_295e-1;
    offset + x + x * z * series
}

impl Add for Angle {
    type Output = Self;
    #[inline]
    fn add(self, other: Self) -> Self {
        Self(self.0.wrapping_add(other.0))
    }
}

impl Sub for Angle {
    type Output = Self;
    #[inline]
    fn sub(self, other: Self) -> Self {
        Self(self.0.wrapping_sub(other.0))
    }
}

impl Neg for Angle {
    type Output = Self;
    #[inline]
    fn neg(self) -> Self {
        Self(self.0.wrapping_neg())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sine_and_cosine_keep_their_documented_error() {
        for k in 0..100_000_u32 {
            let angle = Angle(k.wrapping_mul(42_949));
            let exact = f64::from(angle.0) / 4_294_967_296.0 * core::f64::consts::TAU;
            let got = angle.sin_cos();
            assert!((f64::from(got.sin) - exact.sin()).abs() < 1.5e-7, "{angle:?}");
            assert!((f64::from(got.cos) - exact.cos()).abs() < 1.5e-7, "{angle:?}");
        }
    }

    #[test]
    fn the_angle_of_a_vector_keeps_its_documented_error() {
        for k in 0..10_000_u32 {
            let exact = (f64::from(k) / 10_000.0 - 0.5) * core::f64::consts::TAU;
            let got = Angle::of_vector((700.0 * exact.cos()) as f32, (700.0 * exact.sin()) as f32);
            let error = got - Angle((exact / core::f64::consts::TAU * 4_294_967_296.0) as i64 as u32);
            assert!(error.signed_radians().abs() < 5e-7, "{exact} {got:?}");
        }
        assert_eq!(Angle::of_vector(0.0, 0.0), Angle::ZERO);
    }

    #[test]
    fn turns_wrap_both_ways() {
        assert_eq!(Angle::from_turns(1.25), Angle::DEG_90);
        assert_eq!(Angle::from_turns(-0.75), Angle::DEG_90);
        assert_eq!(Angle::from_turns(f32::NAN), Angle::ZERO);
    }
}
