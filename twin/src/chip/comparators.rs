//! Comparators, and the converters of their thresholds (RM0440, chapters 24 and 22).

use super::adc::REFERENCE_V;
use super::gpio::{Driver, Gpio, place};
use crate::finding::Findings;
use crate::world::World;

/// The internal reference, in V, and the bits that lend it and its divider.
const INTERNAL_V: f64 = 1.212;
const BRGEN: u32 = 1 << 22;
const SCALEN: u32 = 1 << 23;
const LOCK: u32 = 1 << 31;
const VALUE: u32 = 1 << 30;
/// The inputs of COMP1 to COMP7, by INPSEL (RM0440, "COMP non-inverting input assignment").
const INPUTS: [[&str; 2]; 7] = [
    ["PA1", "PB1"],
    ["PA7", "PA3"],
    ["PA0", "PC1"],
    ["PB0", "PE7"],
    ["PB13", "PD12"],
    ["PB11", "PD11"],
    ["PB14", "PD14"],
];
/// The converter, DAC3 or DAC4, and its channel, that INMSEL = 4 selects for each comparator (RM0440, "COMP inverting input assignment").
const THRESHOLDS: [(usize, usize); 7] = [(0, 0), (0, 1), (0, 0), (0, 1), (1, 0), (1, 1), (1, 0)];
/// DAC registers that are kept: CR, DHR12R1, DHR12R2, MCR.
const KEPT: [u32; 4] = [0x00, 0x08, 0x14, 0x3C];

/// The comparators with their converters.
#[derive(Debug, Default)]
pub struct Comparators {
    controls: [u32; 7],
    values: u32,
    converters: [[u32; 4]; 2],
}

impl Comparators {
    fn converter(name: &str) -> Option<usize> {
        ["DAC3", "DAC4"].iter().position(|known| *known == name)
    }

    fn number(name: &str) -> Option<usize> {
        name.strip_prefix("COMP")?.parse::<usize>().ok()?.checked_sub(1)
    }

    /// The threshold of a comparator, in V; `None` while there is none.
    fn threshold_v(&self, index: usize) -> Option<f64> {
        let control = self.controls[index];
        let source = control >> 4 & 7;
        if source < 4 {
            // The internal reference, or the part of it behind its divider.
            let share = if control & BRGEN != 0 { f64::from(source + 1) / 4.0 } else { 1.0 };
            return (control & SCALEN != 0).then_some(INTERNAL_V * share);
        }
        if source != 4 {
            return None;
        }
        let (converter, channel) = THRESHOLDS[index];
        let words = self.converters[converter];
        let enabled = words[0] >> (16 * channel) & 1 != 0;
        enabled.then(|| f64::from(words[1 + channel] & 0xFFF) / 4_096.0 * REFERENCE_V)
    }

    /// The outputs after their polarity, a bit each; a comparator that is off, or has no input or no threshold, gives none.
    pub fn see(&mut self, gpio: &Gpio, world: &World) -> u32 {
        self.values = (0..7).fold(0, |bits, index| {
            let control = self.controls[index];
            let pin = place(INPUTS[index][(control >> 8 & 1) as usize]);
            let volts = world.voltage(pin).filter(|_| gpio.driver(pin) == Driver::Analog);
            let seen = volts.zip(self.threshold_v(index)).is_some_and(|(volts, threshold)| volts > threshold);
            let output =
                control & 1 != 0 && self.threshold_v(index).is_some() && (seen ^ (control & 1 << 15 != 0));
            bits | u32::from(output) << index
        });
        self.values
    }

    /// A register is read.
    pub fn read(&self, name: &str, offset: u32) -> Option<u32> {
        if let Some(index) = Self::number(name) {
            let value = if self.values >> index & 1 != 0 { VALUE } else { 0 };
            return Some(self.controls[index] | value);
        }
        let register = KEPT.iter().position(|known| *known == offset)?;
        Some(self.converters[Self::converter(name)?][register])
    }

    /// A register is written; `false` if the twin has no such register.
    pub fn write(&mut self, name: &str, offset: u32, value: u32, findings: &mut Findings) -> bool {
        if let Some(index) = Self::number(name) {
            let locked = self.controls[index] & LOCK != 0;
            findings.expect(!locked, || format!("{name} is written, and is locked"));
            if !locked {
                self.controls[index] = value & !VALUE;
            }
            return true;
        }
        let (Some(converter), Some(register)) =
            (Self::converter(name), KEPT.iter().position(|known| *known == offset))
        else {
            return false;
        };
        let enabled = self.converters[converter][0] & 0x1_0001 != 0;
        findings.expect(register != 3 || !enabled, || {
            format!("{name}.MCR is written while a channel is enabled")
        });
        self.converters[converter][register] = value;
        true
    }
}
