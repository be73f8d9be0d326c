//! Directions: sine and cosine of an angle, and the table that gives them.

/// Sine and cosine of one angle.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct SinCos {
    /// Sine.
    pub sin: f32,
    /// Cosine.
    pub cos: f32,
}

/// Steps a turn in [`DIRECTIONS`]: half a step to the fourth over 24 is 1.5e-8.
pub(super) const STEPS: usize = 1 << STEP_BITS;
pub(super) const STEP_BITS: u32 = 7;

/// Sine and cosine of the middle of each step, to the last bit.
pub(super) static DIRECTIONS: [SinCos; STEPS] = {
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
