//! Supply, flash interface, system configuration and debug (RM0440, chapters 6, 3, 10 and 47): words that are kept, with their reset values
//! and what they bring about.

use super::rcc::{Rcc, Supply};
use crate::finding::Findings;
use std::collections::HashMap;

/// The registers that are modelled, with their reset values.
const RESET: [(&str, u32, u32); 10] = [
    ("PWR", 0x04, 0),
    ("PWR", 0x08, 0x8000),
    ("PWR", 0x80, 0x0100),
    ("FLASH", 0x00, 0x0004_0600),
    ("SYSCFG", 0x1C, 0),
    ("SYSCFG", 0x20, 0),
    ("DBGMCU", 0x04, 0),
    ("DBGMCU", 0x08, 0),
    ("DBGMCU", 0x0C, 0),
    ("DBGMCU", 0x10, 0),
];

/// The words, and the supply's state.
#[derive(Debug)]
pub struct System {
    words: HashMap<(&'static str, u32), u32>,
    /// The supply is below the voltage detector's threshold.
    pub low_supply: bool,
}

impl Default for System {
    fn default() -> Self {
        let words = RESET.iter().map(|(name, offset, value)| ((*name, *offset), *value)).collect();
        Self { words, low_supply: false }
    }
}

impl System {
    fn key(name: &str, offset: u32) -> Option<(&'static str, u32)> {
        RESET.iter().find(|known| known.0 == name && known.1 == offset).map(|known| (known.0, known.1))
    }

    fn word(&self, name: &'static str, offset: u32) -> u32 {
        self.words.get(&(name, offset)).copied().unwrap_or(0)
    }

    /// A register is read.
    pub fn read(&self, name: &str, offset: u32) -> Option<u32> {
        Self::key(name, offset).and_then(|key| self.words.get(&key).copied())
    }

    /// A register is written; `false` if the twin has no such register.
    pub fn write(&mut self, name: &str, offset: u32, value: u32, findings: &mut Findings) -> bool {
        let Some(key) = Self::key(name, offset) else { return false };
        if name == "SYSCFG" {
            let (locks, register) = if offset == 0x1C { (0b1111, "CFGR2") } else { (u32::MAX, "SWPR") };
            let before = self.word("SYSCFG", offset) & locks;
            findings.expect(value & before == before, || {
                format!("SYSCFG.{register}: a lock cannot be taken back")
            });
        }
        self.words.insert(key, value);
        true
    }

    /// `true` if a timer stops while a debugger halts the core (DBGMCU_APB1FZR1, APB2FZR).
    pub fn stops_with_core(&self, timer: &str) -> bool {
        let (offset, bit) = match timer {
            "TIM2" => (0x08, 0),
            "TIM3" => (0x08, 1),
            "TIM4" => (0x08, 2),
            "TIM1" => (0x10, 11),
            "TIM8" => (0x10, 13),
            "TIM17" => (0x10, 18),
            "TIM20" => (0x10, 20),
            _ => return false,
        };
        self.word("DBGMCU", offset) >> bit & 1 != 0
    }

    /// `true` if the CCM SRAM cannot be written at an offset (SYSCFG_SWPR, a bit for each page of 1 KB).
    pub fn is_protected(&self, offset: u32) -> bool {
        self.word("SYSCFG", 0x20) >> (offset >> 10) & 1 != 0
    }

    /// `true` if none of it can be written.
    pub fn is_all_protected(&self) -> bool {
        self.word("SYSCFG", 0x20) == u32::MAX
    }

    /// The conditions of a fast clock.
    pub fn supply(&self) -> Supply {
        Supply { latency: self.word("FLASH", 0) & 0xF, boosted: self.word("PWR", 0x80) & 1 << 8 == 0 }
    }

    /// `true` while the chip itself activates its timers' break: the crystal has stopped, or the supply is low and that is connected.
    pub fn breaks(&self, rcc: &Rcc) -> bool {
        let watched = self.word("PWR", 0x04) & 1 != 0 && self.word("SYSCFG", 0x1C) & 1 << 2 != 0;
        rcc.has_failed() || (watched && self.low_supply)
    }
}
