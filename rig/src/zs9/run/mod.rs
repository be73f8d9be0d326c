//! Runs the ZS9's drive against its bench.

mod host;
mod qemu;

pub use host::{Commander, Tasks};
pub use qemu::run_in_qemu;
