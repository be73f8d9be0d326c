//! The vehicle's computer: executes the lines, slot by slot.

use super::lines::Lines;
use super::listener::Listener;
use super::script::{self, Action, Expectation, Line};
use super::sender::{COMMAND_SLOTS, Sender, Spoken};
use super::system::System;
use crate::run::{Supervisor, Turn, bar};
use crate::speed_loop::SpeedLoop;
use anyhow::{Result, anyhow, bail};
use indicatif::ProgressBar;
use std::fmt::Write as _;
use tractive::drive::dual::Settings;
use tractive::machine::Ratings;
use tractive::protocol::{Frame, ParameterRequest, Zs9Link};

/// Slots for which an edge-triggered level is held: more than may be lost in a row.
const EDGE_SLOTS: u64 = 5 * COMMAND_SLOTS;
/// The time that passes after a typed line, so that its effect shows, in s.
const TYPED_S: f64 = 0.1;
/// Slots between two displays of the state.
const SHOWN_SLOTS: u64 = 100;
/// Length of a slot, in s.
const SLOT_S: f64 = 1e-3;
/// Half a slot, in s: a line that is due within it belongs to the slot.
const DUE_S: f64 = 0.5 * SLOT_S;

/// Linear ramps of both demands.
#[derive(Clone, Copy, Debug, Default)]
struct Ramp {
    from: [f64; 2],
    to: [f64; 2],
    begin_s: f64,
    over_s: f64,
}

impl Ramp {
    fn at(&self, t_s: f64) -> [f64; 2] {
        if t_s >= self.begin_s + self.over_s {
            return self.to;
        }
        let share = (t_s - self.begin_s) / self.over_s;
        [0, 1].map(|k| self.from[k] + (self.to[k] - self.from[k]) * share)
    }
}

/// The computer's state.
pub struct Talk {
    system: System,
    lines: Lines,
    next: Option<Line>,
    ended: bool,
    /// Time before which no line is executed.
    wait_until_s: f64,
    slot: u64,
    command: Spoken,
    /// Slots from which on charge, discharge and acknowledge are withdrawn.
    edges: [u64; 3],
    ramp: Ramp,
    speed_loop: Option<SpeedLoop>,
    inertia_kg_m2: f64,
    largest_nm: f64,
    /// The ZS9's until another link voltage is asked for.
    nominal_link: Zs9Link,
    loads_nm: [f64; 2],
    sender: Sender,
    /// The listener to the telemetry.
    pub listener: Listener,
    /// Rows of telemetry.csv.
    pub rows: Vec<Vec<String>>,
    /// Lines of frames.log.
    pub frames: String,
    /// Frames sent.
    pub sent: u64,
    /// Frames received.
    pub received: u64,
    /// The line that shows the drive's state while a script runs.
    shown: ProgressBar,
    /// Expectations so far.
    pub expectations: u32,
    /// Expectations that were not met.
    pub failures: Vec<String>,
}

impl Talk {
    /// A talk at rest: the speed loop is made for this inertia and for the largest torque, the steps of all signals for the ratings.
    pub fn new(system: System, lines: Lines, inertia_kg_m2: f64, ratings: &Ratings) -> Self {
        let scales = system.scales(ratings);
        let [_, _, link_ref_v] = Settings::link_range_v(&Settings::operator_ratings(ratings));
        Self {
            system,
            lines,
            next: None,
            ended: false,
            wait_until_s: 0.0,
            slot: 0,
            command: Spoken::default(),
            edges: [0; 3],
            ramp: Ramp::default(),
            speed_loop: None,
            inertia_kg_m2,
            largest_nm: ratings.max_torque_nm.into(),
            nominal_link: Zs9Link { link_ref_v, calibrate: false },
            loads_nm: [0.0; 2],
            sender: Sender::new(system, scales),
            listener: Listener::new(system, scales),
            rows: Vec::new(),
            frames: String::new(),
            sent: 0,
            received: 0,
            shown: bar(0, "{msg}"),
            expectations: 0,
            failures: Vec::new(),
        }
    }

    /// The message of the ZS9's link, sent from now on.
    fn link(&mut self) -> &mut Zs9Link {
        self.sender.link_ref.get_or_insert(self.nominal_link)
    }

    /// Logs a frame in candump's format: time, channel, identifier and bytes, T for frames to the drive, R for frames from it.
    fn log(&mut self, t_s: f64, frame: &Frame, direction: char) {
        let bytes = frame.data.iter().take(usize::from(frame.length));
        let bytes: String = bytes.map(|byte| format!("{byte:02X}")).collect();
        let _ = writeln!(self.frames, "({t_s:.6}) can0 {:03X}#{bytes} {direction}", frame.id);
    }

    /// Executes the lines that are due.
    fn read(&mut self, t_s: f64) -> Result<()> {
        while !self.ended && t_s + DUE_S >= self.wait_until_s {
            if self.next.is_none() {
                self.next = self.lines.take(self.system)?;
            }
            let Some(line) = self.next.take() else {
                self.ended = !self.lines.are_said();
                return Ok(());
            };
            if line.at_s.is_some_and(|at_s| t_s + DUE_S < at_s) {
                self.next = Some(line);
                return Ok(());
            }
            self.sender.check(&line)?;
            self.act(t_s, &line);
            if self.lines.are_typed() {
                self.wait_until_s = self.wait_until_s.max(t_s + TYPED_S);
            }
        }
        Ok(())
    }

    /// Executes a line now.
    ///
    /// # Errors
    /// Names the part that cannot be understood.
    pub fn say(&mut self, t_s: f64, text: &str) -> Result<()> {
        if let Some(line) = script::line(text, 1, self.system)? {
            self.sender.check(&line)?;
            self.act(t_s, &line);
        }
        Ok(())
    }

    /// Takes the rows since the last call, and clears the log.
    pub fn take_rows(&mut self) -> Vec<Vec<String>> {
        self.frames.clear();
        std::mem::take(&mut self.rows)
    }

    fn act(&mut self, t_s: f64, line: &Line) {
        let levels = &mut self.command.levels;
        match &line.action {
            Action::Enable { with_torque } => {
                (levels.enable, levels.with_torque) = (true, *with_torque);
            }
            Action::Disable => levels.enable = false,
            Action::Off(level) => levels.off = *level,
            Action::Coast(level) => levels.coast = *level,
            Action::Charge => self.raise(0),
            Action::Discharge => self.raise(1),
            Action::Acknowledge => self.raise(2),
            Action::Calibrate(level) if self.system == System::Zs9 => self.link().calibrate = *level,
            Action::Calibrate(level) => levels.calibrate = *level,
            Action::Torque(to, over_s) => {
                let from = self.command.torques_nm.map(f64::from);
                self.ramp = Ramp { from, to: *to, begin_s: t_s, over_s: *over_s };
                self.speed_loop = None;
                self.command.speeds_rpm = None;
            }
            Action::Speed(targets_rpm, slope_rpm_s) if self.system == System::Zs9 => {
                let from = match self.command.speeds_rpm {
                    Some(speeds_rpm) => speeds_rpm.map(f64::from),
                    None => self.listener.speeds_rpm().map(|speed_rpm| speed_rpm.map_or(0.0, f64::from)),
                };
                let way = (0..2).map(|k| (targets_rpm[k] - from[k]).abs()).fold(0.0, f64::max);
                self.ramp = Ramp { from, to: *targets_rpm, begin_s: t_s, over_s: way / slope_rpm_s };
                self.command.speeds_rpm = Some(from.map(|speed_rpm| speed_rpm as f32));
                self.command.torques_nm = [0.0; 2];
            }
            Action::Speed([target_rpm, _], slope_rpm_s) => {
                let [speed_rpm, _] = self.listener.speeds_rpm();
                let measured = speed_rpm.map_or(0.0, f64::from);
                let torque_nm = f64::from(self.command.torques_nm[0]);
                let (inertia, largest) = (self.inertia_kg_m2, self.largest_nm);
                let held = self.speed_loop.take();
                let mut held = held.unwrap_or_else(|| SpeedLoop::new(inertia, largest, measured, torque_nm));
                held.aim(*target_rpm, *slope_rpm_s);
                self.speed_loop = Some(held);
            }
            Action::Load(loads_nm) => self.loads_nm = *loads_nm,
            Action::Limits(motor, limits) => self.sender.torque_limits[*motor] = Some(*limits),
            Action::Link(link_ref_v) => self.link().link_ref_v = *link_ref_v as f32,
            Action::LinkLimits(limits) => self.sender.link = Some(*limits),
            Action::Read(parameter) => self.ask(ParameterRequest { parameter: *parameter, write: None }),
            Action::Write(parameter, value) => {
                self.ask(ParameterRequest { parameter: *parameter, write: Some(*value) });
            }
            Action::Corrupt(count) => self.sender.corrupt += count,
            Action::Truncate(count) => self.sender.truncate += count,
            Action::Replay(count) => self.sender.replay(*count),
            Action::Reorder => self.sender.held = Some(None),
            Action::OutOfRange(count) => self.sender.out_of_range(*count),
            Action::Unknown(count) => self.sender.unknown(*count),
            Action::Drop(ms) => self.sender.silent_until = self.slot + u64::from(*ms),
            Action::Wait(wait_s) => self.wait_until_s = t_s + wait_s,
            Action::Expect(expectation) => self.expect(line, expectation),
            Action::End => self.ended = true,
        }
    }

    /// Holds a level for a while.
    fn raise(&mut self, which: usize) {
        self.edges[which] = self.slot + EDGE_SLOTS;
    }

    /// Puts a read first, since the first request after a silence only sets the drive's counter.
    fn ask(&mut self, request: ParameterRequest) {
        self.sender.requests.extend([ParameterRequest { write: None, ..request }, request]);
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
            match (&mut self.speed_loop, &mut self.command) {
                (Some(held), command) => {
                    let [speed_rpm, _] = self.listener.speeds_rpm();
                    let measured = speed_rpm.map_or(0.0, f64::from);
                    command.torques_nm[0] = held.step(measured, COMMAND_SLOTS as f64 * SLOT_S) as f32;
                }
                (None, Spoken { speeds_rpm: Some(speeds_rpm), .. }) => {
                    *speeds_rpm = self.ramp.at(t_s).map(|rpm| rpm as f32);
                }
                (None, command) => command.torques_nm = self.ramp.at(t_s).map(|nm| nm as f32),
            }
        }
        let [charge, discharge, acknowledge] = self.edges.map(|until| self.slot < until);
        let levels = &mut self.command.levels;
        (levels.charge, levels.discharge, levels.acknowledge) = (charge, discharge, acknowledge);
    }

    /// One line about the drive.
    pub fn state(&self, t_s: f64) -> String {
        let say = |column: &str| self.listener.value(column);
        let both = |what: &str, unit: &str| match self.system {
            System::Pmasynrm => say(&format!("{what}_{unit}")),
            System::Zs9 => {
                format!("{}, {}", say(&format!("{what}1_{unit}")), say(&format!("{what}2_{unit}")))
            }
        };
        format!(
            "{t_s:8.3} s  {:<9} {:<11} {:>8} r/min  {:>8} N·m  {:>7} V  {} {}",
            say("state"),
            say("listening"),
            both("speed", "rpm"),
            both("torque", "nm"),
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
        if let Some(foreign) = &self.listener.foreign {
            bail!("{foreign}");
        }
        let done = self.expectations;
        if !self.lines.are_typed() && self.slot.is_multiple_of(SHOWN_SLOTS) {
            self.shown.set_message(self.state(t_s));
        }
        let waited = self.lines.are_typed() && t_s + DUE_S >= self.wait_until_s;
        if waited && self.slot > 0 {
            crate::say!("{}", self.state(t_s));
        }
        self.read(t_s)?;
        if self.lines.are_typed() && self.expectations > done {
            let outcome = self.failures.last().map_or("as expected", String::as_str);
            crate::say!("{outcome}");
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
        if self.ended {
            self.shown.finish_and_clear();
        }
        Ok(Turn { frame, loads_nm: self.loads_nm, done: self.ended })
    }

    fn is_typed(&self) -> bool {
        self.lines.are_typed()
    }
}
