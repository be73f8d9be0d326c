//! The record of a commissioning.

use crate::files::write_text;
use crate::identify::Identify;
use crate::pictures::sheet::number;
use anyhow::{Context, Result, ensure};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fmt::{Display, Formatter};
use std::path::Path;
use std::time::{SystemTime, UNIX_EPOCH};

/// A step that was done.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Step {
    /// Its name.
    pub name: String,
    /// `true` if it has passed.
    pub passed: bool,
    /// The reasons why it has not.
    pub complaints: Vec<String>,
    /// The changes that mend it, by the key or the wire that they are made at.
    pub advice: Vec<String>,
    /// The numbers that it found, by their names with units.
    pub found: BTreeMap<String, f64>,
}

impl Step {
    /// A step that has passed so far.
    pub fn new(name: &str) -> Self {
        Self { name: name.to_owned(), passed: true, ..Self::default() }
    }

    /// Notes a number.
    pub fn find(&mut self, name: &str, value: f64) {
        self.found.insert(name.to_owned(), value);
    }

    /// Notes a number that must lie between two others for the step to pass; `true` if it does.
    pub fn within(&mut self, name: &str, value: f64, [least, most]: [f64; 2]) -> bool {
        self.find(name, value);
        let holds = (least..=most).contains(&value);
        if !holds {
            let [value, least, most] = [value, least, most].map(number);
            self.fail(format!("{name} is {value}: must be from {least} to {most}"));
        }
        holds
    }

    /// Notes what mends it.
    pub fn advise(&mut self, advice: String) {
        self.advice.push(advice);
    }

    /// Marks the step as not passed, with the reason.
    pub fn fail(&mut self, complaint: String) {
        self.passed = false;
        self.complaints.push(complaint);
    }
}

impl Display for Step {
    fn fmt(&self, to: &mut Formatter) -> std::fmt::Result {
        for (name, value) in &self.found {
            writeln!(to, "  {name:<34}{value:.5}")?;
        }
        for complaint in self.complaints.iter().chain(&self.advice) {
            writeln!(to, "  {complaint}")?;
        }
        write!(to, "  {}", if self.passed { "passed" } else { "NOT PASSED" })
    }
}

/// The whole record.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Record {
    /// The nameplate's machine.
    machine: String,
    /// The place: `host`, `qemu` or the CAN interface.
    on: String,
    version: String,
    /// The time at which it began, in seconds since 1970.
    began_unix_s: u64,
    /// `true` if every step has passed.
    pub finished: bool,
    /// The steps that were done.
    #[serde(rename = "step", default)]
    pub steps: Vec<Step>,
}

impl Record {
    /// Nothing done yet.
    pub fn new(machine: &str, identify: &Identify) -> Self {
        let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
        Self {
            machine: machine.to_owned(),
            on: identify.can.clone().unwrap_or_else(|| identify.options.on.name().to_owned()),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            began_unix_s: since.as_secs(),
            finished: false,
            steps: Vec::new(),
        }
    }

    /// The steps of a record that ended early, as far as they have passed, for the same machine at the same place.
    ///
    /// # Errors
    /// A file that cannot be read, and a record of something else.
    pub fn resumed(self, path: &Path) -> Result<Self> {
        let text = std::fs::read_to_string(path).with_context(|| format!("--resume: {}", path.display()))?;
        let before: Self = toml::from_str(&text).with_context(|| format!("--resume: {}", path.display()))?;
        let own = |record: &Self| (record.machine.clone(), record.on.clone());
        let ((machine, on), (here, place)) = (own(&before), own(&self));
        ensure!(
            (&machine, &on) == (&here, &place),
            "--resume: {} is of {machine} on {on}, not of {here} on {place}",
            path.display()
        );
        let steps = before.steps.into_iter().take_while(|step| step.passed).collect();
        Ok(Self { began_unix_s: before.began_unix_s, steps, ..self })
    }

    /// A number that a step found; `None` if none did.
    pub fn found(&self, name: &str) -> Option<f64> {
        self.steps.iter().find_map(|step| step.found.get(name)).copied()
    }

    /// Writes it.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn write(&self, path: &Path) -> Result<()> {
        write_text(path, &toml::to_string(self)?)
    }
}
