//! The papers' figures as this project's code draws them, one SVG a figure.
//!
//! Loci, vectors, sequences and pulses come from the firmware's own control and modulation; curves over time come from a recording.

pub mod architecture;
pub mod chai;
pub mod diagram;
pub mod ink;
mod loci;
pub mod patterns;
pub mod sheet;
pub mod zs9;
