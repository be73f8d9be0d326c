//! The ZS9's reference image with the fault injector.
#![cfg_attr(target_os = "none", no_std, no_main)]

/// The image runs in QEMU; on the host there is nothing to do but to say so.
#[cfg(not(target_os = "none"))]
fn main() {
    println!(
        "This is a firmware for tests. `cargo xtask test --only overruns` builds it for QEMU and runs it."
    );
}

#[cfg(target_os = "none")]
use tractive_fault_injector::board as qemu;

#[cfg(target_os = "none")]
#[path = "../../../src/firmware/zs9_own_law.rs"]
mod law;

#[cfg(target_os = "none")]
#[path = "../../../src/firmware/zs9.rs"]
mod firmware;
