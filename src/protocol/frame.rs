//! A classic CAN frame with an 11-bit identifier.

use crate::cell::Words;

/// Bytes that a frame carries at most.
pub const LENGTH: u8 = 8;

/// A data frame. Identifiers of 29 bits and remote frames are none of the protocol's; a controller filters them out.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Frame {
    /// Identifier, 11 bits.
    pub id: u16,
    /// How many of the bytes were sent, 0 ..= 8.
    pub length: u8,
    /// The bytes; those not sent are zero.
    pub data: [u8; 8],
}

/// Word 0: this bit says that there is a frame at all.
const PRESENT: u32 = 1 << 31;

impl Words<3> for Option<Frame> {
    fn to_words(self) -> [u32; 3] {
        let Some(Frame { id, length, data }) = self else { return [0; 3] };
        let [a, b, c, d, e, f, g, h] = data;
        let head = PRESENT | u32::from(length) << 16 | u32::from(id);
        [head, u32::from_le_bytes([a, b, c, d]), u32::from_le_bytes([e, f, g, h])]
    }

    fn from_words([head, low, high]: [u32; 3]) -> Self {
        let [a, b, c, d] = low.to_le_bytes();
        let [e, f, g, h] = high.to_le_bytes();
        let frame =
            Frame { id: head as u16, length: (head >> 16) as u8 & 0xF, data: [a, b, c, d, e, f, g, h] };
        (head & PRESENT != 0).then_some(frame)
    }
}
