//! The cells between the interrupts, interrupted at every instruction: an image for QEMU, run by `cargo xtask test --only cells`.
//!
//! The periods of the two timers differ by one tick, and a tick is less than an instruction. So from one control interrupt to the next the PWM
//! interrupt lands at most one instruction later, until it has landed everywhere. Each control interrupt uses the low-priority side of one cell once;
//! each PWM interrupt uses the high-priority side of the same cell. Every value carries a checksum and its number, so that torn, stale and lost values
//! show. Two broken cells take part, to show that the test can fail. The return address on the stack tells where a PWM interrupt landed.
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
