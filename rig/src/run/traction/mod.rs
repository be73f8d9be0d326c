//! The PMaSynRM drive on the host and in QEMU.

mod host;
mod qemu;
mod together;

pub use host::Tasks;
pub use qemu::run_in_qemu;
pub use together::{OnBench, Together};
