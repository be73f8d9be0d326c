//! Angles and reference frames.
//!
//! Amplitude-invariant transforms: a balanced set of phase quantities with peak `x` is a space vector of length `x`.
//! All angles are electrical. [`Angle`] is a 32-bit fraction of a turn, so it wraps by itself and loses no
//! precision however long the drive runs.

#![forbid(unsafe_code)]

use core::ops::{Add, Mul, Neg, Sub};

/// √3.
pub const SQRT_3: f32 = 1.732_050_8;
/// Angle units in one turn, 2³².
const UNITS_PER_TURN: f32 = 4_294_967_296.0;
/// Angle units (2⁻³² turn) in one radian.
pub const UNITS_PER_RADIAN: f32 = UNITS_PER_TURN / core::f32::consts::TAU;

/// An angle, or a difference of two, as a fraction of a turn in units of 2⁻³² turn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Angle(pub u32);

/// Sine and cosine of one angle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SinCos {
    /// Sine.
    pub sin: f32,
    /// Cosine.
    pub cos: f32,
}

impl Angle {
    /// The zero angle.
    pub const ZERO: Self = Self(0);
    /// 30°, rounded to the nearest unit.
    pub const DEG_30: Self = Self(357_913_941);
    /// 90°.
    pub const DEG_90: Self = Self(1 << 30);
    /// 120°, rounded to the nearest unit.
    pub const DEG_120: Self = Self(1_431_655_765);

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

    /// Sine and cosine, absolute error below 1.5e-7: the nearest direction of a table, turned by what is left. No branch.
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

/// Steps a turn in [`DIRECTIONS`]: half a step to the fourth over 24 is 1.5e-8.
const STEPS: usize = 1 << STEP_BITS;
const STEP_BITS: u32 = 7;

/// Sine and cosine of the middle of each step, to the last bit.
static DIRECTIONS: [SinCos; STEPS] = {
    let mut directions = [SinCos { sin: 0.0, cos: 1.0 }; STEPS];
    let mut k = 0;
    while k < STEPS {
        directions[k] = SinCos::of_turns((2 * k + 1) as f64 / (2 * STEPS) as f64);
        k += 1;
    }
    directions
};

/// The power series, at compile time, 0 ≤ radians ≤ 2π.
const fn series(radians: f64) -> SinCos {
    let (mut sin, mut cos, mut term, mut n) = (0.0, 0.0, 1.0, 0);
    while n < 40 {
        // cos + j sin is the sum of (j x)ⁿ/n!.
        match n % 4 {
            0 => cos += term,
            1 => sin += term,
            2 => cos -= term,
            _ => sin -= term,
        }
        n += 1;
        term *= radians / n as f64;
    }
    SinCos { sin: sin as f32, cos: cos as f32 }
}

impl SinCos {
    /// Of an angle in turns, 0 ≤ turns ≤ 1, to the last bit; for tables.
    pub const fn of_turns(turns: f64) -> Self {
        series(turns * core::f64::consts::TAU)
    }

    /// The direction turned on by another one: the sum of the angles.
    #[inline]
    pub fn turned(self, by: Self) -> Self {
        Self { sin: self.sin * by.cos + self.cos * by.sin, cos: self.cos * by.cos - self.sin * by.sin }
    }

    /// The direction of six times the angle.
    #[inline]
    pub fn sixfold(self) -> Self {
        let threefold = self.turned(self).turned(self);
        threefold.turned(threefold)
    }

    /// The direction of the opposite angle.
    #[inline]
    pub fn back(self) -> Self {
        Self { sin: -self.sin, ..self }
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

/// Square root of a number that is known not to be negative, correctly rounded; NaN stays NaN.
#[inline]
pub fn root(x: f32) -> f32 {
    crate::board::fpu::sqrt(x)
}

/// Square root, correctly rounded; a negative number gives zero, NaN stays NaN.
#[inline]
pub fn sqrt(x: f32) -> f32 {
    if x < 0.0 { 0.0 } else { crate::board::fpu::sqrt(x) }
}

/// Peak phase voltage of the six-step fundamental, 2 udc/π, in V, of a link of `udc_v`.
pub fn six_step_v(udc_v: f32) -> f32 {
    udc_v * (2.0 * core::f32::consts::FRAC_1_PI)
}

/// `x` held between `low` and `high`; NaN stays NaN. (`f32::clamp` panics on a bad range; this cannot.)
#[inline]
pub fn limit(x: f32, low: f32, high: f32) -> f32 {
    if x < low {
        low
    } else if x > high {
        high
    } else {
        x
    }
}

/// `x` held between `-most` and `most`, which is not negative; NaN stays NaN.
#[inline]
pub fn limit_magnitude(x: f32, most: f32) -> f32 {
    if x.abs() > most { most.copysign(x) } else { x }
}

/// Three phase quantities.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Abc {
    /// Phase a (u).
    pub a: f32,
    /// Phase b (v).
    pub b: f32,
    /// Phase c (w).
    pub c: f32,
}

/// A space vector in the stationary frame; alpha along phase a.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AlphaBeta {
    /// Along phase a.
    pub alpha: f32,
    /// 90° ahead of phase a.
    pub beta: f32,
}

/// A space vector in the rotor frame; d along the magnet flux.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Dq {
    /// Direct axis.
    pub d: f32,
    /// Quadrature axis, 90° ahead of d.
    pub q: f32,
}

impl Abc {
    /// Clarke transform, amplitude-invariant, from all three phases (a common offset drops out).
    #[inline]
    pub fn clarke(self) -> AlphaBeta {
        AlphaBeta {
            alpha: (2.0 * self.a - self.b - self.c) * (1.0 / 3.0),
            beta: (self.b - self.c) * (1.0 / SQRT_3),
        }
    }

    /// As words: the bits of each.
    #[inline(always)]
    pub const fn to_bits(self) -> [u32; 3] {
        [self.a.to_bits(), self.b.to_bits(), self.c.to_bits()]
    }

    /// The inverse of [`Self::to_bits`].
    #[inline(always)]
    pub const fn from_bits([a, b, c]: [u32; 3]) -> Self {
        Self { a: f32::from_bits(a), b: f32::from_bits(b), c: f32::from_bits(c) }
    }

    /// The largest magnitude of the three.
    #[inline]
    pub fn peak(self) -> f32 {
        let (a, b, c) = (self.a.abs(), self.b.abs(), self.c.abs());
        let ab = if a > b { a } else { b };
        if ab > c { ab } else { c }
    }
}

impl AlphaBeta {
    /// Into the frame that stands at the angle of `frame` (Park).
    #[inline]
    pub fn park(self, frame: SinCos) -> Dq {
        Dq {
            d: self.alpha * frame.cos + self.beta * frame.sin,
            q: self.beta * frame.cos - self.alpha * frame.sin,
        }
    }

    /// The angle of the vector.
    #[inline]
    pub fn angle(self) -> Angle {
        Angle::of_vector(self.alpha, self.beta)
    }

    /// Square of the length.
    #[inline]
    pub fn squared(self) -> f32 {
        self.alpha * self.alpha + self.beta * self.beta
    }

    /// Scalar product.
    #[inline]
    pub fn dot(self, other: Self) -> f32 {
        self.alpha * other.alpha + self.beta * other.beta
    }

    /// Turned by the angle of a direction.
    #[inline]
    pub fn turned(self, by: SinCos) -> Self {
        Self {
            alpha: self.alpha * by.cos - self.beta * by.sin,
            beta: self.beta * by.cos + self.alpha * by.sin,
        }
    }

    /// Inverse Clarke.
    #[inline]
    pub fn abc(self) -> Abc {
        let (x, y) = (-0.5 * self.alpha, 0.5 * SQRT_3 * self.beta);
        Abc { a: self.alpha, b: x + y, c: x - y }
    }
}

impl Dq {
    /// Out of the frame that stands at the angle of `frame` (inverse Park).
    #[inline]
    pub fn unpark(self, frame: SinCos) -> AlphaBeta {
        AlphaBeta {
            alpha: self.d * frame.cos - self.q * frame.sin,
            beta: self.q * frame.cos + self.d * frame.sin,
        }
    }

    /// Turned by 90°: multiplication by j.
    #[inline]
    pub fn j(self) -> Self {
        Self { d: -self.q, q: self.d }
    }

    /// Squared length.
    #[inline]
    pub fn squared(self) -> f32 {
        self.d * self.d + self.q * self.q
    }

    /// Length.
    #[inline]
    pub fn length(self) -> f32 {
        crate::board::fpu::sqrt(self.squared())
    }

    /// Turned by the angle of a direction.
    #[inline]
    pub fn turned(self, by: SinCos) -> Self {
        Self { d: self.d * by.cos - self.q * by.sin, q: self.q * by.cos + self.d * by.sin }
    }

    /// Scalar product.
    #[inline]
    pub fn dot(self, other: Self) -> f32 {
        self.d * other.d + self.q * other.q
    }

    /// The angle of the vector in its frame.
    #[inline]
    pub fn angle(self) -> Angle {
        Angle::of_vector(self.d, self.q)
    }
}

macro_rules! vector_arithmetic {
    ($type:ident, $x:ident, $y:ident) => {
        impl Add for $type {
            type Output = Self;
            #[inline]
            fn add(self, other: Self) -> Self {
                Self { $x: self.$x + other.$x, $y: self.$y + other.$y }
            }
        }
        impl Sub for $type {
            type Output = Self;
            #[inline]
            fn sub(self, other: Self) -> Self {
                Self { $x: self.$x - other.$x, $y: self.$y - other.$y }
            }
        }
        impl Mul<f32> for $type {
            type Output = Self;
            #[inline]
            fn mul(self, scale: f32) -> Self {
                Self { $x: self.$x * scale, $y: self.$y * scale }
            }
        }
    };
}
vector_arithmetic!(AlphaBeta, alpha, beta);
vector_arithmetic!(Dq, d, q);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits_hold_both_ends_and_leave_nan() {
        for (x, held) in
            [(0.4, 0.4), (-0.4, -0.4), (1.0, 1.0), (7.0, 1.0), (-7.0, -1.0), (f32::INFINITY, 1.0)]
        {
            assert_eq!((limit(x, -1.0, 1.0), limit_magnitude(x, 1.0)), (held, held), "{x}");
        }
        assert!(limit(f32::NAN, -1.0, 1.0).is_nan() && limit_magnitude(f32::NAN, 1.0).is_nan());
    }

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

    #[test]
    fn park_and_back_is_the_same_vector() {
        let frame = Angle::from_turns(0.137).sin_cos();
        let vector = Abc { a: 3.0, b: -5.0, c: 2.0 }.clarke();
        let back = vector.park(frame).unpark(frame);
        assert!((back.alpha - vector.alpha).abs() < 1e-5 && (back.beta - vector.beta).abs() < 1e-5);
        let abc = vector.abc();
        assert!((abc.b + 5.0).abs() < 1e-5 && (abc.c - 2.0).abs() < 1e-5);
    }
}
