//! The script: a command a line, `[SECONDS] COMMAND …`.

use super::system::System;
use anyhow::{Context, Result, bail};
use tractive::protocol::{LinkLimits, TorqueLimits};

/// The action of a line.
#[derive(Clone, Debug, PartialEq)]
pub enum Action {
    /// Enables; a torque may be demanded already.
    Enable {
        /// The permission for a torque other than zero at the same time.
        with_torque: bool,
    },
    /// Stops: torque to zero, gates off.
    Disable,
    /// Gates off at once, or no longer.
    Off(bool),
    /// Coasts, or no longer.
    Coast(bool),
    /// Charges the link.
    Charge,
    /// Discharges the link.
    Discharge,
    /// Acknowledges the fault.
    Acknowledge,
    /// Calibrates the zero of the position sensor, or no longer.
    Calibrate(bool),
    /// Torques, in N·m, along linear ramps of this many seconds; for one motor only the first.
    Torque([f64; 2], f64),
    /// Speeds in r/min, along linear ramps of this many r/min per second: for one motor only the first, held by a speed loop here; for
    /// two held by the drive's own loops.
    Speed([f64; 2], f64),
    /// The machines' loads against forward rotation, in N·m.
    Load([f64; 2]),
    /// Limits of torque and speed, of motor 0 or 1.
    Limits(usize, TorqueLimits),
    /// Link voltage outside shoot-through, in V.
    Link(f64),
    /// Limits of the link.
    LinkLimits(LinkLimits),
    /// Reads a parameter.
    Read(u8),
    /// Writes a parameter.
    Write(u8, f32),
    /// Flips a bit in each command, for this many commands.
    Corrupt(u32),
    /// Cuts each command short, for this many commands.
    Truncate(u32),
    /// Sends this many old commands again.
    Replay(u32),
    /// Sends the next two commands in the wrong order.
    Reorder,
    /// Sends this many well-protected commands with a torque out of range.
    OutOfRange(u32),
    /// Sends this many frames with an identifier that the protocol does not have.
    Unknown(u32),
    /// Sends nothing for this many milliseconds.
    Drop(u32),
    /// Waits, in s.
    Wait(f64),
    /// Compares what the telemetry says now.
    Expect(Expectation),
    /// Ends the run.
    End,
}

/// The expectation about the telemetry.
#[derive(Clone, Debug, PartialEq)]
pub struct Expectation {
    /// A column of telemetry.csv.
    pub name: String,
    /// The value that it should have.
    pub value: String,
    /// Largest deviation of a number.
    pub within: f64,
}

/// A line.
#[derive(Clone, Debug, PartialEq)]
pub struct Line {
    /// Its number, from 1 on.
    pub number: usize,
    /// The time at which it is due, in s; `None`: after the one before.
    pub at_s: Option<f64>,
    /// Its action.
    pub action: Action,
    /// The line itself.
    pub text: String,
}

/// The words of a line.
pub struct Words<'a> {
    rest: std::str::SplitWhitespace<'a>,
}

impl<'a> Words<'a> {
    fn next(&mut self, what: &str) -> Result<&'a str> {
        self.rest.next().with_context(|| format!("{what} is missing"))
    }

    fn number(&mut self, what: &str, low: f64, high: f64) -> Result<f64> {
        let word = self.next(what)?;
        match word.parse::<f64>() {
            Ok(value) if value >= low && value <= high => Ok(value),
            _ => bail!("{what} {word}: must be a number from {low} to {high}"),
        }
    }

    /// A number for each of this many motors.
    fn each(&mut self, what: &str, motors: usize, [low, high]: [f64; 2]) -> Result<[f64; 2]> {
        let mut each = [0.0; 2];
        for number in each.iter_mut().take(motors) {
            *number = self.number(what, low, high)?;
        }
        Ok(each)
    }

    fn torque(&mut self, motors: usize) -> Result<Action> {
        Ok(Action::Torque(self.each("torque", motors, TORQUE)?, self.after("over", 0.0, 0.0, 1e4)?))
    }

    fn speed(&mut self, motors: usize) -> Result<Action> {
        Ok(Action::Speed(self.each("speed", motors, SPEED)?, self.after("at", 500.0, 1.0, 1e5)?))
    }

    fn load(&mut self, motors: usize) -> Result<Action> {
        Ok(Action::Load(self.each("load", motors, TORQUE)?))
    }

    /// The limits of motor 0 or 1.
    fn limits(&mut self, motor: usize) -> Result<Action> {
        let [_, high_nm] = TORQUE;
        let limits = TorqueLimits {
            motoring_nm: self.number("motoring torque", 0.0, high_nm)? as f32,
            braking_nm: self.number("braking torque", 0.0, high_nm)? as f32,
            speed_rpm: self.number("speed", 0.5, 30_000.0)? as f32,
        };
        Ok(Action::Limits(motor, limits))
    }

    fn link_limits(&mut self) -> Result<Action> {
        let [low_v, high_v] =
            [self.number("low voltage", 0.0, MOST_V)?, self.number("high voltage", 0.0, MOST_V)?];
        if low_v >= high_v {
            bail!("link limits {low_v} and {high_v}: the first must be lower");
        }
        Ok(Action::LinkLimits(LinkLimits { low_v: low_v as f32, high_v: high_v as f32 }))
    }

    fn parameter(&mut self) -> Result<u8> {
        Ok(self.number("parameter", 0.0, 255.0)?.round() as u8)
    }

    fn enable(&mut self) -> Result<Action> {
        match self.rest.next() {
            None => Ok(Action::Enable { with_torque: false }),
            Some("with-torque") => Ok(Action::Enable { with_torque: true }),
            Some(other) => bail!("{other}: only `with-torque` may stand here"),
        }
    }

    fn expectation(&mut self) -> Result<Expectation> {
        let (name, value) = (self.next("column")?.to_owned(), self.next("value")?.to_owned());
        Ok(Expectation { name, value, within: self.after("within", 0.0, 0.0, f64::MAX)? })
    }

    fn count(&mut self, what: &str) -> Result<u32> {
        Ok(self.number(what, 1.0, 1e6)?.round() as u32)
    }

    /// The number after an optional word, or the default without it.
    fn after(&mut self, word: &str, otherwise: f64, low: f64, high: f64) -> Result<f64> {
        match self.rest.next() {
            None => Ok(otherwise),
            Some(found) if found == word => self.number(word, low, high),
            Some(found) => bail!("{found}: only `{word}` may stand here"),
        }
    }

    fn switch(&mut self) -> Result<bool> {
        match self.next("on or off")? {
            "on" => Ok(true),
            "off" => Ok(false),
            other => bail!("{other}: must be on or off"),
        }
    }
}

/// A command with its arguments, as the help shows it, and its parser.
pub type Command = (&'static str, fn(&mut Words) -> Result<Action>);

/// The ZS9's commands, in place of the PMaSynRM drive's.
pub static ZS9_COMMANDS: [Command; 5] = [
    ("torque NM NM [over SECONDS]", |words| words.torque(2)),
    ("speed RPM RPM [at RPM_PER_SECOND]", |words| words.speed(2)),
    ("load NM NM", |words| words.load(2)),
    ("limits 1|2 MOTORING_NM BRAKING_NM SPEED_RPM", |words| {
        let motor = words.number("motor", 1.0, 2.0)?.round() as usize;
        words.limits(motor - 1)
    }),
    ("link VOLTS", |words| Ok(Action::Link(words.number("link voltage", 0.0, MOST_V)?))),
];

/// Every command.
pub static COMMANDS: [Command; 25] = [
    ("enable [with-torque]", |words| words.enable()),
    ("disable", |_| Ok(Action::Disable)),
    ("off on|off", |words| Ok(Action::Off(words.switch()?))),
    ("coast on|off", |words| Ok(Action::Coast(words.switch()?))),
    ("charge", |_| Ok(Action::Charge)),
    ("discharge", |_| Ok(Action::Discharge)),
    ("acknowledge", |_| Ok(Action::Acknowledge)),
    ("calibrate on|off", |words| Ok(Action::Calibrate(words.switch()?))),
    ("torque NM [over SECONDS]", |words| words.torque(1)),
    ("speed RPM [at RPM_PER_SECOND]", |words| words.speed(1)),
    ("load NM", |words| words.load(1)),
    ("limits MOTORING_NM BRAKING_NM SPEED_RPM", |words| words.limits(0)),
    ("link-limits LOW_V HIGH_V", |words| words.link_limits()),
    ("read PARAMETER", |words| Ok(Action::Read(words.parameter()?))),
    ("write PARAMETER VALUE", |words| {
        let parameter = words.parameter()?;
        Ok(Action::Write(parameter, words.number("value", f32::MIN.into(), f32::MAX.into())? as f32))
    }),
    ("corrupt COUNT", |words| Ok(Action::Corrupt(words.count("count")?))),
    ("truncate COUNT", |words| Ok(Action::Truncate(words.count("count")?))),
    ("replay COUNT", |words| Ok(Action::Replay(words.count("count")?))),
    ("reorder", |_| Ok(Action::Reorder)),
    ("out-of-range COUNT", |words| Ok(Action::OutOfRange(words.count("count")?))),
    ("unknown COUNT", |words| Ok(Action::Unknown(words.count("count")?))),
    ("drop MILLISECONDS", |words| Ok(Action::Drop(words.count("milliseconds")?))),
    ("wait SECONDS", |words| Ok(Action::Wait(words.number("seconds", 0.0, 1e5)?))),
    ("expect COLUMN VALUE [within TOLERANCE]", |words| Ok(Action::Expect(words.expectation()?))),
    ("end", |_| Ok(Action::End)),
];

/// Ranges of torques, in N·m, and of speeds, in r/min, in the usual steps.
pub(super) const TORQUE: [f64; 2] = [-3_000.0, 3_000.0];
pub(super) const SPEED: [f64; 2] = [-16_000.0, 16_000.0];
/// Highest voltage that a signal carries, in V, likewise.
pub(super) const MOST_V: f64 = 6_500.0;

/// The ZS9 has no such command.
const LINK_LIMITS: &str = "link-limits";

/// The word that a command begins with.
fn word(usage: &str) -> &str {
    usage.split(' ').next().unwrap_or(usage)
}

/// The commands of a system.
fn commands(system: System) -> impl Iterator<Item = &'static Command> {
    let own: &'static [Command] = if system == System::Zs9 { &ZS9_COMMANDS } else { &[] };
    let is_replaced = move |usage| {
        !own.is_empty() && (word(usage) == LINK_LIMITS || own.iter().any(|(own, _)| word(own) == word(usage)))
    };
    COMMANDS.iter().filter(move |(usage, _)| !is_replaced(usage)).chain(own)
}

fn action(name: &str, words: &mut Words, system: System) -> Result<Action> {
    match commands(system).find(|(usage, _)| word(usage) == name) {
        Some((_, read)) => read(words),
        None if name == LINK_LIMITS => bail!("{name}: the ZS9 has none; `link` is its voltage"),
        None => {
            let usages: Vec<_> = commands(system).map(|(usage, _)| *usage).collect();
            bail!("{name}: must be one of: {}", usages.join(", "))
        }
    }
}

/// One line; `None` if there is nothing on it. The error names the line, the word, and what is allowed.
pub fn line(text: &str, number: usize, system: System) -> Result<Option<Line>> {
    let columns = system.columns();
    let text = text.split('#').next().unwrap_or_default().trim();
    let mut words = Words { rest: text.split_whitespace() };
    let Some(first) = words.rest.next() else { return Ok(None) };
    let mut parse = || -> Result<Line> {
        let at_s = first.parse::<f64>().ok();
        if at_s.is_some_and(|at_s| !(0.0..=1e6).contains(&at_s)) {
            bail!("time {first}: must be 0 to 1000000 s");
        }
        let name = if at_s.is_some() { words.next("a command")? } else { first };
        let action = action(name, &mut words, system)?;
        if let Some(extra) = words.rest.next() {
            bail!("{extra}: nothing more is allowed here");
        }
        if let Action::Expect(Expectation { name, .. }) = &action
            && !columns.contains(&name.as_str())
        {
            bail!("{name}: must be one of {}", columns.join(", "));
        }
        Ok(Line { number, at_s, action, text: text.to_owned() })
    };
    parse().with_context(|| format!("line {number}")).map(Some)
}

/// A whole script. Times that go back are an error too.
pub fn script(text: &str, system: System) -> Result<Vec<Line>> {
    let mut lines = Vec::new();
    let mut last_s = 0.0;
    for (index, text) in text.lines().enumerate() {
        let Some(line) = line(text, index + 1, system)? else { continue };
        if let Some(at_s) = line.at_s {
            if at_s < last_s {
                bail!("line {}: time {at_s} is before {last_s}", line.number);
            }
            last_s = at_s;
        }
        lines.push(line);
    }
    Ok(lines)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_command_of_the_help_is_understood() {
        let all = COMMANDS.map(|(usage, _)| (usage, System::Pmasynrm));
        for (usage, system) in all.into_iter().chain(ZS9_COMMANDS.map(|(usage, _)| (usage, System::Zs9))) {
            let full = usage
                .replace(['[', ']'], "")
                .replace("on|off", "on")
                .replace("1|2", "2")
                .replace("LOW_V HIGH_V", "900 1800")
                .replace("COLUMN VALUE", "state running");
            let words = full.split_whitespace().map(|word| {
                let is_value = word.chars().all(|c| c.is_ascii_uppercase() || c == '_');
                if is_value { "7" } else { word }
            });
            let text = words.collect::<Vec<_>>().join(" ");
            assert!(line(&text, 1, system).unwrap().is_some(), "{text}");
        }
    }

    #[test]
    fn times_comments_and_empty_lines() {
        let script =
            script("# begin\n\n0.5 enable\ntorque 100 over 2 # pull\n1 end\n", System::Pmasynrm).unwrap();
        let got: Vec<_> = script.iter().map(|line| (line.number, line.at_s, line.action.clone())).collect();
        assert_eq!(
            got,
            [
                (3, Some(0.5), Action::Enable { with_torque: false }),
                (4, None, Action::Torque([100.0, 0.0], 2.0)),
                (5, Some(1.0), Action::End),
            ]
        );
    }

    #[test]
    fn two_motors_have_two_numbers() {
        let got = |text| line(text, 1, System::Zs9).map(|line| line.map(|line| line.action));
        assert_eq!(got("torque 20 -30 over 1").unwrap(), Some(Action::Torque([20.0, -30.0], 1.0)));
        assert_eq!(got("speed 800 -800").unwrap(), Some(Action::Speed([800.0, -800.0], 500.0)));
        for wrong in ["torque 20", "limits 3 1 1 1", "link-limits 300 400", "expect speed_rpm 0"] {
            assert!(got(wrong).is_err(), "{wrong}");
        }
        assert!(line("link 667", 1, System::Pmasynrm).is_err());
        let refused = format!("{:#}", got("push 3").unwrap_err());
        for command in ["enable", "torque NM NM [over", "link VOLTS", "limits 1|2"] {
            assert!(refused.contains(command), "{refused}");
        }
        assert!(!refused.contains("link-limits") && !refused.contains("torque NM [over"), "{refused}");
    }

    #[test]
    fn what_is_wrong_is_named() {
        for (text, message) in [
            ("pull 3", "line 1: pull: must be one of: enable"),
            ("torque", "line 1: torque is missing"),
            ("torque x", "line 1: torque x: must be a number from -3000 to 3000"),
            ("torque nan", "line 1: torque nan: must be a number from -3000 to 3000"),
            ("torque 3001", "line 1: torque 3001: must be a number from -3000 to 3000"),
            ("torque 1 for 2", "line 1: for: only `over` may stand here"),
            ("-1 enable", "line 1: time -1: must be 0 to 1000000 s"),
            ("2 end\n1 end", "line 2: time 1 is before 2"),
            ("expect colour red", "line 1: colour: must be one of t_s, state,"),
            ("end now", "line 1: now: nothing more is allowed here"),
            ("link-limits 1800 900", "line 1: link limits 1800 and 900: the first must be lower"),
        ] {
            let error = format!("{:#}", script(text, System::Pmasynrm).unwrap_err());
            assert!(error.starts_with(message), "{error}");
        }
    }
}
