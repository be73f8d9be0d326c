//! Runge–Kutta steps, used by all plants.

/// A state moved along its rates of change.
#[inline]
pub fn along<const N: usize>(y: &[f64; N], slope: &[f64; N], dt_s: f64) -> [f64; N] {
    let mut out = *y;
    for (value, rate) in out.iter_mut().zip(slope) {
        *value += dt_s * rate;
    }
    out
}

/// A state after a fourth-order step, from its rates of change in the frames of the step's beginning, middle and end.
#[inline]
pub fn stepped<const N: usize, F>(
    y0: &[f64; N],
    [begin, middle, end]: [F; 3],
    dt_s: f64,
    rates: impl Fn(&[f64; N], &F) -> [f64; N],
) -> [f64; N] {
    let k1 = rates(y0, &begin);
    let k2 = rates(&along(y0, &k1, 0.5 * dt_s), &middle);
    let k3 = rates(&along(y0, &k2, 0.5 * dt_s), &middle);
    let k4 = rates(&along(y0, &k3, dt_s), &end);
    let mut y = *y0;
    for (index, value) in y.iter_mut().enumerate() {
        *value += dt_s / 6.0 * (k1[index] + 2.0 * (k2[index] + k3[index]) + k4[index]);
    }
    y
}

/// Sine and cosine of an angle after a rotation by another one, of which sine and cosine are given.
#[inline]
pub fn rotated((sin, cos): (f64, f64), (s, c): (f64, f64)) -> (f64, f64) {
    (sin * c + cos * s, cos * c - sin * s)
}
