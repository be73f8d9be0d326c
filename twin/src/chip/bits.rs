//! The modelled bits of registers that the twin models only in part: use of any other bit is reported, never ignored.

/// Peripherals by the beginning of their names, offsets, and the modelled bits. A register that is not listed is modelled completely, or reports itself
/// what it does not model.
const PARTS: [(&str, u32, u32); 24] = [
    // Counting, preload, dead-time clock; no one-pulse mode, no remapped flag.
    ("TIM", 0x00, 0x0000_03F5),
    // Triggers' sources, idle levels; no preloaded control bits, no combined inputs.
    ("TIM", 0x04, 0x00F5_FF70),
    // Mode, trigger, the index's filter; no external clock.
    ("TIM", 0x08, 0x0031_0F77),
    // Interrupts; no DMA.
    ("TIM", 0x0C, 0x0000_00FF),
    // Modes, preload, filters; no fast enable, no clearing, no input prescaler.
    ("TIM", 0x18, 0x0101_7B7B),
    ("TIM", 0x1C, 0x0101_7B7B),
    ("TIM", 0x20, 0x0000_FFFF),
    // Every update counts.
    ("TIM", 0x30, 0),
    // Dead time, lock, off states, the first break without filter; no second break, automatic output or bidirectional breaks.
    ("TIM", 0x44, 0x0000_BFFF),
    // The index in either direction, anywhere.
    ("TIM", 0x58, 0x0000_0001),
    // Break sources and their polarities.
    ("TIM", 0x60, 0x0000_3EFF),
    // Push-pull.
    ("GPIO", 0x04, 0),
    // On, inputs, polarity, hysteresis (which is none here), reference, lock; no blanking.
    ("COMP", 0x00, 0x80C7_8171),
    // On, without trigger, wave and DMA.
    ("DAC", 0x00, 0x0001_0001),
    ("ADC12_COMMON", 0x08, 0x0003_0000),
    ("ADC345_COMMON", 0x08, 0x0003_0000),
    // A rising edge, or software.
    ("ADC", 0x4C, 0xFFFF_FEFF),
    ("SPI3", 0x00, 0x0000_037F),
    ("SPI3", 0x04, 0x0000_0F00),
    ("FDCAN1", 0x18, 0x0000_0003),
    // The transmit buffers as a FIFO.
    ("FDCAN1", 0xC0, 0),
    ("FLASH", 0x00, 0x0004_070F),
    ("PWR", 0x04, 0x0000_000F),
    ("RCC", 0x00, 0x030B_0500),
];

/// The bits of a register that the twin models; `None` if that is all of them.
pub fn modelled(peripheral: &str, offset: u32) -> Option<u32> {
    let part = PARTS.iter().find(|(name, at, _)| peripheral.starts_with(name) && *at == offset)?;
    Some(part.2)
}
