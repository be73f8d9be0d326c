//! The cells under test: what each side does in its interrupt, and what was found.

use crate::accesses::*;
use crate::message::Message;
use core::sync::atomic::{AtomicU32, Ordering::SeqCst, compiler_fence};
use tractive::cell::Words;

/// Records that a reader looks at.
pub const LAST: usize = 4;

/// The numbers of messages published and read.
pub struct Counts {
    begun: AtomicU32,
    done: AtomicU32,
    pub reads: AtomicU32,
    pub torn: AtomicU32,
    pub stale: AtomicU32,
    pub missing: AtomicU32,
}

/// A cell.
pub struct Subject {
    pub name: &'static str,
    /// The control interrupt's turn.
    pub low: fn(&Counts),
    /// The PWM interrupt's turn.
    pub high: fn(&Counts),
    pub counts: Counts,
}

impl Subject {
    const fn new(name: &'static str, low: fn(&Counts), high: fn(&Counts)) -> Self {
        Self { name, low, high, counts: Counts::new() }
    }
}

/// Records that a ring holds: one from the fault on freezes it.
const RING_RECORDS: u32 = 8;

pub static SUBJECTS: [Subject; 18] = [
    Subject::new(
        "downlink-10",
        |c| c.publish(downlink_10_publish),
        |c| {
            c.read(|| DOWNLINK_10.newest(|_| true));
            c.read_before(1, |wanted| DOWNLINK_10.newest(|message| message.word::<0>() == wanted));
        },
    ),
    Subject::new(
        "planned-9",
        |c| c.publish(planned_9_publish),
        |c| {
            c.read(|| PLANNED_9.newest(|_| true));
            (1..4).for_each(|back| {
                c.read_before(back, |wanted| PLANNED_9.newest(|message| message.word::<0>() == wanted));
            });
        },
    ),
    Subject::new(
        "uplink-4",
        |c| c.read(|| uplink_4_read(&UPLINK_4)),
        |c| c.publish(|m| UPLINK_4.publish(*m)),
    ),
    Subject::new(
        "uplink-10",
        |c| c.read(|| uplink_10_read(&UPLINK_10)),
        |c| c.publish(|m| UPLINK_10.publish(*m)),
    ),
    Subject::new(
        "downlink-7",
        |c| c.publish(downlink_7_publish),
        |c| {
            c.read(|| DOWNLINK_7.newest(|_| true));
            c.read_before(1, |wanted| DOWNLINK_7.newest(|message| message.word::<0>() == wanted));
        },
    ),
    Subject::new(
        "uplink-12",
        |c| c.read(|| uplink_12_read(&UPLINK_12)),
        |c| c.publish(|m| UPLINK_12.publish(*m)),
    ),
    // Released and frozen again while the reader reads: then it gets nothing.
    Subject::new("ring-10", |c| c.read(|| ring_read(&RING)), release_and_freeze),
    Subject::new(
        "trail-6",
        |c| c.read_trail(|| trail_6_read(&TRAIL_6)),
        |c| c.publish(|m| TRAIL_6.publish(m.to_words())),
    ),
    Subject::new("uplink-4-empty", |c| c.read_empty(uplink_4_read(&EMPTY_4).is_some()), |_| ()),
    Subject::new("uplink-10-empty", |c| c.read_empty(uplink_10_read(&EMPTY_10).is_some()), |_| ()),
    Subject::new("uplink-12-empty", |c| c.read_empty(uplink_12_read(&EMPTY_12).is_some()), |_| ()),
    Subject::new("trail-6-empty", |c| c.read_empty(trail_6_read(&EMPTY_6).is_some()), |_| ()),
    Subject::new("ring-10-empty", |c| c.read_empty(ring_read(&EMPTY_RING).is_some()), |_| ()),
    Subject::new("unfrozen-empty", |c| c.read_empty(unfrozen_read(&EMPTY_UNFROZEN).is_some()), |_| ()),
    Subject::new("broken-plain-down", |c| c.publish(plain_publish), |c| c.read(|| Some(PLAIN_DOWN.read()))),
    Subject::new("broken-plain-up", |c| c.read(plain_read), |c| c.publish(|m| PLAIN_UP.publish(*m))),
    Subject::new(
        "broken-ring",
        |c| c.read(|| unfrozen_read(&UNFROZEN)),
        |c| c.publish(|m| (0..RING_RECORDS).for_each(|_| UNFROZEN.record(*m))),
    ),
    Subject::new("broken-eager-down", |c| c.publish(eager_publish), |c| c.read(|| EAGER.read())),
];

/// Subjects whose reader tries again, for several interrupts in a row; it may give up then.
pub static BURST_SUBJECTS: [Subject; 4] = [
    Subject::new("burst-ring-10", |c| c.read(|| ring_read(&RING)), release_and_freeze),
    Subject::new(
        "burst-uplink-4",
        |c| c.read(|| uplink_4_read(&UPLINK_4)),
        |c| c.publish(|m| UPLINK_4.publish(*m)),
    ),
    Subject::new(
        "burst-uplink-10",
        |c| c.read(|| uplink_10_read(&UPLINK_10)),
        |c| c.publish(|m| UPLINK_10.publish(*m)),
    ),
    Subject::new(
        "burst-uplink-12",
        |c| c.read(|| uplink_12_read(&UPLINK_12)),
        |c| c.publish(|m| UPLINK_12.publish(*m)),
    ),
];

fn release_and_freeze(counts: &Counts) {
    counts.publish(|m| {
        RING.release();
        (1..=RING_RECORDS).for_each(|number| RING.record(*m, number == RING_RECORDS, false));
    });
}

fn add(count: &AtomicU32) {
    count.store(count.load(SeqCst).wrapping_add(1), SeqCst);
}

impl Counts {
    const fn new() -> Self {
        Self {
            begun: AtomicU32::new(0),
            done: AtomicU32::new(0),
            reads: AtomicU32::new(0),
            torn: AtomicU32::new(0),
            stale: AtomicU32::new(0),
            missing: AtomicU32::new(0),
        }
    }

    fn publish<const N: usize>(&self, publish: impl Fn(&Message<N>)) {
        let number = self.begun.load(SeqCst).wrapping_add(1);
        let message = Message::number(number);
        self.begun.store(number, SeqCst);
        compiler_fence(SeqCst);
        publish(&message);
        compiler_fence(SeqCst);
        self.done.store(number, SeqCst);
    }

    /// The newest value: not older than the last one completed before, not newer than the last one begun since.
    fn read<const N: usize>(&self, read: impl Fn() -> Option<Message<N>>) {
        let oldest = self.done.load(SeqCst);
        compiler_fence(SeqCst);
        let message = read();
        compiler_fence(SeqCst);
        if oldest > 0 {
            self.judge(message, oldest, self.begun.load(SeqCst));
        }
    }

    /// The value so many before the newest, read while later ones are not yet valid: exactly that one.
    fn read_before<const N: usize>(&self, back: u32, read: impl Fn(u32) -> Option<Message<N>>) {
        let newest = self.begun.load(SeqCst);
        if newest > back {
            self.judge(read(newest - back), newest - back, newest - back);
        }
    }

    /// A cell that nobody has written: anything found in it is torn.
    fn read_empty(&self, is_found: bool) {
        add(&self.reads);
        if is_found {
            add(&self.torn);
        }
    }

    /// The newest value as in [`Self::read`]; those before it each older by one.
    fn read_trail<const N: usize>(&self, read: impl Fn() -> Option<[Message<N>; LAST]>) {
        let oldest = self.done.load(SeqCst);
        compiler_fence(SeqCst);
        let records = read();
        compiler_fence(SeqCst);
        // As many as the reader looks at.
        if oldest < 2 * LAST as u32 {
            return;
        }
        let Some([newest, before @ ..]) = records else {
            return self.judge::<N>(None, 0, 0);
        };
        let mut last = newest.claimed();
        self.judge(Some(newest), oldest, self.begun.load(SeqCst));
        for record in before {
            self.judge(Some(record), last.saturating_sub(1), last.saturating_sub(1));
            last = record.claimed();
        }
    }

    fn judge<const N: usize>(&self, message: Option<Message<N>>, oldest: u32, newest: u32) {
        add(&self.reads);
        match message.map(|message| message.whole()) {
            None => add(&self.missing),
            Some(None) => add(&self.torn),
            Some(Some(number)) if !(oldest..=newest).contains(&number) => add(&self.stale),
            Some(Some(_)) => {}
        }
    }
}
