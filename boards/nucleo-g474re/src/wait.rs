//! Waiting for the hardware.

/// Time that passes while the hardware works: on the chip a loop with a bound, in a test the hardware's turn.
pub trait Wait {
    /// Until `done` says so; an error if it does not for too long.
    fn until(&mut self, done: &mut dyn FnMut() -> bool) -> Result<(), Timeout>;
    /// At least this long.
    fn microseconds(&mut self, us: u32);
}

/// The hardware did not answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Timeout;
