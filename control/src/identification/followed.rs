//! The currents as they follow voltages: they tell a machine from current sensors that read something else.
//!
//! Changes of current are volt-seconds times the inverse of the inductance, a symmetric matrix with positive eigenvalues, wherever the rotor stands.
//! Sensors in another order than the phases turn or mirror this matrix; sensors of the wrong sign make it indefinite.

use crate::frames::Dq;

/// Sums over pulses that lie along d or along q.
#[derive(Clone, Copy, Debug)]
pub struct Followed {
    /// Changes of current times volt-seconds along d, and along q, in A·V·s.
    by_d: Dq,
    by_q: Dq,
    /// Squares of the volt-seconds.
    squares: Dq,
}

/// Largest asymmetry, as a share of the trace; with sensors in another order it is 1.7.
const ASYMMETRY: f32 = 0.5;

const NONE: Dq = Dq { d: 0.0, q: 0.0 };

impl Followed {
    /// The sums before the first pulse.
    pub const NOTHING: Self = Self { by_d: NONE, by_q: NONE, squares: NONE };

    /// The sums with one more pulse.
    pub fn and(self, change: Dq, acted: Dq) -> Self {
        Self {
            by_d: self.by_d + change * acted.d,
            by_q: self.by_q + change * acted.q,
            squares: self.squares + Dq { d: acted.d * acted.d, q: acted.q * acted.q },
        }
    }

    /// `true` if the sums are a machine's.
    pub fn is_machine(self) -> bool {
        let (by_d, by_q) = (self.by_d * self.squares.q, self.by_q * self.squares.d);
        let (trace, skew) = (by_d.d + by_q.q, by_q.d - by_d.q);
        let most = ASYMMETRY * trace;
        by_d.d * by_q.q > by_d.q * by_q.d && skew < most && -skew < most
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_salient_machine_is_one_and_exchanged_sensors_are_none() {
        let of = |dd: f32, dq: f32, qd: f32, qq: f32| {
            let pulses = [
                Dq { d: 0.1, q: 0.0 },
                Dq { d: 0.0, q: 0.2 },
                Dq { d: -0.1, q: 0.0 },
                Dq { d: 0.0, q: -0.2 },
            ];
            let change = |acted: Dq| Dq { d: dd * acted.d + dq * acted.q, q: qd * acted.d + qq * acted.q };
            pulses
                .into_iter()
                .fold(Followed::NOTHING, |sums, acted| sums.and(change(acted), acted))
                .is_machine()
        };
        assert!(of(16.0, 0.0, 0.0, 1.0) && of(15.5, 2.56, 2.56, 1.45) && of(1.0, 0.0, 0.0, 1.0));
        // All of the wrong sign; two exchanged; one of the wrong sign; in another order; in another order and of the wrong sign.
        assert!(!of(-1.0, 0.0, 0.0, -1.0) && !of(1.0, 0.0, 0.0, -1.0) && !of(-1.0 / 3.0, 0.0, 0.0, 1.0));
        assert!(!of(-0.5, 0.866, -0.866, -0.5) && !of(0.5, 0.866, -0.866, 0.5));
        assert!(!Followed::NOTHING.is_machine());
    }
}
