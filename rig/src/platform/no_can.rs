//! No CAN.

use crate::can::Bus;
use anyhow::{Result, bail};
use tractive::protocol::Frame;

/// A socket that cannot exist.
pub(crate) enum Socket {}

impl Socket {
    pub(crate) fn open(interface: &str) -> Result<Self> {
        bail!("--can {interface}: there is SocketCAN on Linux alone")
    }
}

impl Bus for Socket {
    fn send(&mut self, _: &Frame) -> Result<()> {
        match *self {}
    }

    fn receive(&mut self) -> Result<Option<Frame>> {
        match *self {}
    }
}
