//! The supervisor that relays the telemetry to the page, and the page's lines to the drive if commands are switched on.

use super::shared::{Row, Shared};
use crate::run::{Supervisor, Turn};
use crate::talk::{Lines, System, Talk};
use anyhow::Result;
use serde_json::{Value, json};
use std::sync::Arc;
use std::time::{Duration, Instant};
use tractive::machine::Ratings;
use tractive::modulation::Mode;
use tractive::nine_switch::Scheme;
use tractive::protocol::Frame;

/// The page's columns with those of the telemetry.
const PMASYNRM: [(&str, &str); 10] = [
    ("peak", "current_a"),
    ("te", "torque_estimate_nm"),
    ("teRef", "torque_nm"),
    ("speed", "speed_rpm"),
    ("udc", "link_v"),
    ("idRef", "id_ref_a"),
    ("iqRef", "iq_ref_a"),
    ("u", "voltage_v"),
    ("f1", "frequency_hz"),
    ("chopper", "chopper_percent"),
];
/// The same of the ZS9.
const ZS9: [(&str, &str); 9] = [
    ("peak1", "current1_a"),
    ("peak2", "current2_a"),
    ("teRef1", "torque1_nm"),
    ("teRef2", "torque2_nm"),
    ("speed1", "speed1_rpm"),
    ("speed2", "speed2_rpm"),
    ("udc", "link_v"),
    ("capacitor", "capacitor_v"),
    ("duty", "duty_percent"),
];

const fn told(system: System) -> &'static [(&'static str, &'static str)] {
    match system {
        System::Pmasynrm => &PMASYNRM,
        System::Zs9 => &ZS9,
    }
}

/// The page's columns of a system's telemetry.
pub fn columns(system: System) -> Vec<&'static str> {
    told(system).iter().map(|(name, _)| *name).chain(["mode"]).collect()
}

/// The supervisor that relays.
pub struct Relay {
    system: System,
    talk: Talk,
    shared: Arc<Shared>,
    began: Instant,
    refused: Option<String>,
}

impl Relay {
    /// A relay to a drive of a system whose rotor has an inertia in kg·m², of a machine of these ratings.
    pub fn new(system: System, inertia_kg_m2: f64, ratings: &Ratings, shared: Arc<Shared>) -> Self {
        let talk = Talk::new(system, Lines::Said, inertia_kg_m2, ratings);
        Self { system, talk, shared, began: Instant::now(), refused: None }
    }

    /// Time since the relay was made, in s.
    pub fn time_s(&self) -> f64 {
        self.began.elapsed().as_secs_f64()
    }

    /// The code of the mode in the telemetry, for the page: 0 is off.
    fn mode(&self, row: &[String]) -> f64 {
        let say = |column: &str| self.system.column(column).map_or("", |place| row[place].as_str());
        let place = match self.system {
            System::Pmasynrm => (0..64).position(|code| Mode::from_code(code).name() == say("mode")),
            System::Zs9 if !matches!(say("state"), "enabled" | "running") => Some(0),
            System::Zs9 => {
                Scheme::ALL.iter().position(|scheme| scheme.name() == say("scheme")).map(|place| place + 1)
            }
        };
        place.unwrap_or(0) as f64
    }

    /// The drive's state in the page's terms.
    fn state(&self, t_s: f64, row: &[String]) -> Value {
        let say = |column: &str| self.system.column(column).map_or("", |place| row[place].as_str());
        let known = |column: &str| Some(say(column)).filter(|word| !word.is_empty());
        let number = |column: &str| known(column).and_then(|word| word.parse::<f64>().ok());
        let trip = known("fault").map(
            |fault| json!({ "fault": fault, "value": number("fault_value"), "limit": number("fault_limit") }),
        );
        let status = json!({
            "state": say("state"),
            "refusal": self.refused.as_deref().or(known("refusal")),
            "listening": say("listening"),
            "errors": number("telemetry_errors"),
        });
        json!({ "t": t_s, "trip": trip, "status": status })
    }
}

impl Supervisor for Relay {
    fn slot(&mut self, t_s: f64) -> Result<Turn> {
        // At the clock's pace, or slower if the drive is.
        let early_s = t_s - self.time_s();
        if early_s > 0.0 {
            std::thread::sleep(Duration::from_secs_f64(early_s));
        }
        while let Some(line) = self.shared.line() {
            self.refused = self.talk.say(t_s, &line).err().map(|error| format!("{line}: {error:#}"));
        }
        let armed = self.shared.is_armed();
        let turn = self.talk.slot(t_s)?;
        Ok(Turn { frame: turn.frame.filter(|_| armed), ..turn })
    }

    fn hear(&mut self, t_s: f64, frame: &Frame) {
        self.talk.hear(t_s, frame);
        for row in self.talk.take_rows() {
            let number = |(_, column): &(&str, &str)| {
                self.system.column(column).and_then(|place| row[place].parse::<f64>().ok())
            };
            let values: Row = told(self.system).iter().map(number).chain([Some(self.mode(&row))]).collect();
            self.shared.put(t_s, values, self.state(t_s, &row));
        }
    }

    /// The page may be watched for any length of time.
    fn is_typed(&self) -> bool {
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::can::{Bus, drive};
    use crate::live::shared::Shared;
    use crate::machine::Machine;
    use crate::talk::System;
    use std::collections::VecDeque;
    use std::sync::Arc;
    use tractive::protocol::e2e::Counter;
    use tractive::protocol::{COMMAND, FROM_DRIVE, Payload};

    /// A bus with incoming frames, and the frames that were sent.
    struct Fake {
        come: VecDeque<Frame>,
        sent: Vec<Frame>,
    }

    impl Bus for Fake {
        fn send(&mut self, frame: &Frame) -> Result<()> {
            self.sent.push(*frame);
            Ok(())
        }

        fn receive(&mut self) -> Result<Option<Frame>> {
            Ok(self.come.pop_front())
        }
    }

    #[test]
    fn a_bus_is_only_looked_at_until_commands_are_switched_on() {
        let shared = Arc::new(Shared::new(true));
        let machine = Machine::load("pmasynrm-180kw").unwrap();
        let mut to = Relay::new(System::Pmasynrm, 10.0, &machine.tables.ratings, Arc::clone(&shared));
        let status = FROM_DRIVE[0].frame(Payload(0), &mut Counter::default());
        let mut bus = Fake { come: [status].into(), sent: Vec::new() };
        drive(&mut bus, &mut to, 0..30).unwrap();
        assert!(bus.sent.is_empty(), "{:?}", bus.sent);
        let told = shared.rows(0);
        assert_eq!(told["rows"].as_array().unwrap().len(), columns(System::Pmasynrm).len());
        assert!(told["state"]["status"]["state"].is_string());
        shared.arm(true).unwrap();
        shared.say("charge").unwrap();
        drive(&mut bus, &mut to, 30..60).unwrap();
        assert!(
            bus.sent.len() == 3 && bus.sent.iter().all(|frame| COMMAND.is_intact(frame)),
            "{:?}",
            bus.sent
        );
        shared.arm(false).unwrap();
        drive(&mut bus, &mut to, 60..90).unwrap();
        assert_eq!(bus.sent.len(), 3);
    }
}
