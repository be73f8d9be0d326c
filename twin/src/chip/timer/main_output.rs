//! A timer's main output: dead time, break, levels at the pins, locked bits.

use super::{AF1, BDTR, BIF, BKE, BKP, CCER, CR1, CR2, MOE, SBIF, SR, Timer};
use crate::chip::output;
use crate::finding::Findings;
use crate::time::Time;

impl Timer {
    /// The dead time that its generator makes.
    pub fn dead(&self, cycle: Time) -> Time {
        output::dead_periods(self.word(BDTR) & 0xFF) * (cycle << (self.word(CR1) >> 8 & 0b11))
    }

    /// The inputs of the break: the level of the pin, the comparators that see their threshold crossed, and the chip's own.
    pub fn break_by(&mut self, pin: bool, comparators: u32, chip: bool) {
        let (af1, bdtr) = (self.word(AF1), self.word(BDTR));
        if !self.has_outputs || bdtr & BKE == 0 {
            self.broken = (false, false);
            return;
        }
        let active_high = bdtr & BKP != 0;
        let from_pin = af1 & 1 != 0 && (pin ^ (af1 & 1 << 9 != 0)) == active_high;
        let polarities = af1 >> 10 & 0xF;
        let from_comparators = af1 >> 1 & 0x7F & (comparators ^ polarities) != 0;
        self.broken = (from_pin || from_comparators, chip);
        if self.broken.0 {
            self.break_now(BIF);
        }
        if chip {
            self.break_now(SBIF);
        }
    }

    pub(super) fn break_now(&mut self, flag: u32) {
        self.words[SR / 4] |= flag;
        self.words[BDTR / 4] &= !MOE;
    }

    /// The level of a channel's output at the pin; `None` while the timer does not drive it.
    pub fn output(&self, channel: usize, complementary: bool, now: Time, cycle: Time) -> Option<bool> {
        let (ccer, bdtr) = (self.word(CCER) >> (4 * channel), self.word(BDTR));
        let (own, other) =
            if complementary { (ccer & 4 != 0, ccer & 1 != 0) } else { (ccer & 1 != 0, ccer & 4 != 0) };
        let inverted = ccer & if complementary { 8 } else { 2 } != 0;
        if bdtr & MOE == 0 || self.frozen {
            // OSSI: the idle level, CR2.OIS; without it the output is off.
            let idle = self.word(CR2) >> (8 + 2 * channel + usize::from(complementary)) & 1 != 0;
            return (bdtr & 1 << 10 != 0 && own).then_some(idle);
        }
        if !own {
            // OSSR: the inactive level.
            return (bdtr & 1 << 11 != 0).then_some(inverted);
        }
        let reference = self.references[channel];
        let dead = if other { self.dead(cycle) } else { 0 };
        let (high, low) = reference.outputs(dead, now);
        let level = match (complementary, other) {
            (false, _) => high,
            (true, true) => low,
            (true, false) => reference.high,
        };
        Some(level ^ inverted)
    }

    pub(super) fn write_break(&mut self, value: u32, findings: &mut Findings) {
        let may = !(self.broken.0 || self.broken.1);
        findings.expect(
            value & MOE == 0 || self.word(BDTR) & MOE != 0 || self.word(SR) & (BIF | SBIF) == 0,
            || format!("{}: the main output is switched on with a break latched", self.name),
        );
        self.words[BDTR / 4] = if may { value } else { value & !MOE };
        self.locked = self.locked.max(value >> 8 & 0b11);
    }

    /// Bits that the lock level protects are written with other values (RM0440, BDTR.LOCK).
    pub(super) fn check_lock(&self, register: usize, value: u32, findings: &mut Findings) {
        let held = match (register, self.locked) {
            (_, 0) => 0,
            // The lock level itself is written once.
            (BDTR, 1) => 0x0F_FFFF & !MOE & !(0b11 << 10),
            (BDTR, _) => 0x0F_FFFF & !MOE,
            (CR2, _) => 0x3F00,
            (AF1, _) => 0x3FFF,
            (CCER, 2..) => 0xAAAA,
            (CR1, _) => 0b11 << 8,
            _ => 0,
        };
        let changed = (self.word(register) ^ value) & held;
        findings.expect(changed == 0, || {
            format!("{}: locked bits {changed:#x} of register {register:#x} are changed", self.name)
        });
    }
}
