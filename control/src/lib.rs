//! `tractive-control`: the arithmetic of a traction drive, usable on its own.
//!
//! * [`control`] decides the voltage: MTPA on saturated flux maps, field weakening, a current loop in flux linkage.
//! * [`modulation`] decides the pulses of a two-level inverter: asynchronous, synchronous, middle-60° and square wave.
//! * [`identification`] decides the voltages that show what an unknown machine is like.
//! * [`start_up`] finds the angle of a rotor whose sensor only counts.
//! * [`nine_switch`] decides the pulses of the inverter that feeds two motors.
//! * [`machine`] holds the types of the tables made offline, [`frames`] angles and vectors, [`time`](mod@time) instants,
//!   [`configuration`] the checks before a start.
//!
//! Control and modulation do not know each other; all know [`frames`], [`time`](mod@time) and [`machine`], which know none of the rest.
//! Interrupts, the cells between them, protection and boards belong to `tractive`.
//!
//! # Features
//! None is on by default.
//!
//! | feature | what it brings |
//! |---|---|
//! | `defmt` | `defmt::Format` for measurements, voltages, pulses, operating points and errors |
//! | `optimal` | the optimised pulse patterns: their modes and angles |
//!
//! # Conventions
//! * Pure steps: `step(&input, &mut state) -> output`; no clock, no peripheral and no global inside.
//! * SI units; the name carries the unit if the type does not (`udc_v`, `period_ticks`).
//! * d along the magnet flux, L_d < L_q; amplitude-invariant transforms, peak values, electrical angles and speeds.
//!   Motoring forward: i_d < 0, i_q > 0.
//! * f32 only; no heap; nothing panics, locks, or loops without a bound.
#![no_std]
#![cfg_attr(not(target_arch = "arm"), forbid(unsafe_code))]
#![cfg_attr(target_arch = "arm", deny(unsafe_code))]

pub mod configuration;
pub mod control;
pub mod frames;
pub mod identification;
pub mod machine;
pub mod modulation;
mod named;
pub mod nine_switch;
pub mod start_up;
pub mod time;
