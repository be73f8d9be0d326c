//! Functions of single numbers: roots, limits, and the largest fundamental.

/// Square root of a number that is known not to be negative, correctly rounded; NaN stays NaN.
#[inline]
pub fn root(x: f32) -> f32 {
    super::fpu::sqrt(x)
}

/// Square root, correctly rounded; a negative number gives zero, NaN stays NaN.
#[inline]
pub fn sqrt(x: f32) -> f32 {
    if x < 0.0 { 0.0 } else { super::fpu::sqrt(x) }
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
}
