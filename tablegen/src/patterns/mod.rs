//! The optimised pulse patterns: quarter-wave symmetric two-level pulses with the least current distortion, by modulation index.
//!
//! A pattern of 2d + 1 pulses a turn has d angles in a quarter of it. For each modulation index, the fundamental as a share of six-step's, they
//! minimise the weighted distortion `sqrt(Σ (V_n/n)²)/V_1` over the harmonics that a machine without a neutral sees. The fundamental is kept, no
//! pulse is shorter than the shortest, and a carrier half has no more than one edge of a phase. Near the optimum the distortion hardly depends on the
//! angles, so they also minimise the peaks of the torque ripple.
//! Angles change continuously from one index to the next: a [`Branch`]. At one index there are many local optima; a branch begins at the best one
//! found from many starts, and is followed from there in both directions.

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
