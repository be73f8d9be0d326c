//! The report: results area by area.

use crate::areas::Area;
use crate::results::{Count, KnownList, Outcome, Results};
use crate::run::{chosen, left_out};
use crate::shards;
use crate::tree::Tree;
use crate::{Options, Places};
use anyhow::Result;
use std::collections::BTreeMap;
use std::fmt::Write;

/// Errors that say that the mutant is no valid program: types that do not fit, a trait that is missing or not available while compiling, a missing arm,
/// an overflow that the compiler sees.
const UNVIABLE: [&str; 11] = [
    "E0277",
    "E0308",
    "E0369",
    "E0600",
    "E0599",
    "E0368",
    "E0282",
    "E0283",
    "E0790",
    "E0015",
    "arithmetic_overflow",
];

/// The counts of the areas, and their survivors that are not known.
fn counted(
    places: &Places,
    tree: &Tree,
    options: &Options,
) -> Result<(BTreeMap<Area, Count>, BTreeMap<Area, String>)> {
    let results = Results::open(&shards::file(places, options), None)?;
    let known = KnownList::read(&places.root.join("mutants/known.toml"), &tree.mutants)?;
    let left_out = left_out(places, tree);
    let mut counts: BTreeMap<Area, Count> = BTreeMap::new();
    let mut survivors: BTreeMap<Area, String> = BTreeMap::new();
    for mutant in chosen(&tree.mutants, options) {
        let Some(area) = mutant.area() else { continue };
        let count = counts.entry(area).or_default();
        let list = survivors.entry(area).or_default();
        if let Some(code) = left_out.get(&mutant.number).map(String::as_str) {
            let of = if UNVIABLE.contains(&code) { &mut count.unviable } else { &mut count.elsewhere };
            *of += 1;
            continue;
        }
        let Some(line) = results.of(mutant) else {
            // A sample tries none of those that need a build of their own.
            let of = if (mutant.fixed || mutant.early) && options.sample.is_some() {
                &mut count.elsewhere
            } else {
                &mut count.open
            };
            *of += 1;
            continue;
        };
        if line.outcome == Outcome::NoProgram {
            count.unviable += 1;
            continue;
        }
        *count.of.entry(line.outcome).or_default() += 1;
        if matches!(line.outcome, Outcome::Missed | Outcome::Unreached | Outcome::Golden) {
            if known.has(mutant) {
                count.known += 1;
            } else {
                writeln!(list, "{}  [{:?} {}]\n    {}", mutant.name(), line.outcome, line.by, mutant.source)?;
            }
        }
    }
    Ok((counts, survivors))
}

/// Prints the table and writes a list of survivors for each area; `true` if all were tried and all survivors are known.
pub fn print(places: &Places, tree: &Tree, options: &Options) -> Result<bool> {
    let (counts, survivors) = counted(places, tree, options)?;
    println!(
        "area            tests   late  bytes missed nobody   open | unviable elsewhere |  known | tests %  +bytes %"
    );
    for (area, count) in &counts {
        let of = |outcome| count.of.get(&outcome).copied().unwrap_or(0);
        let (tests, all) = count.shares();
        println!(
            "{:<14} {:>6} {:>6} {:>6} {:>6} {:>6} {:>6} | {:>8} {:>9} | {:>6} | {tests:>6.1} {all:>9.1}  (asked {})",
            area.name(),
            of(Outcome::Killed),
            of(Outcome::Late),
            of(Outcome::Golden),
            of(Outcome::Missed),
            of(Outcome::Unreached),
            count.open,
            count.unviable,
            count.elsewhere,
            count.known,
            area.bound(),
        );
        let list = survivors.get(area).map_or("", String::as_str);
        std::fs::write(places.work.join(format!("survivors-{}.txt", area.name())), list)?;
    }
    let [noticed, tried] = counts.values().map(Count::noticed).fold([0; 2], |[a, b], [c, d]| [a + c, b + d]);
    let share = 100.0 * noticed as f64 / tried.max(1) as f64;
    println!("{noticed} of {tried} are noticed by tests, or known: {share:.1} %");
    let open: usize = counts.values().map(|count| count.open).sum();
    if open > 0 {
        println!("{open} were not tried");
    }
    Ok(open == 0 && options.least.map_or(noticed == tried, |least| share >= least))
}
