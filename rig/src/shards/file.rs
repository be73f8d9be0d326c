//! The file of a shard.

use super::{Plan, Shard};
use crate::files::write_text;
use anyhow::{Context, Result, bail};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::Path;

/// The beginning of the first line.
const MARK: &str = "# ";
/// The head of the run's number.
const RUN: &str = "run";

/// The name of a shard's file.
pub fn name(shard: Shard) -> String {
    format!("shard-{}-of-{}.csv", shard.shard, shard.shards)
}

/// The first line.
#[derive(Serialize, Deserialize)]
struct Header {
    #[serde(flatten)]
    shard: Shard,
    #[serde(flatten)]
    plan: Plan,
}

/// A shard's file: its campaign and share, and the rows that are done.
#[derive(Clone, Debug)]
pub struct ShardFile {
    /// The campaign.
    pub plan: Plan,
    /// The share.
    pub shard: Shard,
    /// Rows by the numbers of their runs.
    pub rows: BTreeMap<usize, String>,
}

impl ShardFile {
    /// The file as it was left, or an empty one. Fails if the file is another campaign's.
    pub fn resumed(path: &Path, plan: &Plan, shard: Shard) -> Result<Self> {
        if !path.exists() {
            return Ok(Self { plan: plan.clone(), shard, rows: BTreeMap::new() });
        }
        let file = Self::read(path)?;
        if let Some(what) = difference(&file.plan, plan) {
            bail!("{}: is of another {what}; take it away, or choose another folder", path.display());
        }
        if file.shard != shard {
            bail!("{}: is shard {}, not {shard}", path.display(), file.shard);
        }
        Ok(file)
    }

    /// Reads a file.
    pub fn read(path: &Path) -> Result<Self> {
        let named = || path.display().to_string();
        let text = std::fs::read_to_string(path).with_context(named)?;
        Self::parsed(&text).with_context(named)
    }

    fn parsed(text: &str) -> Result<Self> {
        let mut lines = text.lines();
        let header = lines.next().and_then(|line| line.strip_prefix(MARK));
        let Some(header) = header else {
            bail!("is no shard's file: its first line must begin with {MARK:?}")
        };
        let Header { shard, plan } = serde_json::from_str(header).context("line 1")?;
        if shard.shard >= shard.shards {
            bail!("line 1: there is no shard {shard}");
        }
        let head = format!("{RUN},{}", plan.columns);
        if lines.next() != Some(head.as_str()) {
            bail!("line 2: must be {head}");
        }
        let mut rows = BTreeMap::new();
        for (number, line) in (3..).zip(lines) {
            let row = line.split_once(',').and_then(|(run, row)| Some((run.parse::<usize>().ok()?, row)));
            let Some((run, row)) = row else { bail!("line {number}: must be a run's number and its row") };
            if run >= plan.runs || !shard.has(run) {
                bail!("line {number}: run {run} is none of shard {shard} of {} runs", plan.runs);
            }
            if rows.insert(run, row.to_owned()).is_some() {
                bail!("line {number}: run {run} is there twice");
            }
        }
        Ok(Self { plan, shard, rows })
    }

    /// Writes it whole or not at all.
    pub fn write(&self, path: &Path) -> Result<()> {
        let header = Header { shard: self.shard, plan: self.plan.clone() };
        let mut text = format!("{MARK}{}\n{RUN},{}\n", serde_json::to_string(&header)?, self.plan.columns);
        for (run, row) in &self.rows {
            let _ = writeln!(text, "{run},{row}");
        }
        write_text(path, &text)
    }
}

/// The part in which two campaigns differ.
pub(super) fn difference(a: &Plan, b: &Plan) -> Option<&'static str> {
    [
        (a.campaign != b.campaign, "campaign"),
        (a.program != b.program, "program (commit or build)"),
        (a.configuration != b.configuration, "configuration"),
        (a.runs != b.runs, "number of runs"),
        (a.columns != b.columns, "form"),
    ]
    .into_iter()
    .find_map(|(differs, what)| differs.then_some(what))
}
