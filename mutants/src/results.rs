//! Results of mutants, in a file that grows by a line each; a later line of the same mutant wins.

use crate::shards::Head;
use crate::tree::Mutant;
use anyhow::{Context, Result, bail, ensure};
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet, HashMap};
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
    /// No test failed; a run of the rig wrote different bytes.
    Golden,
    /// All tests that reach it, or as many as the time allowed, passed.
    Missed,
    /// No test reaches it.
    Unreached,
    /// In a constant: it does not compile.
    NoProgram,
}

impl Outcome {
    /// `true` if more time could not change the result.
    pub fn is_settled(self) -> bool {
        matches!(self, Self::Killed | Self::Late | Self::NoProgram)
    }
}

/// A line of the file.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Line {
    pub name: String,
    /// The hash of its file.
    pub source: u64,
    pub outcome: Outcome,
    /// The test; for a mutant that was missed, how many passed, of how many.
    pub by: String,
}

/// The file.
pub struct Results {
    path: PathBuf,
    file: Mutex<File>,
    lines: HashMap<String, Line>,
}

impl Results {
    /// Opens it and reads its contents. A shard's file begins with its head.
    ///
    /// # Errors
    /// A file that cannot be written, or one with another head.
    pub fn open(path: &Path, head: Option<&Head>) -> Result<Self> {
        let text = std::fs::read_to_string(path).unwrap_or_default();
        let lines = text.lines().filter_map(|line| serde_json::from_str::<Line>(line).ok());
        let lines = lines.map(|line| (line.name.clone(), line)).collect();
        let file = OpenOptions::new().create(true).append(true).open(path);
        let mut file = file.with_context(|| path.display().to_string())?;
        if let Some(head) = head {
            let there = text.lines().next().map(serde_json::from_str::<Head>);
            match there {
                None => writeln!(file, "{}", serde_json::to_string(head)?)?,
                Some(Ok(there)) if there == *head => {}
                Some(_) => bail!("{}: of another run; remove it to begin anew", path.display()),
            }
        }
        // It was cut off in the middle of a line.
        if !text.is_empty() && !text.ends_with('\n') {
            writeln!(file)?;
        }
        Ok(Self { path: path.to_owned(), file: Mutex::new(file), lines })
    }

    /// Writes a file anew, whole or not at all.
    pub fn replace(path: &Path, lines: &[Line]) -> Result<()> {
        let texts = lines.iter().map(|line| Ok(serde_json::to_string(line)? + "\n"));
        let beside = path.with_extension("new");
        std::fs::write(&beside, texts.collect::<Result<String>>()?)?;
        Ok(std::fs::rename(&beside, path)?)
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

/// Mutants that no test can notice, or that none needs to notice, with the reason.
#[derive(Clone, Debug, Deserialize)]
pub struct Known {
    /// The reason of all of them.
    pub reason: String,
    /// "FILE: WHAT in FUNCTION", followed by " @ " and the line of the source if one function has the same mutation several times. If a name still has
    /// several mutants, " #K" follows for the K-th, from 1, or " (all N)" for all of so many.
    pub mutants: Vec<String>,
}

/// The list of those.
#[derive(Debug, Default, Deserialize)]
pub struct KnownList {
    #[serde(default)]
    known: Vec<Known>,
    /// The numbers of the mutants that are named.
    #[serde(skip)]
    numbers: BTreeSet<u32>,
}

impl KnownList {
    /// Reads it.
    ///
    /// # Errors
    /// A reason that is empty; a name of no mutant, of several, or of a different number of mutants.
    pub fn read(path: &Path, mutants: &[Mutant]) -> Result<Self> {
        let text = std::fs::read_to_string(path).unwrap_or_default();
        Self::parse(&text, mutants).with_context(|| path.display().to_string())
    }

    fn parse(text: &str, mutants: &[Mutant]) -> Result<Self> {
        let mut list: Self = toml::from_str(text)?;
        if let Some(known) = list.known.iter().find(|known| known.reason.trim().is_empty()) {
            bail!("{:?}: reason: empty; say why no test notices them", known.mutants);
        }
        let mut named: HashMap<String, Vec<&Mutant>> = HashMap::new();
        for mutant in mutants {
            let Mutant { file, what, function, source, .. } = mutant;
            let short = format!("{file}: {what} in {function}");
            named.entry(format!("{short} @ {source}")).or_default().push(mutant);
            named.entry(short).or_default().push(mutant);
        }
        for all in named.values_mut() {
            all.sort_by_key(|mutant| (mutant.line, mutant.column));
        }
        for name in list.known.iter().flat_map(|known| &known.mutants) {
            list.numbers.extend(numbers(name, &named)?);
        }
        Ok(list)
    }

    pub fn has(&self, mutant: &Mutant) -> bool {
        self.numbers.contains(&mutant.number)
    }
}

/// The numbers of the mutants that a name of the list has.
fn numbers(name: &str, named: &HashMap<String, Vec<&Mutant>>) -> Result<Vec<u32>> {
    let of = |name: &str| named.get(name).map_or(&[][..], Vec::as_slice);
    let whole = of(name);
    if let [one] = whole {
        return Ok(vec![one.number]);
    }
    if let Some((name, place)) = name.rsplit_once(" #")
        && let Ok(place) = place.parse::<usize>()
    {
        let place = place.checked_sub(1).and_then(|place| of(name).get(place));
        return Ok(vec![place.with_context(|| format!("{name}: there are not so many of these"))?.number]);
    }
    let counted = name.strip_suffix(')').and_then(|name| name.rsplit_once(" (all "));
    if let Some((name, count)) = counted
        && let Ok(count) = count.parse::<usize>()
    {
        let all = of(name);
        ensure!(all.len() == count, "{name}: there are {} of these, not {count}", all.len());
        return Ok(all.iter().map(|mutant| mutant.number).collect());
    }
    ensure!(!whole.is_empty(), "{name}: there is no such mutant");
    bail!("{name}: there are {} of these; say which, \" #K\", or \" (all {})\"", whole.len(), whole.len())
}

/// Counts of an area.
#[derive(Debug, Default)]
pub struct Count {
    pub of: BTreeMap<Outcome, usize>,
    pub known: usize,
    /// Not tried yet.
    pub open: usize,
    /// Left out of the build: because of an error that says that no mutant of this kind can exist, or of another error.
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

    /// The share of what was tried that was noticed by a test, and the share noticed by a test or in bytes; in percent.
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
