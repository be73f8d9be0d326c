//! Faults, limits, and the safe state.
//!
//! A fault is named, latched with the value and the limit that it broke, and puts the gates into the safe state in the
//! very interrupt that finds it.

#![forbid(unsafe_code)]

mod boost;
mod checks;
mod fault;
mod frozen;
mod legs;
mod link;
mod masked_faults;
mod safe;
mod unexplained;
mod words;

pub use boost::BoostWatch;
pub use checks::{
    INNOVATION_RAD, are_sound, check_angle, check_currents, check_demand, check_known, check_measurements,
    check_speed, check_undervoltage, is_sound,
};
pub use fault::{FailedCheck, Fault, Trip};
pub use frozen::FrozenWatch;
pub use legs::LegFaults;
pub use link::LinkLimits;
pub use masked_faults::MaskedFaults;
pub use safe::{DiodeWatch, OpenGates, SafeState, generating, safe_state};
pub use unexplained::UnexplainedWatch;
pub use words::{trip_from_words, trip_to_words};
