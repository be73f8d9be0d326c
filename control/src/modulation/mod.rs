//! WHICH pulses: the modulator of a two-level inverter.
//!
//! Every mode is one carrier with one compare value a phase. The PWM interrupt comes once per carrier half and
//! describes the half after the running one, as a timer's shadow registers take it: its length, each phase's level at
//! its start, and the instant at which that level toggles. In the synchronous modes the halves are locked to
//! the pulse angle (voltage angle + 90°: phase a's reference is the sine of it): the length of each half takes the
//! carrier to its next boundary angle, so phase errors vanish within a half and nothing accumulates.
//!
//! Backward rotation is forward rotation seen in a mirror: the angle changes sign, phases b and c change places.

#![forbid(unsafe_code)]

mod carrier;
mod catch;
mod dead_time;
mod devices;
mod growth;
mod middle60;
mod mode;
mod modulator;
mod period;
mod reference;
mod ripple;
mod schedule;

pub use dead_time::compensated;
pub use devices::Devices;
pub use growth::GROWTH_SECTORS;
pub use mode::{MODE_CODES, Mode, Regulation};
pub use modulator::Modulator;
pub use period::CarrierPeriod;
pub use reference::Reference;
pub use ripple::{RippleFlux, ripple_share};
pub use schedule::{Ladder, Schedule, depth_limit, first_half};
