//! The frames that take effect. A frame is judged in this order: identifier, length, CRC, counter, content; the first error rejects the whole frame,
//! and is counted.

use super::e2e::{self, Order, Sequence};
use super::frame::{Frame, LENGTH};
use super::message_set::MessageSet;
use super::scales::Scales;
use super::signal::Payload;
use super::telemetry::Counts;

/// The reason why a frame was rejected.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Reject {
    /// Its identifier is not one of ours.
    Unknown,
    /// It is not eight bytes long.
    Truncated,
    /// Its CRC is wrong, or it came under another message's identifier.
    Corrupted,
    /// It has the same counter as the one before.
    Repeated,
    /// Its counter is too far from the last: it is old, or too many frames are lost.
    Disordered,
    /// A value is out of its range, or an unused bit is set.
    OutOfRange,
}

/// One message's state in its sequence.
#[derive(Clone, Copy, Debug, Default)]
struct Channel {
    sequence: Sequence,
    /// Slots since the last frame in order.
    silent_ms: u32,
}

impl Channel {
    const NEW: Self = Self { sequence: Sequence::new(), silent_ms: 0 };

    fn age(&mut self, slots: u32, longest_ms: u32) {
        self.silent_ms = self.silent_ms.saturating_add(slots);
        if self.silent_ms >= longest_ms {
            self.sequence.forget();
        }
    }

    fn judge(&mut self, counter: u8) -> Order {
        let order = self.sequence.judge(counter);
        if matches!(order, Order::First | Order::Next { .. }) {
            self.silent_ms = 0;
        }
        order
    }
}

/// Silence after which a message other than the command begins anew, in ms.
const SILENCE_MS: u32 = 1_000;

/// Most messages to a drive.
const MOST: usize = 5;

/// The receiver of all messages to a drive.
#[derive(Clone, Copy, Debug)]
pub struct Receiver<D> {
    /// In the order of [`MessageSet::TO_DRIVE`].
    channels: [Channel; MOST],
    counts: Counts,
    message_set: core::marker::PhantomData<D>,
}

impl<D: MessageSet> Receiver<D> {
    /// Nothing received yet.
    pub const fn new() -> Self {
        const { assert!(D::TO_DRIVE.len() <= MOST) };
        let zero = [0; 9];
        let [received, taken, lost, unknown, truncated, corrupted, repeated, disordered, out_of_range] = zero;
        let counts = Counts {
            received,
            taken,
            lost,
            unknown,
            truncated,
            corrupted,
            repeated,
            disordered,
            out_of_range,
        };
        Self { channels: [Channel::NEW; MOST], counts, message_set: core::marker::PhantomData }
    }

    /// Lets this many slots of a millisecond pass; the command begins anew after a silence of `command_ms`.
    pub fn wait(&mut self, slots: u32, command_ms: u32) {
        let mut longest_ms = command_ms;
        for channel in &mut self.channels {
            channel.age(slots, longest_ms);
            longest_ms = SILENCE_MS;
        }
    }

    /// The counts of the frames so far.
    pub fn counts(&self) -> &Counts {
        &self.counts
    }

    /// Judges a frame whose signals are on these scales.
    pub fn receive(&mut self, frame: &Frame, scales: Scales) -> Result<D::Content, Reject> {
        let verdict = self.judge(frame, scales);
        let counts = &mut self.counts;
        counts.received = counts.received.wrapping_add(1);
        let count = match verdict {
            Ok(_) => &mut counts.taken,
            Err(Reject::Unknown) => &mut counts.unknown,
            Err(Reject::Truncated) => &mut counts.truncated,
            Err(Reject::Corrupted) => &mut counts.corrupted,
            Err(Reject::Repeated) => &mut counts.repeated,
            Err(Reject::Disordered) => &mut counts.disordered,
            Err(Reject::OutOfRange) => &mut counts.out_of_range,
        };
        *count = count.wrapping_add(1);
        verdict
    }

    fn judge(&mut self, frame: &Frame, scales: Scales) -> Result<D::Content, Reject> {
        let known = D::TO_DRIVE.iter().zip(&mut self.channels).find(|(message, _)| message.id == frame.id);
        let Some((message, channel)) = known else { return Err(Reject::Unknown) };
        if frame.length != LENGTH {
            return Err(Reject::Truncated);
        }
        if !message.is_intact(frame) {
            return Err(Reject::Corrupted);
        }
        match channel.judge(e2e::counter(&frame.data)) {
            Order::First => return Ok(D::GREETING),
            Order::Next { lost } => self.counts.lost = self.counts.lost.wrapping_add(lost.into()),
            Order::Repeated => return Err(Reject::Repeated),
            Order::Wrong => return Err(Reject::Disordered),
        }
        let content = message.mark(Payload(u64::from_le_bytes(frame.data)), scales);
        D::decode(frame.id, content, scales).ok_or(Reject::OutOfRange)
    }
}
