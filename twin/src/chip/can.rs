//! The CAN controller with its message RAM (RM0440, chapter 44): classic frames, the first receive FIFO, the transmit FIFO.

use super::gpio::Gpio;
use crate::finding::Findings;
use crate::time::{MICROSECOND, Time};
use crate::world::World;
use std::collections::{HashMap, VecDeque};
use tractive::protocol::Frame;

const CCCR: u32 = 0x18;
const NBTP: u32 = 0x1C;
const PSR: u32 = 0x44;
const RXGFC: u32 = 0x80;
const RXF0S: u32 = 0x90;
const RXF0A: u32 = 0x94;
const TXBC: u32 = 0xC0;
const TXFQS: u32 = 0xC4;
const TXBAR: u32 = 0xCC;
const CKDIV: u32 = 0x100;
/// Registers that are write-protected outside configuration mode.
const PROTECTED: [u32; 4] = [NBTP, RXGFC, TXBC, CKDIV];
const INIT: u32 = 1;
const CCE: u32 = 1 << 1;

/// Words of an element of a FIFO; where FIFOs begin in the message RAM, in words; its length.
const ELEMENT: usize = 18;
const ELEMENTS: usize = 3;
const RX_FIFO_0: usize = 0xB0 / 4;
const TX_FIFO: usize = 0x278 / 4;
const RAM: usize = 0x350 / 4;
/// The bus: its rate, and the length of a frame of eight bytes with its space and some stuffed bits.
const BIT_RATE: u32 = 500_000;
const FRAME_TIME: Time = 2 * 125 * MICROSECOND;

/// PSR.BO, and the time of 129 times eleven recessive bits.
const BUS_OFF: u32 = 1 << 7;
const RECOVERY: Time = 129 * 11 * 2 * MICROSECOND;

/// The controller.
pub struct Can {
    words: HashMap<u32, u32>,
    ram: [u32; RAM],
    receiving: (usize, usize),
    sending: VecDeque<usize>,
    put: usize,
    sent: Time,
    arriving: VecDeque<(Time, Frame)>,
    /// The end of a recovery from bus-off.
    recovers: Time,
    is_timed: bool,
    /// Frames that found the receive FIFO full.
    pub lost: u32,
}

impl Default for Can {
    fn default() -> Self {
        let reset = [(CCCR, INIT), (NBTP, 0x0600_0A03), (PSR, 0x0707), (RXGFC, 0), (TXBC, 0), (CKDIV, 0)];
        Self {
            words: reset.into_iter().collect(),
            ram: [0; RAM],
            receiving: (0, 0),
            sending: VecDeque::new(),
            put: 0,
            sent: Time::MAX,
            arriving: VecDeque::new(),
            recovers: Time::MAX,
            is_timed: false,
            lost: 0,
        }
    }
}

impl Can {
    fn word(&self, offset: u32) -> u32 {
        self.words.get(&offset).copied().unwrap_or(0)
    }

    fn is_on_bus(&self) -> bool {
        self.word(CCCR) & INIT == 0 && self.word(PSR) & BUS_OFF == 0 && self.is_timed
    }

    /// Too many errors: it leaves the bus by itself.
    pub fn leave_bus(&mut self) {
        *self.words.entry(PSR).or_default() |= BUS_OFF;
        *self.words.entry(CCCR).or_default() |= INIT;
    }

    /// Somebody begins to send a frame.
    pub fn hear(&mut self, frame: Frame, now: Time) {
        self.arriving.push_back((now + FRAME_TIME, frame));
    }

    /// The next change.
    pub fn next_event(&self) -> Time {
        self.sent.min(self.recovers).min(self.arriving.front().map_or(Time::MAX, |(at, _)| *at))
    }

    /// Does what is due.
    pub fn act(&mut self, now: Time, gpio: &Gpio, world: &mut World) {
        let is_wired = |signal| gpio.leading_to(("FDCAN1", signal)).any(|pin| world.is_bus(pin, signal));
        if self.recovers <= now {
            self.recovers = Time::MAX;
            *self.words.entry(PSR).or_default() &= !BUS_OFF;
        }
        let (listens, speaks) = (is_wired("RX"), is_wired("TX"));
        if self.sent <= now {
            self.sent = Time::MAX;
            // Without an acknowledge from a listener, the frame is sent again and again.
            if speaks
                && self.is_on_bus()
                && let Some(index) = self.sending.pop_front()
            {
                world.heard(now, self.element(TX_FIFO + ELEMENT * index));
            }
            if !self.sending.is_empty() {
                self.sent = now + FRAME_TIME;
            }
        }
        while self.arriving.front().is_some_and(|(at, _)| *at <= now) {
            let Some((_, frame)) = self.arriving.pop_front() else { return };
            if listens && self.is_on_bus() && self.passes(&frame) {
                self.store(&frame);
            }
        }
    }

    /// The standard filters: two identifiers each, into the first FIFO; other types are not modelled.
    fn passes(&self, frame: &Frame) -> bool {
        let count = (self.word(RXGFC) >> 16 & 0x1F) as usize;
        let found = self.ram[..count.min(28)].iter().any(|filter| {
            let (first, second) = (filter >> 16 & 0x7FF, filter & 0x7FF);
            filter >> 30 == 1 && filter >> 27 & 7 == 1 && [first, second].contains(&u32::from(frame.id))
        });
        found || self.word(RXGFC) >> 4 & 0b11 == 0
    }

    fn store(&mut self, frame: &Frame) {
        let (first, count) = self.receiving;
        if count == ELEMENTS {
            self.lost += 1;
            return;
        }
        let base = RX_FIFO_0 + ELEMENT * ((first + count) % ELEMENTS);
        let half = |from: usize| u32::from_le_bytes([0, 1, 2, 3].map(|byte| frame.data[from + byte]));
        self.ram[base] = u32::from(frame.id) << 18;
        self.ram[base + 1] = u32::from(frame.length) << 16;
        (self.ram[base + 2], self.ram[base + 3]) = (half(0), half(4));
        self.receiving.1 += 1;
    }

    fn element(&self, base: usize) -> Frame {
        let mut data = [0; 8];
        data[..4].copy_from_slice(&self.ram[base + 2].to_le_bytes());
        data[4..].copy_from_slice(&self.ram[base + 3].to_le_bytes());
        Frame {
            id: (self.ram[base] >> 18 & 0x7FF) as u16,
            length: (self.ram[base + 1] >> 16 & 0xF) as u8,
            data,
        }
    }

    /// A register is read.
    pub fn read(&self, offset: u32) -> Option<u32> {
        let (first, count) = (self.receiving.0 as u32, self.receiving.1 as u32);
        match offset {
            RXF0S => Some(count | first << 8 | ((first + count) % 3) << 16 | u32::from(count == 3) << 24),
            TXFQS => {
                let (free, get) =
                    (ELEMENTS - self.sending.len(), self.sending.front().copied().unwrap_or(self.put));
                Some(free as u32 | (get as u32) << 8 | (self.put as u32) << 16 | u32::from(free == 0) << 21)
            }
            _ => self.words.get(&offset).copied(),
        }
    }

    /// A register is written; `false` if the twin has no such register.
    pub fn write(
        &mut self,
        offset: u32,
        value: u32,
        now: Time,
        clock: Option<u32>,
        findings: &mut Findings,
    ) -> bool {
        let open = self.word(CCCR) & (INIT | CCE) == INIT | CCE;
        findings.expect(open || !PROTECTED.contains(&offset), || {
            format!("FDCAN1: {offset:#x} is written while it is protected")
        });
        match offset {
            CCCR => {
                let both = value & CCE == 0 || self.word(CCCR) & INIT != 0;
                findings.expect(both, || "FDCAN1.CCCR.CCE is set before INIT has arrived".into());
                self.words.insert(CCCR, value);
                if value & INIT == 0 {
                    if self.word(PSR) & BUS_OFF != 0 {
                        self.recovers = now + RECOVERY;
                    }
                    self.join(clock, findings);
                }
            }
            RXF0A => {
                let (first, count) = self.receiving;
                let given = (value as usize + ELEMENTS - first) % ELEMENTS + 1;
                findings.expect(given <= count, || {
                    format!("FDCAN1.RXF0A: element {value} is not one that was received")
                });
                self.receiving = ((first + given.min(count)) % ELEMENTS, count - given.min(count));
            }
            TXBAR => {
                findings.expect(value == 1 << self.put && self.sending.len() < ELEMENTS, || {
                    format!("FDCAN1.TXBAR: {value:#b} is not the FIFO's next element")
                });
                self.sending.push_back(self.put);
                self.put = (self.put + 1) % ELEMENTS;
                self.sent = self.sent.min(now + FRAME_TIME);
            }
            _ if PROTECTED.contains(&offset) => {
                self.words.insert(offset, value);
            }
            _ => return false,
        }
        true
    }

    fn join(&mut self, clock: Option<u32>, findings: &mut Findings) {
        let timing = self.word(NBTP);
        let quanta = 1 + (timing >> 8 & 0xFF) + 1 + (timing & 0x7F) + 1;
        let divider = ((timing >> 16 & 0x1FF) + 1)
            * [1, 2, 4, 6, 8, 10, 12, 14, 16, 18, 20, 22, 24, 26, 28, 30][(self.word(CKDIV) & 0xF) as usize];
        let rate = clock.map(|hz| hz / divider / quanta);
        self.is_timed = rate == Some(BIT_RATE);
        findings.expect(self.is_timed, || format!("FDCAN1 joins a bus of {BIT_RATE} bit/s with {rate:?}"));
    }

    /// A word of the message RAM is read.
    pub fn read_ram(&self, offset: u32) -> Option<u32> {
        self.ram.get((offset / 4) as usize).copied()
    }

    /// A word of the message RAM is written.
    pub fn write_ram(&mut self, offset: u32, value: u32) -> bool {
        self.ram.get_mut((offset / 4) as usize).map(|word| *word = value).is_some()
    }
}
