//! The coverage of random runs: modes, regions, borders, names, safe states, and the spread of what was drawn.

use crate::campaign::drawn::Run;
use crate::campaign::report::{sentences, total};
use crate::campaign::{Action, Outcome};
use std::collections::BTreeMap;
use std::fmt::Write as _;

/// Counts for each name, by action.
type Actions<'a> = BTreeMap<&'a str, [usize; 3]>;

/// The number of times that each mode, region, border, fault and safe state was met, as Markdown.
pub fn coverage(runs: &[Run]) -> String {
    let outcomes: Vec<_> = runs.iter().map(|run| run.outcome.clone()).collect();
    let mut text = String::new();
    if let Some(total) = total(&outcomes, "pmasynrm") {
        let _ = writeln!(text, "{}{}\n", sentences(&total), zeros(&outcomes));
    }
    let (mut modes, mut regions) = (Actions::new(), Actions::new());
    let (mut borders, mut ends, mut faults) = (BTreeMap::new(), BTreeMap::new(), BTreeMap::new());
    for Run { outcome, drawn } in runs {
        for (counts, what) in [(&mut modes, &outcome.mode), (&mut regions, &drawn.region)] {
            let counts = counts.entry(what).or_default();
            for (count, action) in counts.iter_mut().zip(Action::ALL) {
                *count += usize::from(outcome.action == action);
            }
        }
        let path: Vec<&str> = drawn.modes.split('>').collect();
        for pair in path.windows(2).filter(|pair| !pair.contains(&"off")) {
            *borders.entry(pair.join(" → ")).or_insert(0_usize) += 1;
        }
        *ends.entry((outcome.named.as_str(), outcome.safe_state.as_str())).or_insert(0_usize) += 1;
        if outcome.fault != "none" {
            *faults.entry(outcome.fault.as_str()).or_insert(0_usize) += 1;
        }
    }
    for (head, counts) in [("mode", modes), ("operating point", regions)] {
        let _ = writeln!(
            text,
            "| {head} when the fault came | motoring | braking | coasting |\n|---|--:|--:|--:|"
        );
        for (what, [motoring, braking, coasting]) in counts {
            let _ = writeln!(text, "| {what} | {motoring} | {braking} | {coasting} |");
        }
        text.push('\n');
    }
    let _ = writeln!(text, "| border crossed | times |\n|---|--:|");
    for (border, count) in borders {
        let _ = writeln!(text, "| {border} | {count} |");
    }
    let _ = writeln!(text, "\n| fault named | state at the end | times |\n|---|---|--:|");
    for ((named, safe), count) in ends {
        let (named, safe) = if named.is_empty() { ("–", "pulses") } else { (named, safe) };
        let _ = writeln!(text, "| {named} | {safe} | {count} |");
    }
    let fewest = faults.iter().min_by_key(|(_, count)| **count);
    if let Some((fault, count)) = fewest {
        let _ = writeln!(text, "\n{} faults, each at least {count} times ({fault}).", faults.len());
    }
    text
}

/// False trips, and numbers that are not finite.
fn zeros(outcomes: &[Outcome]) -> String {
    let sound: Vec<_> = outcomes.iter().filter(|outcome| outcome.fault == "none").collect();
    let false_trips = sound.iter().filter(|outcome| !outcome.named.is_empty()).count();
    let not_finite = outcomes.iter().flat_map(Outcome::numbers).filter(|number| !number.is_finite()).count();
    format!(
        "- runs without a fault: {}, false trips: {false_trips}; numbers that are not finite: {not_finite}",
        sound.len()
    )
}
