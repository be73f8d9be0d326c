//! Phase quantities and space vectors, and the transforms between their frames.

use core::ops::{Add, Mul, Sub};

use super::{Angle, SinCos};

/// √3.
pub const SQRT_3: f32 = 1.732_050_8;

/// Three phase quantities.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
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
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct AlphaBeta {
    /// Along phase a.
    pub alpha: f32,
    /// 90° ahead of phase a.
    pub beta: f32,
}

/// A space vector in the rotor frame; d along the magnet flux.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
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

    /// The sum of the three squares.
    #[inline]
    pub fn squares(self) -> f32 {
        self.a * self.a + self.b * self.b + self.c * self.c
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
        super::fpu::sqrt(self.squared())
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
    fn park_and_back_is_the_same_vector() {
        let frame = Angle::from_turns(0.137).sin_cos();
        let vector = Abc { a: 3.0, b: -5.0, c: 2.0 }.clarke();
        let back = vector.park(frame).unpark(frame);
        assert!((back.alpha - vector.alpha).abs() < 1e-5 && (back.beta - vector.beta).abs() < 1e-5);
        let abc = vector.abc();
        assert!((abc.b + 5.0).abs() < 1e-5 && (abc.c - 2.0).abs() < 1e-5);
    }
}
