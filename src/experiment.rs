//! An identification's memory: its observations in RAM as they come, and the frames that carry them off once it is over.
//!
//! Control observes faster than a bus can carry, so what it observes is kept, [`PACKED_WORDS`] words each, and told in the slots that the
//! drive's telemetry leaves free: over and over, so that a frame that is lost comes again.

#![forbid(unsafe_code)]

use crate::identification::{Observation, PACKED_WORDS, Packed, Stage, Units};
use crate::protocol::e2e::Counter;
use crate::protocol::{EXPERIMENT, ExperimentFrame, Frame, OBSERVATION, ObservationFrame};
use core::sync::atomic::{AtomicU32, Ordering};

/// Observations that the longest experiment makes: 82 KB of RAM.
pub const OBSERVATIONS: usize = 6_800;

/// The observations of the last experiment. One interrupt writes; anybody reads what is counted.
pub struct Memory<const N: usize = OBSERVATIONS> {
    words: [[AtomicU32; PACKED_WORDS]; N],
    count: AtomicU32,
    /// The stage of the newest.
    stage: AtomicU32,
}

impl<const N: usize> Memory<N> {
    /// Before the first experiment.
    #[allow(clippy::declare_interior_mutable_const, reason = "an array initialiser, never borrowed")]
    pub const fn new() -> Self {
        Self {
            words: [const { [const { AtomicU32::new(0) }; PACKED_WORDS] }; N],
            count: AtomicU32::new(0),
            stage: AtomicU32::new(Stage::Done as u32),
        }
    }

    /// Control's side: the newest observation. The first of an experiment takes the place of the experiment before; of the end's there is
    /// one, and what finds no room is left out.
    pub fn keep(&self, observation: &Observation, units: &Units) {
        let before = self.stage();
        let begins = observation.stage == Stage::Probe && before != Stage::Probe;
        if observation.stage == Stage::Done && before == Stage::Done {
            return;
        }
        let count = if begins { 0 } else { self.count.load(Ordering::Relaxed) };
        if let Some(slot) = self.words.get(count as usize) {
            let Packed(words) = units.pack(observation);
            for (cell, word) in slot.iter().zip(words) {
                cell.store(word, Ordering::Relaxed);
            }
            self.count.store(count + 1, Ordering::Release);
        }
        self.stage.store(observation.stage as u32, Ordering::Release);
    }

    /// The stage of the newest observation.
    pub fn stage(&self) -> Stage {
        Stage::ALL.get(self.stage.load(Ordering::Acquire) as usize).copied().unwrap_or_default()
    }

    /// Observations so far.
    pub fn len(&self) -> u16 {
        self.count.load(Ordering::Acquire) as u16
    }

    /// `true` before the first observation.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// A word of an observation.
    fn word(&self, index: u16, part: u8) -> Option<u32> {
        if index >= self.len() {
            return None;
        }
        let word = self.words.get(usize::from(index))?.get(usize::from(part))?;
        Some(word.load(Ordering::Relaxed))
    }
}

impl<const N: usize> Default for Memory<N> {
    fn default() -> Self {
        Self::new()
    }
}

/// Calls between two frames of progress.
const PROGRESS_CALLS: u32 = 32;

/// The sender of what a [`Memory`] holds, in the slots that nothing else is sent in.
#[derive(Clone, Copy, Debug)]
pub struct Teller {
    counters: [Counter; 2],
    calls: u32,
    index: u16,
    part: u8,
}

impl Teller {
    /// At power-up.
    pub const fn new() -> Self {
        Self { counters: [Counter::new(); 2], calls: 0, index: 0, part: 0 }
    }

    /// The frame for a free slot: progress, and once the experiment is over its observations, one after the other and again from the first.
    pub fn tell<const N: usize>(&mut self, memory: &Memory<N>) -> Option<Frame> {
        let [progress, observed] = &mut self.counters;
        let stage = memory.stage();
        let turn = self.calls;
        self.calls = (turn + 1) % PROGRESS_CALLS;
        if turn == 0 {
            let content = ExperimentFrame { stage, observations: memory.len() };
            return Some(EXPERIMENT.frame(content.encode(), progress));
        }
        if stage != Stage::Done {
            (self.index, self.part) = (0, 0);
            return None;
        }
        let Self { index, part, .. } = *self;
        let content = ObservationFrame { index, part, word: memory.word(index, part)? };
        self.part += 1;
        if usize::from(self.part) == PACKED_WORDS {
            let next = index + 1;
            (self.index, self.part) = (if next < memory.len() { next } else { 0 }, 0);
        }
        Some(OBSERVATION.frame(content.encode(), observed))
    }
}

impl Default for Teller {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frames::{AlphaBeta, Dq, SinCos};
    use crate::machine::Ratings;
    use crate::protocol::Payload;

    const RATINGS: Ratings = crate::built_in::traction::BUILT_IN.ratings;

    fn observation(stage: Stage, d: f32) -> Observation {
        Observation {
            stage,
            volt_seconds: AlphaBeta::default(),
            length_s: 0.5 / RATINGS.max_switching_hz,
            current: Dq { d, q: 0.0 },
            frame: SinCos { sin: 0.0, cos: 1.0 },
            udc_v: 0.0,
        }
    }

    /// Currents that so many frames tell, by their observations' numbers.
    fn told(teller: &mut Teller, memory: &Memory<4>, units: &Units, frames: u32) -> [Option<f32>; 4] {
        let mut words = [[None; PACKED_WORDS]; 4];
        for frame in (0..frames).filter_map(|_| teller.tell(memory)) {
            let payload = Payload(u64::from_le_bytes(frame.data));
            if frame.id == OBSERVATION.id {
                let found = ObservationFrame::decode(payload).unwrap();
                words[usize::from(found.index)][usize::from(found.part)] = Some(found.word);
            }
        }
        words.map(|own| match own {
            [Some(a), Some(b), Some(c)] => Some(units.unpack(Packed([a, b, c])).current.d),
            _ => None,
        })
    }

    #[test]
    fn what_was_observed_is_told_again_and_again_once_the_experiment_is_over() {
        let (memory, units, mut teller) = (Memory::<4>::new(), Units::of(&RATINGS), Teller::new());
        assert_eq!(told(&mut teller, &memory, &units, 100), [None; 4]);
        for (stage, d) in [(Stage::Probe, 1.0), (Stage::AlongD, 2.0)] {
            memory.keep(&observation(stage, d), &units);
        }
        assert_eq!(told(&mut teller, &memory, &units, 100), [None; 4], "not before its end");
        for _ in 0..9 {
            memory.keep(&observation(Stage::Done, 3.0), &units);
        }
        assert_eq!(memory.len(), 3);
        for _ in 0..2 {
            let found = told(&mut teller, &memory, &units, 10);
            for (found, wanted) in found.into_iter().zip([1.0, 2.0, 3.0]) {
                assert!((found.unwrap() - wanted).abs() < 0.02);
            }
            assert_eq!(found[3], None);
        }
        // The next experiment takes its place, and what finds no room is left out.
        (0..6).for_each(|k| memory.keep(&observation(Stage::Probe, 10.0 + k as f32), &units));
        memory.keep(&observation(Stage::Done, 99.0), &units);
        assert_eq!(memory.len(), 4);
        let found = told(&mut teller, &memory, &units, 20);
        assert!(
            found
                .into_iter()
                .zip(10..14)
                .all(|(found, wanted)| (found.unwrap() - wanted as f32).abs() < 0.02)
        );
    }
}
