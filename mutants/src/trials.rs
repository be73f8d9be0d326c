//! Runs of tests, with none of the mutants, with all of them watched, or with one active.

use crate::build::Program;
use anyhow::{Context, Result};
use serde::{Deserialize, Serialize};
use std::collections::hash_map::DefaultHasher;
use std::hash::{Hash, Hasher};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

/// A test that passes without a mutant, or a run of the rig whose files are compared with those of a run without one.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Trial {
    pub program: Program,
    /// The test's name, or the rig's words.
    pub name: String,
    /// For a run of the rig, the hash of its files.
    pub golden: Option<u64>,
    /// Processor time without a mutant, in s.
    pub seconds: f64,
    /// The numbers of the mutants that it reaches.
    pub reached: Vec<u32>,
}

/// The end of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum End {
    Same,
    Other,
    Late,
}

/// A mutant's run may take this many times as long, and `GRACE_S` more.
const TIMES: f64 = 4.0;
const GRACE_S: f64 = 0.9;
/// A watched run takes longer than another: from this many s on, a test's time is taken from a run that is not watched.
const SHORT_S: f64 = 0.3;
/// Time by the wall clock after which a run is ended, whatever it waits for.
const WALL: Duration = Duration::from_secs(300);

impl Trial {
    /// "tractive modulation::a_name", or "rig run sweep".
    pub fn label(&self) -> String {
        match self.golden {
            Some(_) => format!("rig {}", self.name),
            None => format!("{}::{}", self.program.name, self.name),
        }
    }

    /// Random draws are the same each time: otherwise a test's time, and whether it notices a mutant, would be chance.
    fn command(&self, out: &Path) -> Command {
        let mut command = Command::new(&self.program.path);
        command.env("PROPTEST_RNG_SEED", "1");
        command.env("PROPTEST_DISABLE_FAILURE_PERSISTENCE", "true").env("PROPTEST_MAX_SHRINK_ITERS", "0");
        command.env("CARGO_MANIFEST_DIR", &self.program.folder).env("RUST_BACKTRACE", "0");
        command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
        if self.golden.is_some() {
            let root = self.program.folder.parent().unwrap_or(&self.program.folder);
            command.current_dir(root).args(self.name.split(' ')).arg("--out").arg(out);
        } else {
            command.current_dir(&self.program.folder).args(["--exact", &self.name, "--test-threads=1"]);
        }
        command
    }

    /// Runs it watched; a run that is compared or takes long is made once more. `None` if it fails, takes longer than `longest_s`, is never the same,
    /// or reaches no mutant.
    pub fn learn(mut self, scratch: &Path, longest_s: u64) -> Option<Self> {
        let folder = tempfolder(scratch).ok()?;
        let (out, time, reached) = (folder.join("out"), folder.join("time"), folder.join("reached"));
        std::fs::create_dir_all(&reached).ok()?;
        let mut watched = self.command(&out);
        watched.env("MUTANT_SECONDS", longest_s.to_string()).env("MUTANT_TIME", &time);
        let mut status = ended(watched.env("MUTANT_REACHED", &reached))?;
        self.seconds = processor_s(&time).max(0.003);
        self.reached = union(&reached);
        let first = hash(&out, status);
        let is_golden = self.golden.is_some();
        if is_golden || (status.success() && self.seconds > SHORT_S) {
            let mut again = self.command(&out);
            again.env("MUTANT", "0").env("MUTANT_SECONDS", longest_s.to_string());
            status = ended(again.env("MUTANT_TIME", &time))?;
            self.seconds = processor_s(&time).max(0.003);
        }
        self.golden = self.golden.map(|_| first);
        let same = if is_golden { hash(&out, status) == first } else { status.success() };
        std::fs::remove_dir_all(&folder).ok()?;
        if !same {
            eprintln!("mutants: left alone, without a mutant it fails or takes too long: {}", self.label());
        }
        (same && !self.reached.is_empty()).then_some(self)
    }

    /// Runs it from another build, with a mutant that is compiled in.
    pub fn run_in(&self, program: &Program, scratch: &Path) -> Result<End> {
        Self { program: program.clone(), ..self.clone() }.run(0, scratch)
    }

    /// Runs it with a mutant.
    pub fn run(&self, mutant: u32, scratch: &Path) -> Result<End> {
        let folder = tempfolder(scratch)?;
        let out = folder.join("out");
        let seconds = (self.seconds * TIMES + GRACE_S).ceil() as u64;
        let mut command = self.command(&out);
        let status =
            ended(command.env("MUTANT", mutant.to_string()).env("MUTANT_SECONDS", seconds.to_string()));
        let end = match (status, self.golden) {
            (None, _) => End::Late,
            (Some(status), _) if is_late(status) => End::Late,
            (Some(status), Some(golden)) if hash(&out, status) == golden => End::Same,
            (Some(status), None) if status.success() => End::Same,
            _ => End::Other,
        };
        std::fs::remove_dir_all(&folder)?;
        Ok(end)
    }
}

/// The tests of a program.
pub fn of(program: &Program) -> Result<Vec<Trial>> {
    let list = Command::new(&program.path)
        .args(["--list", "--format", "terse"])
        .current_dir(&program.folder)
        .output();
    let list = list.with_context(|| program.path.display().to_string())?;
    let ignored = Command::new(&program.path).args(["--list", "--format", "terse", "--ignored"]).output()?;
    let names = |bytes: &[u8]| -> Vec<String> {
        let text = String::from_utf8_lossy(bytes).into_owned();
        text.lines().filter_map(|line| line.strip_suffix(": test")).map(str::to_owned).collect()
    };
    let ignored = names(&ignored.stdout);
    let names = names(&list.stdout).into_iter().filter(|name| !ignored.contains(name));
    Ok(names.map(|name| trial(program, name, None)).collect())
}

/// The rig's runs that are compared.
pub fn goldens(rig: &Program) -> Vec<Trial> {
    include_str!("../goldens.txt").lines().map(|words| trial(rig, words.to_owned(), Some(0))).collect()
}

fn trial(program: &Program, name: String, golden: Option<u64>) -> Trial {
    Trial { program: program.clone(), name, golden, seconds: 0.0, reached: Vec::new() }
}

/// A folder that nothing else uses.
fn tempfolder(scratch: &Path) -> Result<PathBuf> {
    use std::sync::atomic::{AtomicU64, Ordering};
    static NEXT: AtomicU64 = AtomicU64::new(0);
    let folder = scratch.join(format!("{}-{}", std::process::id(), NEXT.fetch_add(1, Ordering::Relaxed)));
    std::fs::create_dir_all(&folder)?;
    Ok(folder)
}

/// Processor time from a copy of the system's own count, for a process and those that it waited for, in s.
fn processor_s(stat: &Path) -> f64 {
    let stat = std::fs::read_to_string(stat).unwrap_or_default();
    let fields = stat.rsplit_once(") ").map_or("", |(_, fields)| fields).split(' ');
    fields.skip(11).take(4).filter_map(|ticks| ticks.parse::<f64>().ok()).sum::<f64>() / 100.0
}

/// Waits for the end of a program; `None` where it has to be made.
fn ended(command: &mut Command) -> Option<ExitStatus> {
    let mut child: Child = command.spawn().ok()?;
    let start = Instant::now();
    let mut pause = Duration::from_micros(200);
    loop {
        match child.try_wait() {
            Ok(Some(status)) => return Some(status),
            Ok(None) if start.elapsed() < WALL => std::thread::sleep(pause),
            _ => {
                let _ = child.kill();
                let _ = child.wait();
                return None;
            }
        }
        pause = (pause * 5 / 4).min(Duration::from_millis(10));
    }
}

/// `true` if it was ended by its limit of processor time.
fn is_late(status: ExitStatus) -> bool {
    use std::os::unix::process::ExitStatusExt;
    matches!(status.signal(), Some(24 | 9))
}

/// The hash of the files that a run wrote, and how it ended.
fn hash(out: &Path, status: ExitStatus) -> u64 {
    let mut hasher = DefaultHasher::new();
    status.code().hash(&mut hasher);
    for name in ["trace.csv", "edges.csv", "telemetry.csv", "frames.log"] {
        std::fs::read(out.join(name)).ok().hash(&mut hasher);
    }
    hasher.finish()
}

/// The mutants that any process of a run reached.
fn union(folder: &Path) -> Vec<u32> {
    let mut all: Vec<u8> = Vec::new();
    for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        let bytes = std::fs::read(entry.path()).unwrap_or_default();
        all.resize(all.len().max(bytes.len()), 0);
        all.iter_mut().zip(bytes).for_each(|(all, byte)| *all |= byte);
    }
    all.iter().enumerate().filter(|(_, byte)| **byte > 0).map(|(number, _)| number as u32).collect()
}
