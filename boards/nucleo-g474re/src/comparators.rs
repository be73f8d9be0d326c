//! The comparators: overcurrent of either sign turns the gates off without clock or software.
//!
//! Each current is wired to two comparators. One triggers a break above the upper threshold, the other, inverted, below the lower one. Thresholds are
//! on-chip DACs with the converters' reference, so a code means the same current to all of them.

use super::power_stage::PowerStage;
use super::registers::Registers;
use stm32_metapac::{comp, dac};

/// The signal that a comparator watches.
#[derive(Clone, Copy, Debug)]
pub struct Watch {
    /// COMP1 ..= COMP7.
    pub number: usize,
    /// `true` if the wire is on the second of its two inputs.
    pub second_input: bool,
    /// `true` if it breaks below its threshold, not above.
    pub below: bool,
    /// Its threshold: a DAC (for 1 and 3 DAC3 channel 1, for 2 and 4 DAC3 channel 2, for 6 DAC4 channel 2, for 7 DAC4 channel 1), or the internal
    /// reference of 1.2 V.
    pub threshold: comp::vals::Inm,
}

impl Watch {
    /// With a DAC as its threshold.
    pub const fn dac(number: usize, second_input: bool, below: bool) -> Self {
        Self { number, second_input, below, threshold: comp::vals::Inm::DACA }
    }
}

/// Each current is on two comparators.
const WATCHES: [Watch; 6] = [
    Watch::dac(1, false, false),
    Watch::dac(3, true, false),
    Watch::dac(6, false, false),
    Watch::dac(2, false, true),
    Watch::dac(4, false, true),
    Watch::dac(7, false, true),
];

/// Sets the PMaSynRM drive's thresholds, then its comparators.
pub fn configure(registers: &Registers, stage: &PowerStage) {
    let (lower, upper) = stage.break_codes();
    configure_watches(registers, [[upper, lower], [lower, upper]], &WATCHES);
}

/// Sets thresholds (codes of DAC3 and DAC4, both channels), then the comparators, and locks the latter until the next reset.
pub fn configure_watches(registers: &Registers, thresholds: [[u16; 2]; 2], watches: &[Watch]) {
    for (converter, codes) in [registers.dac3, registers.dac4].into_iter().zip(thresholds) {
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
    for watch in watches {
        let Some(comparator) = registers.comparators.get(watch.number.wrapping_sub(1)) else { continue };
        comparator.csr().write(|w| {
            w.set_inmsel(watch.threshold);
            w.set_inpsel(watch.second_input);
            w.set_hyst(comp::vals::Hysteresis::HYST20M);
            // The internal reference has to be enabled for the comparator.
            w.set_scalen(watch.threshold == comp::vals::Inm::VREF);
            if watch.below {
                w.set_polarity(comp::vals::Polarity::INVERTED);
            }
            w.set_en(true);
            w.set_lock(true);
        });
    }
}
