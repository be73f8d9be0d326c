//! Faults injected into the interrupts of the reference images, in QEMU: late, lost and slow ones, and control interrupts that begin later, so that the
//! PWM interrupt hits any wanted instruction of theirs. The images here are the reference images on `board`, which is their board with the injector
//! around it.
#![no_std]
#![cfg(target_os = "none")]

pub mod board;
mod file;
mod injector;
