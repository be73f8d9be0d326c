//! The vehicle's computer: does what the lines say, slot by slot.

use super::lines::Lines;
use super::listener::{COLUMNS, Listener};
use super::script::{Action, Expectation, Line};
use super::sender::{COMMAND_SLOTS, Sender};
use super::speed_loop::SpeedLoop;
use crate::run::{Supervisor, Turn};
use anyhow::{Result, anyhow};
use std::fmt::Write as _;
use tractive::protocol::{Command, Frame, ParameterRequest};

/// Slots for which a level stands whose edge counts: more than may be lost in a row.
const EDGE_SLOTS: u64 = 5 * COMMAND_SLOTS;
/// What passes after a typed line, so that its effect shows, in s.
const TYPED_S: f64 = 0.1;
/// Length of a slot, in s.
const SLOT_S: f64 = 1e-3;
/// Half of it: what is due in a slot.
const DUE_S: f64 = 0.5 * SLOT_S;

/// The torque's straight line.
#[derive(Clone, Copy, Debug)]
struct Ramp {
    from_nm: f64,
    to_nm: f64,
    begin_s: f64,
    over_s: f64,
}

impl Ramp {
    fn at(&self, t_s: f64) -> f64 {
        if t_s >= self.begin_s + self.over_s {
            return self.to_nm;
        }
        self.from_nm + (self.to_nm - self.from_nm) * (t_s - self.begin_s) / self.over_s
    }
}

/// The computer's state.
pub struct Talk {
    lines: Lines,
    next: Option<Line>,
    ended: bool,
    /// Before this time no line is done.
    wait_until_s: f64,
    slot: u64,
    command: Command,
    /// Slots in which charge, discharge and acknowledge are taken back.
    edges: [u64; 3],
    ramp: Ramp,
    speed_loop: Option<SpeedLoop>,
    inertia_kg_m2: f64,
    largest_nm: f64,
    load_nm: f64,
    sender: Sender,
    /// What the telemetry says.
    pub listener: Listener,
    /// Rows of telemetry.csv.
    pub rows: Vec<[String; COLUMNS.len()]>,
    /// Lines of frames.log.
    pub frames: String,
    /// Frames sent.
    pub sent: u64,
    /// Frames received.
    pub received: u64,
    /// Expectations so far.
    pub expectations: u32,
    /// Those that were not met.
    pub failures: Vec<String>,
}

impl Talk {
    /// At rest; the speed loop is made for this inertia and torque.
    pub fn new(lines: Lines, inertia_kg_m2: f64, largest_nm: f64) -> Self {
        Self {
            lines,
            next: None,
            ended: false,
            wait_until_s: 0.0,
            slot: 0,
            command: Command::default(),
            edges: [0; 3],
            ramp: Ramp { from_nm: 0.0, to_nm: 0.0, begin_s: 0.0, over_s: 0.0 },
            speed_loop: None,
            inertia_kg_m2,
            largest_nm,
            load_nm: 0.0,
            sender: Sender::default(),
            listener: Listener::default(),
            rows: Vec::new(),
            frames: String::new(),
            sent: 0,
            received: 0,
            expectations: 0,
            failures: Vec::new(),
        }
    }

    /// As candump logs: time, channel, identifier and bytes, T for what is sent to the drive, R for what it sends.
    fn log(&mut self, t_s: f64, frame: &Frame, direction: char) {
        let bytes = frame.data.iter().take(usize::from(frame.length));
        let bytes: String = bytes.map(|byte| format!("{byte:02X}")).collect();
        let _ = writeln!(self.frames, "({t_s:.6}) can0 {:03X}#{bytes} {direction}", frame.id);
    }

    /// Does the lines that are due.
    fn read(&mut self, t_s: f64) -> Result<()> {
        while !self.ended && t_s + DUE_S >= self.wait_until_s {
            if self.next.is_none() {
                self.next = self.lines.next()?;
            }
            let Some(line) = self.next.take() else {
                self.ended = true;
                return Ok(());
            };
            if line.at_s.is_some_and(|at_s| t_s + DUE_S < at_s) {
                self.next = Some(line);
                return Ok(());
            }
            self.act(t_s, &line);
            if self.lines.are_typed() {
                self.wait_until_s = self.wait_until_s.max(t_s + TYPED_S);
            }
        }
        Ok(())
    }

    fn act(&mut self, t_s: f64, line: &Line) {
        let command = &mut self.command;
        match &line.action {
            Action::Enable { with_torque } => {
                (command.enable, command.with_torque) = (true, *with_torque);
            }
            Action::Disable => command.enable = false,
            Action::Off(level) => command.off = *level,
            Action::Coast(level) => command.coast = *level,
            Action::Charge => self.raise(0),
            Action::Discharge => self.raise(1),
            Action::Acknowledge => self.raise(2),
            Action::Torque(to_nm, over_s) => {
                let from_nm = f64::from(command.torque_nm);
                self.ramp = Ramp { from_nm, to_nm: *to_nm, begin_s: t_s, over_s: *over_s };
                self.speed_loop = None;
            }
            Action::Speed(target_rpm, slope_rpm_s) => {
                let measured = self.listener.measured.speed_rpm.map_or(0.0, f64::from);
                let torque_nm = f64::from(command.torque_nm);
                let (inertia, largest) = (self.inertia_kg_m2, self.largest_nm);
                let held = self.speed_loop.take();
                let mut held = held.unwrap_or_else(|| SpeedLoop::new(inertia, largest, measured, torque_nm));
                held.aim(*target_rpm, *slope_rpm_s);
                self.speed_loop = Some(held);
            }
            Action::Load(load_nm) => self.load_nm = *load_nm,
            Action::Limits(limits) => self.sender.torque_limits = Some(*limits),
            Action::LinkLimits(limits) => self.sender.link = Some(*limits),
            Action::Read(parameter) => self.ask(ParameterRequest { parameter: *parameter, write: None }),
            Action::Write(parameter, value) => {
                self.ask(ParameterRequest { parameter: *parameter, write: Some(*value) });
            }
            Action::Corrupt(count) => self.sender.corrupt(*count),
            Action::Truncate(count) => self.sender.truncate(*count),
            Action::Replay(count) => self.sender.replay(*count),
            Action::Reorder => self.sender.reorder(),
            Action::OutOfRange(count) => self.sender.out_of_range(*count),
            Action::Unknown(count) => self.sender.unknown(*count),
            Action::Drop(ms) => self.sender.be_silent_until(self.slot + u64::from(*ms)),
            Action::Wait(wait_s) => self.wait_until_s = t_s + wait_s,
            Action::Expect(expectation) => self.expect(line, expectation),
            Action::End => self.ended = true,
        }
    }

    /// A level stands for a while.
    fn raise(&mut self, which: usize) {
        self.edges[which] = self.slot + EDGE_SLOTS;
    }

    /// The first request after a silence only sets the drive's counter, so something is read before.
    fn ask(&mut self, request: ParameterRequest) {
        self.sender.request(ParameterRequest { write: None, ..request });
        self.sender.request(request);
    }

    fn expect(&mut self, line: &Line, expectation: &Expectation) {
        let Expectation { name, value, within } = expectation;
        self.expectations += 1;
        let found = self.listener.value(name);
        let numbers = found.parse::<f64>().ok().zip(value.parse::<f64>().ok());
        let met = match numbers {
            Some((found, wanted)) => (found - wanted).abs() <= *within,
            None => found == *value || (value == "none" && found.is_empty()),
        };
        if !met {
            let found = if found.is_empty() { "none" } else { &found };
            self.failures.push(format!("line {}: {}: it is {found}", line.number, line.text));
        }
    }

    /// Torque and levels of this slot.
    fn shape(&mut self, t_s: f64) {
        if self.slot % COMMAND_SLOTS == 1 {
            let torque_nm = match &mut self.speed_loop {
                Some(held) => {
                    let measured = self.listener.measured.speed_rpm.map_or(0.0, f64::from);
                    held.step(measured, COMMAND_SLOTS as f64 * SLOT_S)
                }
                None => self.ramp.at(t_s),
            };
            self.command.torque_nm = torque_nm as f32;
        }
        let [charge, discharge, acknowledge] = self.edges.map(|until| self.slot < until);
        let command = &mut self.command;
        (command.charge, command.discharge, command.acknowledge) = (charge, discharge, acknowledge);
    }

    /// One line about the drive.
    pub fn state(&self, t_s: f64) -> String {
        let say = |column: &str| self.listener.value(column);
        format!(
            "{t_s:8.3} s  {:<9} {:<11} {:>8} r/min  {:>8} N·m  {:>7} V  {} {}",
            say("state"),
            say("listening"),
            say("speed_rpm"),
            say("torque_nm"),
            say("link_v"),
            say("fault"),
            say("refusal"),
        )
    }
}

impl Supervisor for Talk {
    fn hear(&mut self, t_s: f64, frame: &Frame) {
        self.received += 1;
        self.log(t_s, frame, 'R');
        if self.listener.receive(frame) {
            self.rows.push(self.listener.row(t_s));
        }
    }

    fn slot(&mut self, t_s: f64) -> Result<Turn> {
        let done = self.expectations;
        let waited = self.lines.are_typed() && t_s + DUE_S >= self.wait_until_s;
        if waited && self.slot > 0 {
            println!("{}", self.state(t_s));
        }
        self.read(t_s)?;
        if self.lines.are_typed() && self.expectations > done {
            let outcome = self.failures.last().map_or("as expected", String::as_str);
            println!("{outcome}");
        }
        self.shape(t_s);
        let frame = self
            .sender
            .step(self.slot, &self.command)
            .map_err(|_| anyhow!("a value is beyond what its signal can carry"))?;
        if let Some(frame) = &frame {
            self.sent += 1;
            self.log(t_s, frame, 'T');
        }
        self.slot += 1;
        Ok(Turn { frame, load_nm: self.load_nm, done: self.ended })
    }

    fn is_typed(&self) -> bool {
        self.lines.are_typed()
    }
}
