//! The systems: control, pulses, cells and protection put together into what the two interrupts call, on any board and on the host.

#![forbid(unsafe_code)]

mod acknowledge;
pub mod dual;
mod mailbox;
mod messages;
pub mod traction;

use crate::ports::System;

pub use mailbox::{DualOperatorMailboxes, Mailboxes, Observation, OperatorMailboxes, Timed};
use mailbox::{SLOT_S, SlotTimer};
pub(crate) use mailbox::{next_slot, slots_between};
pub use messages::{
    Gates, LOADED_WORDS, Loaded, LoadedRecord, PLANNED_WORDS, PlannedHalf, PlannedRecord, half_from_words,
    half_to_words, volt_ticks,
};

/// The input of a control period: the measurements and the operator's command.
#[derive(Clone, Copy)]
struct PeriodInput<'a, S: System> {
    sample: &'a S::Sample,
    command: &'a S::Command,
}
