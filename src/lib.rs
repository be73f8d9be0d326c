//! `tractive`: the controller of a railway traction inverter.
//!
//! A timer interrupt decides which voltage to apply ([`control`]) and, with time to spare, which pulses make it ([`modulation`], for two-level
//! inverters). A PWM interrupt of higher priority loads the pulses; for the inverter that feeds two motors it also computes them ([`nine_switch`]).
//! Lock-free cells carry the few words between the interrupts ([`cell`]). A board supplies samples and takes pulses ([`ports`]); a rig on the host
//! plays the motor. [`drive`] puts the parts together, once for each system ([`drive::traction`], [`drive::dual`]): its tasks are what the two
//! interrupts call, on any board and on the host. [`machine`] has the types of the tables made offline, [`protection`] the faults and the safe state,
//! [`recorder`] the events that led to a fault. [`operator`] switches the drive on and off and, by [`thermal`], reduces its torque when it is hot;
//! [`protocol`] carries requests to it over CAN; [`experiment`] is what an identification keeps for it.
//!
//! [`control`], [`identification`], [`start_up`], [`modulation`], [`nine_switch`], [`machine`], [`frames`] and [`time`](mod@time) come from the crate
//! `tractive-control`, which can be used alone. Neither control nor modulation knows the cells; only the drive knows all of them; only a board knows
//! registers.
//!
//! # Features
//! None is on by default. Without any feature there is no build-script work, no table, no vector and no linker file.
//!
//! | feature | what it brings |
//! |---|---|
//! | `defmt` | `defmt::Format` for what a firmware logs: measurements, reports, faults, states, requests, frames |
//! | `authentication` | the module `protocol::authentication`: commands that only the holder of a key can send |
//! | `built-in` | the module `built_in`: the tables of the machines that `TRACTIVE_MACHINE` and `TRACTIVE_ZS9_MACHINE` name |
//! | `optimal` | the optimised pulse patterns: their modes and angles |
//! | `wire` | the module `wire`: the words between an emulated board and the rig |
//! | `qemu` | what the reference images on QEMU's board need; includes `built-in` and `wire` |
//!
//! # Conventions
//! * Pure steps: `step(&input, &mut state) -> output`, without a clock, a peripheral or a global inside.
//! * SI units, with the unit in the name where a type does not say it (`udc_v`, `period_ticks`).
//! * The d axis is along the magnet flux, L_d < L_q; transforms are amplitude-invariant, with peak values, electrical angles and electrical speeds.
//!   Motoring forward: i_d < 0, i_q > 0.
//! * f32 only; no heap; nothing in an interrupt panics, locks, or loops without a bound.
//! * A value that is not finite ends in a named fault, never in an integrator.
#![no_std]
#![cfg_attr(not(target_os = "none"), forbid(unsafe_code))]
#![cfg_attr(target_os = "none", deny(unsafe_code))]

pub mod board;
#[cfg(feature = "built-in")]
pub mod built_in;
pub mod cell;
pub mod configuration;
pub mod drive;
pub mod experiment;
pub mod operator;
pub mod ports;
pub mod protection;
pub mod protocol;
pub mod recorder;
pub mod thermal;
#[cfg(feature = "wire")]
pub mod wire;

#[doc(hidden)]
pub use tractive_control::named;
pub use tractive_control::{
    control, frames, identification, machine, modulation, nine_switch, start_up, time,
};
