//! Observations of the turn, gathered: a rotor that turns slowly is observed for longer with the same memory.

use super::observation::Observation;
use crate::frames::AlphaBeta;

/// The sum of everything that has acted since the last observation was told.
#[derive(Clone, Copy, Debug)]
pub struct Gathered {
    volt_seconds: AlphaBeta,
    length_s: f32,
    boundaries: u32,
}

/// Boundaries in an observation of the turn. A boundary's is at most two halves long, a packed observation seven.
const BOUNDARIES: u32 = 3;

impl Gathered {
    /// The sum before the first boundary.
    pub const NOTHING: Self =
        Self { volt_seconds: AlphaBeta { alpha: 0.0, beta: 0.0 }, length_s: 0.0, boundaries: 0 };

    /// Takes a boundary's observation; returns the sum of all since the last one when it is to be told.
    pub fn take(&mut self, observation: Observation) -> Option<Observation> {
        self.volt_seconds = self.volt_seconds + observation.volt_seconds;
        self.length_s += observation.length_s;
        self.boundaries += 1;
        if self.boundaries < BOUNDARIES {
            return None;
        }
        let Self { volt_seconds, length_s, .. } = core::mem::replace(self, Self::NOTHING);
        Some(Observation { volt_seconds, length_s, ..observation })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frames::{Dq, SinCos};
    use crate::identification::Stage;

    #[test]
    fn three_boundaries_are_one_with_the_last_ones_current() {
        let mut gathered = Gathered::NOTHING;
        let at = |number: f32| Observation {
            stage: Stage::Turn,
            volt_seconds: AlphaBeta { alpha: number, beta: -number },
            length_s: 0.5,
            current: Dq { d: number, q: 0.0 },
            frame: SinCos { sin: 0.0, cos: 1.0 },
            udc_v: 48.0,
        };
        for first in [1.0, 4.0] {
            assert!(gathered.take(at(first)).is_none() && gathered.take(at(first + 1.0)).is_none());
            let told = gathered.take(at(first + 2.0)).unwrap();
            let sum = 3.0 * first + 3.0;
            assert_eq!(told.volt_seconds, AlphaBeta { alpha: sum, beta: -sum });
            assert!(told.length_s == 1.5 && told.current.d == first + 2.0);
        }
    }
}
