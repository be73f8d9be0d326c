//! The published description of the chip's registers: names, offsets, fields, access, clock enables, pins.

use std::collections::HashMap;
use stm32_metapac::metadata::ir::{Access, Array, BitOffset, BlockItemInner, IR};
use stm32_metapac::metadata::{METADATA, Peripheral};

/// A register.
#[derive(Clone, Debug)]
pub struct Register {
    /// The peripheral's place in the description.
    pub peripheral: usize,
    /// Its offset in the peripheral.
    pub offset: u32,
    /// Its name.
    pub name: String,
    /// The bits that have a name; the others are reserved.
    pub mask: u32,
    /// It can be read.
    pub readable: bool,
    /// It can be written.
    pub writable: bool,
}

/// A bit of an enable register of RCC: offset and mask.
pub type Enable = (u32, u32);

/// The registers by their addresses, and what each peripheral needs.
pub struct Map {
    registers: HashMap<u32, Register>,
    enables: Vec<Option<Enable>>,
    signals: HashMap<(&'static str, u8), Vec<(&'static str, &'static str)>>,
}

/// The peripherals.
pub fn peripherals() -> &'static [Peripheral] {
    METADATA.peripherals
}

/// The name of an interrupt by its number as an exception.
pub fn interrupt(exception: usize) -> &'static str {
    let line = exception.checked_sub(16);
    let found = METADATA.interrupts.iter().find(|known| Some(known.number as usize) == line);
    found.map_or("exception", |known| known.name)
}

/// Fields where the published description is wrong by the reference manual: peripheral, offset, the bits that have a name.
const CORRECTED: [(&str, u32, u32); 1] = [
    // PWR_CR5.R1MODE is bit 8 (RM0440, 6.4.20), not bit 0.
    ("PWR", 0x80, 1 << 8),
];

impl Map {
    /// Of the whole chip.
    pub fn new() -> Self {
        let mut registers = HashMap::new();
        for (index, peripheral) in peripherals().iter().enumerate() {
            let Some(described) = &peripheral.registers else { continue };
            let mut of = Vec::new();
            expand(described.ir, described.block, 0, "", &mut of);
            for (offset, register) in of {
                let address = peripheral.address as u32 + offset;
                let known = CORRECTED.iter().find(|(name, at, _)| *name == peripheral.name && *at == offset);
                // A register of several widths has the bits of its widest.
                let wider = registers.get(&address).map_or(0, |wider: &Register| wider.mask);
                let mask = known.map_or(register.mask | wider, |(.., mask)| *mask);
                registers.insert(address, Register { peripheral: index, offset, mask, ..register });
            }
        }
        let mut signals: HashMap<_, Vec<_>> = HashMap::new();
        for peripheral in peripherals() {
            for pin in peripheral.pins {
                if let Some(af) = pin.af {
                    signals.entry((pin.pin, af)).or_default().push((peripheral.name, pin.signal));
                }
            }
        }
        Self { registers, enables: enables(), signals }
    }

    /// The register at an address.
    pub fn at(&self, address: u32) -> Option<&Register> {
        self.registers.get(&address)
    }

    /// All registers with their addresses.
    pub fn registers(&self) -> impl Iterator<Item = (u32, &Register)> {
        self.registers.iter().map(|(address, register)| (*address, register))
    }

    /// The enable bit of a peripheral's clock; `None` if it needs none.
    pub fn enable(&self, peripheral: usize) -> Option<Enable> {
        self.enables[peripheral]
    }

    /// The signals, by peripheral and name, that an alternate function has at a pin.
    pub fn signals(&self, pin: &str, af: u8) -> &[(&'static str, &'static str)] {
        // The pins' names are the description's own.
        let name = METADATA.pins.iter().find(|known| known.name == pin).map(|known| known.name);
        name.and_then(|name| self.signals.get(&(name, af))).map_or(&[], Vec::as_slice)
    }
}

impl Default for Map {
    fn default() -> Self {
        Self::new()
    }
}

/// The pin of an analog signal, as `("ADC1", "IN2")`.
pub fn analog_pin(peripheral: &str, signals: &[&str]) -> Option<&'static str> {
    let found = peripherals().iter().find(|known| known.name == peripheral)?;
    let pin = found.pins.iter().find(|pin| signals.contains(&pin.signal));
    pin.map(|pin| pin.pin)
}

fn enables() -> Vec<Option<Enable>> {
    let rcc = peripherals().iter().find(|peripheral| peripheral.name == "RCC");
    let ir = rcc.and_then(|rcc| rcc.registers.as_ref()).map(|registers| registers.ir);
    let bit = |register: &str, field: &str| -> Option<Enable> {
        let ir = ir?;
        let item = ir.blocks.iter().flat_map(|block| block.items).find(|item| same(item.name, register))?;
        let set = ir.fieldsets.iter().find(|set| same(set.name, register))?;
        let field = set.fields.iter().find(|known| same(known.name, field))?;
        let BitOffset::Regular(at) = &field.bit_offset else { return None };
        Some((item.byte_offset, 1 << at.offset))
    };
    let named = |peripheral: &Peripheral| match peripheral.name {
        // Message RAM and comparators are in their neighbours' clock domains (RM0440, memory map and RCC_APB2ENR).
        "FDCANRAM1" => bit("APB1ENR1", "FDCANEN"),
        "ADC12_COMMON" => bit("AHB2ENR", "ADC12EN"),
        "ADC345_COMMON" => bit("AHB2ENR", "ADC345EN"),
        name if name.starts_with("COMP") => bit("APB2ENR", "SYSCFGEN"),
        _ => {
            peripheral.rcc.as_ref().and_then(|rcc| rcc.enable.as_ref()).and_then(|e| bit(e.register, e.field))
        }
    };
    peripherals().iter().map(named).collect()
}

/// `true` if two names differ in their spelling alone: the description says `TIM_ADV` and `TimAdv`.
fn same(one: &str, other: &str) -> bool {
    let letters = |name: &str| name.replace('_', "").to_ascii_lowercase();
    letters(one) == letters(other)
}

fn expand(ir: &IR, block: &str, base: u32, prefix: &str, into: &mut Vec<(u32, Register)>) {
    let Some(block) = ir.blocks.iter().find(|known| same(known.name, block)) else { return };
    if let Some(parent) = block.extends {
        expand(ir, parent, base, prefix, into);
    }
    for item in block.items {
        for (index, shift) in offsets(item.array.as_ref()).into_iter().enumerate() {
            let number = if item.array.is_some() { format!("[{index}]") } else { String::new() };
            let (at, name) = (base + item.byte_offset + shift, format!("{prefix}{}{number}", item.name));
            match &item.inner {
                BlockItemInner::Block(inner) => expand(ir, inner.block, at, &format!("{name}."), into),
                BlockItemInner::Register(register) => {
                    let whole = u32::MAX >> (32 - register.bit_size.clamp(1, 32));
                    let mask = register.fieldset.map_or(whole, |set| named_bits(ir, set));
                    let readable = register.access != Access::Write;
                    let writable = register.access != Access::Read;
                    into.push((at, Register { peripheral: 0, offset: at, name, mask, readable, writable }));
                }
            }
        }
    }
}

fn named_bits(ir: &IR, set: &str) -> u32 {
    let Some(set) = ir.fieldsets.iter().find(|known| same(known.name, set)) else { return u32::MAX };
    let parent = set.extends.map_or(0, |parent| named_bits(ir, parent));
    set.fields.iter().fold(parent, |mask, field| {
        let shifts = offsets(field.array.as_ref());
        let bits = |shift: u32| match &field.bit_offset {
            BitOffset::Regular(at) => (((1_u64 << field.bit_size) - 1) << (at.offset + shift)) as u32,
            BitOffset::Cursed(at) => at.ranges.iter().fold(0, |mask, range| {
                range.clone().fold(mask, |mask, bit| mask | 1_u32.checked_shl(bit + shift).unwrap_or(0))
            }),
        };
        shifts.into_iter().fold(mask, |mask, shift| mask | bits(shift))
    })
}

fn offsets(array: Option<&Array>) -> Vec<u32> {
    match array {
        None => vec![0],
        Some(Array::Regular(array)) => (0..array.len).map(|index| index * array.stride).collect(),
        Some(Array::Cursed(array)) => array.offsets.to_vec(),
    }
}
