//! Sample and hold of the phase currents: each phase at its own instant, before the nominal instant of the sample.

use super::Tick;

/// The holds of one converter.
#[derive(Clone, Copy, Debug, Default)]
pub struct Holds {
    /// Number of ticks by which each phase is early.
    early: [Tick; 3],
    held_a: [f64; 3],
}

impl Holds {
    /// Each phase is early by this many ticks.
    pub fn new(early: [Tick; 3]) -> Self {
        Self { early, held_a: [0.0; 3] }
    }

    /// The next instant after `now` at which a phase is held for a conversion at `at`.
    pub fn next_event(&self, now: Tick, at: Tick) -> Option<Tick> {
        let instants =
            self.early.into_iter().filter(|early| *early > 0).map(|early| at.saturating_sub(early));
        instants.filter(|instant| *instant > now).min()
    }

    /// Holds the phases whose instant for a conversion at `at` is now.
    pub fn act(&mut self, now: Tick, at: Tick, currents_a: impl FnOnce() -> [f64; 3]) {
        let due = self.early.map(|early| early > 0 && now + early == at);
        if due.contains(&true) {
            let now_a = currents_a();
            for (held_a, (due, now_a)) in self.held_a.iter_mut().zip(due.into_iter().zip(now_a)) {
                *held_a = if due { now_a } else { *held_a };
            }
        }
    }

    /// The phase currents of a conversion now: the held ones, and the others at their present values.
    pub fn read(&self, now_a: [f64; 3]) -> [f64; 3] {
        core::array::from_fn(|phase| if self.early[phase] > 0 { self.held_a[phase] } else { now_a[phase] })
    }
}

#[cfg(test)]
mod tests {
    use super::Holds;

    #[test]
    fn each_phase_is_held_at_its_instant() {
        let mut holds = Holds::new([20, 5, 0]);
        assert_eq!([0, 80, 95].map(|now| holds.next_event(now, 100)), [Some(80), Some(95), None]);
        for now in 0..=100_u32 {
            holds.act(now.into(), 100, || [f64::from(now); 3]);
        }
        assert_eq!(holds.read([100.0; 3]), [80.0, 95.0, 100.0]);
    }
}
