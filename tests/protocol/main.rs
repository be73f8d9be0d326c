//! The protocol: its protection against AUTOSAR's own values, its messages against the published DBC file, what takes effect
//! against whatever may come.

mod adversary;
mod authentication;
#[path = "../../fuzz/src/bytes.rs"]
mod bytes;
#[path = "../../fuzz/src/corpus.rs"]
mod corpus;
mod dbc;
mod document;
mod e2e;
mod fuzz;
mod message_sets;
mod receiver;
mod scales;
mod session;
mod zs9;

use tractive::protocol::e2e::Counter;
use tractive::protocol::{Frame, Message, Payload};

/// Frames of one message, in their order.
pub struct Stream {
    message: &'static Message,
    counter: Counter,
}

impl Stream {
    /// From counter 0 on.
    pub fn of(message: &'static Message) -> Self {
        Self { message, counter: Counter::new() }
    }

    /// The next frame, with this content.
    pub fn frame(&mut self, content: Payload) -> Frame {
        self.message.frame(content, &mut self.counter)
    }
}
