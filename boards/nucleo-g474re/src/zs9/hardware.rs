//! The causes that keep the ZS9's gates off without software: their names, and the places where they were seen.

use super::bridge::BREAKING;
use super::start::bridge;
use crate::hardware::{cause, seen_by};
use crate::pins;
use crate::registers::Registers;
use tractive::ports::HardwareBreak;
use tractive::protection::Fault;

/// The comparator on the gate drivers' ready wire, as a bit of [`seen_by`].
const DRIVERS: u16 = 1 << 4;
/// The comparators' bits lie above the timers'.
const COMPARATORS: u16 = 3;

/// The cause of a latched break; `None` if none is latched, or if the drive itself has made the break.
#[inline]
pub fn latched_by(registers: &Registers) -> Option<HardwareBreak> {
    let outputs = bridge(registers).outputs();
    let fault = cause(&outputs, || held_by(registers))?;
    Some(HardwareBreak { fault, seen: outputs.broken() | seen_by(registers, &BREAKING) << COMPARATORS })
}

/// A cause that is present now.
pub fn held_by(registers: &Registers) -> Option<Fault> {
    let seen = seen_by(registers, &BREAKING);
    if !pins::drivers_ready(registers) || seen & DRIVERS != 0 {
        return Some(Fault::GateDriver);
    }
    (seen != 0).then_some(Fault::HardwareOvercurrent)
}
