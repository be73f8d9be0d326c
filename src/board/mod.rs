//! The boards themselves, one file or folder each: QEMU's exists only on the target, where no feature names another; that of a
//! feature exists on the host too, for the tests of its registers.

#[cfg(feature = "board-nucleo-g474re")]
pub mod nucleo_g474re;
#[cfg(all(target_os = "none", feature = "qemu", not(feature = "board-nucleo-g474re")))]
pub mod qemu;

#[cfg(all(target_os = "none", feature = "saboteur", feature = "board-nucleo-g474re"))]
compile_error!("the feature `saboteur` is for the emulated board alone");
