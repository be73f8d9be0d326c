//! Results of mutants, in a file that grows by a line each; a later line of the same mutant wins.

use crate::tree::Mutant;
use anyhow::{Context, Result, bail};
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, HashMap};
use std::fs::{File, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::Mutex;

/// The end of a mutant.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
pub enum Outcome {
    /// A test failed.
    Killed,
    /// A test did not end.
    Late,
    /// No test failed; a run of the rig wrote other bytes.
    Golden,
    /// All that come by it, or what time there was, passed.
    Missed,
    /// No test comes by it.
    Unreached,
}

/// A line of the file.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Line {
    pub name: String,
    /// The hash of its file.
    pub source: u64,
    pub outcome: Outcome,
    /// The test; of a mutant that was missed how many passed, of how many.
    pub by: String,
}

/// The file.
pub struct Results {
    path: PathBuf,
    file: Mutex<File>,
    lines: HashMap<String, Line>,
}

impl Results {
    /// Opens it, and reads what is there.
    pub fn open(path: &Path) -> Result<Self> {
        let text = std::fs::read_to_string(path).unwrap_or_default();
        let lines = text.lines().filter_map(|line| serde_json::from_str::<Line>(line).ok());
        let lines = lines.map(|line| (line.name.clone(), line)).collect();
        let file = OpenOptions::new().create(true).append(true).open(path);
        let file = file.with_context(|| path.display().to_string())?;
        Ok(Self { path: path.to_owned(), file: Mutex::new(file), lines })
    }

    /// The result of a mutant, of the same source.
    pub fn of(&self, mutant: &Mutant) -> Option<&Line> {
        self.lines.get(&mutant.name()).filter(|line| line.source == mutant.hash)
    }

    /// Writes a line.
    pub fn add(&self, line: &Line) -> Result<()> {
        let text = serde_json::to_string(line)? + "\n";
        let Ok(mut file) = self.file.lock() else { return Ok(()) };
        file.write_all(text.as_bytes()).with_context(|| self.path.display().to_string())
    }
}

/// Mutants that no test can notice, or none needs to, with the reason.
#[derive(Clone, Debug, Deserialize)]
pub struct Known {
    /// The reason of all of them.
    pub reason: String,
    /// "FILE: WHAT in FUNCTION", and behind " @ " the line of the source where one function has the same mutation several times.
    pub mutants: Vec<String>,
}

/// The list of those.
#[derive(Debug, Default, Deserialize)]
pub struct KnownList {
    #[serde(default)]
    pub known: Vec<Known>,
}

impl KnownList {
    pub fn read(path: &Path) -> Result<Self> {
        let text = std::fs::read_to_string(path).unwrap_or_default();
        let list: Self = toml::from_str(&text).with_context(|| path.display().to_string())?;
        match list.known.iter().find(|known| known.reason.trim().is_empty()) {
            Some(known) => {
                bail!("{}: {:?}: reason: empty; say why no test notices them", path.display(), known.mutants)
            }
            None => Ok(list),
        }
    }

    pub fn has(&self, mutant: &Mutant) -> bool {
        let Mutant { file, what, function, source, .. } = mutant;
        let short = format!("{file}: {what} in {function}");
        let long = format!("{short} @ {source}");
        self.known.iter().flat_map(|known| &known.mutants).any(|name| *name == short || *name == long)
    }
}

/// Counts of an area.
#[derive(Debug, Default)]
pub struct Count {
    pub of: BTreeMap<Outcome, usize>,
    pub known: usize,
    /// Not tried yet.
    pub open: usize,
    /// Left out of the build: of an error that says that no mutant of this kind can be, or of another.
    pub unviable: usize,
    pub elsewhere: usize,
}

impl Count {
    /// Mutants that tests notice or that are known, and all that were tried.
    pub fn noticed(&self) -> [usize; 2] {
        let tests =
            [Outcome::Killed, Outcome::Late].iter().filter_map(|outcome| self.of.get(outcome)).sum::<usize>();
        [tests + self.known, self.of.values().sum()]
    }

    /// The share of what was tried that was noticed by a test; and by a test or in bytes; in percent.
    pub fn shares(&self) -> (f64, f64) {
        let count =
            |outcomes: &[Outcome]| outcomes.iter().filter_map(|outcome| self.of.get(outcome)).sum::<usize>();
        let all =
            count(&[Outcome::Killed, Outcome::Late, Outcome::Golden, Outcome::Missed, Outcome::Unreached]);
        let share = |part: usize| 100.0 * part as f64 / all.max(1) as f64;
        let tests = count(&[Outcome::Killed, Outcome::Late]);
        (share(tests), share(tests + count(&[Outcome::Golden])))
    }
}
