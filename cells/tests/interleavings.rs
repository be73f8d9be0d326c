//! The cells under every interleaving that loom can find. Run with `RUSTFLAGS="--cfg loom"`.
#![cfg(loom)]

use loom::sync::Arc;
use loom::thread;
use tractive::cell::{History, Mailbox, Ring, Seqlock, Words};

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

// The writer is the thread that loom runs first. The other way round loom sees too few interleavings: it backtracks only to an object's last access,
// which is the writer's own load of its counter.

#[test]
fn an_uplink_is_never_torn() {
    loom::model(|| {
        let cell = Arc::new(Seqlock::<Message, 2>::new());
        cell.publish(Message::number(1));
        let reader = Arc::clone(&cell);
        let thread = thread::spawn(move || reader.read());
        cell.publish(Message::number(2));
        let read = thread.join().unwrap();
        assert!([None, Some(Message::number(1)), Some(Message::number(2))].contains(&read), "{read:?}");
        assert_eq!(cell.read(), Some(Message::number(2)));
    });
}

/// The newest two records' words; both words of a record are its number.
fn newest_two(trail: &History<2>) -> Option<[[u32; 2]; 2]> {
    let place = trail.find(1, |_| true)?;
    trail.read(place, |records| records.map(|record| [record.word::<0>(), record.word::<1>()]))
}

#[test]
fn a_trail_is_never_torn_by_the_next_record() {
    loom::model(|| {
        let trail = Arc::new(History::<2>::new());
        trail.publish([1; 2]);
        let reader = Arc::clone(&trail);
        let thread = thread::spawn(move || newest_two(&reader));
        trail.publish([2; 2]);
        trail.publish([3; 2]);
        let read = thread.join().unwrap();
        let whole = [None, Some([[1; 2], [0; 2]]), Some([[2; 2], [1; 2]]), Some([[3; 2], [2; 2]])];
        assert!(whole.contains(&read), "{read:?}");
        assert_eq!(newest_two(&trail), Some([[3; 2], [2; 2]]));
    });
}

/// The protocol: while a reader reads, the writer publishes at most once, because its previous value was ready for every
/// reader before it began.
#[test]
fn a_downlink_gives_the_value_that_is_ready_while_the_next_one_is_written() {
    loom::model(|| {
        let cell = Arc::new(Mailbox::<Message, 2>::new());
        cell.publish(Message::number(1));
        cell.publish(Message::number(2));
        let reader = Arc::clone(&cell);
        // Value 2 is ready; 3 is not yet, by its valid-from instant.
        let thread = thread::spawn(move || reader.newest(|record| record.word::<0>() != 3));
        cell.publish(Message::number(3));
        assert_eq!(thread.join().unwrap(), Some(Message::number(2)));
        assert_eq!(cell.newest(|_| true), Some(Message::number(3)));
    });
}

/// With four slots, the last three values stay whole while the next one is written, whichever of them the reader is to get.
#[test]
fn a_planned_value_is_whole_until_three_later_ones_are_published() {
    for wanted in 2..=4 {
        loom::model(move || {
            let cell = Arc::new(Mailbox::<Message, 2, 4>::new());
            (1..=4).for_each(|number| cell.publish(Message::number(number)));
            let reader = Arc::clone(&cell);
            let thread = thread::spawn(move || reader.newest(|record| record.word::<0>() <= wanted));
            cell.publish(Message::number(5));
            assert_eq!(thread.join().unwrap(), Some(Message::number(wanted)));
        });
    }
}

/// The test can fail: the oldest slot is the one being written.
#[test]
#[should_panic(expected = "assertion")]
fn a_planned_value_of_four_slots_ago_is_written_over() {
    loom::model(|| {
        let cell = Arc::new(Mailbox::<Message, 2, 4>::new());
        (1..=4).for_each(|number| cell.publish(Message::number(number)));
        let reader = Arc::clone(&cell);
        let thread = thread::spawn(move || reader.newest(|record| record.word::<0>() <= 1));
        cell.publish(Message::number(5));
        assert_eq!(thread.join().unwrap(), Some(Message::number(1)));
    });
}

#[test]
fn the_newest_of_a_downlink_is_whole() {
    loom::model(|| {
        let cell = Arc::new(Mailbox::<Message, 2>::new());
        cell.publish(Message::number(1));
        cell.publish(Message::number(2));
        let reader = Arc::clone(&cell);
        let thread = thread::spawn(move || reader.newest(|_| true));
        cell.publish(Message::number(3));
        let read = thread.join().unwrap();
        assert!([Some(Message::number(2)), Some(Message::number(3))].contains(&read), "{read:?}");
    });
}

/// The test can fail: two publications within one read tear the value.
#[test]
#[should_panic(expected = "torn")]
fn a_downlink_outside_its_protocol_is_torn() {
    loom::model(|| {
        let cell = Arc::new(Mailbox::<Message, 2>::new());
        cell.publish(Message::number(1));
        let reader = Arc::clone(&cell);
        let thread = thread::spawn(move || reader.newest(|_| true));
        cell.publish(Message::number(2));
        cell.publish(Message::number(3));
        if let Some(message) = thread.join().unwrap() {
            assert!(message.is_whole(), "torn: {message:?}");
        }
    });
}

/// Nothing of the first value is seen before it is complete.
#[test]
fn the_first_value_of_an_uplink_is_whole_or_not_there() {
    loom::model(|| {
        let cell = Arc::new(Seqlock::<Message, 2>::new());
        let reader = Arc::clone(&cell);
        let thread = thread::spawn(move || reader.read());
        cell.publish(Message::number(1));
        let read = thread.join().unwrap();
        assert!([None, Some(Message::number(1))].contains(&read), "{read:?}");
        assert_eq!(cell.read(), Some(Message::number(1)));
    });
}

#[test]
fn the_first_value_of_a_downlink_is_whole_or_not_there() {
    loom::model(|| {
        let cell = Arc::new(Mailbox::<Message, 2>::new());
        let reader = Arc::clone(&cell);
        let thread = thread::spawn(move || reader.newest(|_| true));
        cell.publish(Message::number(1));
        let read = thread.join().unwrap();
        assert!([None, Some(Message::number(1))].contains(&read), "{read:?}");
        assert_eq!(cell.newest(|_| true), Some(Message::number(1)));
    });
}

/// A reader never goes back to an older value.
#[test]
fn an_uplink_goes_forward() {
    let mut model = loom::model::Builder::new();
    model.preemption_bound = Some(2);
    model.check(|| {
        let cell = Arc::new(Seqlock::<Message, 2>::new());
        cell.publish(Message::number(1));
        let reader = Arc::clone(&cell);
        let thread = thread::spawn(move || [reader.read(), reader.read()]);
        cell.publish(Message::number(2));
        if let [Some(first), Some(second)] = thread.join().unwrap() {
            assert!(first.0[0] <= second.0[0], "{first:?} then {second:?}");
        }
    });
}

#[test]
fn a_downlink_goes_forward() {
    let mut model = loom::model::Builder::new();
    model.preemption_bound = Some(3);
    model.check(|| {
        let cell = Arc::new(Mailbox::<Message, 2>::new());
        cell.publish(Message::number(1));
        cell.publish(Message::number(2));
        let reader = Arc::clone(&cell);
        let thread = thread::spawn(move || [reader.newest(|_| true), reader.newest(|_| true)]);
        cell.publish(Message::number(3));
        let [first, second] = thread.join().unwrap().map(|read| read.unwrap().0[0]);
        assert!(first <= second, "{first} then {second}");
    });
}

/// Words one after another, with nothing that says whether they belong together: the cells exist to avoid this.
#[test]
#[should_panic(expected = "torn")]
fn words_alone_are_torn() {
    use loom::sync::atomic::{AtomicU32, Ordering};
    loom::model(|| {
        let words = Arc::new([AtomicU32::new(1), AtomicU32::new(1)]);
        let reader = Arc::clone(&words);
        let thread = thread::spawn(move || [0, 1].map(|k: usize| reader[k].load(Ordering::Acquire)));
        words.iter().for_each(|word| word.store(2, Ordering::Release));
        let read = Message(thread.join().unwrap());
        assert!(read.is_whole(), "torn: {read:?}");
    });
}

/// The reader gets only what a fault has frozen, whole; nothing while the writer still writes, or writes again.
#[test]
fn a_ring_gives_only_what_is_frozen() {
    loom::model(|| {
        let ring = Arc::new(Ring::<Message, 2, 8>::new());
        ring.record(Message::number(1), false, false);
        let reader = Arc::clone(&ring);
        let thread = thread::spawn(move || [reader.read(0), reader.read(1)]);
        ring.record(Message::number(2), true, false);
        let expected = [Some(Message::number(1)), Some(Message::number(2))];
        for (read, expected) in thread.join().unwrap().into_iter().zip(expected) {
            assert!(read.is_none() || read == expected, "{read:?}");
        }
        assert_eq!([ring.read(0), ring.read(1), ring.read(2)], [expected[0], expected[1], None]);
    });
}

#[test]
fn a_ring_that_is_released_under_the_readers_hands_gives_nothing_torn() {
    loom::model(|| {
        let ring = Arc::new(Ring::<Message, 2, 8>::new());
        for n in 1..9 {
            ring.record(Message::number(n), n == 8, false);
        }
        let reader = Arc::clone(&ring);
        let thread = thread::spawn(move || reader.read(0));
        ring.release();
        ring.record(Message::number(9), true, false);
        let read = thread.join().unwrap();
        assert!([None, Some(Message::number(1)), Some(Message::number(9))].contains(&read), "{read:?}");
    });
}
