//! The cells between the interrupts, hit on every instruction: an image for QEMU, run by `cargo xtask test --only cells`.
//!
//! The periods of the two timers differ by one tick, and a tick is less than an instruction: so from one control interrupt to the
//! next the PWM interrupt lands no more than one instruction later, until it has landed everywhere. In each
//! control interrupt the low-priority side of one cell is used once; in each PWM interrupt the high-priority side of the same cell.
//! Every value carries a checksum and its number, so that a torn, a stale and a lost one show. Two broken cells take part, to show that
//! the test can fail. Where a PWM interrupt landed is the return address on its stack.
#![cfg_attr(target_os = "none", no_std, no_main)]

/// The image runs in the emulator; on the host there is nothing to do but to say so.
#[cfg(not(target_os = "none"))]
fn main() {
    println!("This is an image for the emulator. `cargo xtask test --only cells` builds and runs it.");
}

#[cfg(target_os = "none")]
mod accesses;
#[cfg(target_os = "none")]
mod broken;
#[cfg(target_os = "none")]
mod firmware;
#[cfg(target_os = "none")]
mod message;
#[cfg(target_os = "none")]
mod subject;
