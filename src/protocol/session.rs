//! The drive's end: frames in, a request out; a status in, frames out. One step a slot of 1 ms, one frame a slot at most each way.

use super::commands::{Command, LinkLimits, ParameterRequest, TorqueLimits};
use super::frame::Frame;
use super::parameters::{Parameters, RPM_PER_RAD_S, WriteError};
use super::receiver::{Content, Receiver};
use super::sender::Sender;
use super::telemetry::{Counts, Listening, Measured, Outcome, ParameterAnswer, StatusFrame};
use crate::machine::Ratings;
use crate::modulation::Mode;
use crate::operator::{Limits, Request, State, Status};

/// What is sent of.
#[derive(Clone, Copy, Debug)]
pub struct Told<'a> {
    /// The operator's status.
    pub status: &'a Status,
    /// Measurements.
    pub measured: &'a Measured,
    /// Pulse pattern.
    pub mode: Mode,
}

/// The drive's end of the protocol.
#[derive(Clone, Copy, Debug)]
pub struct Session {
    ratings: &'static Ratings,
    receiver: Receiver,
    parameters: Parameters,
    command: Command,
    /// Slots since the newest command; `None` before the first, and after the time-out to off.
    age_ms: Option<u32>,
    /// Whether a command at rest has come since the drive went off: before it no level counts.
    armed: bool,
    torque_limits: Option<TorqueLimits>,
    link_limits: Option<LinkLimits>,
    state: State,
    sender: Sender,
}

impl Session {
    /// Nothing received yet.
    pub const fn new(ratings: &'static Ratings) -> Self {
        Self {
            ratings,
            receiver: Receiver::new(),
            parameters: Parameters::rated(ratings),
            command: AT_REST,
            age_ms: None,
            armed: false,
            torque_limits: None,
            link_limits: None,
            state: State::Init,
            sender: Sender::new(),
        }
    }

    /// The slot's first half: what has come, and what is asked of the drive now.
    pub fn listen(&mut self, received: Option<&Frame>) -> Request {
        self.wait();
        if let Some(Ok(content)) = received.map(|frame| self.receiver.receive(frame)) {
            self.take(content);
        }
        self.request()
    }

    /// The slot's second half: the frame to send, if one is due.
    pub fn tell(&mut self, told: &Told) -> Option<Frame> {
        self.state = told.status.state;
        let status = StatusFrame::new(told.status, told.mode, self.listening(), self.receiver.counts());
        self.sender.step(&status, told.measured, told.status.trip.as_ref(), self.receiver.counts())
    }

    /// The parameters in force.
    pub fn parameters(&self) -> &Parameters {
        &self.parameters
    }

    /// What became of the frames received.
    pub fn counts(&self) -> &Counts {
        self.receiver.counts()
    }

    /// What becomes of the newest command.
    pub fn listening(&self) -> Listening {
        match self.age_ms {
            None => Listening::Off,
            Some(age_ms) if age_ms as f32 >= self.parameters.command_zero_ms => Listening::ZeroTorque,
            Some(_) => Listening::Fresh,
        }
    }

    fn wait(&mut self) {
        self.receiver.wait(self.parameters.command_zero_ms as u32);
        self.age_ms = self.age_ms.map(|age_ms| age_ms.saturating_add(1));
        if self.age_ms.is_some_and(|age_ms| age_ms as f32 >= self.parameters.command_off_ms) {
            self.age_ms = None;
            self.armed = false;
            self.command = AT_REST;
        }
    }

    fn take(&mut self, content: Content) {
        match content {
            Content::Greeting => (),
            Content::Command(command) => {
                self.armed |= Command { torque_nm: 0.0, off: false, ..command } == AT_REST;
                self.command = command;
                self.age_ms = Some(0);
            }
            Content::Limits(limits) => self.torque_limits = Some(limits),
            Content::LinkLimits(limits) => self.link_limits = Some(limits),
            Content::Parameter(request) => {
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

    fn request(&self) -> Request {
        let idle = Request { limits: self.limits(), ..Request::idle(self.ratings) };
        let command = &self.command;
        if !self.armed {
            return Request { off: command.off, ..idle };
        }
        let fresh = self.listening() == Listening::Fresh;
        Request {
            enable: command.enable,
            with_torque: command.with_torque,
            off: command.off,
            coast: command.coast,
            charge: command.charge,
            discharge: command.discharge,
            acknowledge: command.acknowledge,
            torque_nm: if fresh { command.torque_nm } else { 0.0 },
            ..idle
        }
    }

    /// The lower of the sender's limits and the parameters; as rated where nothing is said.
    fn limits(&self) -> Limits {
        let (ratings, parameters) = (self.ratings, &self.parameters);
        let mut limits = Limits {
            motoring_nm: parameters.torque_limit_nm,
            braking_nm: parameters.torque_limit_nm,
            speed_rad_s: parameters.speed_limit_rpm / RPM_PER_RAD_S,
            ..Limits::rated(ratings)
        };
        if let Some(sent) = &self.torque_limits {
            limits.motoring_nm = beyond(sent.motoring_nm, parameters.torque_limit_nm, ratings.max_torque_nm);
            limits.braking_nm = beyond(sent.braking_nm, parameters.torque_limit_nm, ratings.max_torque_nm);
            let rated_rpm = ratings.max_speed_rad_s * RPM_PER_RAD_S;
            limits.speed_rad_s =
                beyond(sent.speed_rpm, parameters.speed_limit_rpm, rated_rpm) / RPM_PER_RAD_S;
        }
        if let Some(sent) = &self.link_limits {
            limits.link_low_v = sent.low_v;
            limits.link_high_v = sent.high_v;
        }
        // Rounding to the signal's step and back must not make the rating itself look higher than it is.
        if limits.speed_rad_s > ratings.max_speed_rad_s
            && limits.speed_rad_s < ratings.max_speed_rad_s * (1.0 + STEP_SHARE)
        {
            limits.speed_rad_s = ratings.max_speed_rad_s;
        }
        limits
    }
}

/// Rounding that is forgiven at a rating, as a share of it.
const STEP_SHARE: f32 = 1e-4;

/// What is sent beyond the rating stays, so that it is refused with a reason; within it the parameter holds.
fn beyond(sent: f32, parameter: f32, rated: f32) -> f32 {
    if sent > rated * (1.0 + STEP_SHARE) || sent < parameter { sent } else { parameter }
}

const AT_REST: Command = Command {
    enable: false,
    with_torque: false,
    off: false,
    coast: false,
    charge: false,
    discharge: false,
    acknowledge: false,
    torque_nm: 0.0,
};

/// Whether the gates pulse in a state, or may begin to without a further command.
fn may_pulse(state: State) -> bool {
    matches!(state, State::Enabled | State::Running | State::Coasting | State::Stopping)
}
