//! The cells under every interleaving that loom can find. Run with `RUSTFLAGS="--cfg loom"`.
#![cfg(loom)]

use loom::sync::Arc;
use loom::thread;
use tractive::cell::{Downlink, Uplink, Words};

/// Two words that belong together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Message([u32; 2]);

impl Message {
    fn number(n: u32) -> Self {
        Self([n; 2])
    }

    fn is_whole(&self) -> bool {
        self.0.iter().all(|word| *word == self.0[0])
    }
}

impl Words<2> for Message {
    fn to_words(self) -> [u32; 2] {
        self.0
    }

    fn from_words(words: [u32; 2]) -> Self {
        Self(words)
    }
}

#[test]
fn an_uplink_is_never_torn() {
    loom::model(|| {
        let cell = Arc::new(Uplink::<Message, 2>::new());
        cell.publish(Message::number(1));
        let writer = Arc::clone(&cell);
        let thread = thread::spawn(move || writer.publish(Message::number(2)));
        if let Some(message) = cell.read() {
            assert!(message.is_whole(), "{message:?}");
        }
        thread.join().unwrap();
        assert_eq!(cell.read(), Some(Message::number(2)));
    });
}

/// The protocol: while a reader reads, the writer publishes at most once, because its previous value was ready for every
/// reader before it began.
#[test]
fn a_downlink_is_never_torn_under_its_protocol() {
    loom::model(|| {
        let cell = Arc::new(Downlink::<Message, 2>::new());
        cell.publish(Message::number(1));
        cell.publish(Message::number(2));
        let writer = Arc::clone(&cell);
        let thread = thread::spawn(move || writer.publish(Message::number(3)));
        // Value 2 is ready; 3 is not yet, by its valid-from instant.
        let message = cell.newest(|message| message.0[0] <= 2);
        if let Some(message) = message {
            assert!(message.is_whole(), "{message:?}");
        }
        thread.join().unwrap();
        assert_eq!(cell.newest(|_| true), Some(Message::number(3)));
    });
}

/// The test can fail: two publications within one read tear the value.
#[test]
#[should_panic]
fn a_downlink_outside_its_protocol_is_torn() {
    loom::model(|| {
        let cell = Arc::new(Downlink::<Message, 2>::new());
        cell.publish(Message::number(1));
        let writer = Arc::clone(&cell);
        let thread = thread::spawn(move || {
            writer.publish(Message::number(2));
            writer.publish(Message::number(3));
        });
        if let Some(message) = cell.newest(|_| true) {
            assert!(message.is_whole(), "{message:?}");
        }
        thread.join().unwrap();
    });
}
