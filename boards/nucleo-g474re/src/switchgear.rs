//! Contactors, discharge resistor and braking chopper.
//!
//! Relays and contactors are plain outputs, high to close, each with an input for its auxiliary contact. The chopper is TIM17's channel 1,
//! edge-aligned, 1 kHz: one period per operator slot. Its compare is preloaded, so a duty holds for whole periods. Its main output works as those of
//! the gates do ([`super::outputs`]): when off, the pin is driven low, and the chip's own break switches it off.

pub use super::pins::Wires;
use super::pins::{self, CHOPPER_OFF, Wire, is_high};
use super::power_stage::CORE_HZ;
use super::registers::Registers;
use stm32_metapac::timer::{regs, vals};
use tractive::operator::Switches;

/// Counts of a chopper period.
pub const CHOPPER_COUNTS: u16 = 1_000;
/// Chopper periods per second, in Hz.
const CHOPPER_HZ: u32 = 1_000;

/// Sets the outputs low, the chopper off and counting. The chopper's pin is still an input then.
pub fn configure(registers: &Registers) {
    let timer = registers.tim17;
    timer.psc().write_value((CORE_HZ / CHOPPER_HZ / u32::from(CHOPPER_COUNTS) - 1) as u16);
    timer.arr().write(|w| w.set_arr(CHOPPER_COUNTS - 1));
    timer.ccr(0).write(|w| w.set_ccr(CHOPPER_OFF));
    timer.ccmr_output(0).write(|w| {
        w.set_ocm(0, vals::Ocm::PWM_MODE1);
        w.set_ocpe(0, true);
    });
    timer.ccer().write(|w| w.set_cce(0, true));
    timer.egr().write(|w| w.set_ug(true));
    // No break pin is wired; the chip's own break (crystal, lock-up, memory, supply) remains.
    timer.af1().write(|w| w.set_bkine(false));
    timer.bdtr().write(|w| {
        w.set_ossi(vals::Ossi::IDLE_LEVEL);
        w.set_bke(0, true);
        w.set_bkp(0, vals::Bkp::ACTIVE_HIGH);
        w.set_lock(vals::Lock::LEVEL2);
        w.set_moe(true);
    });
    timer.cr1().write(|w| {
        w.set_arpe(true);
        w.set_cen(true);
    });
}

/// Switches the chopper off for good: no duty reaches its pin any more.
pub fn stop_chopper(registers: &Registers) {
    registers.tim17.bdtr().modify(|w| w.set_moe(false));
}

/// Switches the chopper on again after a break of the chip's own, which keeps the timer's main output off for good; for a drive without a fault. While the
/// cause lasts, the hardware keeps it off.
pub fn resume_chopper(registers: &Registers) {
    let timer = registers.tim17;
    if !timer.bdtr().read().moe() {
        // Status flags are cleared by writing 0; writing 1 leaves them alone.
        let mut all_but_break = regs::Sr1chCmp(u32::MAX);
        all_but_break.set_bif(0, false);
        timer.sr().write_value(all_but_break);
        timer.bdtr().modify(|w| w.set_moe(true));
    }
}

/// Sets all switches. From the idle loop only.
pub fn set(registers: &Registers, switches: &Switches) {
    set_wires(registers, &pins::SWITCHGEAR, switches);
    registers.tim17.ccr(0).write(|w| w.set_ccr(counts(switches.chopper)));
}

/// The same for any system, without a chopper.
pub fn set_wires(registers: &Registers, of: &Wires, switches: &Switches) {
    let Switches { precharge, main, discharge, .. } = *switches;
    // What opens comes before what closes: a contactor is never still commanded closed when the discharge resistor goes on.
    let wires = [(of.precharge, precharge), (of.main, main), (of.discharge, discharge)];
    for closes in [false, true] {
        for (wire, _) in wires.iter().filter(|(_, closed)| *closed == closes) {
            wire.set(registers, closes);
        }
    }
}

/// `true` for each auxiliary contact, of precharge relay and main contactor, that is closed.
pub fn contacts(registers: &Registers, of: &Wires) -> (bool, bool) {
    let closed = |wire: Wire| is_high(wire.port(registers), wire.number);
    (closed(of.precharge_contact), closed(of.main_contact))
}

/// A duty as a compare; a value that is not a number gives no duty.
fn counts(duty: f32) -> u16 {
    let counts = duty * f32::from(CHOPPER_COUNTS);
    if counts >= f32::from(CHOPPER_COUNTS) {
        CHOPPER_COUNTS
    } else if counts > 0.0 {
        counts as u16
    } else {
        CHOPPER_OFF
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_duty_is_a_share_of_the_period() {
        for (duty, wanted) in [(0.0, 0), (0.5, 500), (1.0, 1_000), (2.0, 1_000), (-1.0, 0), (f32::NAN, 0)] {
            assert_eq!(counts(duty), wanted, "{duty}");
        }
    }
}
