//! Why the gates are off, as far as the hardware tells.

use super::legs::SoftwareBreak;
use super::pins;
use super::registers::Registers;
use crate::protection::Fault;

/// What holds the gates off in hardware, by its name; `None` while nothing does, or where the drive itself has broken. A ready line
/// that is high again by the time somebody looks, within a control period, leaves nothing but the comparators to suspect.
#[inline]
pub fn cause(registers: &Registers) -> Option<Fault> {
    let legs = &registers.legs;
    if !legs.is_tripped() {
        return None;
    }
    match legs.software_break() {
        Some(SoftwareBreak::Drive) => None,
        Some(SoftwareBreak::Late) => Some(Fault::PwmDeadline),
        None if legs.is_system_break() => Some(Fault::ClockFailure),
        None if !pins::drivers_are_ready(registers) => Some(Fault::GateDriver),
        None => Some(Fault::HardwareOvercurrent),
    }
}
