//! A message: an identifier, a number for its protection, a period, and signals.

use super::e2e::{self, Counter, DataIds};
use super::frame::{Frame, LENGTH};
use super::scales::{Quantity, Scales};
use super::signal::{Payload, Signal};

/// The CRC of every message.
pub const CRC: Signal = Signal::number("crc", 0, 8, 0xFF);
/// The counter of every message.
pub const COUNTER: Signal = Signal::number("counter", 8, 4, 0xF);

/// A message.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Message {
    /// Name.
    pub name: &'static str,
    /// CAN identifier, 11 bits.
    pub id: u16,
    /// Number for the protection, 1 ..= 31.
    pub number: u8,
    /// Time from one to the next, in ms; 0 if it is sent on occasion.
    pub period_ms: u16,
    /// Signals besides CRC and counter.
    pub signals: &'static [Signal],
    data_ids: DataIds,
    /// Value of the lowest of the four bits that give the scales, and the mask of the quantities.
    mark: (u64, u32),
    /// The bits of all signals.
    used: u64,
}

impl Message {
    /// A message.
    pub const fn new(
        name: &'static str,
        id: u16,
        number: u8,
        period_ms: u16,
        signals: &'static [Signal],
    ) -> Self {
        let mut used = CRC.mask() | COUNTER.mask();
        let mut index = 0;
        while index < signals.len() {
            used |= signals[index].mask();
            index += 1;
        }
        Self { name, id, number, period_ms, signals, data_ids: e2e::data_ids(number), mark: (0, 0), used }
    }

    /// The same message, with four bits from `start` on that give the scales of these quantities.
    pub const fn telling(self, start: u32, quantities: &[Quantity]) -> Self {
        Self { mark: (1 << start, Scales::mask(quantities)), ..self }
    }

    /// The content with the bits that give the scales added, or removed if it has them. On the usual scales they are zero.
    #[inline(never)]
    pub const fn mark(&self, content: Payload, scales: Scales) -> Payload {
        let (worth, mask) = self.mark;
        Payload(content.0 ^ worth.wrapping_mul(scales.code(mask) as u64))
    }

    /// The quantities whose scales the message gives.
    pub fn quantities(&self) -> impl Iterator<Item = Quantity> {
        let (_, mask) = self.mark;
        Quantity::SCALED.into_iter().filter(move |quantity| mask & Scales::mask(&[*quantity]) != 0)
    }

    /// The signal of the bits that give the scales, with the one value that it may have; `None` on the usual scales.
    pub fn mark_signal(&self, scales: Scales) -> Option<Signal> {
        let (worth, mask) = self.mark;
        let code = scales.code(mask);
        (code != 0)
            .then(|| Signal { min: code as f32, ..Signal::number("scale", worth.trailing_zeros(), 4, code) })
    }

    /// Its 16 data identifiers.
    pub const fn data_ids(&self) -> &DataIds {
        &self.data_ids
    }

    /// The frame with this content.
    #[inline(never)]
    pub fn frame(&self, content: Payload, counter: &mut Counter) -> Frame {
        let mut data = content.0.to_le_bytes();
        e2e::protect(&mut data, counter.take(), &self.data_ids);
        Frame { id: self.id, length: LENGTH, data }
    }

    /// `true` if a frame of this message has the correct CRC.
    #[inline(never)]
    pub fn is_intact(&self, frame: &Frame) -> bool {
        e2e::is_intact(&frame.data, &self.data_ids)
    }

    /// `true` if every bit outside the message's signals is zero.
    pub const fn is_tidy(&self, payload: Payload) -> bool {
        payload.0 & !self.used == 0
    }
}
