//! A CAN bus, by SocketCAN.

use crate::can::Bus;
use anyhow::{Context, Result};
use socketcan::{CanDataFrame, CanFrame, CanSocket, EmbeddedFrame, Id, ShouldRetry, Socket as _, StandardId};
use tractive::protocol::Frame;

/// A SocketCAN socket that does not block.
pub(crate) struct Socket(CanSocket);

impl Socket {
    pub(crate) fn open(interface: &str) -> Result<Self> {
        let open = || -> Result<CanSocket> {
            let socket = CanSocket::open(interface)?;
            socket.set_nonblocking(true)?;
            Ok(socket)
        };
        Ok(Self(open().with_context(|| format!("--can {interface}"))?))
    }
}

impl Bus for Socket {
    fn send(&mut self, frame: &Frame) -> Result<()> {
        match self.0.write_frame(&to_bus(frame)?) {
            // A full queue loses a frame; the drive's counters will show it.
            Err(error) if error.should_retry() => Ok(()),
            sent => Ok(sent?),
        }
    }

    fn receive(&mut self) -> Result<Option<Frame>> {
        loop {
            match self.0.read_frame() {
                Ok(CanFrame::Data(frame)) => {
                    if let Some(frame) = from_bus(&frame) {
                        return Ok(Some(frame));
                    }
                }
                // The protocol uses neither remote frames nor bus errors.
                Ok(_) => {}
                Err(error) if error.should_retry() => return Ok(None),
                Err(error) => return Err(error.into()),
            }
        }
    }
}

fn to_bus(frame: &Frame) -> Result<CanDataFrame> {
    let id = StandardId::new(frame.id).context("an identifier of more than 11 bits")?;
    let length = usize::from(frame.length).min(8);
    CanDataFrame::new(id, &frame.data[..length]).context("more than eight bytes")
}

/// The frame in the protocol's form; `None` for an extended identifier.
fn from_bus(frame: &CanDataFrame) -> Option<Frame> {
    let Id::Standard(id) = frame.id() else { return None };
    let mut data = [0; 8];
    data.get_mut(..frame.data().len())?.copy_from_slice(frame.data());
    Some(Frame { id: id.as_raw(), length: frame.data().len() as u8, data })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_frame_goes_to_the_bus_and_back() {
        let frame = Frame { id: 0x181, length: 5, data: [1, 2, 3, 4, 5, 0, 0, 0] };
        assert_eq!(from_bus(&to_bus(&frame).unwrap()), Some(frame));
        assert!(to_bus(&Frame { id: 0x800, ..frame }).is_err());
        let extended = socketcan::ExtendedId::new(0x181).unwrap();
        assert_eq!(from_bus(&CanDataFrame::new(extended, &[1]).unwrap()), None);
    }

    #[test]
    fn an_interface_that_is_not_there_is_named() {
        let error = Socket::open("nowhere0").err().unwrap();
        assert!(format!("{error:#}").starts_with("--can nowhere0"), "{error:#}");
    }
}
