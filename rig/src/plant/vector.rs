//! Space vectors in f64.

/// A vector in the stationary frame, amplitude-invariant; alpha along phase u.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Vector {
    /// Along phase u.
    pub alpha: f64,
    /// 90° ahead of it.
    pub beta: f64,
}

impl Vector {
    /// Made of three phases; their common component drops out.
    #[inline]
    pub fn clarke([a, b, c]: [f64; 3]) -> Self {
        Self { alpha: (2.0 * a - b - c) / 3.0, beta: (b - c) / 3.0_f64.sqrt() }
    }

    /// The phases.
    #[inline]
    pub fn phases(self) -> [f64; 3] {
        let (x, y) = (-0.5 * self.alpha, 0.5 * 3.0_f64.sqrt() * self.beta);
        [self.alpha, x + y, x - y]
    }

    /// Transformed from a frame at an angle of this sine and cosine.
    #[inline]
    pub fn from_rotor((d, q): (f64, f64), (sin, cos): (f64, f64)) -> Self {
        Self { alpha: d * cos - q * sin, beta: d * sin + q * cos }
    }

    /// Transformed into such a frame.
    #[inline]
    pub fn to_rotor(self, (sin, cos): (f64, f64)) -> (f64, f64) {
        (self.alpha * cos + self.beta * sin, self.beta * cos - self.alpha * sin)
    }
}
