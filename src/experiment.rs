//! An identification's memory: its observations in RAM as they come, and the frames that send them once the experiment is over.
//!
//! Control observes faster than a bus can carry. So the observations are kept, [`PACKED_WORDS`] words each, and sent in the slots that the drive's
//! telemetry leaves free, over and over, so that a lost frame comes again.

#![forbid(unsafe_code)]

use crate::identification::{Observation, PACKED_WORDS, Packed, Stage, Units};
use crate::protocol::e2e::Counter;
use crate::protocol::{EXPERIMENT, ExperimentFrame, Frame, OBSERVATION, ObservationFrame};
use core::sync::atomic::{AtomicU32, Ordering};

/// Observations that the longest experiment makes: 82 KB of RAM.
pub const OBSERVATIONS: usize = 6_800;

/// The observations of the last experiment. One interrupt writes; anybody may read the counted ones.
pub struct Memory<const N: usize = OBSERVATIONS> {
    words: [[AtomicU32; PACKED_WORDS]; N],
    count: AtomicU32,
    /// The stage of the newest observation, from 1 on; 0 before the first.
    stage: AtomicU32,
    /// Stage and count as they were when the slot began.
    shown: AtomicU32,
}

/// Position of the stage in the shown word, above the count.
const SHOWN_STAGE: u32 = 16;

impl<const N: usize> Memory<N> {
    /// The state before the first experiment.
    #[allow(clippy::declare_interior_mutable_const, reason = "an array initialiser, never borrowed")]
    pub const fn new() -> Self {
        Self {
            words: [const { [const { AtomicU32::new(0) }; PACKED_WORDS] }; N],
            count: AtomicU32::new(0),
            stage: AtomicU32::new(0),
            shown: AtomicU32::new(0),
        }
    }

    /// Control's side, at the end of each period: keeps the newest observation, if there is one, and updates the shown state if the period begins a
    /// slot.
    pub fn take(&self, newest: Option<&Observation>, units: &Units, begins_slot: bool) {
        if let Some(observation) = newest {
            self.keep(observation, units);
        }
        if begins_slot {
            self.show();
        }
    }

    /// Keeps an observation. The first one of an experiment replaces the experiment before; only one of the end is kept, and observations that find
    /// no room are dropped.
    fn keep(&self, observation: &Observation, units: &Units) {
        let before = stage_of(self.stage.load(Ordering::Relaxed));
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
        self.stage.store(observation.stage as u32 + 1, Ordering::Release);
    }

    /// Shows the present state: it is the one sent in the slot, whenever the idle loop runs.
    fn show(&self) {
        let count = self.count.load(Ordering::Relaxed);
        self.shown.store(self.stage.load(Ordering::Relaxed) << SHOWN_STAGE | count, Ordering::Release);
    }

    /// The stage of the experiment and the number of observations so far, as they were when the slot began.
    pub fn told(&self) -> ExperimentFrame {
        let shown = self.shown.load(Ordering::Acquire);
        ExperimentFrame { stage: stage_of(shown >> SHOWN_STAGE), observations: shown as u16 }
    }

    /// A word of an observation.
    fn word(&self, index: u16, part: u8) -> Option<u32> {
        let word = self.words.get(usize::from(index))?.get(usize::from(part))?;
        Some(word.load(Ordering::Relaxed))
    }
}

/// The stage from the kept number, its position from 1 on; [`Stage::Done`] before the first.
fn stage_of(kept: u32) -> Stage {
    let stage = kept.checked_sub(1).and_then(|place| Stage::ALL.get(place as usize));
    stage.copied().unwrap_or(Stage::Done)
}

/// Calls between two frames of progress.
const PROGRESS_CALLS: u32 = 32;

/// The sender of the contents of a [`Memory`], in the slots in which nothing else is sent.
#[derive(Clone, Copy, Debug)]
pub struct Teller {
    counters: [Counter; 2],
    calls: u32,
    index: u16,
    part: u8,
}

impl Teller {
    /// The state at power-up.
    pub const fn new() -> Self {
        Self { counters: [Counter::new(); 2], calls: 0, index: 0, part: 0 }
    }

    /// The frame for a free slot: progress, and once the experiment is over its observations, one after the other and again from the first.
    pub fn tell<const N: usize>(&mut self, memory: &Memory<N>) -> Option<Frame> {
        let [progress, observed] = &mut self.counters;
        let told = memory.told();
        let turn = self.calls;
        self.calls = (turn + 1) % PROGRESS_CALLS;
        if turn == 0 {
            return Some(EXPERIMENT.frame(told.encode(), progress));
        }
        if told.stage != Stage::Done || told.observations == 0 {
            (self.index, self.part) = (0, 0);
            return None;
        }
        let Self { index, part, .. } = *self;
        let content = ObservationFrame { index, part, word: memory.word(index, part)? };
        self.part += 1;
        if usize::from(self.part) == PACKED_WORDS {
            let next = index + 1;
            (self.index, self.part) = (if next < told.observations { next } else { 0 }, 0);
        }
        Some(OBSERVATION.frame(content.encode(), observed))
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

    /// Currents that this many frames carry, by their observations' numbers.
    fn told(teller: &mut Teller, memory: &Memory<4>, units: &Units, frames: u32) -> [Option<f32>; 4] {
        memory.show();
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
        assert_eq!(told(&mut teller, &memory, &units, 0), [None; 4]);
        assert_eq!(memory.told().observations, 3);
        for _ in 0..2 {
            let found = told(&mut teller, &memory, &units, 10);
            for (found, wanted) in found.into_iter().zip([1.0, 2.0, 3.0]) {
                assert!((found.unwrap() - wanted).abs() < 0.02);
            }
            assert_eq!(found[3], None);
        }
        // The next experiment replaces it, and observations that find no room are dropped.
        (0..6).for_each(|k| memory.keep(&observation(Stage::Probe, 10.0 + k as f32), &units));
        memory.keep(&observation(Stage::Done, 99.0), &units);
        memory.show();
        assert_eq!(memory.told().observations, 4);
        let found = told(&mut teller, &memory, &units, 20);
        assert!(
            found
                .into_iter()
                .zip(10..14)
                .all(|(found, wanted)| (found.unwrap() - wanted as f32).abs() < 0.02)
        );
    }
}
