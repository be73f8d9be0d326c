//! Runs the ZS9's drive against its bench.

mod host;

pub use host::run_on_host;
