//! The firmware that identifies its machine: two interrupts and an idle loop, nothing else.
#![cfg_attr(target_os = "none", no_std, no_main)]

/// The image runs on a board; on the host it only says so.
#[cfg(not(target_os = "none"))]
fn main() {
    println!(
        "This is the firmware. `cargo rig identify --on qemu --image FILE` runs it in QEMU, `cargo rig identify` its code here."
    );
}

#[cfg(all(target_os = "none", not(feature = "qemu")))]
compile_error!("the reference images need the feature `qemu`");

#[cfg(all(target_os = "none", feature = "qemu"))]
use tractive::board::qemu;

#[cfg(all(target_os = "none", feature = "qemu"))]
#[path = "../firmware/identification_law.rs"]
mod law;

#[cfg(all(target_os = "none", feature = "qemu"))]
#[path = "../firmware/paper_patterns.rs"]
mod patterns;

#[cfg(all(target_os = "none", feature = "qemu"))]
#[path = "../firmware/pmasynrm.rs"]
mod firmware;
