//! The independent watchdog (RM0440, chapter 42).

use crate::finding::Findings;
use crate::time::{SECOND, Time};

/// The internal low-speed oscillator, in Hz, nominally.
const LSI_HZ: Time = 32_000;
/// The time that a register takes to become valid: six cycles of the oscillator.
const UPDATE: Time = 6 * SECOND / LSI_HZ;

/// The watchdog.
#[derive(Debug)]
pub struct Watchdog {
    prescaler: u32,
    reload: u32,
    unlocked: bool,
    fed: Option<Time>,
    updating_until: Time,
    /// It has reset the chip.
    pub has_bitten: bool,
}

impl Default for Watchdog {
    fn default() -> Self {
        Self { prescaler: 0, reload: 0xFFF, unlocked: false, fed: None, updating_until: 0, has_bitten: false }
    }
}

impl Watchdog {
    fn bites(&self) -> Time {
        let count = Time::from(self.reload + 1) * (4 << self.prescaler.min(6));
        self.fed.map_or(Time::MAX, |fed| fed + count * SECOND / LSI_HZ)
    }

    /// `true` once it is started.
    pub fn is_running(&self) -> bool {
        self.fed.is_some()
    }

    /// The instant at which it resets the chip.
    pub fn next_event(&self) -> Time {
        if self.has_bitten { Time::MAX } else { self.bites() }
    }

    /// Resets the chip, if it was not fed.
    pub fn act(&mut self, now: Time) {
        self.has_bitten |= self.bites() <= now;
    }

    /// A register is read.
    pub fn read(&self, offset: u32, now: Time) -> Option<u32> {
        match offset {
            0x04 => Some(self.prescaler),
            0x08 => Some(self.reload),
            0x0C => Some(if now < self.updating_until { 0b011 } else { 0 }),
            _ => None,
        }
    }

    /// A register is written; `false` if the twin has no such register.
    pub fn write(&mut self, offset: u32, value: u32, now: Time, findings: &mut Findings) -> bool {
        match (offset, value) {
            (0x00, 0x5555) => self.unlocked = true,
            (0x00, key) => {
                self.unlocked = false;
                match key {
                    0xCCCC => self.fed = self.fed.or(Some(now)),
                    0xAAAA => self.fed = self.fed.map(|_| now),
                    _ => {}
                }
            }
            (0x04 | 0x08, _) => {
                findings.expect(self.unlocked, || "IWDG is written while it is locked".into());
                let register = if offset == 0x04 { &mut self.prescaler } else { &mut self.reload };
                *register = value;
                self.updating_until = now + UPDATE;
            }
            _ => return false,
        }
        true
    }
}
