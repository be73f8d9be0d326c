//! The idle loop's operator: asked over CAN, answered by what the board says of itself.

use super::can::Can;
use super::registers::Registers;
use super::{hardware, pins, switchgear};
use crate::frames::Abc;
use crate::operator::{Configuration, Desk, Feedback, OperatorPort, Request, Status};
use crate::protocol::Station;
use crate::time::Instant;

/// The operator's side of the board.
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

    /// What the board says of itself.
    pub fn feedback(&self) -> Feedback {
        let (precharge_closed, main_closed) = switchgear::contacts(&self.registers);
        Feedback {
            precharge_closed,
            main_closed,
            driver_ready: pins::drivers_ready(&self.registers),
            enable_input: pins::is_enabled(&self.registers),
            // An incremental encoder cannot tell at standstill; while it turns, the drive looks at its angle.
            sensor_alive: true,
            // The encoder's index has passed.
            position_known: self.registers.tim4.sr().read().idxif(),
            // The start has refused sensors whose zero is too far off, and taken the rest away.
            offsets_a: Abc::default(),
            configuration: self.configuration,
            parameters_open: false,
            hardware: hardware::held_by(&self.registers),
        }
    }
}

impl OperatorPort for Serve<'_> {
    fn ask(&mut self, _at: Instant) -> (Request, Feedback) {
        self.can.tend();
        let frame = self.can.receive();
        (self.station.listen(self.desk.observed(), frame.as_ref()), self.feedback())
    }

    /// The switches at once: a slot earlier or later is nothing to a contactor, and the chopper's compare is preloaded.
    fn tell(&mut self, _from: Instant, status: &Status) {
        switchgear::set(&self.registers, &status.switches);
        if let Some(frame) = self.station.tell(status) {
            self.can.send(&frame);
        }
    }
}
