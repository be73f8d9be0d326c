//! End-to-end protection after AUTOSAR's profile 2: byte 0 is a CRC, the lower half of byte 1 a counter.
//!
//! The CRC ([`crc8_h2f`]) runs over bytes 1 to 7 and then over a byte that is not sent: the one of the message's 16 data identifiers whose index is
//! the counter. So a frame that comes under another message's identifier fails the check.

use super::crc::crc8_h2f;

/// The 16 data identifiers of a message.
pub type DataIds = [u8; 16];

/// Largest step of the counter that is accepted: up to two frames may be lost in a row.
pub const MAX_DELTA: u8 = 3;

/// The data identifiers of the message with this number, 1 ..= 31: the upper half of each is the number's lower half, the lower half is the counter,
/// with its highest bit inverted from number 16 on. So no two messages share an identifier at the same counter.
pub const fn data_ids(number: u8) -> DataIds {
    let turned = if number & 0x10 != 0 { 8 } else { 0 };
    let mut list = [0; 16];
    let mut counter = 0;
    while counter < 16 {
        list[counter] = number << 4 | counter as u8 ^ turned;
        counter += 1;
    }
    list
}

/// The counter of a frame.
pub const fn counter(data: &[u8; 8]) -> u8 {
    data[1] & 0xF
}

fn crc(data: &[u8; 8], ids: &DataIds) -> u8 {
    let [_, protected @ ..] = *data;
    crc8_h2f(protected.into_iter().chain([ids[usize::from(counter(data)) & 0xF]]))
}

/// Writes counter and CRC.
pub fn protect(data: &mut [u8; 8], counter: u8, ids: &DataIds) {
    data[1] = data[1] & 0xF0 | counter & 0xF;
    data[0] = crc(data, ids);
}

/// `true` if the CRC is correct.
pub fn is_intact(data: &[u8; 8], ids: &DataIds) -> bool {
    data[0] == crc(data, ids)
}

/// The frame's place in the sequence, by its counter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Order {
    /// The first frame, or the first after a silence: it sets the counter and has no effect.
    First,
    /// In order, after this many lost ones.
    Next {
        /// The number of frames missing before it.
        lost: u8,
    },
    /// The same counter again.
    Repeated,
    /// Too far from the last one: old, or too many frames are lost.
    Wrong,
}

/// The receiver's side of one message.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Sequence {
    last: Option<u8>,
}

impl Sequence {
    /// Nothing received yet.
    pub const fn new() -> Self {
        Self { last: None }
    }

    /// Notes a silence: the next frame only sets the counter.
    pub fn forget(&mut self) {
        self.last = None;
    }

    /// Judges a frame with a correct CRC. A frame that is repeated or out of order leaves the sequence as it is, so that it cannot disturb it.
    pub fn judge(&mut self, counter: u8) -> Order {
        let Some(last) = self.last else {
            self.last = Some(counter);
            return Order::First;
        };
        match counter.wrapping_sub(last) & 0xF {
            0 => Order::Repeated,
            delta @ 1..=MAX_DELTA => {
                self.last = Some(counter);
                Order::Next { lost: delta - 1 }
            }
            _ => Order::Wrong,
        }
    }
}

/// The sender's side of one message.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counter(u8);

impl Counter {
    /// A counter that begins at 0.
    pub const fn new() -> Self {
        Self(0)
    }

    /// The counter of the next frame.
    pub fn take(&mut self) -> u8 {
        let counter = self.0;
        self.0 = counter.wrapping_add(1) & 0xF;
        counter
    }
}
