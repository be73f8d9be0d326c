//! The cells between two threads, which race where the interrupts of one core would only preempt each other. In `cargo xtask test --only miri` the
//! interpreter checks for undefined behaviour, data races, and the stale values that weak memory allows.
#![cfg(not(loom))]

use std::sync::Barrier;
use tractive::cell::{Mailbox, Seqlock, Words};

/// Words that belong together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Message([u32; 9]);

impl Message {
    fn number(n: u32) -> Self {
        Self(core::array::from_fn(|k| n.wrapping_mul(k as u32 * 2 + 1)))
    }

    fn whole(&self) -> Option<u32> {
        let [n, ..] = self.0;
        (*self == Self::number(n)).then_some(n)
    }
}

impl Words<9> for Message {
    fn to_words(self) -> [u32; 9] {
        self.0
    }

    fn from_words(words: [u32; 9]) -> Self {
        Self(words)
    }
}

const ROUNDS: u32 = if cfg!(miri) { 50 } else { 200_000 };

/// The writer may overtake every try of a read: then the reader gets nothing, but never anything torn or older than before.
#[test]
fn an_uplink_between_threads_is_whole_and_goes_forward() {
    let cell = Seqlock::<Message, 9>::new();
    assert_eq!(cell.read(), None);
    cell.publish(Message::number(1));
    std::thread::scope(|scope| {
        scope.spawn(|| (2..ROUNDS).for_each(|n| cell.publish(Message::number(n))));
        let mut last = 1;
        for _ in 0..ROUNDS {
            if let Some(message) = cell.read() {
                let n = message.whole().unwrap_or_else(|| panic!("torn: {message:?}"));
                assert!(n >= last, "{n} after {last}");
                last = n;
            }
        }
    });
    assert_eq!(cell.read(), Some(Message::number(ROUNDS - 1)));
}

/// The protocol, with numbers for instants: while value n + 1 is written, value n is the ready one, and no second value is begun before the reads are
/// over.
#[test]
fn a_downlink_between_threads_has_what_is_ready() {
    let cell = Mailbox::<Message, 9>::new();
    assert_eq!(cell.newest(|_| true), None);
    cell.publish(Message::number(1));
    let period = Barrier::new(2);
    let rounds = ROUNDS.min(2_000);
    std::thread::scope(|scope| {
        scope.spawn(|| {
            for n in 2..rounds {
                period.wait();
                cell.publish(Message::number(n));
                period.wait();
            }
        });
        for now in 1..rounds - 1 {
            period.wait();
            let ready = cell.newest(|message| message.word::<0>() == now);
            let newest = cell.newest(|_| true).and_then(|message| message.whole());
            period.wait();
            assert_eq!(ready, Some(Message::number(now)));
            assert!([Some(now), Some(now + 1)].contains(&newest), "{newest:?} in {now}");
        }
    });
}

#[test]
fn every_value_arrives_in_its_turn() {
    let (down, up) = (Mailbox::<Message, 9>::new(), Seqlock::<Message, 9>::new());
    for n in 1..ROUNDS {
        down.publish(Message::number(n));
        up.publish(Message::number(n));
        assert_eq!(down.newest(|_| true), Some(Message::number(n)));
        assert_eq!(up.read(), Some(Message::number(n)));
        let before = down.newest(|message| message.word::<0>() < n);
        assert_eq!(before, (n > 1).then(|| Message::number(n - 1)));
        assert_eq!(down.newest(|message| message.word::<0>() + 1 < n), None);
    }
}
