//! Cells that do not hold what a cell must.
#![allow(unsafe_code)]

use crate::message::Message;
use core::cell::UnsafeCell;
use core::sync::atomic::{AtomicU32, Ordering};
use tractive::cell::Words;

/// A plain struct copy in either direction.
pub struct Plain<const N: usize>(UnsafeCell<Message<N>>);

// SAFETY: one core, and the value is nothing but words: a copy under way is read torn, which is what it is for.
unsafe impl<const N: usize> Sync for Plain<N> {}

impl<const N: usize> Plain<N> {
    pub const fn new() -> Self {
        Self(UnsafeCell::new(Message::BLANK))
    }

    pub fn publish(&self, value: Message<N>) {
        // SAFETY: the pointer is valid and aligned; volatile, so that the copy happens.
        unsafe { self.0.get().write_volatile(value) }
    }

    pub fn read(&self) -> Message<N> {
        // SAFETY: as above.
        unsafe { self.0.get().read_volatile() }
    }
}

/// A ring that is read while it is written.
pub struct Unfrozen<const N: usize, const R: usize> {
    slots: [[AtomicU32; N]; R],
    written: AtomicU32,
}

impl<const N: usize, const R: usize> Unfrozen<N, R> {
    pub const fn new() -> Self {
        Self { slots: [const { [const { AtomicU32::new(0) }; N] }; R], written: AtomicU32::new(0) }
    }

    pub fn record(&self, value: Message<N>) {
        let written = self.written.load(Ordering::Relaxed);
        if let Some(slot) = self.slots.get(written as usize % R) {
            for (cell, word) in slot.iter().zip(value.to_words()) {
                cell.store(word, Ordering::Relaxed);
            }
        }
        self.written.store(written.wrapping_add(1), Ordering::Release);
    }

    /// The value number `index`, 0 the oldest.
    pub fn read(&self, index: usize) -> Option<Message<N>> {
        let written = self.written.load(Ordering::Acquire) as usize;
        let slot = self.slots.get((written + index) % R)?;
        let mut words = [0; N];
        for (word, cell) in words.iter_mut().zip(slot) {
            *word = cell.load(Ordering::Relaxed);
        }
        (written >= R).then(|| Message::from_words(words))
    }
}

/// A double buffer that announces the slot before it is filled: its old contents are read once more, or half of them.
pub struct Eager<const N: usize> {
    slots: [[AtomicU32; N]; 2],
    published: AtomicU32,
}

impl<const N: usize> Eager<N> {
    pub const fn new() -> Self {
        Self { slots: [const { [const { AtomicU32::new(0) }; N] }; 2], published: AtomicU32::new(0) }
    }

    pub fn publish(&self, value: Message<N>) {
        let next = self.published.load(Ordering::Relaxed).wrapping_add(1);
        self.published.store(next, Ordering::Release);
        for (cell, word) in self.slot(next).iter().zip(value.to_words()) {
            cell.store(word, Ordering::Relaxed);
        }
    }

    pub fn read(&self) -> Option<Message<N>> {
        let published = self.published.load(Ordering::Acquire);
        let mut words = [0; N];
        for (word, cell) in words.iter_mut().zip(self.slot(published)) {
            *word = cell.load(Ordering::Relaxed);
        }
        (published > 0).then(|| Message::from_words(words))
    }

    fn slot(&self, count: u32) -> &[AtomicU32; N] {
        let [even, odd] = &self.slots;
        if count & 1 == 0 { even } else { odd }
    }
}
