//! A board on a CAN bus, by SocketCAN.

use crate::run::Supervisor;
use anyhow::{Context, Result};
use socketcan::{CanFrame, CanSocket, EmbeddedFrame, Socket, StandardId};
use std::time::{Duration, Instant};
use tractive::protocol::{Frame, LENGTH};

/// A supervisor's slot.
const SLOT: Duration = Duration::from_millis(1);

/// Lets a supervisor command whoever is on the bus, a slot each millisecond, until it is done.
pub(crate) fn drive(interface: &str, supervisor: &mut dyn Supervisor) -> Result<()> {
    let named = || format!("--can {interface}");
    let socket = CanSocket::open(interface).with_context(named)?;
    let begun = Instant::now();
    for slot in 0_u32.. {
        let turn = supervisor.slot(begun.elapsed().as_secs_f64())?;
        if let Some(frame) = turn.frame {
            let id = StandardId::new(frame.id).context("an identifier of more than 11 bits")?;
            let sent = CanFrame::new(id, &frame.data).context("a frame of more than eight bytes")?;
            socket.write_frame(&sent).with_context(named)?;
        }
        if turn.done {
            break;
        }
        while let Some(left) = (SLOT * (slot + 1)).checked_sub(begun.elapsed()).filter(|left| !left.is_zero())
        {
            match socket.read_frame_timeout(left) {
                Ok(received) => {
                    if let Some(frame) = of(&received) {
                        supervisor.hear(begun.elapsed().as_secs_f64(), &frame);
                    }
                }
                Err(error) if error.kind() == std::io::ErrorKind::TimedOut => {}
                Err(error) => return Err(error).with_context(named),
            }
        }
    }
    Ok(())
}

/// The protocol's frame; `None` for what is none of its kind.
fn of(received: &CanFrame) -> Option<Frame> {
    let CanFrame::Data(data) = received else { return None };
    let socketcan::Id::Standard(id) = data.id() else { return None };
    let data = <[u8; LENGTH as usize]>::try_from(data.data()).ok()?;
    Some(Frame { id: id.as_raw(), length: LENGTH, data })
}
