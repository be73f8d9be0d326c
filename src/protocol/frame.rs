//! A classic CAN frame with an 11-bit identifier.

use crate::cell::Words;
use embedded_can::{Id, StandardId};

/// Bytes that a frame carries at most.
pub const LENGTH: u8 = 8;

/// A data frame. Identifiers of 29 bits and remote frames are not part of the protocol; a controller filters them out.
///
/// Through [`embedded_can::Frame`] it becomes the frame of any CAN driver, and any driver's frame becomes one:
///
/// ```
/// use embedded_can::{ExtendedId, Frame as _, Id, StandardId};
/// use tractive::protocol::{COMMAND, Frame};
/// # type Driver = Frame;
/// # let id = StandardId::new(COMMAND.id).ok_or("11 bits")?;
/// # let received = Driver::new(id, &[0; 8]).ok_or("eight bytes")?;
/// let frame = Frame::new(received.id(), received.data()).ok_or("none of the protocol's")?;
/// assert_eq!(frame.id, COMMAND.id);
/// let sent = Driver::new(frame.id(), frame.data());
/// # assert_eq!(sent, Some(frame));
/// assert_eq!(Frame::new(ExtendedId::ZERO, &[]), None, "29 bits");
/// # Ok::<(), &str>(())
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Frame {
    /// Identifier, 11 bits.
    pub id: u16,
    /// The number of bytes that were sent, 0 ..= 8.
    pub length: u8,
    /// The bytes; those not sent are zero.
    pub data: [u8; 8],
}

impl embedded_can::Frame for Frame {
    /// `None` for an identifier of 29 bits or more than eight bytes.
    fn new(id: impl Into<Id>, data: &[u8]) -> Option<Self> {
        let Id::Standard(id) = id.into() else { return None };
        let mut frame = Self { id: id.as_raw(), length: data.len() as u8, data: [0; 8] };
        frame.data.get_mut(..data.len())?.copy_from_slice(data);
        Some(frame)
    }

    /// `None`: the protocol has no remote frames.
    fn new_remote(_: impl Into<Id>, _: usize) -> Option<Self> {
        None
    }

    fn is_extended(&self) -> bool {
        false
    }

    fn is_remote_frame(&self) -> bool {
        false
    }

    fn id(&self) -> Id {
        StandardId::new(self.id).unwrap_or(StandardId::MAX).into()
    }

    fn dlc(&self) -> usize {
        self.length.into()
    }

    fn data(&self) -> &[u8] {
        self.data.get(..self.dlc()).unwrap_or(&self.data)
    }
}

/// Bit of word 0 that says that there is a frame at all.
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

#[cfg(test)]
mod tests {
    use super::*;
    use embedded_can::{ExtendedId, Frame as _};

    #[test]
    fn a_drivers_frame_becomes_the_protocols_whole_or_not_at_all() {
        let id = StandardId::new(0x181).unwrap();
        let bytes = [1, 2, 3, 4, 5, 6, 7, 8, 9];
        for length in 0..=8 {
            let frame = Frame::new(id, &bytes[..length]).unwrap();
            assert_eq!((frame.id(), frame.dlc(), frame.data()), (id.into(), length, &bytes[..length]));
            assert!(frame.is_standard() && frame.is_data_frame());
            assert_eq!(frame.data[length..], [0; 8][length..]);
        }
        assert_eq!(Frame::new(id, &bytes), None);
        assert_eq!(Frame::new(ExtendedId::ZERO, &[]), None);
        assert_eq!(Frame::new_remote(id, 8), None);
    }
}
