//! The idle loop's operator: asked over CAN, answered by what the board says of itself.

use super::can::Can;
use super::registers::Registers;
use super::switchgear::Wires;
use super::zs9;
use super::{hardware, pins, switchgear};
use crate::frames::Abc;
use crate::operator::{
    Configuration, DualDemands, DualObservation, DualRequest, DualStatus, Feedback, Observation,
    OperatorPort, Request, Status, TorqueDemand, Watched,
};
use crate::protocol::{Frame, Station, Zs9Station};
use crate::time::Instant;

/// The operator's side of the board, over a protocol's station and what the drive says of itself.
pub struct Serve<'a, S = Station, O = Observation> {
    registers: Registers,
    /// The bus.
    pub can: Can,
    /// The protocol.
    pub station: S,
    desk: &'a dyn Watched<O>,
    configuration: Configuration,
}

/// The same for the ZS9.
pub type DualServe<'a> = Serve<'a, Zs9Station, DualObservation>;

impl<'a, S, O> Serve<'a, S, O> {
    /// At power-up; the configuration has been checked, or not.
    pub const fn new(
        registers: Registers,
        can: Can,
        station: S,
        desk: &'a dyn Watched<O>,
        configuration: Configuration,
    ) -> Self {
        Self { registers, can, station, desk, configuration }
    }

    /// What every board says of itself.
    fn common(&self, wires: &Wires) -> Feedback {
        let (precharge_closed, main_closed) = switchgear::contacts(&self.registers, wires);
        Feedback {
            precharge_closed,
            main_closed,
            driver_ready: pins::drivers_ready(&self.registers),
            // An incremental encoder cannot tell at standstill; while it turns, the drive looks at its angle.
            sensor_alive: true,
            // The start has refused sensors whose zero is too far off, and taken the rest away.
            offsets_a: Abc::default(),
            configuration: self.configuration,
            ..Feedback::default()
        }
    }

    fn hear(&mut self) -> Option<Frame> {
        self.can.tend();
        self.can.receive()
    }

    fn say(&mut self, frame: Option<Frame>) {
        if let Some(frame) = frame {
            self.can.send(&frame);
        }
    }
}

impl Serve<'_> {
    /// What the board says of itself.
    pub fn feedback(&self) -> Feedback {
        Feedback {
            enable_input: pins::is_enabled(&self.registers),
            // The encoder's index has passed.
            position_known: self.registers.tim4.sr().read().idxif(),
            hardware: hardware::held_by(&self.registers),
            ..self.common(&pins::SWITCHGEAR)
        }
    }
}

impl DualServe<'_> {
    /// What the board says of itself.
    pub fn feedback(&self) -> Feedback {
        let Registers { tim3, tim4, .. } = self.registers;
        Feedback {
            enable_input: zs9::pins::is_enabled(&self.registers),
            // Both encoders' indices have passed.
            position_known: [tim3, tim4].into_iter().all(|timer| timer.sr().read().idxif()),
            hardware: zs9::hardware::held_by(&self.registers),
            ..self.common(&zs9::pins::SWITCHGEAR)
        }
    }
}

/// The switches at once: a slot earlier or later is nothing to a contactor, and the chopper's compare is preloaded.
impl OperatorPort<TorqueDemand> for Serve<'_> {
    fn ask(&mut self, _at: Instant) -> (Request, Feedback) {
        let frame = self.hear();
        (self.station.listen(self.desk.observed(), frame.as_ref()), self.feedback())
    }

    fn tell(&mut self, _from: Instant, status: &Status) {
        switchgear::set(&self.registers, &status.switches);
        let frame = self.station.tell(status);
        self.say(frame);
    }
}

impl OperatorPort<DualDemands> for DualServe<'_> {
    fn ask(&mut self, _at: Instant) -> (DualRequest, Feedback) {
        let frame = self.hear();
        (self.station.listen(self.desk.observed(), frame.as_ref()), self.feedback())
    }

    fn tell(&mut self, _from: Instant, status: &DualStatus) {
        switchgear::set_wires(&self.registers, &zs9::pins::SWITCHGEAR, &status.switches);
        let frame = self.station.tell(status);
        self.say(frame);
    }
}
