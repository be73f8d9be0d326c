//! The comparators: overcurrent of either sign turns the gates off without clock or software.
//!
//! Each current is wired to two of them. One breaks above the upper threshold, the other, inverted, below the lower one.
//! Thresholds are on-chip DACs with the converters' reference, so a code means the same current to all of them.

use super::power_stage::PowerStage;
use super::registers::Registers;
use stm32_metapac::{comp, dac};

/// Numbers of the comparators that break the PWM timers.
pub const WATCHING: [usize; 6] = [1, 2, 3, 4, 6, 7];

/// A comparator: its number, which of its two inputs the current is on, and whether it watches the lower threshold.
/// The inverting input of 1 and 3 is DAC3 channel 1, of 2 and 4 DAC3 channel 2, of 6 DAC4 channel 2, of 7 DAC4 channel 1.
const INPUTS: [(usize, bool, bool); 6] = [
    (1, false, false),
    (3, true, false),
    (6, false, false),
    (2, false, true),
    (4, false, true),
    (7, false, true),
];

/// Sets thresholds, then comparators, and locks these until the next reset.
pub fn configure(registers: &Registers, stage: &PowerStage) {
    let (lower, upper) = stage.break_codes();
    for (converter, codes) in [(registers.dac3, [upper, lower]), (registers.dac4, [lower, upper])] {
        converter.mcr().write(|w| {
            // The bus runs at more than 160 MHz.
            w.set_hfsel(2);
            w.set_mode(0, dac::vals::Mode::NORMAL_INT_BUFDIS);
            w.set_mode(1, dac::vals::Mode::NORMAL_INT_BUFDIS);
        });
        for (channel, code) in codes.into_iter().enumerate() {
            converter.dhr12r(channel).write(|w| w.set_dhr(code));
        }
        converter.cr().write(|w| {
            w.set_en(0, true);
            w.set_en(1, true);
        });
    }
    for (number, second_input, lower) in INPUTS {
        registers.comparators[number - 1].csr().write(|w| {
            w.set_inmsel(comp::vals::Inm::DACA);
            w.set_inpsel(second_input);
            w.set_hyst(comp::vals::Hysteresis::HYST20M);
            if lower {
                w.set_polarity(comp::vals::Polarity::INVERTED);
            }
            w.set_en(true);
            w.set_lock(true);
        });
    }
}
