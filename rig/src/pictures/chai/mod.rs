//! The first paper's figures.

pub mod blocks;
pub mod machine;
pub mod modes;
pub mod runs;
