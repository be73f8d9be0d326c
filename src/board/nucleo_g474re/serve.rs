//! The idle loop's operator: asked over CAN, answered by what the board says of itself.

use super::can::Can;
use super::pins;
use super::registers::Registers;
use crate::frames::Abc;
use crate::operator::{Configuration, Desk, Feedback, OperatorPort, Request, Status};
use crate::protection::Fault;
use crate::protocol::Station;
use crate::time::Instant;

/// The operator's side of the board. It has no contactors: the link is alive by itself.
pub struct Serve<'a> {
    registers: Registers,
    /// The bus.
    pub can: Can,
    /// The protocol.
    pub station: Station,
    desk: &'a Desk,
    configuration: Configuration,
}

impl<'a> Serve<'a> {
    /// At power-up; the configuration has been checked, or not.
    pub const fn new(
        registers: Registers,
        can: Can,
        station: Station,
        desk: &'a Desk,
        configuration: Configuration,
    ) -> Self {
        Self { registers, can, station, desk, configuration }
    }

    fn feedback(&self) -> Feedback {
        let tripped = self.registers.legs.is_tripped();
        Feedback {
            precharge_closed: false,
            main_closed: false,
            driver_ready: !tripped,
            enable_input: pins::is_enabled(&self.registers),
            sensor_alive: true,
            // The encoder's index has passed.
            position_known: self.registers.tim4.sr().read().idxif(),
            // The start has refused sensors whose zero is too far off, and taken the rest away.
            offsets_a: Abc::default(),
            configuration: self.configuration,
            parameters_open: false,
            hardware: tripped.then_some(Fault::GateDriver),
        }
    }
}

impl OperatorPort for Serve<'_> {
    fn ask(&mut self, _at: Instant) -> (Request, Feedback) {
        self.can.tend();
        let frame = self.can.receive();
        (self.station.listen(self.desk.observed(), frame.as_ref()), self.feedback())
    }

    fn tell(&mut self, _from: Instant, status: &Status) {
        if let Some(frame) = self.station.tell(status) {
            self.can.send(&frame);
        }
    }
}
