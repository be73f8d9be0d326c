//! Which frames take effect. A frame is judged in this order: identifier, length, CRC, counter, content; the first that is wrong
//! rejects it whole, and is counted.

use super::commands::{
    COMMAND, Command, LIMITS, LINK_LIMITS, LinkLimits, PARAMETER_REQUEST, ParameterRequest, TorqueLimits,
};
use super::e2e::{self, Order, Sequence};
use super::frame::{Frame, LENGTH};
use super::message::Message;
use super::signal::Payload;
use super::telemetry::Counts;

/// Why a frame was rejected.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reject {
    /// Its identifier is none of ours.
    Unknown,
    /// It is not eight bytes long.
    Truncated,
    /// Its CRC is wrong, or it came under another message's identifier.
    Corrupted,
    /// It has the counter of the one before.
    Repeated,
    /// Its counter is too far from the last: it is old, or too many are lost.
    Disordered,
    /// A value is out of its range, or an unused bit is set.
    OutOfRange,
}

/// What a frame that was taken says.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Content {
    /// The first of its message, or the first after a silence: it only set the counter.
    Greeting,
    /// A command.
    Command(Command),
    /// Limits of torque and speed.
    Limits(TorqueLimits),
    /// Limits of the link.
    LinkLimits(LinkLimits),
    /// A parameter is to be read or written.
    Parameter(ParameterRequest),
}

/// One message's place in its sequence.
#[derive(Clone, Copy, Debug, Default)]
struct Channel {
    sequence: Sequence,
    /// Slots since the last frame in order.
    silent_ms: u32,
}

impl Channel {
    const NEW: Self = Self { sequence: Sequence::new(), silent_ms: 0 };

    fn age(&mut self, longest_ms: u32) {
        self.silent_ms = self.silent_ms.saturating_add(1);
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

/// After this silence a message other than the command begins anew, in ms.
const SILENCE_MS: u32 = 1_000;

/// The receiver of all messages.
#[derive(Clone, Copy, Debug)]
pub struct Receiver {
    command: Channel,
    limits: Channel,
    link_limits: Channel,
    parameter: Channel,
    counts: Counts,
}

impl Receiver {
    /// Nothing received yet.
    pub const fn new() -> Self {
        let [command, limits, link_limits, parameter] = [Channel::NEW; 4];
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
        Self { command, limits, link_limits, parameter, counts }
    }

    /// A millisecond passes; the command begins anew after a silence of `command_ms`.
    pub fn wait(&mut self, command_ms: u32) {
        self.command.age(command_ms);
        for channel in [&mut self.limits, &mut self.link_limits, &mut self.parameter] {
            channel.age(SILENCE_MS);
        }
    }

    /// What became of the frames so far.
    pub fn counts(&self) -> &Counts {
        &self.counts
    }

    /// A frame.
    pub fn receive(&mut self, frame: &Frame) -> Result<Content, Reject> {
        let verdict = self.judge(frame);
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

    fn judge(&mut self, frame: &Frame) -> Result<Content, Reject> {
        let (message, channel): (&Message, _) = match frame.id {
            id if id == COMMAND.id => (&COMMAND, &mut self.command),
            id if id == LIMITS.id => (&LIMITS, &mut self.limits),
            id if id == LINK_LIMITS.id => (&LINK_LIMITS, &mut self.link_limits),
            id if id == PARAMETER_REQUEST.id => (&PARAMETER_REQUEST, &mut self.parameter),
            _ => return Err(Reject::Unknown),
        };
        if frame.length != LENGTH {
            return Err(Reject::Truncated);
        }
        if !message.is_intact(frame) {
            return Err(Reject::Corrupted);
        }
        match channel.judge(e2e::counter(&frame.data)) {
            Order::First => return Ok(Content::Greeting),
            Order::Next { lost } => self.counts.lost = self.counts.lost.wrapping_add(lost.into()),
            Order::Repeated => return Err(Reject::Repeated),
            Order::Wrong => return Err(Reject::Disordered),
        }
        decode(frame.id, Payload(u64::from_le_bytes(frame.data))).ok_or(Reject::OutOfRange)
    }
}

impl Default for Receiver {
    fn default() -> Self {
        Self::new()
    }
}

fn decode(id: u16, payload: Payload) -> Option<Content> {
    Some(match id {
        id if id == COMMAND.id => Content::Command(Command::decode(payload)?),
        id if id == LIMITS.id => Content::Limits(TorqueLimits::decode(payload)?),
        id if id == LINK_LIMITS.id => Content::LinkLimits(LinkLimits::decode(payload)?),
        _ => Content::Parameter(ParameterRequest::decode(payload)?),
    })
}
