//! Campaigns on more than one computer: each shard does its share of the runs and leaves one file, and the files merge into exactly the bytes
//! that one shard alone would have left.
//!
//! A shard's file is a line of JSON after `# `, which identifies its campaign, and a CSV with the number of each run. It is written
//! whole or not at all, every few runs; a restarted shard does the runs that are not in its file yet.

mod file;
mod merge;

pub use file::{ShardFile, name};
pub use merge::{Merged, merge};

use crate::files::make_folder;
use crate::run::bar;
use anyhow::{Context, Result};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::fmt;
use std::path::Path;
use std::str::FromStr;
use std::time::{Duration, Instant};

/// A share of a campaign's runs: the one with this number of `count` shards, which take the runs in turn.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Shard {
    /// Its number, from 0.
    pub shard: usize,
    /// The number of shards.
    pub shards: usize,
}

impl Shard {
    /// All runs.
    pub const WHOLE: Self = Self { shard: 0, shards: 1 };

    /// `true` if the run belongs to this shard.
    pub const fn has(self, run: usize) -> bool {
        run % self.shards == self.shard
    }
}

impl fmt::Display for Shard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.shard, self.shards)
    }
}

impl FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let parse = || {
            let (shard, shards) = text.split_once('/')?;
            Some(Self { shard: shard.parse().ok()?, shards: shards.parse().ok()? })
        };
        parse()
            .filter(|shard| shard.shard < shard.shards)
            .ok_or_else(|| "must be K/N with K from 0 to N − 1, for instance 0/3".to_owned())
    }
}

/// A campaign, described by everything that determines its results.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Plan {
    /// Its name: faults, healthy, random, points.
    pub campaign: String,
    /// Its options.
    pub configuration: serde_json::Value,
    /// The number of its runs.
    pub runs: usize,
    /// The program that runs it, by the hash of its bytes: another commit's program differs.
    pub program: String,
    /// The head of its CSV, without the run's number.
    pub columns: String,
}

impl Plan {
    /// A campaign of this program.
    pub fn new(campaign: &str, configuration: serde_json::Value, runs: usize, columns: &str) -> Result<Self> {
        Ok(Self {
            campaign: campaign.to_owned(),
            configuration,
            runs,
            program: program()?,
            columns: columns.to_owned(),
        })
    }
}

/// The hash of this program's bytes.
fn program() -> Result<String> {
    let path = std::env::current_exe().context("this program's own file")?;
    let bytes = std::fs::read(&path).with_context(|| path.display().to_string())?;
    Ok(format!("{:016x}", hash(&bytes)))
}

/// FNV-1a of bytes, 64 bits.
pub fn hash(bytes: &[u8]) -> u64 {
    bytes.iter().fold(0xcbf2_9ce4_8422_2325, |hash, byte| {
        (hash ^ u64::from(*byte)).wrapping_mul(0x0000_0100_0000_01b3)
    })
}

/// The seed of a run: a hash of its campaign and its number, whatever shard it is in.
pub fn seed(campaign: &str, run: u64) -> u64 {
    // The last steps of SplitMix64, so that neighbours differ in every bit.
    let mixed = hash(&[campaign.as_bytes(), &run.to_le_bytes()].concat());
    let mixed = (mixed ^ mixed >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let mixed = (mixed ^ mixed >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    mixed ^ mixed >> 31
}

/// The number of runs that are done at once.
const BLOCK: usize = 16;
/// Least time between two writings of a shard's file.
const PAUSE: Duration = Duration::from_secs(1);

/// Does a shard's runs that are not in its file yet, each a row of the CSV, and writes the file into a folder.
pub fn run(
    plan: &Plan,
    shard: Shard,
    folder: &Path,
    row: impl Fn(usize) -> Result<String> + Sync,
) -> Result<()> {
    make_folder(folder)?;
    let path = folder.join(name(shard));
    let mut file = ShardFile::resumed(&path, plan, shard)?;
    let left: Vec<usize> =
        (0..plan.runs).filter(|run| shard.has(*run) && !file.rows.contains_key(run)).collect();
    let done = file.rows.len();
    let bar = bar((done + left.len()) as u64, "shard [{bar:40}] {pos}/{len} {elapsed} (left {eta})");
    bar.set_position(done as u64);
    let mut written: Option<Instant> = None;
    for block in left.chunks(BLOCK) {
        let rows = block.par_iter().map(|run| {
            let row = row(*run).with_context(|| format!("run {run}"))?;
            bar.inc(1);
            Ok((*run, row))
        });
        file.rows.extend(rows.collect::<Result<Vec<_>>>()?);
        if written.is_none_or(|written| written.elapsed() > PAUSE) {
            file.write(&path)?;
            written = Some(Instant::now());
        }
    }
    file.write(&path)?;
    bar.finish_and_clear();
    crate::say!("shard {shard}: {} runs, {done} of them there before: {}", file.rows.len(), path.display());
    Ok(())
}

/// A row of a CSV as text, without its line's end.
pub fn csv_row(row: &impl Serialize) -> Result<String> {
    let mut writer = csv::WriterBuilder::new().has_headers(false).from_writer(Vec::new());
    writer.serialize(row)?;
    let bytes = writer.into_inner().map_err(csv::IntoInnerError::into_error)?;
    Ok(String::from_utf8(bytes)?.trim_end_matches('\n').to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_shard_is_written_k_of_n() {
        assert_eq!("2/7".parse(), Ok(Shard { shard: 2, shards: 7 }));
        for wrong in ["", "3", "3/3", "-1/3", "0/0", "1/2/3", "a/b"] {
            assert!(wrong.parse::<Shard>().is_err(), "{wrong}");
        }
    }

    #[test]
    fn every_run_is_in_one_shard() {
        for shards in 1..8 {
            for run in 0..50 {
                assert_eq!((0..shards).filter(|shard| Shard { shard: *shard, shards }.has(run)).count(), 1);
            }
        }
    }

    #[test]
    fn seeds_are_of_campaign_and_run() {
        let mut seeds: Vec<_> =
            ["a", "b"].iter().flat_map(|name| (0..10_000).map(|run| seed(name, run))).collect();
        seeds.sort_unstable();
        seeds.dedup();
        assert_eq!(seeds.len(), 20_000);
        // A change of the hash would change every published campaign.
        assert_eq!(seed("a", 0), 0x407a_628d_9394_c9ca);
    }
}
