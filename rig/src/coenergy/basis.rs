//! The co-energy as one polynomial, even in the current along q, and its derivatives: flux linkages that are reciprocal by construction.
//!
//! `W'(i_d, i_q) = Σ c_mn T_m(x) T_2n(y)` in Chebyshev polynomials of the scaled currents, `ψ_d = ∂W'/∂i_d`, `ψ_q = ∂W'/∂i_q`.

/// Highest powers along d and along q; the pairs that are used lie below a straight line between them.
const MOST_D: usize = 12;
const MOST_Q: usize = 24;

/// The rectangle of the polynomial, as shares of the bound: along d its middle and its half width, along q its half width.
const MIDDLE_D: f64 = -0.4;
const WIDTH_D: f64 = 0.72;
const WIDTH_Q: f64 = 1.12;

/// The terms of the polynomial over a rectangle of currents.
#[derive(Clone, Debug)]
pub struct Basis {
    middle_a: f64,
    width_d_a: f64,
    width_q_a: f64,
    /// Orders along d and q.
    terms: Vec<(usize, usize)>,
}

/// The first `N` Chebyshev polynomials, each with its first derivatives, `K` values in all.
fn chebyshev<const N: usize, const K: usize>(x: f64) -> [[f64; K]; N] {
    let mut all = [[0.0; K]; N];
    all[0][0] = 1.0;
    (all[1][0], all[1][1]) = (x, 1.0);
    for n in 2..N {
        let (last, before) = (all[n - 1], all[n - 2]);
        // The k-th derivative of 2 x T less the polynomial before.
        all[n] = core::array::from_fn(|k| {
            2.0 * x * last[k] - before[k] + if k > 0 { 2.0 * k as f64 * last[k - 1] } else { 0.0 }
        });
    }
    all
}

impl Basis {
    /// For currents within a bound, in A.
    pub fn new(bound_a: f64) -> Self {
        Self::over(MIDDLE_D * bound_a, WIDTH_D * bound_a, WIDTH_Q * bound_a)
    }

    /// Over a rectangle: along d its middle and its half width, along q its half width, in A.
    pub fn over(middle_a: f64, width_d_a: f64, width_q_a: f64) -> Self {
        let below = |m: usize, n: usize| {
            m as f64 / MOST_D as f64 + n as f64 / MOST_Q as f64 <= 1.0 && (m, n) != (0, 0)
        };
        let all = (0..=MOST_D).flat_map(|m| (0..=MOST_Q).step_by(2).map(move |n| (m, n)));
        Self { middle_a, width_d_a, width_q_a, terms: all.filter(|(m, n)| below(*m, *n)).collect() }
    }

    /// Terms.
    pub fn len(&self) -> usize {
        self.terms.len()
    }

    /// The contribution of each term to a derivative of the co-energy, of these orders along d and q, at a current in A.
    pub fn derivative(&self, current: (f64, f64), orders: (usize, usize)) -> Vec<f64> {
        let [derivative] = self.derivatives::<1, 5>(current, [orders]);
        derivative
    }

    /// The contribution of each term to the flux linkages along d and q at a current in A.
    pub fn flux(&self, current: (f64, f64)) -> [Vec<f64>; 2] {
        self.derivatives::<2, 2>(current, [(1, 0), (0, 1)])
    }

    /// Derivatives of orders below `K`.
    fn derivatives<const N: usize, const K: usize>(
        &self,
        (id, iq): (f64, f64),
        orders: [(usize, usize); N],
    ) -> [Vec<f64>; N] {
        let along_x = chebyshev::<{ MOST_D + 1 }, K>((id - self.middle_a) / self.width_d_a);
        let along_y = chebyshev::<{ MOST_Q + 1 }, K>(iq / self.width_q_a);
        orders.map(|(along_d, along_q)| {
            let scale = self.width_d_a.powi(along_d as i32) * self.width_q_a.powi(along_q as i32);
            self.terms.iter().map(|(m, n)| along_x[*m][along_d] * along_y[*n][along_q] / scale).collect()
        })
    }

    /// Currents on an even grid over the rectangle, of one sign along q.
    pub fn grid(&self, rows: u32, columns: u32) -> impl Iterator<Item = (f64, f64)> + '_ {
        (0..rows).flat_map(move |row| {
            let id = self.middle_a + self.width_d_a * (2.0 * f64::from(row) / f64::from(rows - 1) - 1.0);
            (0..columns).map(move |column| (id, self.width_q_a * f64::from(column) / f64::from(columns - 1)))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_derivatives_are_those_of_the_polynomial() {
        let basis = Basis::new(100.0);
        let (at, step) = ((-30.0, 20.0), 1e-3);
        let along_d = (0..4).map(|order| ((order, 0), (order + 1, 0)));
        let orders = along_d.chain((0..4).map(|order| ((0, order), (0, order + 1))));
        for (low, high) in orders {
            let along_d = high.0 > low.0;
            let moved = |by: f64| if along_d { (at.0 + by, at.1) } else { (at.0, at.1 + by) };
            let (before, after) = (basis.derivative(moved(-step), low), basis.derivative(moved(step), low));
            for ((a, b), slope) in before.iter().zip(&after).zip(basis.derivative(at, high)) {
                let seen = (b - a) / (2.0 * step);
                assert!((seen - slope).abs() < 1e-4 * (1.0 + slope.abs()), "{low:?}: {seen}, {slope}");
            }
        }
    }

    #[test]
    fn flux_along_q_is_odd_and_that_along_d_even() {
        let basis = Basis::new(100.0);
        let ([d, q], [d_image, q_image]) = (basis.flux((-40.0, 30.0)), basis.flux((-40.0, -30.0)));
        assert!(d.iter().zip(&d_image).all(|(a, b)| (a - b).abs() < 1e-9));
        assert!(q.iter().zip(&q_image).all(|(a, b)| (a + b).abs() < 1e-9));
        assert!(q.iter().any(|value| value.abs() > 1e-3));
    }
}
