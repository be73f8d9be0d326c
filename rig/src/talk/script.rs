//! The script: a command a line, `[SECONDS] COMMAND …`.

use super::system::System;
use anyhow::{Context, Result, bail};
use tractive::protocol::{LinkLimits, TorqueLimits};

/// What a line does.
#[derive(Clone, Debug, PartialEq)]
pub enum Action {
    /// Enables; with a torque that may stand already.
    Enable {
        /// Whether a torque other than zero may come with it.
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
    /// Torques, in N·m, along straight lines of this many seconds; of one motor the first.
    Torque([f64; 2], f64),
    /// Speeds in r/min, along straight lines of so many r/min per second: of one motor the first, held by a speed loop here; of two
    /// held by the drive's own.
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
    /// Turns a bit in each of the next so many commands.
    Corrupt(u32),
    /// Cuts each of the next so many commands short.
    Truncate(u32),
    /// Sends so many old commands again.
    Replay(u32),
    /// Sends the next two commands in the wrong order.
    Reorder,
    /// Sends so many well-protected commands with a torque out of range.
    OutOfRange(u32),
    /// Sends so many frames with an identifier that is none of the protocol's.
    Unknown(u32),
    /// Sends nothing for so many milliseconds.
    Drop(u32),
    /// Waits, in s.
    Wait(f64),
    /// Compares what the telemetry says now.
    Expect(Expectation),
    /// Ends the run.
    End,
}

/// What is expected of the telemetry.
#[derive(Clone, Debug, PartialEq)]
pub struct Expectation {
    /// A column of telemetry.csv.
    pub name: String,
    /// What it should be.
    pub value: String,
    /// By how much a number may differ.
    pub within: f64,
}

/// A line.
#[derive(Clone, Debug, PartialEq)]
pub struct Line {
    /// Its number, from 1 on.
    pub number: usize,
    /// When it is due, in s; `None`: after the one before.
    pub at_s: Option<f64>,
    /// What it does.
    pub action: Action,
    /// The line itself.
    pub text: String,
}

/// The words of a line.
struct Words<'a> {
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

    /// A number for each motor.
    fn each(&mut self, what: &str, system: System, [low, high]: [f64; 2]) -> Result<[f64; 2]> {
        let first = self.number(what, low, high)?;
        let second = match system {
            System::Pmasynrm => 0.0,
            System::Zs9 => self.number(what, low, high)?,
        };
        Ok([first, second])
    }

    fn count(&mut self, what: &str) -> Result<u32> {
        Ok(self.number(what, 1.0, 1e6)?.round() as u32)
    }

    /// The number after a word that may be there, or what holds without it.
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

/// What the ZS9 has in the place of the PMaSynRM drive's.
pub const ZS9_COMMANDS: [&str; 5] = [
    "torque NM NM [over SECONDS]",
    "speed RPM RPM [at RPM_PER_SECOND]",
    "load NM NM",
    "limits 1|2 MOTORING_NM BRAKING_NM SPEED_RPM",
    "link VOLTS",
];

/// Every command with what follows it, as the help shows it.
pub const COMMANDS: [&str; 24] = [
    "enable [with-torque]",
    "disable",
    "off on|off",
    "coast on|off",
    "charge",
    "discharge",
    "acknowledge",
    "torque NM [over SECONDS]",
    "speed RPM [at RPM_PER_SECOND]",
    "load NM",
    "limits MOTORING_NM BRAKING_NM SPEED_RPM",
    "link-limits LOW_V HIGH_V",
    "read PARAMETER",
    "write PARAMETER VALUE",
    "corrupt COUNT",
    "truncate COUNT",
    "replay COUNT",
    "reorder",
    "out-of-range COUNT",
    "unknown COUNT",
    "drop MILLISECONDS",
    "wait SECONDS",
    "expect COLUMN VALUE [within TOLERANCE]",
    "end",
];

const TORQUE: [f64; 2] = [-3_000.0, 3_000.0];
const SPEED: [f64; 2] = [-16_000.0, 16_000.0];

fn action(name: &str, words: &mut Words, system: System) -> Result<Action> {
    let [_, high_nm] = TORQUE;
    Ok(match name {
        "enable" => match words.rest.next() {
            None => Action::Enable { with_torque: false },
            Some("with-torque") => Action::Enable { with_torque: true },
            Some(other) => bail!("{other}: only `with-torque` may stand here"),
        },
        "disable" => Action::Disable,
        "off" => Action::Off(words.switch()?),
        "coast" => Action::Coast(words.switch()?),
        "charge" => Action::Charge,
        "discharge" => Action::Discharge,
        "acknowledge" => Action::Acknowledge,
        "torque" => {
            Action::Torque(words.each("torque", system, TORQUE)?, words.after("over", 0.0, 0.0, 1e4)?)
        }
        "speed" => Action::Speed(words.each("speed", system, SPEED)?, words.after("at", 500.0, 1.0, 1e5)?),
        "load" => Action::Load(words.each("load", system, TORQUE)?),
        "limits" => {
            let motor = match system {
                System::Pmasynrm => 1,
                System::Zs9 => words.number("motor", 1.0, 2.0)?.round() as usize,
            };
            let limits = TorqueLimits {
                motoring_nm: words.number("motoring torque", 0.0, high_nm)? as f32,
                braking_nm: words.number("braking torque", 0.0, high_nm)? as f32,
                speed_rpm: words.number("speed", 0.5, 30_000.0)? as f32,
            };
            Action::Limits(motor - 1, limits)
        }
        "link" if system == System::Zs9 => Action::Link(words.number("link voltage", 0.0, 6_500.0)?),
        "link-limits" if system == System::Zs9 => {
            bail!("link-limits: the ZS9 has none; `link` is its voltage")
        }
        "link-limits" => {
            let low_v = words.number("low voltage", 0.0, 6_500.0)?;
            let high_v = words.number("high voltage", 0.0, 6_500.0)?;
            if low_v >= high_v {
                bail!("link limits {low_v} and {high_v}: the first must be lower");
            }
            Action::LinkLimits(LinkLimits { low_v: low_v as f32, high_v: high_v as f32 })
        }
        "read" => Action::Read(words.number("parameter", 0.0, 255.0)?.round() as u8),
        "write" => {
            let parameter = words.number("parameter", 0.0, 255.0)?.round() as u8;
            Action::Write(parameter, words.number("value", f64::from(f32::MIN), f64::from(f32::MAX))? as f32)
        }
        "corrupt" => Action::Corrupt(words.count("count")?),
        "truncate" => Action::Truncate(words.count("count")?),
        "replay" => Action::Replay(words.count("count")?),
        "reorder" => Action::Reorder,
        "out-of-range" => Action::OutOfRange(words.count("count")?),
        "unknown" => Action::Unknown(words.count("count")?),
        "drop" => Action::Drop(words.count("milliseconds")?),
        "wait" => Action::Wait(words.number("seconds", 0.0, 1e5)?),
        "expect" => Action::Expect(Expectation {
            name: words.next("column")?.to_owned(),
            value: words.next("value")?.to_owned(),
            within: words.after("within", 0.0, 0.0, f64::MAX)?,
        }),
        "end" => Action::End,
        other => bail!("{other}: must be one of: {}", COMMANDS.join(", ")),
    })
}

/// One line; `None` if there is nothing on it.
///
/// # Errors
/// Names the line, the word, and what is allowed.
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

/// A whole script.
///
/// # Errors
/// As [`line()`], and times that go back.
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
        let all = COMMANDS.map(|usage| (usage, System::Pmasynrm));
        for (usage, system) in all.into_iter().chain(ZS9_COMMANDS.map(|usage| (usage, System::Zs9))) {
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
