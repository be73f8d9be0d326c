//! The drive's end: frames in, a request out; a status in, frames out. One step per slot of 1 ms; at most one frame is sent per slot.

use super::commands::ParameterRequest;
use super::frame::Frame;
use super::message_set::{DemandStatus, MessageSet, Request, Taken};
use super::parameters::{Parameters, WriteError};
use super::receiver::Receiver;
use super::scales::Scales;
use super::sender::Sender;
use super::telemetry::{Counts, Listening, Outcome, ParameterAnswer, StatusFrame};
use crate::machine::Ratings;
use crate::operator::{State, Status};
use core::borrow::Borrow;

/// The source of the telemetry.
#[derive(Clone, Copy, Debug)]
pub struct TelemetrySource<'a, D: MessageSet> {
    /// The operator's status.
    pub status: &'a Status<DemandStatus<D>>,
    /// Measurements.
    pub measured: &'a D::Measured,
    /// Pulse pattern.
    pub mode: D::Pattern,
}

/// The drive's end of the protocol.
#[derive(Clone, Copy, Debug)]
pub struct Session<D: MessageSet> {
    ratings: &'static Ratings,
    scales: Scales,
    receiver: Receiver<D>,
    parameters: Parameters,
    /// The content received last.
    said: D,
    /// Slots since the newest command; `None` before the first one, and after the time-out to off.
    age_ms: Option<u32>,
    /// `true` once a command at rest has come since the drive went off: before that no level counts.
    armed: bool,
    state: State,
    sender: Sender<D>,
}

impl<D: MessageSet> Session<D> {
    /// Nothing received yet.
    pub const fn new(ratings: &'static Ratings) -> Self {
        let scales = if D::IS_ZS9 { Scales::of_zs9(ratings) } else { Scales::of(ratings) };
        Self {
            ratings,
            scales,
            receiver: Receiver::new(),
            parameters: Parameters::rated(ratings),
            said: D::SILENT,
            age_ms: None,
            armed: false,
            state: State::Init,
            sender: Sender::new(),
        }
    }

    /// The slot's first half, `slots` after the last one that was handled: takes the frames that have come since, and returns the present request to
    /// the drive.
    pub fn listen<F: Borrow<Frame>>(
        &mut self,
        slots: u32,
        received: impl IntoIterator<Item = F>,
    ) -> Request<D> {
        self.wait(slots);
        for frame in received {
            if let Ok(content) = self.receiver.receive(frame.borrow(), self.scales) {
                self.take(content);
            }
        }
        let fresh = self.listening() == Listening::Fresh;
        self.said.request(self.armed, fresh, &self.parameters, self.ratings)
    }

    /// The slot's second half: the frame to send, if one is due.
    pub fn tell(&mut self, source: &TelemetrySource<D>) -> Option<Frame> {
        self.state = source.status.state;
        let status = StatusFrame::new(source.status, source.mode, self.listening(), self.receiver.counts());
        self.sender.step(
            &status,
            (source.measured, self.scales),
            source.status.temperatures.as_ref(),
            source.status.trip.as_ref(),
            self.receiver.counts(),
        )
    }

    /// The parameters in force.
    pub fn parameters(&self) -> &Parameters {
        &self.parameters
    }

    /// The counts of the frames received.
    pub fn counts(&self) -> &Counts {
        self.receiver.counts()
    }

    /// The use that is made of the newest command.
    pub fn listening(&self) -> Listening {
        match self.age_ms {
            None => Listening::Off,
            Some(age_ms) if age_ms as f32 >= self.parameters.command_zero_ms => Listening::ZeroTorque,
            Some(_) => Listening::Fresh,
        }
    }

    fn wait(&mut self, slots: u32) {
        self.receiver.wait(slots, self.parameters.command_zero_ms as u32);
        self.age_ms = self.age_ms.map(|age_ms| age_ms.saturating_add(slots));
        if self.age_ms.is_some_and(|age_ms| age_ms as f32 >= self.parameters.command_off_ms) {
            self.age_ms = None;
            self.armed = false;
            self.said.rest();
        }
    }

    fn take(&mut self, content: D::Content) {
        match self.said.take(content) {
            Taken::Kept => (),
            Taken::Command { at_rest } => {
                self.armed |= at_rest;
                self.age_ms = Some(0);
            }
            Taken::Parameter(request) => {
                let answer = self.serve(&request);
                self.sender.answer(answer);
            }
        }
    }

    fn serve(&mut self, request: &ParameterRequest) -> ParameterAnswer {
        let ParameterRequest { parameter, write } = *request;
        let outcome = match write {
            _ if self.parameters.read(parameter).is_none() => Outcome::Unknown,
            None => Outcome::Done,
            Some(_) if may_pulse(self.state) => Outcome::Enabled,
            Some(value) => match self.parameters.write(parameter, value, self.ratings) {
                Ok(()) => Outcome::Done,
                Err(WriteError::Unknown) => Outcome::Unknown,
                Err(WriteError::OutOfRange) => Outcome::OutOfRange,
            },
        };
        ParameterAnswer { outcome, parameter, value: self.parameters.read(parameter) }
    }
}

/// `true` if the gates pulse in a state, or may begin to without a further command.
fn may_pulse(state: State) -> bool {
    matches!(state, State::Enabled | State::Running | State::Coasting | State::Stopping)
}
