//! What the idle loop exchanges with the rig, once a slot: a frame each way, and the wires to contactors and sensors.

use super::{Block, currents_from_words, currents_to_words};
use crate::cell::Words;
use crate::operator::{Configuration, Feedback, Switches};
use crate::protection::Fault;
use crate::protocol::Frame;

/// What a slot sends and switches, told when the next one begins: from then on it holds.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SlotRequest {
    /// A frame.
    pub frame: Option<Frame>,
    /// Contactors and resistors.
    pub switches: Switches,
}

impl Words<5> for SlotRequest {
    fn to_words(self) -> [u32; 5] {
        let [head, low, high] = self.frame.to_words();
        let Switches { precharge, main, discharge, chopper } = self.switches;
        let flags = u32::from(precharge) | u32::from(main) << 1 | u32::from(discharge) << 2;
        [head, low, high, flags, chopper.to_bits()]
    }

    fn from_words([head, low, high, flags, chopper]: [u32; 5]) -> Self {
        let flag = |bit: u32| flags >> bit & 1 != 0;
        Self {
            frame: Option::from_words([head, low, high]),
            switches: Switches {
                precharge: flag(0),
                main: flag(1),
                discharge: flag(2),
                chopper: f32::from_bits(chopper),
            },
        }
    }
}

/// What has come when a slot begins.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SlotAnswer {
    /// A frame.
    pub frame: Option<Frame>,
    /// What the board says.
    pub feedback: Feedback,
}

impl SlotAnswer {
    /// As a block.
    pub fn to_block(&self) -> Block {
        let [head, low, high] = self.frame.to_words();
        let feedback = &self.feedback;
        let [a, b, c] = currents_to_words(feedback.offsets_a);
        let mut flags = feedback.configuration as u32;
        for (bit, flag) in [
            feedback.precharge_closed,
            feedback.main_closed,
            feedback.driver_ready,
            feedback.enable_input,
            feedback.sensor_alive,
            feedback.position_known,
            feedback.parameters_open,
        ]
        .into_iter()
        .enumerate()
        {
            flags |= u32::from(flag) << (8 + bit);
        }
        let hardware = feedback.hardware.map_or(0, |fault| fault as u32);
        [head, low, high, flags, hardware, a, b, c, 0, 0, 0, 0, 0, 0, 0, 0]
    }

    /// The inverse of [`SlotAnswer::to_block`].
    pub fn from_block(block: &Block) -> Self {
        let [head, low, high, flags, hardware, a, b, c, ..] = *block;
        let flag = |bit: u32| flags >> (8 + bit) & 1 != 0;
        Self {
            frame: Option::from_words([head, low, high]),
            feedback: Feedback {
                precharge_closed: flag(0),
                main_closed: flag(1),
                driver_ready: flag(2),
                enable_input: flag(3),
                sensor_alive: flag(4),
                position_known: flag(5),
                parameters_open: flag(6),
                offsets_a: currents_from_words(a, b, c),
                configuration: match flags & 0xFF {
                    1 => Configuration::Good,
                    2 => Configuration::Bad,
                    _ => Configuration::Unchecked,
                },
                hardware: Fault::from_code(hardware),
            },
        }
    }
}
