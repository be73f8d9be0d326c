//! The tables of the machines chosen when this crate was built, by `TRACTIVE_MACHINE` and `TRACTIVE_ZS9_MACHINE`: those of the two papers unless the
//! environment names others. They are for the reference images, tests and examples; a firmware of one's own makes its tables in its own build script,
//! with `tractive-tablegen`.

#![forbid(unsafe_code)]

/// The machine of the traction drive.
pub mod traction {
    include!(concat!(env!("OUT_DIR"), "/machine_tables.rs"));
}

/// The machine that drives the ZS9, both motors alike.
pub mod zs9 {
    include!(concat!(env!("OUT_DIR"), "/zs9_tables.rs"));
}
