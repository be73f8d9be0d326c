//! Angles and reference frames.
//!
//! Amplitude-invariant transforms: a balanced set of phase quantities with peak `x` is a space vector of length `x`.
//! All angles are electrical. [`Angle`] is a 32-bit fraction of a turn, so it wraps by itself and loses no
//! precision however long the drive runs.

#![cfg_attr(not(target_arch = "arm"), forbid(unsafe_code))]

mod angle;
mod direction;
mod fpu;
mod scalar;
mod vector;

pub use angle::{Angle, UNITS_PER_RADIAN};
pub use direction::SinCos;
pub use scalar::{limit, limit_magnitude, root, six_step_v, sqrt};
pub use vector::{Abc, AlphaBeta, Dq, SQRT_3};
