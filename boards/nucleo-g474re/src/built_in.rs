//! The tables of the machines that were chosen when the images were built (`TRACTIVE_MACHINE` and `TRACTIVE_ZS9_MACHINE`): those of the two papers
//! unless the environment names others.

/// The machine of the PMaSynRM image.
pub mod traction {
    include!(concat!(env!("OUT_DIR"), "/traction.rs"));
}

/// The machine of the ZS9 image; both motors are alike.
pub mod zs9 {
    include!(concat!(env!("OUT_DIR"), "/zs9.rs"));
}
