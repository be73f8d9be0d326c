//! The idle loop's operator: it gets requests over CAN and answers them with the board's own feedback.

use super::can::Can;
use super::position::PositionState;
use super::power_stage::THERMAL;
use super::registers::Registers;
use super::switchgear::Wires;
use super::temperatures::TemperatureInputs;
use super::{CLOCK, hardware, pins, switchgear};
use tractive::drive::OperatorMailboxes;
use tractive::experiment::{Memory, Teller};
use tractive::operator::{
    Configuration, Feedback, OperatorPort, Request, Settings, Slot, Status, TorqueDemand,
};
use tractive::ports::Report;
use tractive::protection::FailedCheck;
use tractive::protocol::{CanEndpoint, Frame};
use tractive::time::Instant;

/// Frames stored for a slot: more than the bus can carry in its millisecond (4.5 with eight bytes, 10.6 without data).
const INBOX: usize = 12;

/// The operator's side of the board, with a protocol's station.
pub struct Serve<'a, S = CanEndpoint> {
    pub(crate) registers: Registers,
    /// The bus.
    pub can: Can,
    /// The protocol.
    pub station: S,
    position: &'a PositionState,
    configuration: Configuration,
    /// Frames that have come since the last slot, and their number.
    inbox: [Frame; INBOX],
    waiting: usize,
    /// The temperature sensors.
    pub temperatures: TemperatureInputs,
}

impl<'a, S> Serve<'a, S> {
    /// At power-up; the configuration has been checked or has failed.
    pub fn new(
        registers: Registers,
        can: Can,
        station: S,
        position: &'a PositionState,
        configuration: Configuration,
    ) -> Self {
        let (inbox, waiting) = ([Frame::default(); INBOX], 0);
        Self {
            registers,
            can,
            station,
            position,
            configuration,
            inbox,
            waiting,
            temperatures: TemperatureInputs::default(),
        }
    }

    /// The feedback that every board gives.
    pub(crate) fn common(&self, wires: &Wires) -> Feedback {
        let (precharge_closed, main_closed) = switchgear::contacts(&self.registers, wires);
        Feedback {
            precharge_closed,
            main_closed,
            driver_ready: pins::drivers_ready(&self.registers),
            position_known: self.position.is_known(),
            // An incremental encoder cannot tell at standstill; while it turns, it checks its index, and the drive checks its angle.
            sensor_alive: !self.position.is_lost(),
            configuration: self.configuration,
            // No offsets: the start has refused sensors whose zero is too far off, and subtracted the zeros of the others.
            ..Feedback::default()
        }
    }

    /// Empties the controller's FIFO, which holds three frames, into the inbox. Called on every pass of the idle loop.
    pub(crate) fn collect(&mut self) {
        let room = self.inbox.get_mut(self.waiting..).unwrap_or_default();
        self.waiting += self.can.receive(room);
    }

    /// The frames that have come since the last slot.
    pub(crate) fn hear(&mut self) -> impl Iterator<Item = Frame> + use<S> {
        self.can.tend();
        self.inbox.into_iter().take(core::mem::take(&mut self.waiting))
    }

    pub(crate) fn say(&mut self, frame: Option<Frame>) {
        if let Some(frame) = frame {
            self.can.send(&frame);
        }
    }
}

/// The PMaSynRM drive's end of the protocol.
pub trait Station {
    /// The operator's settings with the parameters in force.
    fn settings<'a>(&self, settings: &Settings<'a>) -> Settings<'a>;
    /// The request in a slot, `slots` after the last one, given the frames that have come since.
    fn listen(&mut self, slots: u32, frames: impl Iterator<Item = Frame>) -> Request;
    /// The frame to send after the slot, if one is due.
    fn tell(&mut self, status: &Status, report: Option<&Report>) -> Option<Frame>;
}

impl Station for CanEndpoint {
    fn settings<'a>(&self, settings: &Settings<'a>) -> Settings<'a> {
        Self::settings(self, settings)
    }

    fn listen(&mut self, slots: u32, frames: impl Iterator<Item = Frame>) -> Request {
        Self::listen(self, slots, frames)
    }

    fn tell(&mut self, status: &Status, report: Option<&Report>) -> Option<Frame> {
        Self::tell(self, status, report)
    }
}

/// The same, with additional frames of what an identification stores, where the drive's frames leave room.
pub struct Identifying<'a> {
    drive: CanEndpoint,
    teller: Teller,
    memory: &'a Memory,
}

impl<'a> Identifying<'a> {
    /// At power-up.
    pub const fn new(drive: CanEndpoint, memory: &'a Memory) -> Self {
        Self { drive, teller: Teller::new(), memory }
    }
}

impl Station for Identifying<'_> {
    fn settings<'a>(&self, settings: &Settings<'a>) -> Settings<'a> {
        self.drive.settings(settings)
    }

    fn listen(&mut self, slots: u32, frames: impl Iterator<Item = Frame>) -> Request {
        self.drive.listen(slots, frames)
    }

    fn tell(&mut self, status: &Status, report: Option<&Report>) -> Option<Frame> {
        self.drive.tell(status, report).or_else(|| self.teller.tell(self.memory))
    }
}

impl<S: Station> Serve<'_, S> {
    /// The board's feedback.
    pub fn feedback(&self) -> Feedback {
        Feedback {
            enable_input: pins::is_enabled(&self.registers),
            position_counted: self.position.is_counted(),
            hardware: hardware::held_by(&self.registers),
            temperatures: self.temperatures.ratios(),
            ..self.common(&pins::SWITCHGEAR)
        }
    }

    /// Sets the switches. A drive that has not started has switched its chopper off for good; that of any other is on again once no fault is left.
    pub fn switch(&self, status: &Status, started: bool) {
        switchgear::set(&self.registers, &status.switches);
        if started && status.trip.is_none() {
            switchgear::resume_chopper(&self.registers);
        }
    }

    /// One pass of the idle loop: takes the frames that have come, and serves the newest slot if not yet served. Says whether it served one.
    pub fn pass(&mut self, slot: &mut Slot, mailboxes: &OperatorMailboxes, rated: &Settings) -> bool {
        self.collect();
        let settings = self.station.settings(rated);
        slot.run(mailboxes, self, &settings, &CLOCK)
    }

    /// The same if the start was refused, with `why`; once in a slot's time.
    pub fn refuse(&mut self, slot: &mut Slot, why: FailedCheck, rated: &Settings) {
        self.collect();
        slot.refuse(why, self, rated, &CLOCK);
    }
}

/// Sets the switches at once: a slot earlier or later does not matter to a contactor, and the chopper's compare is preloaded.
impl<S: Station> OperatorPort<TorqueDemand> for Serve<'_, S> {
    fn ask(&mut self, _at: Instant, slots: u32) -> (Request, Feedback) {
        if THERMAL.is_some() {
            self.temperatures.step(self.registers.adc1);
        }
        let frames = self.hear();
        (self.station.listen(slots, frames), self.feedback())
    }

    fn tell(&mut self, _from: Instant, status: &Status, report: Option<&Report>) {
        self.switch(status, report.is_some());
        let frame = self.station.tell(status, report);
        self.say(frame);
    }
}
