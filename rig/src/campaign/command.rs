//! `campaign`: runs cases, prints the table and writes it.

use super::judge::Verdict;
use super::{Campaign, dual, healthy, report, traction};
use crate::run::bar;
use crate::without::Ablation;
use anyhow::{Context, Result, bail};
use clap::Args;
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::process::ExitCode;

/// The options of a campaign.
#[derive(Args, Clone, Debug)]
pub struct CampaignOptions {
    /// Each fault of each kind once in each mode, instead of every case.
    #[arg(long)]
    pub fast: bool,
    /// Only cases whose name (system, fault, speed in r/min, the ZS9's scheme, action) has each of these words.
    #[arg(long, value_name = "WORD", num_args = 1..)]
    pub only: Vec<String>,
    /// One protection off: a fault's name, short_circuit or leg_safe_state. The cases that are lost are then listed.
    #[arg(long, value_name = "PROTECTION")]
    pub without: Option<Ablation>,
    /// Folder for cases.csv, summary.json and report.html.
    #[arg(long, default_value = "target/tractive/campaign")]
    pub out: PathBuf,
    /// A document whose generated part is written anew: the tables of the fast campaign, the totals of the full one.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["only", "without"])]
    pub doc: Option<PathBuf>,
    /// The document is not written: whether it is up to date decides on the exit code.
    #[arg(long, requires = "doc")]
    pub check_doc: bool,
    /// Instead of faults: this many minutes of hard but healthy driving, at random, in which nothing may trip.
    #[arg(long, value_name = "MINUTES", value_parser = crate::options::positive)]
    pub healthy: Option<f64>,
    /// With --healthy: the gates are blocked and released now and then, too.
    #[arg(long, requires = "healthy")]
    pub blocks: bool,
    /// Seed of the driving.
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    /// Print the totals as JSON.
    #[arg(long)]
    pub json: bool,
}

/// Runs the campaign. Exit code 1 where a case is uncaught, or the document is not up to date.
pub fn run(options: &CampaignOptions) -> Result<ExitCode> {
    if let Some(minutes) = options.healthy {
        return drive_healthy(minutes, options);
    }
    let mut cases = super::cases(options.fast);
    cases.retain(|case| {
        let name = case.name();
        options.only.iter().all(|word| name.split(' ').any(|part| part.contains(word.as_str())))
    });
    if cases.is_empty() {
        bail!("--only {}: no case has all of these words", options.only.join(" "));
    }
    std::fs::create_dir_all(&options.out).with_context(|| format!("--out {}", options.out.display()))?;
    let bar = bar(cases.len() as u64, "campaign [{bar:40}] {pos}/{len} {elapsed} (left {eta})");
    let outcomes = Campaign::new(options.without)?.run_all(&cases, || bar.inc(1))?;
    bar.finish_and_clear();
    let given = serde_json::json!({
        "fast": options.fast,
        "only": options.only,
        "without": options.without.map(Ablation::name),
    });
    report::write(&outcomes, given, &options.out)?;
    if options.json {
        let totals = report::SYSTEMS.map(|(system, _)| (system, report::total(&outcomes, system)));
        crate::say!("{}", serde_json::to_string(&BTreeMap::from(totals))?);
    } else {
        crate::say!("{}", report::text(&outcomes).trim_start());
        crate::say!("report: {}", options.out.join("report.html").display());
    }
    let lost: Vec<_> = outcomes.iter().filter(|outcome| outcome.verdict == Verdict::Uncaught).collect();
    for outcome in &lost {
        let (system, fault, mode, speed_rpm, why) =
            (outcome.system, &outcome.fault, &outcome.mode, outcome.speed_rpm, &outcome.why);
        eprintln!("uncaught: {system} {fault} {mode} {speed_rpm} r/min {}: {why}", outcome.action.name());
    }
    let mut good = lost.is_empty();
    if let Some(path) = &options.doc {
        let part = if options.fast { report::Part::Tables } else { report::Part::Sentences };
        let same = report::renew(path, &outcomes, part, options.check_doc)?;
        if options.check_doc && !same {
            eprintln!("{}: not up to date", path.display());
            good = false;
        }
    }
    Ok(if good { ExitCode::SUCCESS } else { ExitCode::from(1) })
}

/// Minutes of a piece: pieces are driven on all cores.
const PIECE_MIN: f64 = 0.5;

fn drive_healthy(minutes: f64, options: &CampaignOptions) -> Result<ExitCode> {
    let drive = traction::Drive::new(options.without)?;
    let dual = dual::Drive::new(options.without)?;
    let pieces = (minutes / PIECE_MIN).ceil() as u64;
    let piece_s = minutes * 60.0 / pieces as f64;
    let seeds: Vec<_> = (0..pieces).map(|piece| options.seed + piece).collect();
    let mut systems = report::SYSTEMS.map(|(system, _)| system).to_vec();
    systems.retain(|system| options.only.iter().all(|word| system.contains(word.as_str())));
    if systems.is_empty() {
        bail!("--only {}: no system has all of these words", options.only.join(" "));
    }
    let rides: Vec<_> =
        systems.iter().flat_map(|system| seeds.iter().map(move |seed| (*system, *seed))).collect();
    let bar = bar(rides.len() as u64, "healthy [{bar:40}] {pos}/{len} {elapsed} (left {eta})");
    let ridden = rides.par_iter().map(|(system, seed)| {
        let driven = match *system {
            "zs9" => healthy::dual::drive(&dual, piece_s, *seed)?.into(),
            _ => healthy::traction::drive(&drive, piece_s, *seed, options.blocks)?.into(),
        };
        bar.inc(1);
        Ok((*system, *seed, driven))
    });
    let ridden: Vec<(&str, u64, healthy::Driven)> = ridden.collect::<Result<_>>()?;
    bar.finish_and_clear();
    let (mut good, mut totals) = (true, BTreeMap::new());
    for system in &systems {
        let (mut trips, mut current_a, mut udc_v) = (0, 0.0_f64, 0.0_f64);
        for (_, seed, driven) in ridden.iter().filter(|(of, _, _)| of == system) {
            current_a = current_a.max(driven.peaks.current_a);
            udc_v = udc_v.max(driven.peaks.udc_v);
            if let Some(tripped) = &driven.tripped {
                trips += 1;
                eprintln!("{system}, seed {seed}: {tripped}");
            }
        }
        if options.json {
            let total = serde_json::json!({ "minutes": minutes, "pieces": pieces, "trips": trips, "peak_current_a": current_a, "highest_udc_v": udc_v });
            totals.insert(*system, total);
            good &= trips == 0;
            continue;
        }
        crate::say!(
            "{system}: {minutes} min of driving in {pieces} pieces: {trips} trips, {current_a:.0} A and {udc_v:.0} V at most"
        );
        good &= trips == 0;
    }
    if options.json {
        crate::say!("{}", serde_json::to_string(&totals)?);
    }
    Ok(if good { ExitCode::SUCCESS } else { ExitCode::from(1) })
}
