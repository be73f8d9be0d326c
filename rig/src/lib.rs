//! The rig: acts as the motor for the drive, on the host and in QEMU, and shows what happened.
//!
//! [`machine`] turns any machine folder into a plant and into the tables that the firmware's own code runs on; [`mod@bench`] puts plant, inverter and
//! sensors into the timers' time; [`run`] connects a drive to it; [`scenario`] defines what is driven and what is to be seen; [`report`] draws it.
#![forbid(unsafe_code)]

pub mod ablation;
pub mod analysis;
pub mod bench;
#[cfg(unix)]
pub mod benchmark;
pub mod bound;
pub mod campaign;
pub mod can;
#[cfg(unix)]
mod coenergy;
pub mod columns;
#[cfg(unix)]
pub mod commission;
#[cfg(unix)]
pub mod compare;
pub mod curves;
#[cfg(unix)]
pub mod dbc;
pub mod distortion;
pub mod figures;
pub mod files;
#[cfg(unix)]
pub mod folder;
#[cfg(unix)]
pub mod gallery;
#[cfg(unix)]
pub mod identify;
pub mod inject;
pub mod law;
#[cfg(unix)]
pub mod live;
pub mod machine;
#[cfg(unix)]
pub mod merge;
pub mod mtpa_methods;
#[cfg(unix)]
pub mod needs;
#[cfg(unix)]
pub mod nine_switch;
#[cfg(unix)]
pub mod optimised;
pub mod options;
pub mod output;
pub mod pattern;
pub mod pictures;
pub mod plant;
#[cfg_attr(unix, path = "platform/unix.rs")]
#[cfg_attr(not(unix), path = "platform/none.rs")]
mod platform;
#[cfg(unix)]
pub mod points;
pub mod report;
pub mod rows;
pub mod run;
pub mod scenario;
pub mod shards;
pub mod spectrum;
mod speed_loop;
mod steps;
#[cfg(unix)]
pub mod talk;
pub mod trace;
pub mod verdict;
pub mod warmth;
pub mod zs9;
