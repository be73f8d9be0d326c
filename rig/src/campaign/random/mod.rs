//! Runs whose machine, line, flaws, trajectory and fault are drawn at random by a Latin hypercube; a run that fails is minimised as far as it
//! still fails.

pub mod command;
mod coverage;
mod hypercube;
mod minimise;
mod row;

pub use coverage::coverage;
pub use hypercube::Hypercube;
pub use minimise::minimise;
