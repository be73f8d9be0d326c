//! The causes that keep the gates off without software, and their names.

use super::legs::BREAKING;
use super::outputs::{Outputs, SoftwareBreak};
use super::pins;
use super::registers::Registers;
use tractive::protection::Fault;

/// The cause of a latched break; `None` if none is latched, or if the drive itself has made the break. A cause that has gone (the break itself ends
/// an overcurrent) has left only its latch: if the drivers are ready and the chip is well it was a comparator.
#[inline]
pub fn latched_by(registers: &Registers) -> Option<Fault> {
    cause(&registers.legs.outputs(), || held_by(registers))
}

/// The same for any system's timers; `held` gives what holds the gates now.
#[inline]
pub fn cause<const N: usize>(outputs: &Outputs<N>, held: impl FnOnce() -> Option<Fault>) -> Option<Fault> {
    if !outputs.is_tripped() {
        return None;
    }
    match outputs.software_break() {
        Some(SoftwareBreak::Drive) => None,
        Some(SoftwareBreak::Late) => Some(Fault::PwmDeadline),
        None if outputs.is_system_break() => Some(Fault::ClockFailure),
        None => held().or(Some(Fault::HardwareOvercurrent)),
    }
}

/// A cause that is present now.
pub fn held_by(registers: &Registers) -> Option<Fault> {
    if !pins::drivers_ready(registers) {
        return Some(Fault::GateDriver);
    }
    (seen_by(registers, &BREAKING) != 0).then_some(Fault::HardwareOvercurrent)
}

/// The comparators among these that see their threshold crossed, one bit each; bit 0 is that of COMP1.
pub fn seen_by(registers: &Registers, numbers: &[usize]) -> u16 {
    numbers.iter().fold(0, |bits, number| {
        let index = number.wrapping_sub(1);
        let comparator = registers.comparators.get(index);
        let crossed = comparator.is_some_and(|comparator| comparator.csr().read().value());
        bits | u16::from(crossed) << (index & 0xF)
    })
}
