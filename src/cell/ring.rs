//! A ring that one interrupt fills until a fault freezes it, and that anybody reads afterwards.

#[cfg(loom)]
use loom::sync::atomic::{AtomicU32, Ordering};

#[cfg(not(loom))]
use core::sync::atomic::{AtomicU32, Ordering};

use super::{Words, acquire, load, order, release, store};

/// The last `N` values of one writer, `N` a power of two.
///
/// The writer is wait-free. Once a fault is reported to it, it takes `N / 8` more values, the faulty one among them, and then no others, so that the
/// events before the fault remain. The reader gets values only from a frozen ring, so nothing is written while it reads; should the ring be released
/// meanwhile, the reader notices and gets nothing.
pub struct Ring<T, const W: usize, const N: usize> {
    slots: [[AtomicU32; W]; N],
    /// Values ever written. Beyond its largest number the count continues with `N`: the ring stays full.
    written: AtomicU32,
    /// The number of records that a release has forgotten.
    forgotten: AtomicU32,
    /// Values since the fault, the faulty one among them.
    after: AtomicU32,
    value: core::marker::PhantomData<fn(T) -> T>,
}

impl<T: Words<W>, const W: usize, const N: usize> Ring<T, W, N> {
    /// Number of values that are still taken, beginning with the faulty one.
    pub const AFTER: usize = {
        assert!(N.is_power_of_two() && N >= 8);
        N / 8
    };

    /// An empty ring.
    #[cfg(not(loom))]
    #[allow(clippy::declare_interior_mutable_const, reason = "an array initialiser, never borrowed")]
    pub const fn new() -> Self {
        Self {
            slots: [const { [const { AtomicU32::new(0) }; W] }; N],
            written: AtomicU32::new(0),
            forgotten: AtomicU32::new(0),
            after: AtomicU32::new(0),
            value: core::marker::PhantomData,
        }
    }

    /// An empty ring (loom's atomics are not `const`).
    #[cfg(loom)]
    pub fn new() -> Self {
        Self {
            slots: core::array::from_fn(|_| core::array::from_fn(|_| AtomicU32::new(0))),
            written: AtomicU32::new(0),
            forgotten: AtomicU32::new(0),
            after: AtomicU32::new(0),
            value: core::marker::PhantomData,
        }
    }

    /// Writer's side: the next value, with the flag of a latched fault. A ring that a fault has frozen takes none, unless it is to record `anew`.
    #[inline(always)]
    pub fn record(&self, value: T, faulty: bool, anew: bool) {
        let mut after = self.after.load(Ordering::Relaxed);
        if after == Self::AFTER as u32 {
            if !anew {
                return;
            }
            self.release();
            after = 0;
        }
        let written = self.written.load(Ordering::Relaxed);
        let Some(slot) = self.slots.get(written as usize % N) else { return };
        store(slot, value.to_words());
        let next = written.wrapping_add(1);
        release(&self.written, if next == 0 { N as u32 } else { next });
        // The last word to change: whoever sees it full sees all that it froze.
        release(&self.after, after + u32::from(faulty));
    }

    /// Writer's side: forgets the fault and the values before it, and records anew.
    #[cold]
    #[inline(never)]
    pub fn release(&self) {
        self.after.store(0, Ordering::Relaxed);
        self.forgotten.store(self.written.load(Ordering::Relaxed), Ordering::Relaxed);
        order(Ordering::Release);
    }

    /// Reader's side: `true` if a fault has frozen the ring.
    pub fn is_frozen(&self) -> bool {
        acquire(&self.after) == Self::AFTER as u32
    }

    /// Reader's side: value number `index`, 0 being the oldest; `None` beyond the newest, and while the ring is not frozen.
    pub fn read(&self, index: usize) -> Option<T> {
        if !self.is_frozen() {
            return None;
        }
        let written = acquire(&self.written);
        let length = match written.checked_sub(self.forgotten.load(Ordering::Relaxed)) {
            Some(kept) if (kept as usize) < N => kept as usize,
            _ => N,
        };
        let back = length.checked_sub(index).filter(|back| *back > 0)?;
        let value = T::from_words(load(self.slots.get((written as usize).wrapping_sub(back) % N)?));
        order(Ordering::Acquire);
        let untouched = self.is_frozen() && self.written.load(Ordering::Relaxed) == written;
        untouched.then_some(value)
    }
}

#[cfg(all(test, not(loom)))]
mod tests {
    use super::*;

    #[derive(Clone, Copy, Debug, PartialEq)]
    struct Number(u32);

    impl Words<1> for Number {
        fn to_words(self) -> [u32; 1] {
            [self.0]
        }

        fn from_words([word]: [u32; 1]) -> Self {
            Self(word)
        }
    }

    fn contents<const N: usize>(ring: &Ring<Number, 1, N>) -> Vec<u32> {
        (0..).map_while(|index| ring.read(index)).map(|number| number.0).collect()
    }

    extern crate std;
    use std::vec::Vec;

    #[test]
    fn a_fault_freezes_what_came_before_and_a_little_after() {
        for faulty_at in 0..40 {
            let ring = Ring::<Number, 1, 16>::new();
            for n in 0..60 {
                let open = n < faulty_at + 2;
                assert_eq!(contents(&ring).is_empty(), open, "{n}");
                ring.record(Number(n), n >= faulty_at, false);
            }
            let first = (faulty_at + 2).saturating_sub(16);
            assert_eq!(contents(&ring), (first..faulty_at + 2).collect::<Vec<_>>());
        }
    }

    #[test]
    fn a_released_ring_records_the_next_fault() {
        let ring = Ring::<Number, 1, 8>::new();
        (0..20).for_each(|n| ring.record(Number(n), n > 10, false));
        ring.release();
        assert!(!ring.is_frozen() && ring.read(0).is_none());
        (100..103).for_each(|n| ring.record(Number(n), n > 100, false));
        assert_eq!(contents(&ring), [100, 101]);
    }

    /// The values before a fault are kept if the ring is to begin anew while nothing has frozen it.
    #[test]
    fn only_a_frozen_ring_begins_anew() {
        let ring = Ring::<Number, 1, 8>::new();
        (0..20).for_each(|n| ring.record(Number(n), n > 18, true));
        assert_eq!(contents(&ring), (12..20).collect::<Vec<_>>());
        (90..100).for_each(|n| ring.record(Number(n), false, false));
        assert_eq!(contents(&ring), (12..20).collect::<Vec<_>>());
        (100..103).for_each(|n| ring.record(Number(n), n > 101, true));
        assert_eq!(contents(&ring), [100, 101, 102]);
    }

    #[test]
    fn a_full_ring_stays_full_when_the_count_wraps() {
        let ring = Ring::<Number, 1, 8>::new();
        ring.written.store(u32::MAX - 3, Ordering::Relaxed);
        (0..12).for_each(|n| ring.record(Number(n), n >= 11, false));
        assert_eq!(contents(&ring), (4..12).collect::<Vec<_>>());
    }
}
