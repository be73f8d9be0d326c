//! The PMaSynRM firmware: two interrupts and an idle loop, nothing else.
#![cfg_attr(target_os = "none", no_std, no_main)]

/// The image runs on a board; on the host it names the commands that run it.
#[cfg(not(target_os = "none"))]
fn main() {
    println!(
        "This is the firmware of a traction inverter. It runs on its board, or in QEMU against a simulated motor:\n\n  \
         cargo xtask run [SCENARIO]   set up what is missing, build, run a scenario [default: sweep]\n  \
         cargo xtask talk [SCRIPT]    the same, and command the drive over its protocol\n  \
         cargo xtask flash            build a board's image and flash it\n  \
         cargo xtask timing           instructions of each interrupt against their budgets\n  \
         cargo xtask test             run every check\n  \
         cargo rig --help             the firmware's code on this machine: scenarios, operating points, patterns, campaigns"
    );
}

#[cfg(all(target_os = "none", not(feature = "qemu")))]
compile_error!("the reference images need the feature `qemu`");

#[cfg(all(target_os = "none", feature = "qemu"))]
use tractive::board::qemu;

#[cfg(all(target_os = "none", feature = "qemu"))]
#[path = "firmware/own_law.rs"]
mod law;

#[cfg(all(target_os = "none", feature = "qemu"))]
#[path = "firmware/paper_patterns.rs"]
mod patterns;

#[cfg(all(target_os = "none", feature = "qemu"))]
#[path = "firmware/pmasynrm.rs"]
mod firmware;
