//! Authentication of commands: [`COMMAND`] with a tag that only the holder of a key can make, and that is valid for one frame alone.
//!
//! The tag is the first 24 bits of an AES-128 CMAC (RFC 4493) over 16 bytes, all little-endian: the epoch (8), the frame's number in
//! it (4), and the frame's bytes 1 to 4, which are counter, levels, torque and mark. It stands in bytes 5 to 7, which COMMAND leaves free; the CRC
//! covers it like any content. The frame carries the lowest four bits of the number as its counter; the receiver knows the others. In outline this is
//! AUTOSAR's SecOC, without its freshness server: whoever supplies the *epoch* to both ends must never use one twice with a key; otherwise a
//! recording of the first time would be followed in the second.
//!
//! The guard stands in front of the drive's end and knows nothing of it; the other messages pass unchanged:
//!
//! ```
//! use tractive::protocol::authentication::{Guard, Signer};
//! use tractive::protocol::{Command, Scales};
//! # let (key, epoch) = ([7; 16], 1);
//! let mut signer = Signer::new(&key, epoch);
//! let mut guard = Guard::new(&key, epoch);
//! let command = Command { torque_nm: 100.0, ..Command::AT_REST };
//! let frame = signer.frame(command.encode(Scales::USUAL)?).ok_or("the epoch's last frame")?;
//! let taken = guard.admit(&frame).ok_or("refused")?;
//! assert_eq!(Command::decode(tractive::protocol::Payload(u64::from_le_bytes(taken.data)), Scales::USUAL), Some(command));
//! assert_eq!(guard.admit(&frame), None, "once is enough");
//! // On a board: endpoint.listen(slots, frames.filter_map(|frame| guard.admit(&frame)))
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

use super::commands::COMMAND;
use super::e2e::{self, Counter};
use super::frame::{Frame, LENGTH};
use super::signal::Payload;
use aes::Aes128;
use cmac::{Cmac, KeyInit, Mac};

/// Length of a key, in bytes.
pub const KEY_LENGTH: usize = 16;
/// Bits of a frame before the tag.
const CONTENT_BITS: u32 = 40;
/// Number of frames after which the counter repeats.
const ROUND: u32 = 16;
/// Rounds of the counter within which a number is searched: as many frames less one may be lost in a row, 630 ms of commands.
const ROUNDS: u32 = 4;

/// The code over an epoch, a frame's number in it, and the frame's bytes before the tag.
fn code(cipher: &Cmac<Aes128>, epoch: u64, number: u32, data: &[u8; 8]) -> Cmac<Aes128> {
    let [_, head, low, high, tail, ..] = *data;
    cipher
        .clone()
        .chain_update(epoch.to_le_bytes())
        .chain_update(number.to_le_bytes())
        .chain_update([head, low, high, tail])
}

/// The sender's side.
pub struct Signer {
    cipher: Cmac<Aes128>,
    epoch: u64,
    /// The next frame's number; `None` after the last one.
    next: Option<u32>,
    counter: Counter,
}

impl Signer {
    /// The state at the beginning of an epoch.
    pub fn new(key: &[u8; KEY_LENGTH], epoch: u64) -> Self {
        Self { cipher: Cmac::new(&(*key).into()), epoch, next: Some(0), counter: Counter::new() }
    }

    /// The next frame with this content of [`COMMAND`], its mark included; `None` if the content reaches into the tag, and after the epoch's last
    /// frame, the 2³²nd.
    pub fn frame(&mut self, content: Payload) -> Option<Frame> {
        let number = self.next.filter(|_| content.0 >> CONTENT_BITS == 0)?;
        let head = COMMAND.frame(content, &mut self.counter).data;
        let code: [u8; 16] = code(&self.cipher, self.epoch, number, &head).finalize().into_bytes().into();
        let [first, second, third, ..] = code;
        let [_, b, c, d, e, ..] = head;
        let mut data = [0, b, c, d, e, first, second, third];
        e2e::protect(&mut data, e2e::counter(&head), COMMAND.data_ids());
        self.next = number.checked_add(1);
        Some(Frame { id: COMMAND.id, length: LENGTH, data })
    }
}

/// The drive's side.
pub struct Guard {
    cipher: Cmac<Aes128>,
    epoch: u64,
    /// The lowest number that has not been used; `None` after the last one.
    next: Option<u32>,
    refused: u32,
}

impl Guard {
    /// The state at the beginning of an epoch.
    pub fn new(key: &[u8; KEY_LENGTH], epoch: u64) -> Self {
        Self { cipher: Cmac::new(&(*key).into()), epoch, next: Some(0), refused: 0 }
    }

    /// The frame for the drive's end: a command without its tag; any other frame, and a damaged command, unchanged, for the receiver to judge. `None`
    /// for a command whose tag is not that of a frame still to come.
    pub fn admit(&mut self, frame: &Frame) -> Option<Frame> {
        if frame.id != COMMAND.id || frame.length != LENGTH || !COMMAND.is_intact(frame) {
            return Some(*frame);
        }
        let counter = e2e::counter(&frame.data);
        let Some(number) = self.number(counter, &frame.data) else {
            self.refused = self.refused.wrapping_add(1);
            return None;
        };
        self.next = number.checked_add(1);
        let [_, head, low, high, tail, ..] = frame.data;
        let mut data = [0, head, low, high, tail, 0, 0, 0];
        e2e::protect(&mut data, counter, COMMAND.data_ids());
        Some(Frame { data, ..*frame })
    }

    /// The number with which a frame with this counter has a correct tag.
    fn number(&self, counter: u8, data: &[u8; 8]) -> Option<u32> {
        let next = self.next?;
        let nearest = next.checked_add(u32::from(counter).wrapping_sub(next) % ROUND)?;
        let [.., first, second, third] = *data;
        (0..ROUNDS).filter_map(|round| nearest.checked_add(round * ROUND)).find(|number| {
            let code = code(&self.cipher, self.epoch, *number, data);
            code.verify_truncated_left(&[first, second, third]).is_ok()
        })
    }

    /// The number of commands refused; wraps.
    pub const fn refused(&self) -> u32 {
        self.refused
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_frame_of_an_epoch_is_the_last() {
        let (mut signer, mut guard) = (Signer::new(&[1; 16], 2), Guard::new(&[1; 16], 2));
        (signer.next, guard.next) = (Some(u32::MAX), Some(u32::MAX - 1));
        for _ in 0..ROUND - 1 {
            signer.counter.take();
        }
        let last = signer.frame(Payload(0)).unwrap();
        assert!(guard.admit(&last).is_some());
        assert_eq!((signer.frame(Payload(0)), guard.admit(&last)), (None, None));
    }
}
