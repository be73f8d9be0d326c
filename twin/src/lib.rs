//! The board's twin: the very image that is flashed, executed against a model of its chip, with the simulated motor at the pins.
//!
//! [`core`] is the processor, [`chip`] its peripherals, [`map`] the published description of their registers, [`world`] what is wired
//! to the pins, [`machine`] all of it in time; [`run`] drives it by a script of commands over CAN.

pub mod chip;
pub mod core;
pub mod faults;
pub mod finding;
pub mod image;
pub mod instants;
pub mod machine;
pub mod map;
pub mod mistakes;
pub mod output;
pub mod replay;
pub mod run;
pub mod stage;
pub mod time;
pub mod world;
