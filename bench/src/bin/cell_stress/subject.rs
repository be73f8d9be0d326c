//! The cells under test: what each side does in its interrupt, and what was found.

use crate::accesses::*;
use crate::message::Message;
use core::sync::atomic::{AtomicU32, Ordering::SeqCst, compiler_fence};

/// What was published and what was read.
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

pub static SUBJECTS: [Subject; 9] = [
    Subject::new(
        "downlink-9",
        |c| c.publish(downlink_9_publish),
        |c| {
            c.read(|| DOWNLINK_9.newest(|_| true));
            c.read_before(|not| DOWNLINK_9.newest(|message| message.word::<0>() != not));
        },
    ),
    Subject::new(
        "downlink-10",
        |c| c.publish(downlink_10_publish),
        |c| {
            c.read(|| DOWNLINK_10.newest(|_| true));
            c.read_before(|not| DOWNLINK_10.newest(|message| message.word::<0>() != not));
        },
    ),
    Subject::new(
        "uplink-27",
        |c| c.read(|| uplink_27_read(&UPLINK_27)),
        |c| c.publish(|m| UPLINK_27.publish(*m)),
    ),
    Subject::new(
        "uplink-10",
        |c| c.read(|| uplink_10_read(&UPLINK_10)),
        |c| c.publish(|m| UPLINK_10.publish(*m)),
    ),
    Subject::new("uplink-27-empty", |c| c.read_empty(uplink_27_read(&EMPTY_27)), |_| ()),
    Subject::new("uplink-10-empty", |c| c.read_empty(uplink_10_read(&EMPTY_10)), |_| ()),
    Subject::new("broken-plain-down", |c| c.publish(plain_publish), |c| c.read(|| Some(PLAIN_DOWN.read()))),
    Subject::new("broken-plain-up", |c| c.read(plain_read), |c| c.publish(|m| PLAIN_UP.publish(*m))),
    Subject::new("broken-eager-down", |c| c.publish(eager_publish), |c| c.read(|| EAGER.read())),
];

/// Those whose reader tries again, for several interrupts in a row; it may give up then.
pub static BURST_SUBJECTS: [Subject; 2] = [
    Subject::new(
        "burst-uplink-27",
        |c| c.read(|| uplink_27_read(&UPLINK_27)),
        |c| c.publish(|m| UPLINK_27.publish(*m)),
    ),
    Subject::new(
        "burst-uplink-10",
        |c| c.read(|| uplink_10_read(&UPLINK_10)),
        |c| c.publish(|m| UPLINK_10.publish(*m)),
    ),
];

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

    /// The newest value: none older than the last one that was done before, none newer than the last one begun since.
    fn read<const N: usize>(&self, read: impl Fn() -> Option<Message<N>>) {
        let oldest = self.done.load(SeqCst);
        compiler_fence(SeqCst);
        let message = read();
        compiler_fence(SeqCst);
        if oldest > 0 {
            self.judge(message, oldest, self.begun.load(SeqCst));
        }
    }

    /// The one before the newest, as it is read while the newest is not yet valid: exactly that one.
    fn read_before<const N: usize>(&self, read: impl Fn(u32) -> Option<Message<N>>) {
        let newest = self.begun.load(SeqCst);
        if newest > 1 {
            self.judge(read(newest), newest - 1, newest - 1);
        }
    }

    /// A cell that nobody has written: anything found in it is torn.
    fn read_empty<const N: usize>(&self, message: Option<Message<N>>) {
        add(&self.reads);
        if message.is_some() {
            add(&self.torn);
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
