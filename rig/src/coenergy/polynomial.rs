//! The co-energy's polynomial with its terms.

use super::basis::Basis;

/// A co-energy of the current, and its derivatives.
#[derive(Clone, Debug)]
pub struct Polynomial {
    /// Its Chebyshev polynomials.
    pub basis: Basis,
    /// The factor of each.
    pub terms: Vec<f64>,
}

impl Polynomial {
    fn sum(&self, parts: &[f64]) -> f64 {
        parts.iter().zip(&self.terms).map(|(a, b)| a * b).sum()
    }

    /// Flux linkages along d and q at a current in A, in Wb.
    pub fn flux(&self, current: (f64, f64)) -> (f64, f64) {
        let [d, q] = self.basis.flux(current);
        (self.sum(&d), self.sum(&q))
    }

    /// Incremental inductances, in H: along d, between d and q, along q.
    pub fn inductances(&self, current: (f64, f64)) -> [f64; 3] {
        [(2, 0), (1, 1), (0, 2)].map(|orders| self.sum(&self.basis.derivative(current, orders)))
    }

    /// Flux linkages at a current in A. Beyond a circle they continue straight outward from it, with the incremental inductances on the circle. As
    /// these vary around it, a part along the circle keeps both the derivatives of one co-energy, `W + W_r h + W_rr h²/2`.
    pub fn flux_further(&self, current: (f64, f64), from_a: f64) -> (f64, f64) {
        let r = current.0.hypot(current.1);
        if r <= from_a {
            return self.flux(current);
        }
        let (h, c, s) = (r - from_a, current.0 / r, current.1 / r);
        let at = (from_a * c, from_a * s);
        let of = |orders| self.sum(&self.basis.derivative(at, orders));
        let (psi, [dd, dq, qq]) = (self.flux(at), self.inductances(at));
        let [ddd, ddq, dqq, qqq]: [f64; 4] = [(3, 0), (2, 1), (1, 2), (0, 3)].map(of);
        let around =
            c * s * (qqq * s - ddd * c) + ddq * c * (c * c - 2.0 * s * s) + dqq * s * (2.0 * c * c - s * s);
        let bent = 0.5 * h * h * from_a / r * around;
        (psi.0 + h * (dd * c + dq * s) - bent * s, psi.1 + h * (dq * c + qq * s) + bent * c)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_map_beyond_the_circle_is_still_one_co_energys_gradient() {
        let basis = Basis::new(100.0);
        let terms: Vec<f64> = (0..basis.len()).map(|k| (1.0 + k as f64).sin() / (1.0 + k as f64)).collect();
        let polynomial = Polynomial { basis, terms };
        let (flux, step_a) = (|d: f64, q: f64| polynomial.flux_further((d, q), 90.0), 1e-4);
        for (d, q) in [(-80.0, 60.0), (-100.0, 20.0), (-70.0, -95.0), (15.0, 100.0)] {
            let by_q = (flux(d, q + step_a).0 - flux(d, q - step_a).0) / (2.0 * step_a);
            let by_d = (flux(d + step_a, q).1 - flux(d - step_a, q).1) / (2.0 * step_a);
            assert!((by_q - by_d).abs() < 1e-6 * (1.0 + by_q.abs()), "{d}, {q}: {by_q}, {by_d}");
        }
        let (within, beyond) = (flux(-53.999, 71.999), flux(-54.001, 72.001));
        assert!((within.0 - beyond.0).hypot(within.1 - beyond.1) < 1e-3, "{within:?}, {beyond:?}");
    }
}
