//! What holds the gates off without software, and its name.

use super::comparators::WATCHING;
use super::legs::SoftwareBreak;
use super::pins;
use super::registers::Registers;
use crate::protection::Fault;

/// The cause of a latched break; `None` when none is latched, or where the drive itself has broken. A cause that has gone, as an
/// overcurrent does that the break itself has ended, has left only its latch: while the drivers are ready and the chip is
/// well it was a comparator.
#[inline]
pub fn latched_by(registers: &Registers) -> Option<Fault> {
    let legs = &registers.legs;
    if !legs.is_tripped() {
        return None;
    }
    match legs.software_break() {
        Some(SoftwareBreak::Drive) => None,
        Some(SoftwareBreak::Late) => Some(Fault::PwmDeadline),
        None if legs.is_system_break() => Some(Fault::ClockFailure),
        None => held_by(registers).or(Some(Fault::HardwareOvercurrent)),
    }
}

/// A cause that is there now.
pub fn held_by(registers: &Registers) -> Option<Fault> {
    if !pins::drivers_ready(registers) {
        return Some(Fault::GateDriver);
    }
    let seen = WATCHING.iter().any(|number| {
        let comparator = registers.comparators.get(number - 1);
        comparator.is_some_and(|comparator| comparator.csr().read().value())
    });
    seen.then_some(Fault::HardwareOvercurrent)
}
