//! `tractive`: the controller of a railway traction inverter.
#![no_std]
#![cfg_attr(not(target_os = "none"), forbid(unsafe_code))]
#![cfg_attr(target_os = "none", deny(unsafe_code))]

pub mod board;
pub mod cell;
pub mod control;
pub mod drive;
pub mod frames;
pub mod link;
pub mod machine;
pub mod modulation;
pub mod protection;
pub mod time;
