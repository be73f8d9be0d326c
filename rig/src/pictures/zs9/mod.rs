//! The second paper's figures.

pub mod blocks;
pub mod gates;
pub mod loci;
pub mod runs;
pub mod sequences;
pub mod vectors;
