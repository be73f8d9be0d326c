//! `campaign --random`: draws and runs cases, reports what was covered, and minimises the failures.

use super::{Hypercube, coverage, minimise};
use crate::campaign::drawn::Run;
use crate::campaign::judge::Verdict;
use crate::campaign::options::CampaignOptions;
use crate::campaign::report::{Part, renew_with};
use crate::campaign::traction::Drive;
use crate::campaign::traction::random::DIMENSIONS;
use crate::files::{make_folder, write_text};
use crate::run::bar;
use crate::scenario::traction::PatternsName;
use crate::shards::{self, Merged, Plan, seed};
use anyhow::{Context, Result, ensure};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::path::Path;
use std::process::ExitCode;

/// The name of the campaign.
pub const RANDOM: &str = "random";
/// The configuration of a campaign.
#[derive(Serialize, Deserialize)]
struct Configuration {
    seed: u64,
    patterns: PatternsName,
}

/// Largest number of failures that are minimised: each takes some dozens of runs.
const SMALL: usize = 5;

/// The drive, and what is drawn for it.
pub struct Random {
    drive: Drive,
    cube: Hypercube,
    name: String,
}

impl Random {
    /// The given number of runs with a seed.
    pub fn new(runs: usize, seed: u64, patterns: PatternsName) -> Result<Self> {
        let name = format!("{RANDOM} {seed} {runs}");
        let drive = Drive::new(None)?.with(patterns);
        Ok(Self { drive, cube: Hypercube::new(&name, runs, DIMENSIONS.len()), name })
    }

    /// Runs one.
    pub fn run(&self, run: usize) -> Result<Run> {
        let point = self.cube.point(run).with_context(|| format!("--run {run}: there is no such run"))?;
        let values: Vec<f64> =
            DIMENSIONS.iter().zip(point).map(|(dimension, coordinate)| dimension.at(coordinate)).collect();
        self.drive.run_values(run, &values, seed(&self.name, run as u64))
    }

    /// A run's values, with as few odd ones as possible, so that it is still uncaught.
    pub fn smallest(&self, run: &Run) -> Result<Run> {
        let drawn = &run.drawn;
        let is_uncaught = |values: &[f64]| -> Result<bool> {
            let run = self.drive.run_values(drawn.run, values, drawn.seed)?;
            Ok(run.outcome.verdict == Verdict::Uncaught)
        };
        let values = minimise(&DIMENSIONS, &drawn.values, is_uncaught)?;
        self.drive.run_values(drawn.run, &values, drawn.seed)
    }
}

/// Runs the campaign. Exit code 1 if a run is uncaught, or the document is not up to date.
pub fn run(runs: usize, options: &CampaignOptions) -> Result<ExitCode> {
    ensure!(runs > 0, "--random 0: must be at least 1");
    let random = Random::new(runs, options.seed, options.patterns(None))?;
    if let Some(run) = options.run {
        let run = random.run(run)?;
        crate::say!("{}", words(&run));
        let lost = run.outcome.verdict == Verdict::Uncaught;
        if lost {
            crate::say!("smallest: {}", words(&random.smallest(&run)?));
        }
        return Ok(ExitCode::from(u8::from(lost)));
    }
    let configuration =
        serde_json::to_value(Configuration { seed: options.seed, patterns: options.patterns(None) })?;
    let plan = Plan::new(RANDOM, configuration, runs, &Run::columns())?;
    if let Some(shard) = options.shard {
        shards::run(&plan, shard, &options.out, |run| random.run(run)?.row())?;
        return Ok(ExitCode::SUCCESS);
    }
    make_folder(&options.out)?;
    let bar = bar(runs as u64, "random [{bar:40}] {pos}/{len} {elapsed} (left {eta})");
    let row = |run: usize| {
        let row = random.run(run)?.row();
        bar.inc(1);
        row
    };
    let rows = (0..runs).into_par_iter().map(row).collect::<Result<_>>()?;
    bar.finish_and_clear();
    let merged = Merged { plan, rows };
    let mut good = finish(&merged, &options.out)?;
    if let Some(path) = &options.doc {
        let text = coverage(&Run::of(&merged)?);
        let part = match options.patterns(None) {
            PatternsName::Paper => Part::Coverage,
            PatternsName::Optimal => Part::OptimalCoverage,
        };
        let same = renew_with(path, part, &text, options.check_doc)?;
        if options.check_doc && !same {
            eprintln!("{}: not up to date", path.display());
            good = false;
        }
    }
    Ok(if good { ExitCode::SUCCESS } else { ExitCode::from(1) })
}

/// Writes campaign.csv and prints the coverage; `true` if nothing is uncaught. Uncaught runs are minimised.
fn finish(merged: &Merged, out: &Path) -> Result<bool> {
    write_text(&out.join("campaign.csv"), &merged.csv())?;
    let runs = Run::of(merged)?;
    crate::say!("{}", coverage(&runs).trim_end());
    let lost: Vec<_> = runs.iter().filter(|run| run.outcome.verdict == Verdict::Uncaught).collect();
    let Configuration { seed, patterns } = serde_json::from_value(merged.plan.configuration.clone())?;
    let random = Random::new(merged.plan.runs, seed, patterns)?;
    for (number, run) in lost.iter().enumerate() {
        eprintln!("uncaught: {}", words(run));
        if number < SMALL {
            eprintln!("smallest: {}", words(&random.smallest(run)?));
        }
    }
    Ok(lost.is_empty())
}

/// The same for merged shards.
pub fn merged(merged: &Merged, out: &Path) -> Result<bool> {
    finish(merged, out)
}

/// A run in words: its outcome, and the values that differ from a sound drive's.
fn words(run: &Run) -> String {
    let Run { outcome, drawn } = run;
    let odd =
        DIMENSIONS.iter().zip(&drawn.values).filter(|(dimension, value)| dimension.sound != Some(**value));
    let values: Vec<_> = odd.map(|(dimension, value)| format!("{} {value}", dimension.name)).collect();
    let named = if outcome.named.is_empty() { "no fault" } else { outcome.named.as_str() };
    format!(
        "run {} ({} {} {:.0} r/min {}, {}): {named}, {:?} {}; {}",
        drawn.run,
        outcome.fault,
        outcome.mode,
        outcome.speed_rpm,
        outcome.action.name(),
        drawn.modes,
        outcome.verdict,
        outcome.why,
        values.join(", ")
    )
}
