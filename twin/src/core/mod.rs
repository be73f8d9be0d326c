//! The processor: a Cortex-M4F's instructions by an emulator, its exceptions and its time by what ARMv7-M says.

pub mod cost;
pub mod cpu;
pub mod nvic;

#[cfg(test)]
mod tests;
