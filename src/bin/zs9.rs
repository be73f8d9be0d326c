//! The ZS9 firmware: two interrupts and an idle loop, nothing else.
#![cfg_attr(target_os = "none", no_std, no_main)]

/// The image runs on a board; on the host it only says so.
#[cfg(not(target_os = "none"))]
fn main() {
    println!(
        "This is the firmware. `cargo xtask run zs9-cycle` builds it for its board and runs it in QEMU."
    );
}

#[cfg(all(target_os = "none", not(feature = "qemu")))]
compile_error!("the reference images need the feature `qemu`");

#[cfg(all(target_os = "none", feature = "qemu"))]
use tractive::board::qemu;

#[cfg(all(target_os = "none", feature = "qemu"))]
#[path = "../firmware/zs9_own_law.rs"]
mod law;

#[cfg(all(target_os = "none", feature = "qemu"))]
#[path = "../firmware/zs9.rs"]
mod firmware;
