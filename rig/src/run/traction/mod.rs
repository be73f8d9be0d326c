//! The PMaSynRM drive on the host and in QEMU.

mod host;
mod qemu;

pub use host::Tasks;
pub use qemu::run_in_qemu;
