//! The frames to the drive, slot by slot, and the damage done to them on the way.

use super::script::{Action, Line, MOST_V, SPEED, TORQUE};
use super::system::System;
use anyhow::{Result, ensure};
use std::collections::VecDeque;
use tractive::operator::Levels;
use tractive::protocol::e2e::Counter;
use tractive::protocol::{
    COMMAND, Command, Frame, LIMITS, LINK_LIMITS, LinkLimits, Message, OutOfRange, PARAMETER_REQUEST,
    ParameterRequest, Payload, Quantity, Scales, TO_ZS9, TorqueLimits, ZS9_COMMAND, ZS9_LINK,
    ZS9_PARAMETER_REQUEST, Zs9Command, Zs9Demands, Zs9Link,
};

/// The command that is sent.
#[derive(Clone, Copy, Debug, Default)]
pub struct Spoken {
    /// Levels.
    pub levels: Levels,
    /// Torques, in N·m; for one motor only the first.
    pub torques_nm: [f32; 2],
    /// Speeds in r/min, instead of the torques.
    pub speeds_rpm: Option<[f32; 2]>,
}

impl Spoken {
    fn encode(&self, system: System, scales: Scales) -> Result<Payload, OutOfRange> {
        let levels = self.levels;
        match system {
            System::Pmasynrm => {
                let Levels { enable, with_torque, off, coast, charge, discharge, acknowledge, calibrate } =
                    levels;
                let [torque_nm, _] = self.torques_nm;
                Command {
                    enable,
                    with_torque,
                    off,
                    coast,
                    charge,
                    discharge,
                    acknowledge,
                    calibrate,
                    torque_nm,
                }
                .encode(scales)
            }
            System::Zs9 => {
                let demands =
                    self.speeds_rpm.map_or(Zs9Demands::Torques(self.torques_nm), Zs9Demands::Speeds);
                Zs9Command { levels, demands }.encode(scales)
            }
        }
    }
}

/// Slots between two commands.
pub const COMMAND_SLOTS: u64 = 10;
/// Slots between two of the limits.
const LIMIT_SLOTS: u64 = 100;
/// Commands that are kept to be sent again.
const KEPT: usize = 32;
/// The identifier of the unknown frames.
const UNKNOWN_ID: u16 = 0x123;
/// A raw torque far out of range.
const TORQUE_OUT_OF_RANGE: Payload = Payload(0x7FFF << 16);

/// An additional frame.
#[derive(Clone, Copy, Debug)]
enum Extra {
    /// A frame as it is.
    Frame(Frame),
    /// An old command: this many before the newest.
    Old(usize),
    /// A command out of range, with the next counter value.
    OutOfRange,
}

/// Frames with their counters.
#[derive(Debug, Default)]
pub struct Sender {
    system: System,
    scales: Scales,
    command: Counter,
    limits: [Counter; 2],
    link_limits: Counter,
    parameter: Counter,
    /// Limits to repeat, of either motor.
    pub torque_limits: [Option<TorqueLimits>; 2],
    /// Limits to repeat.
    pub link: Option<LinkLimits>,
    /// Link voltage to repeat.
    pub link_ref: Option<Zs9Link>,
    /// Parameters to ask for.
    pub requests: VecDeque<ParameterRequest>,
    kept: VecDeque<Frame>,
    /// Additional frames to send.
    extra: VecDeque<Extra>,
    /// Number of commands in which a bit is still to be flipped.
    pub corrupt: u32,
    /// Number of commands that are still to be cut short.
    pub truncate: u32,
    turned: u32,
    /// The command that is held back until the next one has gone: `Some(None)` before it has come.
    pub held: Option<Option<Frame>>,
    /// The first slot in which something is sent again.
    pub silent_until: u64,
}

impl Sender {
    /// A sender to a system on these scales, with nothing sent yet.
    pub fn new(system: System, scales: Scales) -> Self {
        Self { system, scales, ..Self::default() }
    }

    /// Checks that the signals can carry what a line asks for, on the machine's scales.
    ///
    /// # Errors
    /// Names the line, and the largest torque, speed and voltage.
    pub fn check(&self, line: &Line) -> Result<()> {
        let fits = match &line.action {
            Action::Torque(to_nm, _) => {
                let torques_nm = to_nm.map(|nm| nm as f32);
                Spoken { torques_nm, ..Spoken::default() }.encode(self.system, self.scales).is_ok()
            }
            Action::Speed(to_rpm, _) if self.system == System::Zs9 => {
                let speeds_rpm = Some(to_rpm.map(|rpm| rpm as f32));
                Spoken { speeds_rpm, ..Spoken::default() }.encode(self.system, self.scales).is_ok()
            }
            Action::Limits(_, limits) => limits.encode(self.scales).is_ok(),
            Action::LinkLimits(limits) => limits.encode(self.scales).is_ok(),
            Action::Link(volts) => {
                Zs9Link { link_ref_v: *volts as f32, calibrate: false }.encode(self.scales).is_ok()
            }
            _ => true,
        };
        let most = |usual: f64, quantity| usual as f32 * self.scales.worth(quantity);
        ensure!(
            fits,
            "line {}: {}: a value is beyond what its signal carries for this machine: {} N·m, {} r/min, {} V at most",
            line.number,
            line.text,
            most(TORQUE[1], Quantity::Torque),
            most(SPEED[1], Quantity::Speed),
            most(MOST_V, Quantity::Voltage)
        );
        Ok(())
    }

    /// Messages of a command and of a parameter.
    fn messages(&self) -> [&'static Message; 2] {
        match self.system {
            System::Pmasynrm => [&COMMAND, &PARAMETER_REQUEST],
            System::Zs9 => [&ZS9_COMMAND, &ZS9_PARAMETER_REQUEST],
        }
    }

    /// Limits of a motor.
    fn motor_limits(&mut self, motor: usize) -> Result<Option<Frame>, OutOfRange> {
        let message = match self.system {
            System::Pmasynrm => &LIMITS,
            System::Zs9 => TO_ZS9[1 + motor],
        };
        let Some(limits) = &self.torque_limits[motor] else { return Ok(None) };
        let content = message.mark(limits.encode(self.scales)?, self.scales);
        Ok(Some(message.frame(content, &mut self.limits[motor])))
    }

    /// Limits of the link, or its voltage.
    fn link(&mut self) -> Result<Option<Frame>, OutOfRange> {
        let (message, content) = match (&self.link, &self.link_ref) {
            (Some(limits), _) => (&LINK_LIMITS, LINK_LIMITS.mark(limits.encode(self.scales)?, self.scales)),
            (None, Some(link)) => (&ZS9_LINK, ZS9_LINK.mark(link.encode(self.scales)?, self.scales)),
            (None, None) => return Ok(None),
        };
        Ok(Some(message.frame(content, &mut self.link_limits)))
    }

    /// Sends the newest commands again, the newest first.
    pub fn replay(&mut self, count: u32) {
        self.extra.extend((0..count as usize).map(Extra::Old));
    }

    /// Sends unknown frames.
    pub fn unknown(&mut self, count: u32) {
        let frame = Frame { id: UNKNOWN_ID, length: 8, data: [0x55; 8] };
        self.extra.extend((0..count).map(|_| Extra::Frame(frame)));
    }

    /// Sends commands whose torque is out of range.
    pub fn out_of_range(&mut self, count: u32) {
        self.extra.extend((0..count).map(|_| Extra::OutOfRange));
    }

    /// The frame of a slot. Fails if a signal cannot carry its value.
    pub fn step(&mut self, slot: u64, command: &Spoken) -> Result<Option<Frame>, OutOfRange> {
        if slot < self.silent_until {
            return Ok(None);
        }
        let [command_message, parameter_message] = self.messages();
        Ok(match (slot % COMMAND_SLOTS, slot % LIMIT_SLOTS) {
            (1, _) => {
                let content = command.encode(self.system, self.scales)?;
                let content = command_message.mark(content, self.scales);
                let frame = command_message.frame(content, &mut self.command);
                self.mistreated(frame)
            }
            (3, 3) => self.motor_limits(0)?,
            (3, 13) => self.link()?,
            (3, 23) => self.motor_limits(1)?,
            (5, _) => match self.requests.pop_front() {
                Some(request) => Some(parameter_message.frame(request.encode()?, &mut self.parameter)),
                None => None,
            },
            (2 | 4 | 6 | 8, _) => match self.extra.pop_front() {
                Some(Extra::Frame(frame)) => Some(frame),
                Some(Extra::Old(back)) => self.kept.iter().rev().nth(back).copied(),
                Some(Extra::OutOfRange) => {
                    let content = command_message.mark(TORQUE_OUT_OF_RANGE, self.scales);
                    Some(command_message.frame(content, &mut self.command))
                }
                None => None,
            },
            _ => None,
        })
    }

    /// The frame that is sent instead of a command.
    fn mistreated(&mut self, frame: Frame) -> Option<Frame> {
        if self.kept.len() == KEPT {
            self.kept.pop_front();
        }
        self.kept.push_back(frame);
        if self.corrupt > 0 {
            self.corrupt -= 1;
            // A different bit each time, CRC and counter included.
            self.turned = (self.turned + 13) % 64;
            let data = (u64::from_le_bytes(frame.data) ^ 1 << self.turned).to_le_bytes();
            return Some(Frame { data, ..frame });
        }
        if self.truncate > 0 {
            self.truncate -= 1;
            let mut data = frame.data;
            data[5..].fill(0);
            return Some(Frame { length: 5, data, ..frame });
        }
        match self.held.take() {
            None => Some(frame),
            Some(None) => {
                self.held = Some(Some(frame));
                None
            }
            Some(Some(late)) => {
                self.extra.push_front(Extra::Frame(late));
                Some(frame)
            }
        }
    }
}
