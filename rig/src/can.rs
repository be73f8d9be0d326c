//! A drive on a CAN bus, commanded in real time.

use crate::platform::can::Socket;
use crate::run::Supervisor;
use anyhow::Result;
use std::ops::Range;
use std::time::{Duration, Instant};
use tractive::protocol::Frame;

/// Time between two polls of the bus: a slot.
const SLOT: Duration = Duration::from_millis(1);

/// A bus that sends and receives frames.
pub trait Bus {
    /// Sends a frame.
    fn send(&mut self, frame: &Frame) -> Result<()>;
    /// The next received frame; `None` if there is none now.
    fn receive(&mut self) -> Result<Option<Frame>>;
}

/// Lets a supervisor command any drive on the bus of an interface of this computer, until it is done.
///
/// # Errors
/// Names the interface that cannot be opened; otherwise the bus's own, or the supervisor's.
pub fn command(interface: &str, supervisor: &mut dyn Supervisor) -> Result<()> {
    drive(&mut Socket::open(interface)?, supervisor, 0..u64::MAX)
}

/// The same on any bus, for the slots of these numbers.
pub(crate) fn drive(bus: &mut impl Bus, supervisor: &mut dyn Supervisor, slots: Range<u64>) -> Result<()> {
    let first = slots.start;
    let begun = Instant::now();
    for slot in slots {
        let due = Duration::from_secs_f64((slot - first) as f64 * SLOT.as_secs_f64());
        std::thread::sleep(due.saturating_sub(begun.elapsed()));
        let t_s = slot as f64 * SLOT.as_secs_f64();
        while let Some(frame) = bus.receive()? {
            supervisor.hear(t_s, &frame);
        }
        let turn = supervisor.slot(t_s)?;
        if let Some(frame) = turn.frame {
            bus.send(&frame)?;
        }
        if turn.done {
            break;
        }
    }
    Ok(())
}
