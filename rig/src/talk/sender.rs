//! What is sent to the drive in which slot, and what is done to it on the way.

use std::collections::VecDeque;
use tractive::protocol::e2e::Counter;
use tractive::protocol::{
    COMMAND, Command, Frame, LIMITS, LINK_LIMITS, LinkLimits, OutOfRange, PARAMETER_REQUEST,
    ParameterRequest, Payload, TorqueLimits,
};

/// Slots between two commands.
pub const COMMAND_SLOTS: u64 = 10;
/// Slots between two of the limits.
const LIMIT_SLOTS: u64 = 100;
/// Commands that are kept to be sent again.
const KEPT: usize = 32;
/// The identifier of the frames that nobody knows.
const UNKNOWN_ID: u16 = 0x123;
/// A raw torque far out of range.
const TORQUE_OUT_OF_RANGE: Payload = Payload(0x7FFF << 16);

/// A frame that is sent besides.
#[derive(Clone, Copy, Debug)]
enum Extra {
    /// As it is.
    Frame(Frame),
    /// An old command: this many before the newest.
    Old(usize),
    /// A command out of range, in its turn.
    OutOfRange,
}

/// Frames with their counters.
#[derive(Debug, Default)]
pub struct Sender {
    command: Counter,
    limits: Counter,
    link_limits: Counter,
    parameter: Counter,
    /// Limits to repeat.
    pub torque_limits: Option<TorqueLimits>,
    /// Limits to repeat.
    pub link: Option<LinkLimits>,
    requests: VecDeque<ParameterRequest>,
    kept: VecDeque<Frame>,
    /// Frames to send besides.
    extra: VecDeque<Extra>,
    corrupt: u32,
    truncate: u32,
    turned: u32,
    /// The command that waits for the next one to go first: `Some(None)` before it has come.
    held: Option<Option<Frame>>,
    /// The first slot in which something is sent again.
    silent_until: u64,
}

impl Sender {
    /// Asks for a parameter.
    pub fn request(&mut self, request: ParameterRequest) {
        self.requests.push_back(request);
    }

    /// Turns a bit in each of the next commands.
    pub fn corrupt(&mut self, count: u32) {
        self.corrupt += count;
    }

    /// Cuts the next commands short.
    pub fn truncate(&mut self, count: u32) {
        self.truncate += count;
    }

    /// Sends the newest commands again, the newest first.
    pub fn replay(&mut self, count: u32) {
        self.extra.extend((0..count as usize).map(Extra::Old));
    }

    /// Swaps the next two commands.
    pub fn reorder(&mut self) {
        self.held = Some(None);
    }

    /// Sends frames that nobody knows.
    pub fn unknown(&mut self, count: u32) {
        let frame = Frame { id: UNKNOWN_ID, length: 8, data: [0x55; 8] };
        self.extra.extend((0..count).map(|_| Extra::Frame(frame)));
    }

    /// Sends commands whose torque is out of range.
    pub fn out_of_range(&mut self, count: u32) {
        self.extra.extend((0..count).map(|_| Extra::OutOfRange));
    }

    /// Sends nothing before this slot.
    pub fn be_silent_until(&mut self, slot: u64) {
        self.silent_until = slot;
    }

    /// The frame of a slot.
    ///
    /// # Errors
    /// A value that its signal cannot carry.
    pub fn step(&mut self, slot: u64, command: &Command) -> Result<Option<Frame>, OutOfRange> {
        if slot < self.silent_until {
            return Ok(None);
        }
        Ok(match (slot % COMMAND_SLOTS, slot % LIMIT_SLOTS) {
            (1, _) => {
                let frame = COMMAND.frame(command.encode()?, &mut self.command);
                self.mistreated(frame)
            }
            (3, 3) => match &self.torque_limits {
                Some(limits) => Some(LIMITS.frame(limits.encode()?, &mut self.limits)),
                None => None,
            },
            (3, 13) => match &self.link {
                Some(limits) => Some(LINK_LIMITS.frame(limits.encode()?, &mut self.link_limits)),
                None => None,
            },
            (5, _) => match self.requests.pop_front() {
                Some(request) => Some(PARAMETER_REQUEST.frame(request.encode()?, &mut self.parameter)),
                None => None,
            },
            (2 | 4 | 6 | 8, _) => match self.extra.pop_front() {
                Some(Extra::Frame(frame)) => Some(frame),
                Some(Extra::Old(back)) => self.kept.iter().rev().nth(back).copied(),
                Some(Extra::OutOfRange) => Some(COMMAND.frame(TORQUE_OUT_OF_RANGE, &mut self.command)),
                None => None,
            },
            _ => None,
        })
    }

    /// What leaves instead of a command.
    fn mistreated(&mut self, frame: Frame) -> Option<Frame> {
        if self.kept.len() == KEPT {
            self.kept.pop_front();
        }
        self.kept.push_back(frame);
        if self.corrupt > 0 {
            self.corrupt -= 1;
            // Another bit each time, CRC and counter included.
            self.turned = (self.turned + 13) % 64;
            let data = (u64::from_le_bytes(frame.data) ^ 1 << self.turned).to_le_bytes();
            return Some(Frame { data, ..frame });
        }
        if self.truncate > 0 {
            self.truncate -= 1;
            let mut data = frame.data;
            data[5..].fill(0);
            return Some(Frame { length: 5, data, ..frame });
        }
        match self.held.take() {
            None => Some(frame),
            Some(None) => {
                self.held = Some(Some(frame));
                None
            }
            Some(Some(late)) => {
                self.extra.push_front(Extra::Frame(late));
                Some(frame)
            }
        }
    }
}
