//! The time that the plant's steps take, out of all that a thread does.

pub use crate::platform::processor_s;
use std::cell::Cell;

/// One out of this many steps of the plant is timed.
const TIMED: u64 = 16;

thread_local! {
    static STEPS: Cell<u64> = const { Cell::new(0) };
    static IN_PLANT: Cell<f64> = const { Cell::new(0.0) };
    /// The cost of reading the clock, in s.
    static TAKING: Cell<f64> = const { Cell::new(0.0) };
}

/// Does a step of the plant, and times it once in a while.
#[inline]
pub fn in_plant<R>(step: impl FnOnce() -> R) -> R {
    let count = STEPS.get();
    STEPS.set(count + 1);
    if !count.is_multiple_of(TIMED) {
        return step();
    }
    let began = processor_s();
    let result = step();
    IN_PLANT.set(IN_PLANT.get() + processor_s() - began - TAKING.get());
    result
}

/// Begins counting on this thread.
pub fn begin() {
    STEPS.set(0);
    IN_PLANT.set(0.0);
    const TRIES: u32 = 10_000;
    let began_s = processor_s();
    for _ in 0..TRIES {
        std::hint::black_box(processor_s());
    }
    TAKING.set((processor_s() - began_s) / f64::from(TRIES));
}

/// Number of the plant's steps since [`begin`], and the time that they took, in s.
pub fn taken() -> (u64, f64) {
    (STEPS.get(), IN_PLANT.get() * TIMED as f64)
}
