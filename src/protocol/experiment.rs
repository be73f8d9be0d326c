//! The messages that an image with an identification's law sends besides the drive's: its progress, and its observations.

use super::message::Message;
use super::signal::{Payload, Signal};
use crate::identification::Stage;

const STAGE: Signal = Signal::number("stage", 12, 4, 15);
const OBSERVATIONS: Signal = Signal::number("observations", 16, 13, 0x1FFF);

const PART: Signal = Signal::number("part", 12, 2, 2);
const INDEX: Signal = Signal::number("index", 16, 13, 0x1FFF);
const LOW: Signal = Signal::number("low", 32, 16, 0xFFFF);
const HIGH: Signal = Signal::number("high", 48, 16, 0xFFFF);

/// The stage of the experiment, and the number of its observations so far.
pub const EXPERIMENT: Message = Message::new("EXPERIMENT", 0x18A, 14, 100, &[STAGE, OBSERVATIONS]);

/// One word of a packed observation.
pub const OBSERVATION: Message = Message::new("OBSERVATION", 0x18B, 15, 0, &[PART, INDEX, LOW, HIGH]);

/// The messages from an image with an identification's law, besides those from every drive.
pub const FROM_IDENTIFICATION: [&Message; 2] = [&EXPERIMENT, &OBSERVATION];

/// Content of [`EXPERIMENT`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ExperimentFrame {
    /// The stage in progress; [`Stage::Done`] before the first experiment, too, but then without observations.
    pub stage: Stage,
    /// Observations so far.
    pub observations: u16,
}

impl ExperimentFrame {
    /// As a frame's content.
    pub fn encode(&self) -> Payload {
        let mut payload = Payload::default();
        STAGE.put_raw(&mut payload, self.stage as u32);
        OBSERVATIONS.put_raw(&mut payload, self.observations.into());
        payload
    }

    /// From a frame's content; `None` if the stage is invalid.
    pub fn decode(payload: Payload) -> Option<Self> {
        let stage = *Stage::ALL.get(STAGE.raw(payload) as usize)?;
        Some(Self { stage, observations: OBSERVATIONS.raw(payload) as u16 })
    }
}

/// Content of [`OBSERVATION`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ObservationFrame {
    /// Number of the observation, from 0 on.
    pub index: u16,
    /// Number of the word.
    pub part: u8,
    /// The word.
    pub word: u32,
}

impl ObservationFrame {
    /// As a frame's content.
    pub fn encode(&self) -> Payload {
        let mut payload = Payload::default();
        PART.put_raw(&mut payload, self.part.into());
        INDEX.put_raw(&mut payload, self.index.into());
        LOW.put_raw(&mut payload, self.word & 0xFFFF);
        HIGH.put_raw(&mut payload, self.word >> 16);
        payload
    }

    /// From a frame's content; `None` if the number of the word is invalid.
    pub fn decode(payload: Payload) -> Option<Self> {
        PART.get(payload)?;
        Some(Self {
            index: INDEX.raw(payload) as u16,
            part: PART.raw(payload) as u8,
            word: LOW.raw(payload) | HIGH.raw(payload) << 16,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_told_comes_back() {
        for stage in Stage::ALL {
            let told = ExperimentFrame { stage, observations: 0x1ABC };
            assert_eq!(ExperimentFrame::decode(told.encode()), Some(told));
        }
        for word in [0, 1, 0xFFFF, 0x1_0000, 0x8765_4321, u32::MAX] {
            let told = ObservationFrame { index: 513, part: 1, word };
            assert_eq!(ObservationFrame::decode(told.encode()), Some(told), "{word:x}");
        }
    }

    #[test]
    fn a_stage_that_is_none_is_refused() {
        let mut payload = Payload::default();
        STAGE.put_raw(&mut payload, Stage::ALL.len() as u32);
        assert_eq!(ExperimentFrame::decode(payload), None);
    }
}
