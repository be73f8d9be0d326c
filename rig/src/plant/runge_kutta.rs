//! Runge–Kutta steps, as all plants make them.

/// A state moved along its rates of change.
#[inline]
pub fn along<const N: usize>(y: &[f64; N], slope: &[f64; N], dt_s: f64) -> [f64; N] {
    let mut out = *y;
    for (value, rate) in out.iter_mut().zip(slope) {
        *value += dt_s * rate;
    }
    out
}

/// Sine and cosine of an angle after turning by another one, of which sine and cosine are given.
#[inline]
pub fn rotated((sin, cos): (f64, f64), (s, c): (f64, f64)) -> (f64, f64) {
    (sin * c + cos * s, cos * c - sin * s)
}
