//! `campaign --healthy`: drives the minutes in pieces, and reports what tripped.

use super::{Driven, dual as random_dual, traction as random_traction};
use crate::campaign::options::CampaignOptions;
use crate::campaign::{dual, report, traction};
use crate::files::write_text;
use crate::run::bar;
use crate::shards::{self, Merged, Plan};
use anyhow::{Context, Result, bail};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;
use std::process::ExitCode;

/// The name of the campaign.
pub const HEALTHY: &str = "healthy";
/// Minutes of a piece: pieces are driven on all cores.
const PIECE_MIN: f64 = 0.5;

/// The outcome of a piece.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Piece {
    /// The system.
    pub system: String,
    /// Its number.
    pub piece: usize,
    /// The seed of its driving.
    pub seed: u64,
    /// Largest phase current, in A.
    pub current_a: f64,
    /// Highest DC voltage, in V.
    pub udc_v: f64,
    /// The trip in words; empty without one.
    pub tripped: String,
}

/// The head of its CSV.
const COLUMNS: &str = "system,piece,seed,current_a,udc_v,tripped";

/// The drives and what is asked of them.
struct Course<'a> {
    systems: Vec<&'static str>,
    pieces: usize,
    piece_s: f64,
    drive: traction::Drive,
    dual: dual::Drive,
    options: &'a CampaignOptions,
}

impl Course<'_> {
    fn piece(&self, run: usize) -> Result<Piece> {
        let system = self.systems.get(run / self.pieces).context("a system of that number")?;
        let piece = run % self.pieces;
        let seed = shards::seed(&format!("{HEALTHY} {}", self.options.seed), piece as u64);
        let driven: Driven = match *system {
            "zs9" => random_dual::drive(&self.dual, self.piece_s, seed)?.into(),
            _ => random_traction::drive(&self.drive, self.piece_s, seed, self.options.blocks)?.into(),
        };
        Ok(Piece {
            system: (*system).to_owned(),
            piece,
            seed,
            current_a: driven.peaks.current_a,
            udc_v: driven.peaks.udc_v,
            tripped: driven.tripped.unwrap_or_default(),
        })
    }
}

/// Drives; exit code 1 if something trips.
pub fn run(minutes: f64, options: &CampaignOptions) -> Result<ExitCode> {
    let pieces = (minutes / PIECE_MIN).ceil() as usize;
    let mut systems = report::SYSTEMS.map(|(system, _)| system).to_vec();
    systems.retain(|system| options.only.iter().all(|word| system.contains(word.as_str())));
    if systems.is_empty() {
        bail!("--only {}: no system has all of these words", options.only.join(" "));
    }
    let course = Course {
        pieces,
        piece_s: minutes * 60.0 / pieces as f64,
        drive: traction::Drive::new(options.without)?.with(options.patterns(None)),
        dual: dual::Drive::new(options.without)?,
        systems,
        options,
    };
    let runs = course.systems.len() * pieces;
    if let Some(shard) = options.shard {
        let configuration = serde_json::json!({
            "minutes": minutes,
            "only": options.only,
            "without": options.without.map(crate::ablation::Ablation::name),
            "blocks": options.blocks,
            "patterns": options.patterns(None),
            "seed": options.seed,
        });
        let plan = Plan::new(HEALTHY, configuration, runs, COLUMNS)?;
        shards::run(&plan, shard, &options.out, |run| shards::csv_row(&course.piece(run)?))?;
        return Ok(ExitCode::SUCCESS);
    }
    let bar = bar(runs as u64, "healthy [{bar:40}] {pos}/{len} {elapsed} (left {eta})");
    let piece = |run: usize| {
        let piece = course.piece(run);
        bar.inc(1);
        piece
    };
    let driven = (0..runs).into_par_iter().map(piece).collect::<Result<Vec<_>>>()?;
    bar.finish_and_clear();
    Ok(if tell(&driven, minutes, options.json)? { ExitCode::SUCCESS } else { ExitCode::from(1) })
}

/// Prints the outcome of the pieces; `true` if nothing tripped.
fn tell(driven: &[Piece], minutes: f64, json: bool) -> Result<bool> {
    let mut totals = BTreeMap::new();
    for (system, _) in report::SYSTEMS {
        let of: Vec<_> = driven.iter().filter(|piece| piece.system == system).collect();
        if of.is_empty() {
            continue;
        }
        let most = |value: fn(&Piece) -> f64| of.iter().map(|piece| value(piece)).fold(0.0, f64::max);
        let (current_a, udc_v) = (most(|piece| piece.current_a), most(|piece| piece.udc_v));
        let tripped: Vec<_> = of.iter().filter(|piece| !piece.tripped.is_empty()).collect();
        for Piece { piece, seed, tripped, .. } in &tripped {
            eprintln!("{system}, piece {piece}, seed {seed}: {tripped}");
        }
        let (pieces, trips) = (of.len(), tripped.len());
        if !json {
            crate::say!(
                "{system}: {minutes} min of driving in {pieces} pieces: {trips} trips, {current_a:.0} A and {udc_v:.0} V at most"
            );
        }
        let total = serde_json::json!({ "minutes": minutes, "pieces": pieces, "trips": trips, "peak_current_a": current_a, "highest_udc_v": udc_v });
        totals.insert(system, total);
    }
    if json {
        crate::say!("{}", serde_json::to_string(&totals)?);
    }
    Ok(driven.iter().all(|piece| piece.tripped.is_empty()))
}

/// Writes campaign.csv of merged shards, and prints what `campaign --healthy` prints; `true` if nothing tripped.
pub fn merged(merged: &Merged, out: &Path, json: bool) -> Result<bool> {
    write_text(&out.join("campaign.csv"), &merged.csv())?;
    let minutes = merged.plan.configuration.get("minutes").and_then(serde_json::Value::as_f64);
    tell(&merged.read()?, minutes.context("a configuration without its minutes")?, json)
}
