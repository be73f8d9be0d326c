//! `compare`: both control laws on the same plant with the same options, and what each reached, row by row.

mod flaws;
mod outcome;
mod parts;
mod rows;
mod zs9;

pub use flaws::{FLAW_HEADS, FlawRow, flaws, table as flaws_table};
pub use outcome::Row;
pub use parts::PartRow;

use crate::files::{make_folder, write_text};
use crate::machine::Machine;
use crate::run::bar;
use crate::scenario::catalogue::{self, Chosen};
use crate::scenario::{Choice, System};
use crate::trace::Recorded;
use anyhow::{Context, Result};
use clap::Args;
use comfy_table::presets::NOTHING;
use comfy_table::{ContentArrangement, Table};
use outcome::{LAWS, Outcome, Outcomes};
use rayon::prelude::*;
use rows::Plan;
use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;
use std::process::ExitCode;

/// The heads of the table.
const HEADS: [&str; 4] = ["", "tractive", "--law pi", "ahead"];

/// The options of a comparison.
#[derive(Args, Clone, Debug)]
pub struct CompareOptions {
    /// Only rows whose name has each of these words.
    #[arg(long, value_name = "WORD", num_args = 1..)]
    pub only: Vec<String>,
    /// Instead: our law with its parts taken away one at a time.
    #[arg(long, conflicts_with = "only")]
    pub parts: bool,
    /// Instead: our law with the flaws of --real, one at a time and all at once.
    #[arg(long, conflicts_with_all = ["only", "parts"])]
    pub flaws: bool,
    /// Folder for compare.csv and compare.md, or parts.md, or flaws.md.
    #[arg(long)]
    pub out: Option<PathBuf>,
    /// Print the rows as JSON.
    #[arg(long)]
    pub json: bool,
}

/// Runs the rows whose name has each of the words.
pub fn rows(only: &[String]) -> Result<Vec<Row>> {
    let plan = planned(only)?;
    Ok(judged(&plan, &drive(lines(&plan))?, &Machine::load("pmasynrm-180kw")?))
}

/// Runs our law with its parts taken away one at a time.
pub fn parts() -> Result<Vec<PartRow>> {
    let plan = parts::planned()?;
    Ok(parts::found(&plan, &drive(parts::lines(&plan))?, &Machine::load("pmasynrm-180kw")?))
}

/// All of [`rows`] and [`parts`], which have many runs in common.
pub fn rows_and_parts() -> Result<(Vec<Row>, Vec<PartRow>)> {
    let (plan, less) = (planned(&[])?, parts::planned()?);
    let (driven, machine) = (drive(&lines(&plan) | &parts::lines(&less))?, Machine::load("pmasynrm-180kw")?);
    Ok((judged(&plan, &driven, &machine), parts::found(&less, &driven, &machine)))
}

fn planned(only: &[String]) -> Result<Vec<&'static Plan>> {
    let mut plan: Vec<_> = rows::ROWS.iter().chain(&zs9::ROWS).collect();
    plan.retain(|row| only.iter().all(|word| row.quantity.contains(word.as_str())));
    anyhow::ensure!(!plan.is_empty(), "--only {}: no row has all of these words", only.join(" "));
    Ok(plan)
}

fn lines(plan: &[&Plan]) -> BTreeSet<String> {
    let lines = plan.iter().flat_map(|row| row.lines());
    lines.flat_map(|line| LAWS.map(|law| format!("{line} {law}"))).collect()
}

fn judged(plan: &[&Plan], driven: &BTreeMap<String, Outcome>, machine: &Machine) -> Vec<Row> {
    let outcomes = [0, 1].map(|law| Outcomes { law, more: LAWS[law], driven, machine });
    plan.iter().map(|row| row.judge(&outcomes)).collect()
}

/// Runs command lines side by side; returns the outcome of each.
fn drive(lines: BTreeSet<String>) -> Result<BTreeMap<String, Outcome>> {
    let bar = bar(lines.len() as u64, "compare [{bar:40}] {pos}/{len} {elapsed} (left {eta})");
    let driven = lines.into_par_iter().map(|line| {
        let outcome = outcome_of(&line)?;
        bar.inc(1);
        Ok((line, outcome))
    });
    let driven = driven.collect::<Result<_>>();
    bar.finish_and_clear();
    driven
}

fn outcome_of(line: &str) -> Result<Outcome> {
    match catalogue::choose(line.split_whitespace())? {
        Chosen::Traction(choice) => outcome(&choice),
        Chosen::Zs9(choice) => outcome(&choice),
    }
    .with_context(|| line.to_owned())
}

fn outcome<S: System>(choice: &Choice<S>) -> Result<Outcome> {
    let machine = choice.machine()?;
    let recording = choice.drive(&machine)?;
    let trip = recording.trip().map(|trip| trip.fault.name());
    Ok(Outcome { figures: choice.figures(&recording, &machine), trip })
}

/// The command. Exit code 1 if a row is not ahead and no reason is given.
pub fn run(options: &CompareOptions) -> Result<ExitCode> {
    options.out.as_deref().map_or(Ok(()), make_folder)?;
    if options.parts {
        return run_parts(options);
    }
    if options.flaws {
        return run_flaws(options);
    }
    let rows = rows(&options.only)?;
    let cells = |row: &Row| [row.quantity.to_owned(), row.found[0].clone(), row.found[1].clone(), row.mark()];
    let mut table = Table::new();
    table.load_style(NOTHING).set_content_arrangement(ContentArrangement::Dynamic).set_header(HEADS);
    table.add_rows(rows.iter().map(cells));
    if options.json {
        crate::say!("{}", serde_json::to_string(&rows)?);
    } else {
        let ahead = rows.iter().filter(|row| row.ahead).count();
        crate::say!("{ahead} of {} rows ahead\n\n{}", rows.len(), table.trim_fmt());
    }
    if let Some(out) = &options.out {
        let mut csv = csv::Writer::from_path(out.join("compare.csv"))?;
        csv.write_record(["quantity", "tractive", "pi", "ahead"])?;
        for row in &rows {
            csv.write_record(cells(row))?;
        }
        csv.flush()?;
        let lines: Vec<_> = rows.iter().map(Row::markdown).collect();
        let text = format!("| | `tractive` | `--law pi` |\n|---|---|---|\n{}\n", lines.join("\n"));
        write_text(&out.join("compare.md"), &text)?;
    }
    let unexplained = rows.iter().any(|row| !row.ahead && row.why.is_empty());
    Ok(if unexplained { ExitCode::from(1) } else { ExitCode::SUCCESS })
}

/// The heads of the table of parts.
const PART_HEADS: [&str; 5] = ["part", "quantity", "with it", "without it", "--law pi"];

fn run_parts(options: &CompareOptions) -> Result<ExitCode> {
    let rows = parts()?;
    let mut table = Table::new();
    table.load_style(NOTHING).set_content_arrangement(ContentArrangement::Dynamic).set_header(PART_HEADS);
    table.add_rows(rows.iter().map(|row| {
        let [all, without, pi] = row.found.each_ref().map(String::as_str);
        [row.part, row.quantity, all, without, pi]
    }));
    crate::say!("{}", table.trim_fmt());
    if let Some(out) = &options.out {
        let lines: Vec<_> = rows.iter().map(PartRow::markdown).collect();
        let text =
            format!("| {} |\n|---|---|---:|---:|---:|\n{}\n", PART_HEADS.join(" | "), lines.join("\n"));
        write_text(&out.join("parts.md"), &text)?;
    }
    Ok(ExitCode::SUCCESS)
}

fn run_flaws(options: &CompareOptions) -> Result<ExitCode> {
    let rows = flaws()?;
    if options.json {
        crate::say!("{}", serde_json::to_string(&rows)?);
    } else {
        let mut table = Table::new();
        table.load_style(NOTHING).set_content_arrangement(ContentArrangement::Dynamic).set_header(FLAW_HEADS);
        table.add_rows(rows.iter().map(FlawRow::cells));
        crate::say!("{}", table.trim_fmt());
    }
    if let Some(out) = &options.out {
        write_text(&out.join("flaws.md"), &flaws_table(&rows))?;
    }
    Ok(ExitCode::SUCCESS)
}
