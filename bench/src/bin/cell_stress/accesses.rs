//! The accesses of the low-priority side, which the PWM interrupt hits, each a function of its own: `cargo xtask test` finds them by this module and
//! requires that every instruction of theirs that is executed is hit. Sizes are those of the drives' cells.

use crate::broken::{Eager, Plain, Unfrozen};
use crate::message::Message;
use tractive::cell::{History, Mailbox, Ring, Seqlock, Words};

pub static DOWNLINK_10: Mailbox<Message<10>, 10> = Mailbox::new();
pub static UPLINK_4: Seqlock<Message<4>, 4> = Seqlock::new();
pub static UPLINK_10: Seqlock<Message<10>, 10> = Seqlock::new();
pub static TRAIL_6: History<6> = History::new();
/// The carrier halves that control plans.
pub static PLANNED_9: Mailbox<Message<9>, 9, 4> = Mailbox::new();
/// Never written.
pub static EMPTY_6: History<6> = History::new();
pub static EMPTY_RING: Ring<Message<10>, 10, 8> = Ring::new();
pub static EMPTY_UNFROZEN: Unfrozen<10, 8> = Unfrozen::new();
pub static EMPTY_4: Seqlock<Message<4>, 4> = Seqlock::new();
pub static EMPTY_12: Seqlock<Message<12>, 12> = Seqlock::new();
pub static EMPTY_10: Seqlock<Message<10>, 10> = Seqlock::new();
/// Between the idle loop's operator and control.
pub static DOWNLINK_7: Mailbox<Message<7>, 7> = Mailbox::new();
pub static UPLINK_12: Seqlock<Message<12>, 12> = Seqlock::new();
/// A flight recorder of eight records; in the image it is filled by control and read by the idle loop.
pub static RING: Ring<Message<10>, 10, 8> = Ring::new();
pub static UNFROZEN: Unfrozen<10, 8> = Unfrozen::new();
pub static PLAIN_DOWN: Plain<10> = Plain::new();
pub static PLAIN_UP: Plain<13> = Plain::new();
pub static EAGER: Eager<10> = Eager::new();

#[inline(never)]
pub fn downlink_10_publish(message: &Message<10>) {
    DOWNLINK_10.publish(*message);
}

#[inline(never)]
pub fn planned_9_publish(message: &Message<9>) {
    PLANNED_9.publish(*message);
}

#[inline(never)]
pub fn downlink_7_publish(message: &Message<7>) {
    DOWNLINK_7.publish(*message);
}

#[inline(never)]
pub fn uplink_12_read(cell: &Seqlock<Message<12>, 12>) -> Option<Message<12>> {
    cell.read()
}

/// The newest record.
#[inline(never)]
pub fn ring_read(cell: &Ring<Message<10>, 10, 8>) -> Option<Message<10>> {
    cell.read(7)
}

#[inline(never)]
pub fn unfrozen_read(cell: &Unfrozen<10, 8>) -> Option<Message<10>> {
    cell.read(7)
}

#[inline(never)]
pub fn uplink_4_read(cell: &Seqlock<Message<4>, 4>) -> Option<Message<4>> {
    cell.read()
}

#[inline(never)]
pub fn uplink_10_read(cell: &Seqlock<Message<10>, 10>) -> Option<Message<10>> {
    cell.read()
}

/// The last four records, the newest first.
#[inline(never)]
pub fn trail_6_read(cell: &History<6>) -> Option<[Message<6>; 4]> {
    cell.read(cell.find(1, |_| true)?, |records| records.map(|record| Message::from_words(words(&record))))
}

#[inline(always)]
fn words(record: &tractive::cell::Record<6>) -> [u32; 6] {
    macro_rules! all {
        ($($k:literal)*) => { [$(record.word::<$k>()),*] };
    }
    all!(0 1 2 3 4 5)
}

#[inline(never)]
pub fn plain_publish(message: &Message<10>) {
    PLAIN_DOWN.publish(*message);
}

#[inline(never)]
pub fn plain_read() -> Option<Message<13>> {
    Some(PLAIN_UP.read())
}

#[inline(never)]
pub fn eager_publish(message: &Message<10>) {
    EAGER.publish(*message);
}
