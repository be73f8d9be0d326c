//! `tractive`: the controller of a railway traction inverter.
//!
//! A timer interrupt decides WHICH voltage ([`control`]), a PWM interrupt decides WHICH pulses ([`modulation`] for two-level
//! inverters, [`nine_switch`] for the one that feeds two motors),
//! lock-free cells carry the few words between them ([`cell`]), a board knows the hardware ([`board`]), and a rig on the
//! host plays the motor. [`drive`] puts them together, once for each system ([`drive::traction`], [`drive::dual`]): its tasks are
//! what the two interrupts call, on any board and on the host. [`machine`] holds the tables made offline, [`protection`] the faults and the safe state,
//! [`recorder`] what led to one.
//!
//! Who knows whom: [`frames`], [`time`] and [`machine`] know nobody; control and modulation know these, never each other;
//! neither knows the cells; only the drive knows all of them; only a board knows registers.
//!
//! # Conventions
//! * Pure steps: `step(&input, &mut state) -> output`; no clock, no peripheral, no global inside.
//! * SI units, with the unit in the name where a type does not say it (`udc_v`, `period_ticks`).
//! * d along the magnet flux, L_d < L_q; amplitude-invariant transforms, peak values, electrical angles and speeds.
//!   Motoring forward: i_d < 0, i_q > 0.
//! * f32 only; no heap; nothing in an interrupt panics, locks, or loops without a bound.
//! * A value that is not finite ends in a named fault, never in an integrator.
#![no_std]
#![cfg_attr(not(target_os = "none"), forbid(unsafe_code))]
#![cfg_attr(target_os = "none", deny(unsafe_code))]

pub mod board;
pub mod cell;
pub mod configuration;
pub mod control;
pub mod drive;
pub mod frames;
pub mod link;
pub mod machine;
pub mod modulation;
pub mod nine_switch;
pub mod operator;
pub mod protection;
pub mod recorder;
pub mod time;
