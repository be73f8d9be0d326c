//! `campaign`: runs cases, prints the table and writes it.

use super::judge::Verdict;
use super::options::CampaignOptions;
use super::{Campaign, Case, Outcome, healthy, random, report};
use crate::ablation::Ablation;
use crate::files::make_folder;
use crate::machine::Machine;
use crate::run::bar;
use crate::scenario::traction::PatternsName;
use crate::shards::{self, Merged, Plan};
use anyhow::{Context, Result, bail, ensure};
use std::collections::BTreeMap;
use std::path::Path;
use std::process::ExitCode;

/// The name of the campaign of the listed cases.
pub const FAULTS: &str = "faults";

/// Runs the campaign. Exit code 1 if a case is uncaught, or the document is not up to date.
pub fn run(options: &CampaignOptions) -> Result<ExitCode> {
    if let Some(minutes) = options.healthy {
        return healthy::command::run(minutes, options);
    }
    if let Some(runs) = options.random {
        return random::command::run(runs, options);
    }
    let machine = options.machine()?;
    let patterns = options.patterns(machine.as_ref());
    let is_usual = patterns == PatternsName::Paper;
    ensure!(
        options.doc.is_none() || is_usual,
        "--doc: of other patterns the campaign at random alone has a part"
    );
    let campaign = campaign(machine, options.without)?.with(patterns);
    if let Some(most_rpm) = campaign.most_rpm() {
        eprintln!(
            "no case above {most_rpm:.0} r/min: there the EMF alone makes a current above trip_current_a flow through the diodes"
        );
    }
    let cases = cases(&campaign, options)?;
    let given = serde_json::json!({
        "machine": options.machine,
        "fast": options.fast,
        "only": options.only,
        "without": options.without.map(Ablation::name),
        "patterns": patterns,
    });
    if let Some(shard) = options.shard {
        let plan = Plan::new(FAULTS, given, cases.len(), Outcome::COLUMNS)?;
        let row = |run: usize| {
            let case = cases.get(run).context("a case of that number")?;
            shards::csv_row(&campaign.run(case).with_context(|| case.name())?)
        };
        shards::run(&plan, shard, &options.out, row)?;
        return Ok(ExitCode::SUCCESS);
    }
    make_folder(&options.out)?;
    let bar = bar(cases.len() as u64, "campaign [{bar:40}] {pos}/{len} {elapsed} (left {eta})");
    let outcomes = campaign.run_all(&cases, || bar.inc(1))?;
    bar.finish_and_clear();
    let mut good = finish(&outcomes, given, &options.out, options.json)?;
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

/// The drives that are chosen.
fn campaign(machine: Option<Machine>, without: Option<Ablation>) -> Result<Campaign> {
    match machine {
        Some(machine) => Campaign::of(machine, without),
        None => Campaign::new(without),
    }
}

/// The cases that are chosen.
fn cases(campaign: &Campaign, options: &CampaignOptions) -> Result<Vec<Case>> {
    let mut cases = campaign.cases(options.fast);
    cases.retain(|case| {
        let name = case.name();
        options.only.iter().all(|word| name.split(' ').any(|part| part.contains(word.as_str())))
    });
    if cases.is_empty() {
        bail!("--only {}: no case has all of these words", options.only.join(" "));
    }
    Ok(cases)
}

/// Writes and prints the outcomes of the cases; `true` if none is uncaught.
fn finish(outcomes: &[Outcome], given: serde_json::Value, out: &Path, json: bool) -> Result<bool> {
    let machine = given["machine"].as_str().map(str::to_owned);
    report::write(outcomes, given, out)?;
    if json {
        let totals = report::SYSTEMS.map(|(system, _)| (system, report::total(outcomes, system)));
        crate::say!("{}", serde_json::to_string(&BTreeMap::from(totals))?);
    } else {
        crate::say!("{}", report::text(outcomes, machine.as_deref()).trim_start());
        crate::say!("report: {}", out.join("report.html").display());
    }
    let lost: Vec<_> = outcomes.iter().filter(|outcome| outcome.verdict == Verdict::Uncaught).collect();
    for outcome in &lost {
        let (system, fault, mode, speed_rpm, why) =
            (outcome.system, &outcome.fault, &outcome.mode, outcome.speed_rpm, &outcome.why);
        eprintln!("uncaught: {system} {fault} {mode} {speed_rpm} r/min {}: {why}", outcome.action.name());
    }
    Ok(lost.is_empty())
}

/// Writes from merged shards the files and the text that `campaign` gives without shards; `true` if nothing is uncaught.
pub fn merged(merged: &Merged, out: &Path, json: bool) -> Result<bool> {
    finish(&merged.read()?, merged.plan.configuration.clone(), out, json)
}
