//! SPI3 as a master that shifts words of 16 bits in (RM0440, chapter 39): clock, FIFOs of two words, receive flag.

use super::gpio::{Driver, Gpio};
use crate::finding::Findings;
use crate::time::Time;
use crate::world::World;
use std::collections::VecDeque;

const CR1: u32 = 0x00;
const CR2: u32 = 0x04;
const SR: u32 = 0x08;
const DR: u32 = 0x0C;
const CPOL: u32 = 1 << 1;
const MSTR: u32 = 1 << 2;
const SPE: u32 = 1 << 6;
/// SSM and SSI: without both, a master loses its master mode to its own select pin.
const SELECTED: u32 = 0b11 << 8;
/// Words that each FIFO holds.
const WORDS: usize = 2;
const BITS: Time = 16;

/// The controller.
#[derive(Debug)]
pub struct Spi {
    control: [u32; 2],
    sending: usize,
    received: VecDeque<u16>,
    overrun: bool,
    /// The end of the word that is shifted.
    ends: Option<Time>,
}

impl Default for Spi {
    fn default() -> Self {
        Self { control: [0, 0x0700], sending: 0, received: VecDeque::new(), overrun: false, ends: None }
    }
}

impl Spi {
    /// The end of the word that is shifted.
    pub fn next_event(&self) -> Time {
        self.ends.unwrap_or(Time::MAX)
    }

    fn word_time(&self, cycle: Time) -> Time {
        (BITS * cycle) << ((self.control[0] >> 3 & 7) + 1)
    }

    /// Does what is due. Without a wire, a word is all zeros.
    pub fn act(&mut self, now: Time, cycle: Time, gpio: &Gpio, world: &mut World) {
        if self.ends.is_none_or(|at| at > now) {
            return;
        }
        let is_wired = |signal| gpio.leading_to(("SPI3", signal)).any(|pin| world.is_feedback(pin, signal));
        let word = if is_wired("SCK") && is_wired("MISO") { world.shift_word() } else { 0 };
        if self.received.len() < WORDS {
            self.received.push_back(word);
        } else {
            self.overrun = true;
        }
        self.sending -= 1;
        self.ends = (self.sending > 0).then(|| now + self.word_time(cycle));
    }

    /// A register is read.
    pub fn read(&mut self, offset: u32) -> Option<u32> {
        match offset {
            CR1 | CR2 => Some(self.control[(offset / 4) as usize]),
            SR => {
                let (full, level) = (self.sending >= WORDS, self.received.len() as u32);
                let busy = u32::from(self.ends.is_some()) << 7;
                let flags = u32::from(level > 0) | u32::from(!full) << 1 | u32::from(self.overrun) << 6;
                Some(flags | busy | (2 * level).min(3) << 9)
            }
            DR => Some(self.received.pop_front().unwrap_or(0).into()),
            _ => None,
        }
    }

    /// A register is written; `false` if the twin has no such register.
    pub fn write(
        &mut self,
        offset: u32,
        value: u32,
        now: Time,
        cycle: Time,
        findings: &mut Findings,
    ) -> bool {
        match offset {
            CR1 => {
                let starts = value & SPE != 0;
                findings.expect(!starts || value & (MSTR | SELECTED) == MSTR | SELECTED, || {
                    "SPI3 is started, and is no master".into()
                });
                findings.expect(value & CPOL == 0, || {
                    "SPI3: the driver board shifts at the falling edge of a clock that rests low".into()
                });
                self.control[0] = value;
            }
            CR2 => {
                findings
                    .expect(value >> 8 & 0xF == 0xF, || "SPI3: only words of 16 bits are modelled".into());
                self.control[1] = value;
            }
            DR => {
                findings.expect(self.control[0] & SPE != 0, || "SPI3.DR is written while it is off".into());
                findings.expect(self.sending < WORDS, || "SPI3.DR is written while it is full".into());
                self.sending = (self.sending + 1).min(WORDS);
                self.ends = self.ends.or(Some(now + self.word_time(cycle)));
            }
            _ => return false,
        }
        true
    }
}

/// The level of a pin as the program has written it.
pub fn written(gpio: &Gpio, pin: usize) -> bool {
    gpio.driver(pin) == Driver::Level(true)
}
