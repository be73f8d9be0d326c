//! The systems: control, pulses, cells and protection put together. What the two interrupts call, on any board and
//! on the host.

#![forbid(unsafe_code)]

mod acknowledge;
pub mod dual;
mod messages;
pub mod traction;

pub use messages::{
    COMMITTAL_WORDS, Committal, CommittalRecord, Gates, HalfKind, VoltageCommand, half_from_words,
    half_to_words, volt_ticks,
};
