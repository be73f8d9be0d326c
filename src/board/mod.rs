//! The board of the reference images: QEMU's, which exists only on the target. Boards of real hardware are packages in `boards/`.

#[cfg(all(target_os = "none", feature = "qemu"))]
pub mod qemu;
