//! The currents that the loops regulate: those where the carrier has no ripple, or the mean over a sixth of a turn.

use crate::frames::Dq;

/// Number of samples kept: a sixth of a turn at 70 Hz, at 20 kHz.
const KEPT: usize = 48;

/// The newest samples, rotor frame, in A.
#[derive(Clone, Copy, Debug)]
pub struct Samples {
    /// The sample at the newest carrier boundary.
    pub boundary: Option<Dq>,
    kept: [Dq; KEPT],
    newest: usize,
    count: usize,
}

impl Samples {
    /// The state without samples.
    pub const EMPTY: Self = Self { boundary: None, kept: [Dq { d: 0.0, q: 0.0 }; KEPT], newest: 0, count: 0 };

    /// Takes a control period's sample.
    pub fn push(&mut self, current: Dq) {
        self.newest = if self.newest + 1 < KEPT { self.newest + 1 } else { 0 };
        if let Some(place) = self.kept.get_mut(self.newest) {
            *place = current;
        }
        self.count = (self.count + 1).min(KEPT);
    }

    /// The mean over so many control periods, or over as many as there are.
    pub fn mean(&self, window: f32) -> Dq {
        let most = self.count as f32;
        let window = if window < most { window } else { most };
        let window = if window > 1.0 { window } else { 1.0 };
        let (mut sum, mut left, mut at) = (Dq::default(), window, self.newest);
        for _ in 0..KEPT {
            let Some(current) = self.kept.get(at) else { break };
            let share = if left < 1.0 { left } else { 1.0 };
            sum = sum + *current * share;
            left -= share;
            if left <= 0.0 {
                break;
            }
            at = if at > 0 { at - 1 } else { KEPT - 1 };
        }
        sum * (1.0 / window)
    }
}
