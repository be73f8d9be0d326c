//! The cells between the two interrupts: one type per priority direction.
//!
//! Both are arrays of 32-bit atomics with relaxed loads and stores (plain `ldr`/`str` on the target), so a value
//! can be stale but never undefined, and nothing here needs `unsafe`. One core; the higher-priority interrupt
//! preempts the lower one and runs to completion.
//!
//! * [`Downlink`], low → high: a double buffer. The reader is wait-free because the writer cannot run while
//!   it reads, and never sees a half-written value because the writer fills the slot that nobody reads.
//! * [`Uplink`], high → low: a sequence counter. The writer is wait-free; the reader tries again when a write
//!   came in between, a bounded number of times (a second write within one read takes a carrier half).
//! * [`Ring`], one interrupt → anybody, afterwards: the flight recorder's memory, read only once a fault has frozen it.

#![forbid(unsafe_code)]

mod ring;

pub use ring::Ring;

#[cfg(loom)]
use loom::sync::atomic::{AtomicU32, Ordering, fence};

#[cfg(not(loom))]
use core::sync::atomic::{AtomicU32, Ordering, fence};

/// A value that travels as `N` words of 32 bits.
pub trait Words<const N: usize>: Copy {
    /// The value as words.
    fn to_words(self) -> [u32; N];
    /// The value from what [`Words::to_words`] made.
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

/// From the low-priority interrupt (writer) to the high-priority one (reader).
///
/// It holds the two newest values, so that the reader can pick by a rule that does not depend on when the
/// writer happened to finish: the newest one if `ready`, otherwise the one before it. The older slot is
/// rewritten only by the next [`Downlink::publish`]; a writer that publishes only once its previous value is
/// `ready` for every reader (one control period later, by construction) never has the slot in use rewritten.
pub struct Downlink<T, const N: usize> {
    slots: [[AtomicU32; N]; 2],
    /// Counts the values published, 0 before the first; the newest is in slot `published % 2`.
    published: AtomicU32,
    value: core::marker::PhantomData<fn(T) -> T>,
}

impl<T: Words<N>, const N: usize> Downlink<T, N> {
    /// An empty cell: both slots hold zero words, which [`Downlink::newest`] reports as `None` until published.
    #[cfg(not(loom))]
    #[allow(clippy::declare_interior_mutable_const, reason = "an array initialiser, never borrowed")]
    pub const fn new() -> Self {
        Self {
            slots: [const { [const { AtomicU32::new(0) }; N] }; 2],
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
        // Zero means "none yet", so the count wraps from its odd maximum to the even 2.
        let next = match self.published.load(Ordering::Relaxed).wrapping_add(1) {
            0 => 2,
            count => count,
        };
        store(self.slot(next), value.to_words());
        self.published.store(next, Ordering::Release);
    }

    /// Reader's side: the newest value that is `ready`, of the two newest; `None` when neither is.
    #[inline]
    pub fn newest(&self, ready: impl Fn(&T) -> bool) -> Option<T> {
        let published = self.published.load(Ordering::Acquire);
        if published == 0 {
            return None;
        }
        let newest = T::from_words(load(self.slot(published)));
        if ready(&newest) {
            return Some(newest);
        }
        if published == 1 {
            return None;
        }
        let older = T::from_words(load(self.slot(published.wrapping_sub(1))));
        if ready(&older) { Some(older) } else { None }
    }

    #[inline]
    fn slot(&self, count: u32) -> &[AtomicU32; N] {
        let [even, odd] = &self.slots;
        if count & 1 == 0 { even } else { odd }
    }
}

impl<T: Words<N>, const N: usize> Default for Downlink<T, N> {
    fn default() -> Self {
        Self::new()
    }
}

/// How often [`Uplink::read`] tries. Two writes within one read are half a carrier apart, so the second try succeeds;
/// the third is margin.
const READ_TRIES: usize = 3;

/// From the high-priority interrupt (writer) to the low-priority one (reader).
pub struct Uplink<T, const N: usize> {
    /// Odd while a write is under way.
    sequence: AtomicU32,
    words: [AtomicU32; N],
    value: core::marker::PhantomData<fn(T) -> T>,
}

impl<T: Words<N>, const N: usize> Uplink<T, N> {
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
        for _ in 0..READ_TRIES {
            let before = self.sequence.load(Ordering::Acquire);
            let words = load(&self.words);
            fence(Ordering::Acquire);
            let after = self.sequence.load(Ordering::Relaxed);
            if before == after && before & 1 == 0 {
                return if before == 0 { None } else { Some(T::from_words(words)) };
            }
        }
        None
    }
}

impl<T: Words<N>, const N: usize> Default for Uplink<T, N> {
    fn default() -> Self {
        Self::new()
    }
}
