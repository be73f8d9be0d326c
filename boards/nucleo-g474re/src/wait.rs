//! Waiting for the hardware.

/// Time that passes while the hardware works: on the chip a bounded loop, in a test the hardware's turn.
pub trait Wait {
    /// Waits until `done` returns true; an error if that takes too long.
    fn until(&mut self, done: &mut dyn FnMut() -> bool) -> Result<(), Timeout>;
    /// Waits at least this long.
    fn microseconds(&mut self, us: u32);
}

/// The hardware did not answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Timeout;
