//! A drive on a CAN bus.

use super::relay::Relay;
use crate::run::Supervisor;
use anyhow::Result;
use std::time::Duration;
use tractive::protocol::Frame;

/// Time between two looks at the bus, in s: a slot.
const SLOT_S: f64 = 1e-3;

/// A bus that takes and gives frames.
pub trait Bus {
    /// Sends a frame.
    fn send(&mut self, frame: &Frame) -> Result<()>;
    /// The next frame that has come; `None` where there is none now.
    fn receive(&mut self) -> Result<Option<Frame>>;
}

/// Relays between a bus and the page, for so many slots from a number on.
pub fn relay(bus: &mut impl Bus, relay: &mut Relay, slots: std::ops::Range<u64>) -> Result<()> {
    for slot in slots {
        let t_s = slot as f64 * SLOT_S;
        let early_s = t_s - relay.time_s();
        if early_s > 0.0 {
            std::thread::sleep(Duration::from_secs_f64(early_s));
        }
        while let Some(frame) = bus.receive()? {
            relay.hear(t_s, &frame);
        }
        if let Some(frame) = relay.relay(t_s)?.frame {
            bus.send(&frame)?;
        }
    }
    Ok(())
}

/// Relays between an interface of this machine and the page, until the program is interrupted.
#[cfg(target_os = "linux")]
pub fn run(interface: &str, to: &mut Relay) -> Result<()> {
    relay(&mut linux::Socket::open(interface)?, to, 0..u64::MAX)
}

/// There is SocketCAN on Linux alone.
#[cfg(not(target_os = "linux"))]
pub fn run(interface: &str, _: &mut Relay) -> Result<()> {
    anyhow::bail!("--can {interface}: there is SocketCAN on Linux alone")
}

#[cfg(target_os = "linux")]
mod linux {
    use crate::live::bus::Bus;
    use anyhow::{Context, Result};
    use socketcan::{
        CanDataFrame, CanFrame, CanSocket, EmbeddedFrame, Id, ShouldRetry, Socket as _, StandardId,
    };
    use tractive::protocol::Frame;

    /// A SocketCAN socket that does not wait.
    pub struct Socket(CanSocket);

    impl Socket {
        pub fn open(interface: &str) -> Result<Self> {
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
                // A queue that is full loses a frame, as the drive's counters will tell.
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
                    // Neither remote frames nor a bus's errors are anything to the protocol.
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

    /// The frame as the protocol has it; `None` for an extended identifier.
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
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::live::relay::{Relay, columns};
    use crate::live::shared::Shared;
    use crate::talk::System;
    use std::collections::VecDeque;
    use std::sync::Arc;
    use tractive::protocol::e2e::Counter;
    use tractive::protocol::{COMMAND, FROM_DRIVE, Payload};

    /// A bus with frames that come, and those that were sent.
    struct Fake {
        come: VecDeque<Frame>,
        sent: Vec<Frame>,
    }

    impl Bus for Fake {
        fn send(&mut self, frame: &Frame) -> Result<()> {
            self.sent.push(*frame);
            Ok(())
        }

        fn receive(&mut self) -> Result<Option<Frame>> {
            Ok(self.come.pop_front())
        }
    }

    #[test]
    fn a_bus_is_only_looked_at_until_commands_are_switched_on() {
        let shared = Arc::new(Shared::new(true));
        let mut to = Relay::new(System::Pmasynrm, 10.0, 1235.0, Arc::clone(&shared));
        let status = FROM_DRIVE[0].frame(Payload(0), &mut Counter::default());
        let mut bus = Fake { come: [status].into(), sent: Vec::new() };
        relay(&mut bus, &mut to, 0..30).unwrap();
        assert!(bus.sent.is_empty(), "{:?}", bus.sent);
        let told = shared.rows(0);
        assert_eq!(told["rows"].as_array().unwrap().len(), columns(System::Pmasynrm).len());
        assert!(told["state"]["status"]["state"].is_string());
        shared.arm(true).unwrap();
        shared.say("charge").unwrap();
        relay(&mut bus, &mut to, 30..60).unwrap();
        assert!(
            bus.sent.len() == 3 && bus.sent.iter().all(|frame| COMMAND.is_intact(frame)),
            "{:?}",
            bus.sent
        );
        shared.arm(false).unwrap();
        relay(&mut bus, &mut to, 60..90).unwrap();
        assert_eq!(bus.sent.len(), 3);
    }
}
