//! Accesses: which register it is, whether it is there, clocked, writable, and of whom.

use super::Chip;
use super::adc::Adc;
use super::bits;
use crate::finding::Findings;
use crate::map::{Register, peripherals};
use crate::time::Time;
use crate::world::World;

/// ADC12_COMMON.CCR, and ADC345_COMMON's.
const COMMON_CCR: u32 = 0x08;

impl Chip {
    /// The register of an access, if it may be accessed at all.
    fn found(&self, address: u32, what: &str, findings: &mut Findings) -> Option<(&'static str, Register)> {
        let Some(register) = self.map.at(address & !3).or_else(|| self.map.at(address)) else {
            findings.add(format!("{address:#010x} is {what}, where the chip has no register"));
            return None;
        };
        let peripheral = peripherals()[register.peripheral].name;
        if let Some((offset, bit)) = self.map.enable(register.peripheral)
            && self.rcc.word(offset) & bit == 0
        {
            findings.add(format!("{peripheral}.{} is {what} while its clock is off", register.name));
        }
        Some((peripheral, register.clone()))
    }

    /// The program reads a register.
    pub fn read(
        &mut self,
        address: u32,
        size: usize,
        now: Time,
        world: &mut World,
        findings: &mut Findings,
    ) -> u32 {
        let Some((peripheral, register)) = self.found(address, "read", findings) else { return 0 };
        self.accesses.entry(address).or_default().0 += 1;
        findings.expect(register.readable, || {
            format!("{peripheral}.{} is read, and can only be written", register.name)
        });
        let value = self.value(peripheral, register.offset, now, world);
        let Some(value) = value else {
            findings.add(format!("{peripheral}.{} is read, which the twin does not model", register.name));
            return 0;
        };
        value >> (8 * (address - (address & !3))) & (u64::MAX >> (64 - 8 * size)) as u32
    }

    fn value(&mut self, peripheral: &'static str, offset: u32, now: Time, world: &mut World) -> Option<u32> {
        let cycle = self.rcc.cycle();
        if let Some(timer) = self.timers.iter_mut().find(|timer| timer.name == peripheral) {
            if let Some(tracks) = world.encoder(peripheral, &self.gpio) {
                timer.follow(tracks);
            }
            return timer.read(offset, now, cycle);
        }
        if let Some(number) = Self::adc(peripheral) {
            return self.adcs[number].read(offset);
        }
        match peripheral {
            "RCC" => self.rcc.read(offset),
            "IWDG" => self.watchdog.read(offset, now),
            "FDCAN1" => self.can.read(offset),
            "FDCANRAM1" => self.can.read_ram(offset),
            "ADC12_COMMON" if offset == COMMON_CCR => Some(self.adcs[0].common),
            "ADC345_COMMON" if offset == COMMON_CCR => Some(self.adcs[2].common),
            "SPI3" => self.spi.read(offset),
            name if name.starts_with("GPIO") => self.gpio.read(name, offset, world),
            name if name.starts_with("COMP") || name.starts_with("DAC") => {
                self.comparators.read(name, offset)
            }
            name => self.system.read(name, offset),
        }
    }

    /// The program writes a register.
    pub fn write(&mut self, address: u32, size: usize, value: u32, now: Time, findings: &mut Findings) {
        let Some((peripheral, register)) = self.found(address, "written", findings) else { return };
        self.accesses.entry(address).or_default().1 += 1;
        let name = format!("{peripheral}.{}", register.name);
        findings.expect(register.writable, || format!("{name} is written, and can only be read"));
        findings.expect(address & 3 == 0, || format!("{name} is written by {size} bytes at {address:#010x}"));
        let reserved = value & !register.mask;
        // Writing ones leaves status flags alone, also where a bit has no name.
        let flags = peripheral.starts_with("TIM") && register.offset == 0x10;
        findings.expect(reserved == 0 || flags, || {
            format!("reserved bits {reserved:#010x} of {name} are written")
        });
        let cycle = self.rcc.cycle();
        let offset = register.offset;
        let ignored = bits::modelled(peripheral, offset).map_or(0, |bits| value & register.mask & !bits);
        findings.expect(ignored == 0, || {
            format!("bits {ignored:#010x} of {name} are written, which the twin does not model")
        });
        let done = if let Some(timer) = self.timers.iter_mut().find(|timer| timer.name == peripheral) {
            timer.write(offset, value, now, cycle, findings)
        } else if let Some(number) = Self::adc(peripheral) {
            self.adcs[number].write(offset, value, now, cycle, findings)
        } else {
            self.write_other(peripheral, offset, value, now, findings)
        };
        findings
            .expect(done, || format!("{name} is written with {value:#010x}, which the twin does not model"));
        for index in 0..self.timers.len() {
            self.pass_triggers(index, now);
        }
    }

    fn write_other(
        &mut self,
        peripheral: &str,
        offset: u32,
        value: u32,
        now: Time,
        findings: &mut Findings,
    ) -> bool {
        match peripheral {
            "RCC" => self.rcc.write(offset, value, now, self.system.supply(), findings),
            "IWDG" => self.watchdog.write(offset, value, now, findings),
            "FDCAN1" => self.can.write(offset, value, now, self.rcc.can_clock(), findings),
            "FDCANRAM1" => self.can.write_ram(offset, value),
            "SPI3" => self.spi.write(offset, value, now, self.rcc.cycle(), findings),
            "ADC12_COMMON" | "ADC345_COMMON" if offset == COMMON_CCR => {
                let (first, second) = self.adcs.split_at_mut(2);
                let of = if peripheral == "ADC12_COMMON" { first } else { second };
                let busy = of.iter().any(Adc::is_enabled);
                findings
                    .expect(!busy, || format!("{peripheral}.CCR is written while a converter is enabled"));
                of.iter_mut().for_each(|adc| adc.common = value);
                true
            }
            name if name.starts_with("GPIO") => self.gpio.write(name, offset, value),
            name if name.starts_with("COMP") || name.starts_with("DAC") => {
                self.comparators.write(name, offset, value, findings)
            }
            name => self.system.write(name, offset, value, findings),
        }
    }

    fn adc(peripheral: &str) -> Option<usize> {
        ["ADC1", "ADC2", "ADC3"].iter().position(|name| *name == peripheral)
    }
}
