//! The optimised pulse patterns: quarter-wave symmetric two-level pulses of least current distortion, by modulation index.
//!
//! A pattern of 2d + 1 pulses a turn has d angles in a quarter of it. For each modulation index, the fundamental as a share of
//! six-step's, they minimise the weighted distortion `sqrt(Σ (V_n/n)²)/V_1` over the harmonics that a machine without a neutral
//! sees, with the fundamental kept, no pulse shorter than the shortest, and no more than one edge of a phase in a carrier half. Near the
//! optimum the distortion hardly depends on the angles: there they also minimise the peaks of the torque ripple.
//! Angles go on continuously from one index to the next: a [`Branch`]. At one index there are many local optima; a branch begins at
//! the best of them that many starts find, and is followed from there both ways.

mod branch;
mod local;
mod source;
mod torque;
mod waveform;

pub use branch::{BRANCHES, Branch, Followed};
pub use source::angle_table;
pub use waveform::Waveform;

/// Follows every branch, in the order of [`BRANCHES`].
///
/// # Errors
/// The branch that has no optimum at its anchor, or one that breaks off inside its window.
pub fn follow_all() -> Result<Vec<Followed>, String> {
    BRANCHES.iter().map(Branch::followed).collect()
}
