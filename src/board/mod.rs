//! The board of the reference images: QEMU's, which exists on the target alone. Boards of real hardware are packages in `boards/`.

#[cfg(all(target_os = "none", feature = "qemu"))]
pub mod qemu;
