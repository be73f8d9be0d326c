//! Runs with machine, line, flaws, trajectory and fault at random, by a Latin hypercube; and whatever fails made as small as it still
//! fails.

pub mod command;
mod coverage;
mod hypercube;
mod minimise;
mod row;

pub use coverage::coverage;
pub use hypercube::Hypercube;
pub use minimise::minimise;
