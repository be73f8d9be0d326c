//! Mutation testing: every mutant compiled into one build of the tests, and chosen when they run.

mod areas;
mod build;
mod changed;
mod constants;
mod modules;
mod report;
mod results;
mod run;
mod schema;
mod shards;
mod sites;
mod tree;
mod trials;
mod values;

use anyhow::Result;
use areas::Area;
use clap::Parser;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Tests the tests of `tractive`.
#[derive(Debug, Parser)]
#[command(name = "cargo xtask mutants", version)]
pub struct Options {
    /// Only the mutants of an area (may be repeated)
    #[arg(long, value_enum)]
    area: Vec<Area>,
    /// Only those of files whose path begins like this (may be repeated)
    #[arg(long)]
    file: Vec<String>,
    /// Only those in constants and lengths, each of which takes a build of its own
    #[arg(long, conflicts_with = "sample")]
    constants: bool,
    /// Shard K of N, from 0, into a file of its own
    #[arg(long, value_name = "K/N", value_parser = shard)]
    shard: Option<(usize, usize)>,
    /// Only N of them, evenly spread
    #[arg(long, value_name = "N", conflicts_with = "shard")]
    sample: Option<usize>,
    /// Draw the sample with this number as the seed instead
    #[arg(long, value_name = "N", requires = "sample")]
    seed: Option<u64>,
    /// Take half of the sample, if there are as many, from files that the last N commits or the working tree changed
    #[arg(long, value_name = "N", requires = "seed")]
    changed: Option<u32>,
    /// Only the tests of these packages (may be repeated) [default: all that contain any of this code]
    #[arg(long, value_name = "NAME")]
    tests: Vec<String>,
    /// Processor time of tests, measured without a mutant, for which one mutant is tried, in s
    #[arg(long, value_name = "S", default_value_t = 20.0)]
    budget: f64,
    /// Longest processor time of a test that is still tried, in s
    #[arg(long, value_name = "S", default_value_t = 10)]
    longest: u64,
    /// Try mutants that no test notices with runs of the rig too, and compare bytes
    #[arg(long)]
    bytes: bool,
    /// Threads
    #[arg(long, value_name = "N", default_value_t = 2)]
    jobs: usize,
    /// Try those again that were missed and are not known
    #[arg(long)]
    again: bool,
    /// Exit code 1 only if less than this share of what was tried is noticed by tests or known, in percent [default: if a survivor is not known]
    #[arg(long, value_name = "P")]
    least: Option<f64>,
    /// List the mutants and do nothing else
    #[arg(long)]
    list: bool,
    /// Report the results of all that were tried and do nothing else; exit code 1 if one was not tried
    #[arg(long)]
    report: bool,
    /// Merge all shards' files into the results of the whole, and report
    #[arg(long, value_name = "FILE", num_args = 1.., conflicts_with_all = ["shard", "sample", "area", "file", "constants"])]
    merge: Vec<PathBuf>,
}

fn shard(text: &str) -> Result<(usize, usize), String> {
    let parsed = text.split_once('/').and_then(|(k, n)| Some((k.parse().ok()?, n.parse().ok()?)));
    parsed.filter(|(k, n)| k < n).ok_or_else(|| "K/N with K from 0 below N".to_owned())
}

/// Places of the run.
pub struct Places {
    /// The repository.
    pub root: PathBuf,
    /// The folder of the copy, its build, and the results.
    pub work: PathBuf,
}

fn main() -> Result<ExitCode> {
    let mut options = Options::parse();
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().map(Path::to_owned).unwrap_or_default();
    let places = Places { work: root.join("target/mutants"), root };
    let tree = tree::read(&places.root)?;
    if options.list {
        for mutant in run::chosen(&tree.mutants, &options) {
            println!("{}", mutant.name());
        }
        return Ok(ExitCode::SUCCESS);
    }
    if !options.merge.is_empty() {
        let paths = std::mem::take(&mut options.merge);
        shards::merge(&paths, &places, &tree, &mut options)?;
    } else if !options.report {
        run::run(&places, &tree, &options)?;
    }
    let good = report::print(&places, &tree, &options)?;
    Ok(ExitCode::from(u8::from(!good)))
}
