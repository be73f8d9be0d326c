//! Time, in a unit that fits a whole number of times into a cycle of every clock of the chip.

/// An instant or a length of time, in parts of 1 / 4.08 GHz.
pub type Time = u64;

/// Parts of a second.
pub const SECOND: Time = 4_080_000_000;
/// A millisecond.
pub const MILLISECOND: Time = SECOND / 1_000;
/// A microsecond.
pub const MICROSECOND: Time = SECOND / 1_000_000;

/// The length of a cycle of a clock in Hz; a clock that does not divide the second gets the next shorter one.
pub const fn cycle(hz: u32) -> Time {
    SECOND / hz as Time
}

/// The same time in s.
pub fn seconds(time: Time) -> f64 {
    time as f64 / SECOND as f64
}
