//! The cells between the two interrupts: one type per priority direction.
//!
//! All are arrays of 32-bit atomics with relaxed loads and stores (plain `ldr`/`str` on the target), so a value can be stale but never undefined, and
//! nothing here needs `unsafe`. There is one core, and the higher-priority interrupt preempts the lower one and runs to completion. So on the target
//! the compiler alone orders the accesses of each period; the sequence counter, which is seldom used, has fences.
//!
//! * [`Mailbox`], low → high: a double buffer, or one of more slots. The reader is wait-free because the writer cannot run while it reads, and it
//!   never sees a half-written value because the writer fills the slot that nobody reads.
//! * [`History`], high → low: a ring of records. The writer is wait-free and writes each record once; the reader reads the last few in place, and the
//!   writer cannot come round to them meanwhile.
//! * [`Seqlock`], high → low: a sequence counter. The writer is wait-free; the reader tries again if a write came in between, a bounded number of
//!   times (a second write within one read takes a carrier half).
//! * [`Ring`], one interrupt → anybody, afterwards: the flight recorder's memory, read only once a fault has frozen it.

#![forbid(unsafe_code)]

mod ring;

pub use ring::Ring;

#[cfg(loom)]
use loom::sync::atomic::{AtomicU32, Ordering, fence, fence as order};

#[cfg(all(not(loom), target_os = "none"))]
use core::sync::atomic::compiler_fence as order;
#[cfg(all(not(loom), not(target_os = "none")))]
use core::sync::atomic::fence as order;
#[cfg(not(loom))]
use core::sync::atomic::{AtomicU32, Ordering, fence};

/// A value that travels as `N` words of 32 bits.
pub trait Words<const N: usize>: Copy {
    /// The value as words.
    fn to_words(self) -> [u32; N];
    /// The value from the words that [`Words::to_words`] made.
    fn from_words(words: [u32; N]) -> Self;
}

#[inline]
fn store<const N: usize>(slot: &[AtomicU32; N], words: [u32; N]) {
    for (cell, word) in slot.iter().zip(words) {
        cell.store(word, Ordering::Relaxed);
    }
}

#[inline]
fn load<const N: usize>(slot: &[AtomicU32; N]) -> [u32; N] {
    let mut words = [0; N];
    for (word, cell) in words.iter_mut().zip(slot) {
        *word = cell.load(Ordering::Relaxed);
    }
    words
}

/// Loads a word, and with it all that was stored before it.
#[inline(always)]
fn acquire(word: &AtomicU32) -> u32 {
    let value = word.load(Ordering::Relaxed);
    order(Ordering::Acquire);
    value
}

/// Stores a word after all that was stored before.
#[inline(always)]
fn release(word: &AtomicU32, value: u32) {
    order(Ordering::Release);
    word.store(value, Ordering::Relaxed);
}

/// From the low-priority interrupt (writer) to the high-priority one (reader).
///
/// It holds the newest values, two unless more are requested (a power of two), so that the reader can choose by a rule that does not depend on when
/// the writer happened to finish: the newest value that is `ready`. Only the next [`Mailbox::publish`] rewrites the oldest slot. If a writer
/// publishes only once no reader needs that slot any more (with two values: once its previous value is `ready` for every reader, one control period
/// later by construction), the slot in use is never rewritten.
pub struct Mailbox<T, const N: usize, const SLOTS: usize = 2> {
    slots: [[AtomicU32; N]; SLOTS],
    /// Counts the values published, 0 before the first; the newest is in slot `published % SLOTS`.
    published: AtomicU32,
    value: core::marker::PhantomData<fn(T) -> T>,
}

impl<T: Words<N>, const N: usize, const SLOTS: usize> Mailbox<T, N, SLOTS> {
    /// An empty cell: all slots hold zero words, which [`Mailbox::newest`] reports as `None` until published.
    #[cfg(not(loom))]
    #[allow(clippy::declare_interior_mutable_const, reason = "an array initialiser, never borrowed")]
    pub const fn new() -> Self {
        const { assert!(SLOTS.is_power_of_two()) };
        Self {
            slots: [const { [const { AtomicU32::new(0) }; N] }; SLOTS],
            published: AtomicU32::new(0),
            value: core::marker::PhantomData,
        }
    }

    /// An empty cell (loom's atomics are not `const`).
    #[cfg(loom)]
    pub fn new() -> Self {
        Self {
            slots: core::array::from_fn(|_| core::array::from_fn(|_| AtomicU32::new(0))),
            published: AtomicU32::new(0),
            value: core::marker::PhantomData,
        }
    }

    /// Writer's side: publishes a value. Called by one interrupt only.
    #[inline]
    pub fn publish(&self, value: T) {
        // Zero means "none yet", so the count wraps to full slots.
        let next = match self.published.load(Ordering::Relaxed).wrapping_add(1) {
            0 => SLOTS as u32,
            count => count,
        };
        // Not before the previous value has been made known.
        order(Ordering::Release);
        store(self.slot(next), value.to_words());
        release(&self.published, next);
    }

    /// Reader's side: the newest value whose record is `ready`; `None` when none is.
    #[inline]
    pub fn newest(&self, ready: impl Fn(&Record<N>) -> bool) -> Option<T> {
        self.find(ready).map(|record| T::from_words(load(record.0)))
    }

    /// The same, in place.
    #[inline]
    pub fn find(&self, ready: impl Fn(&Record<N>) -> bool) -> Option<Record<'_, N>> {
        let published = acquire(&self.published);
        for back in 0..SLOTS as u32 {
            if back >= published {
                return None;
            }
            let record = Record(self.slot(published.wrapping_sub(back)));
            if ready(&record) {
                return Some(record);
            }
        }
        None
    }

    /// Reader's side: the newest value in place, ready or not.
    #[inline]
    pub fn last(&self) -> Option<Record<'_, N>> {
        match acquire(&self.published) {
            0 => None,
            published => Some(Record(self.slot(published))),
        }
    }

    #[inline]
    fn slot(&self, count: u32) -> &[AtomicU32; N] {
        &self.slots[count as usize % SLOTS]
    }
}

/// Counts a try that a write has overtaken; true if another try remains. Out of line: so the read exists once, not once per try.
#[cold]
#[inline(never)]
fn overtaken(tries: &mut usize) -> bool {
    *tries = tries.saturating_sub(1);
    *tries > 0
}

/// The number of tries of [`Seqlock::read`]. Two writes within one read are half a carrier apart, so the second try succeeds;
/// the third is margin.
const READ_TRIES: usize = 3;

/// From the high-priority interrupt (writer) to the low-priority one (reader).
pub struct Seqlock<T, const N: usize> {
    /// The sequence count, odd while a write is under way.
    sequence: AtomicU32,
    words: [AtomicU32; N],
    value: core::marker::PhantomData<fn(T) -> T>,
}

impl<T: Words<N>, const N: usize> Seqlock<T, N> {
    /// An empty cell.
    #[cfg(not(loom))]
    #[allow(clippy::declare_interior_mutable_const, reason = "an array initialiser, never borrowed")]
    pub const fn new() -> Self {
        Self {
            sequence: AtomicU32::new(0),
            words: [const { AtomicU32::new(0) }; N],
            value: core::marker::PhantomData,
        }
    }

    /// An empty cell (loom's atomics are not `const`).
    #[cfg(loom)]
    pub fn new() -> Self {
        Self {
            sequence: AtomicU32::new(0),
            words: core::array::from_fn(|_| AtomicU32::new(0)),
            value: core::marker::PhantomData,
        }
    }

    /// Writer's side: publishes a value. Called by one interrupt only.
    #[inline]
    pub fn publish(&self, value: T) {
        let sequence = self.sequence.load(Ordering::Relaxed);
        self.sequence.store(sequence.wrapping_add(1), Ordering::Relaxed);
        fence(Ordering::Release);
        store(&self.words, value.to_words());
        // Zero means "none yet", so the even counts wrap to 2.
        let done = match sequence.wrapping_add(2) {
            0 => 2,
            count => count,
        };
        self.sequence.store(done, Ordering::Release);
    }

    /// Reader's side: the newest value, whole; `None` before the first, or when every try was overtaken by a write.
    #[inline]
    pub fn read(&self) -> Option<T> {
        let mut tries = READ_TRIES;
        loop {
            let before = self.sequence.load(Ordering::Acquire);
            let words = load(&self.words);
            fence(Ordering::Acquire);
            let after = self.sequence.load(Ordering::Relaxed);
            if before == after && before & 1 == 0 {
                return if before == 0 { None } else { Some(T::from_words(words)) };
            }
            if !overtaken(&mut tries) {
                return None;
            }
        }
    }
}

/// Records that a [`History`] holds.
const RECORDS: usize = 8;

/// From the high-priority interrupt (writer) to the low-priority one (reader): the last records of `N` words.
///
/// The reader finds the wanted record by its content, then reads that one and those before it as often as it likes. A new record overwrites the
/// oldest of the ring: a read is valid until that happens to one of the records read, which is detected.
pub struct History<const N: usize> {
    records: [[AtomicU32; N]; RECORDS],
    /// Counts the records, 0 before the first; record n is in place `n % RECORDS`.
    published: AtomicU32,
}

/// The number of a record; the count continues past the ring's end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Place(u32);

/// A record in place: each word is loaded when it is asked for. Zeros if nothing was published yet.
#[derive(Clone, Copy)]
pub struct Record<'a, const N: usize>(&'a [AtomicU32; N]);

impl<const N: usize> Record<'_, N> {
    /// Word number `K`.
    #[inline(always)]
    pub fn word<const K: usize>(&self) -> u32 {
        const { assert!(K < N) };
        self.0[K].load(Ordering::Relaxed)
    }
}

impl<const N: usize> History<N> {
    /// An empty cell.
    #[cfg(not(loom))]
    #[allow(clippy::declare_interior_mutable_const, reason = "an array initialiser, never borrowed")]
    pub const fn new() -> Self {
        Self { records: [const { [const { AtomicU32::new(0) }; N] }; RECORDS], published: AtomicU32::new(0) }
    }

    /// An empty cell (loom's atomics are not `const`).
    #[cfg(loom)]
    pub fn new() -> Self {
        Self {
            records: core::array::from_fn(|_| core::array::from_fn(|_| AtomicU32::new(0))),
            published: AtomicU32::new(0),
        }
    }

    /// Writer's side: publishes a record. Called by one interrupt only.
    #[inline]
    pub fn publish(&self, words: [u32; N]) {
        let count = self.published.load(Ordering::Relaxed);
        // The words must not be seen before the count of the write before.
        order(Ordering::Release);
        store(&self.records[count as usize % RECORDS], words);
        // Zero means "none yet", so the count wraps to a full ring.
        let next = match count.wrapping_add(1) {
            0 => RECORDS as u32,
            next => next,
        };
        release(&self.published, next);
    }

    /// Reader's side: `true` while no record is newer than that at a place.
    #[inline]
    pub fn is_newest(&self, place: Place) -> bool {
        acquire(&self.published) == place.0.wrapping_add(1)
    }

    /// Reader's side: the newest of the last `within` records that `fits`; `None` if there is none.
    #[inline(always)]
    pub fn find(&self, within: u32, fits: impl Fn(Record<N>) -> bool) -> Option<Place> {
        let published = acquire(&self.published);
        let mut place = Place(published.wrapping_sub(1));
        for _ in 0..if published == 0 { 0 } else { within } {
            if fits(self.record(place, 0)) {
                return Some(place);
            }
            place.0 = place.0.wrapping_sub(1);
        }
        None
    }

    /// Reader's side: the result of `look` for the record at a place and those before it, the newest first; `None` if writes have come round to one
    /// of them, or if the count has wrapped since the place was found, once in 2³² records.
    #[inline]
    pub fn read<const COUNT: usize, R>(
        &self,
        place: Place,
        look: impl Fn([Record<N>; COUNT]) -> R,
    ) -> Option<R> {
        const { assert!(COUNT < RECORDS) };
        let seen = look(core::array::from_fn(|back| self.record(place, back as u32)));
        order(Ordering::Acquire);
        // The record being written now is the oldest of the ring.
        let written = self.published.load(Ordering::Relaxed).wrapping_sub(place.0);
        (written <= (RECORDS - COUNT) as u32).then_some(seen)
    }

    /// The record this many places before a place. The count wraps by whole rings.
    #[inline(always)]
    fn record(&self, place: Place, back: u32) -> Record<'_, N> {
        Record(&self.records[place.0.wrapping_sub(back) as usize % RECORDS])
    }
}

#[cfg(all(test, not(loom)))]
mod tests {
    extern crate std;

    use super::*;
    use std::vec::Vec;

    impl Words<1> for u32 {
        fn to_words(self) -> [u32; 1] {
            [self]
        }

        fn from_words([word]: [u32; 1]) -> Self {
            word
        }
    }

    /// Both counts skip 0, which means "none yet", and keep the order of the slots.
    #[test]
    fn the_counts_wrap_without_a_gap() {
        let (down, up) = (Mailbox::<u32, 1>::new(), Seqlock::<u32, 1>::new());
        for n in 1..10 {
            if n == 4 {
                // As after 2³² publications, less a few; each count in step with the previous one.
                down.published
                    .store(down.published.load(Ordering::Relaxed).wrapping_sub(6), Ordering::Relaxed);
                up.sequence.store(0_u32.wrapping_sub(6), Ordering::Relaxed);
            }
            down.publish(n);
            up.publish(n);
            assert_eq!((down.newest(|_| true), up.read()), (Some(n), Some(n)));
            assert_eq!(down.newest(|value| value.word::<0>() < n), (n > 1).then(|| n - 1), "{n}");
        }
        assert!(down.published.load(Ordering::Relaxed) < 10 && up.sequence.load(Ordering::Relaxed) < 20);
    }

    #[test]
    fn a_read_is_tried_as_often_as_it_may_be_overtaken() {
        let mut tries = READ_TRIES;
        assert_eq!([0; 4].map(|_| overtaken(&mut tries)), [true, true, false, false]);
    }

    /// A value that reads its own cell while it is written.
    #[derive(Clone, Copy)]
    struct Looking(u32);

    static LOOKED_AT: Seqlock<Looking, 1> = Seqlock::new();

    impl Words<1> for Looking {
        fn to_words(self) -> [u32; 1] {
            assert!(LOOKED_AT.read().is_none(), "whatever stood there, it is being written");
            [self.0]
        }

        fn from_words([word]: [u32; 1]) -> Self {
            Self(word)
        }
    }

    #[test]
    fn nothing_is_read_while_it_is_written() {
        for value in 1..4 {
            LOOKED_AT.publish(Looking(value));
            assert_eq!(LOOKED_AT.read().map(|looking| looking.0), Some(value));
        }
    }

    /// Counts around the beginning and around the wrap: a place in a ring depends on the count by its lowest bits, and on the two ends.
    fn counts() -> impl Iterator<Item = u32> {
        (0..100).chain(u32::MAX - 100..=u32::MAX)
    }

    /// The values of a mailbox, from the newest back; `None` if there is none.
    fn values<const SLOTS: usize>(cell: &Mailbox<u32, 1, SLOTS>) -> Vec<Option<u32>> {
        (0..SLOTS)
            .map(|back| {
                let seen = core::cell::Cell::new(0);
                cell.newest(|_| seen.replace(seen.get() + 1) == back)
            })
            .collect()
    }

    fn every_slot_is_kept<const SLOTS: usize>() {
        for count in counts() {
            let cell = Mailbox::<u32, 1, SLOTS>::new();
            cell.published.store(count, Ordering::Relaxed);
            // A count that was reached without these values: all that it has.
            for (place, slot) in cell.slots.iter().enumerate() {
                slot[0].store(1_000 + place as u32, Ordering::Relaxed);
            }
            let before = values(&cell);
            assert_eq!(before.iter().flatten().count(), SLOTS.min(count as usize), "{count}");
            for number in 0..2 * SLOTS {
                let known = values(&cell);
                cell.publish(number as u32);
                let now = values(&cell);
                // The new one, then all that were there, except the oldest.
                assert_eq!(now[0], Some(number as u32), "{count}");
                assert_eq!(now[1..], known[..SLOTS - 1], "{count}");
                assert_eq!(cell.last().map(|record| record.word::<0>()), now[0]);
            }
        }
    }

    #[test]
    fn every_slot_of_a_mailbox_is_kept_until_its_turn() {
        every_slot_is_kept::<1>();
        every_slot_is_kept::<2>();
        every_slot_is_kept::<4>();
        every_slot_is_kept::<16>();
        every_slot_is_kept::<32>();
    }

    /// The records read from a history as it stood, after this many more have come.
    fn read<const COUNT: usize>(later: u32, from: u32) -> Option<[u32; COUNT]> {
        let trail = History::<1>::new();
        trail.published.store(from, Ordering::Relaxed);
        (0..8).for_each(|number| trail.publish([number]));
        let place = trail.find(1, |_| true)?;
        assert!(trail.is_newest(place));
        (8..8 + later).for_each(|number| trail.publish([number]));
        assert_eq!(trail.is_newest(place), later == 0);
        trail.read(place, |records| records.map(|record| record.word::<0>()))
    }

    fn every_read_is_whole<const COUNT: usize>() {
        for (later, from) in (0..12).flat_map(|later| counts().map(move |from| (later, from))) {
            // The next record would overwrite the oldest of those read: from then on nothing is returned.
            let kept = later as usize + COUNT < RECORDS;
            let newest_first = core::array::from_fn(|back| 7 - back as u32);
            let counted = u64::from(from) + 8;
            let wraps = counted < 1 << 32 && counted + u64::from(later) >= 1 << 32;
            let told = (kept && !wraps).then_some(newest_first);
            assert_eq!(read::<COUNT>(later, from), told, "{later} {from}");
        }
    }

    #[test]
    fn a_history_tells_no_record_that_was_overwritten() {
        every_read_is_whole::<1>();
        every_read_is_whole::<2>();
        every_read_is_whole::<4>();
        every_read_is_whole::<7>();
    }

    /// Record `within` back is the last one that is searched, and none is there before the first.
    #[test]
    fn a_history_is_searched_as_far_as_it_is_told() {
        for from in counts() {
            let trail = History::<1>::new();
            assert!(trail.find(8, |_| true).is_none());
            trail.published.store(from, Ordering::Relaxed);
            (0..8).for_each(|number| trail.publish([number]));
            for (within, wanted) in (0..=8).flat_map(|within| (0..8).map(move |wanted| (within, wanted))) {
                let place = trail.find(within, |record| record.word::<0>() == wanted);
                assert_eq!(place.is_some(), 7 - wanted < within, "{within} {wanted} {from}");
                let read = place.and_then(|place| trail.read(place, |[one]: [Record<1>; 1]| one.word::<0>()));
                assert!(read.is_none_or(|read| read == wanted));
            }
        }
    }
}
