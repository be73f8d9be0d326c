//! A CAN controller in memory, and a vehicle's computer on the bus.

use nucleo_g474re::can::Can;
use nucleo_g474re::registers::Registers;
use nucleo_g474re::start::Wait;
use std::collections::VecDeque;
use stm32_metapac as pac;
use tractive::protocol::{Frame, Message, Payload, e2e::Counter};

/// Words of a FIFO's element, and where the FIFOs begin (RM0440, message RAM).
const ELEMENT: usize = 18;
const RX_FIFO_0: usize = 0xB0 / 4;
const TX_BUFFERS: usize = 0x278 / 4;
/// Register offsets in words.
const RXF0S: usize = 0x90 / 4;
const RXF0A: usize = 0x94 / 4;
const TXBAR: usize = 0xCC / 4;
/// No acknowledge has been written.
const NONE: u32 = 0xFF;

/// The controller: a receive FIFO of three elements, and one frame at a time that goes out at once.
pub struct Bus {
    registers: *mut u32,
    ram: *mut u32,
    pub can: Can,
    waiting: VecDeque<Frame>,
    first: usize,
    /// Frames that found the FIFO full.
    pub lost: u32,
}

impl Bus {
    /// Configured for these messages.
    pub fn new(messages: &[&Message], registers: &Registers, wait: &mut dyn Wait) -> Self {
        let block = || Box::leak(vec![0_u32; 0x100].into_boxed_slice()).as_mut_ptr();
        let (own, ram) = (block(), block());
        // SAFETY: the blocks are aligned, as large as the peripherals, never freed, and only this thread has them.
        let can = unsafe {
            Can::new(pac::can::Fdcan::from_ptr(own.cast()), pac::fdcanram::Fdcanram::from_ptr(ram.cast()))
        };
        can.configure(messages, &registers.rcc, wait).unwrap();
        let bus = Self { registers: own, ram, can, waiting: VecDeque::new(), first: 0, lost: 0 };
        bus.write(RXF0A, NONE);
        bus
    }

    fn read(&self, word: usize) -> u32 {
        // SAFETY: a word of the block of registers.
        unsafe { self.registers.add(word).read_volatile() }
    }

    fn write(&self, word: usize, value: u32) {
        // SAFETY: as in `read`.
        unsafe { self.registers.add(word).write_volatile(value) }
    }

    /// A frame arrives.
    pub fn arrive(&mut self, frame: Frame) {
        if self.waiting.len() == 3 {
            self.lost += 1;
            return;
        }
        let [a, b, c, d, e, f, g, h] = frame.data;
        let words = [
            u32::from(frame.id) << 18,
            u32::from(frame.length) << 16,
            u32::from_le_bytes([a, b, c, d]),
            u32::from_le_bytes([e, f, g, h]),
        ];
        let base = RX_FIFO_0 + (self.first + self.waiting.len()) % 3 * ELEMENT;
        for (word, value) in words.into_iter().enumerate() {
            // SAFETY: within the message RAM.
            unsafe { self.ram.add(base + word).write_volatile(value) };
        }
        self.waiting.push_back(frame);
        self.write(RXF0S, self.waiting.len() as u32 | (self.first as u32) << 8);
    }

    /// Settles the controller after the writes since the last time; the frame that was sent, if one was.
    pub fn settle(&mut self) -> Option<Frame> {
        let read = self.read(RXF0A);
        if read != NONE {
            while self.waiting.pop_front().is_some() {
                let index = self.first as u32;
                self.first = (self.first + 1) % 3;
                if index == read {
                    break;
                }
            }
            self.write(RXF0A, NONE);
            self.write(RXF0S, self.waiting.len() as u32 | (self.first as u32) << 8);
        }
        let requested = self.read(TXBAR);
        self.write(TXBAR, 0);
        if requested == 0 {
            return None;
        }
        let base = TX_BUFFERS + requested.trailing_zeros() as usize * ELEMENT;
        // SAFETY: within the message RAM.
        let [id, length, low, high] =
            [0, 1, 2, 3].map(|word| unsafe { self.ram.add(base + word).read_volatile() });
        let mut data = [0; 8];
        data[..4].copy_from_slice(&low.to_le_bytes());
        data[4..].copy_from_slice(&high.to_le_bytes());
        Some(Frame { id: (id >> 18) as u16, length: (length >> 16 & 0xF) as u8, data })
    }
}

/// A message's sender.
pub struct Sender {
    message: &'static Message,
    counter: Counter,
}

impl Sender {
    pub fn of(message: &'static Message) -> Self {
        Self { message, counter: Counter::new() }
    }

    pub fn frame(&mut self, content: Payload) -> Frame {
        self.message.frame(content, &mut self.counter)
    }
}
