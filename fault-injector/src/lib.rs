//! Faults injected into the interrupts of the reference images, in QEMU: late, lost and slow ones, and control interrupts that begin later,
//! so that the PWM interrupt comes on whichever of their instructions is wanted. The images here are the reference images on
//! `board`, which is theirs with the injector around it.
#![no_std]
#![cfg(target_os = "none")]

pub mod board;
mod file;
mod injector;
