//! The coverage of random runs: modes, borders, names, safe states, and the spread of what was drawn.

use crate::campaign::Action;
use crate::campaign::drawn::Run;
use crate::campaign::report::{sentences, total};
use std::collections::BTreeMap;
use std::fmt::Write as _;

/// The number of times that each mode, border, fault and safe state was met, as Markdown.
pub fn coverage(runs: &[Run]) -> String {
    let outcomes: Vec<_> = runs.iter().map(|run| run.outcome.clone()).collect();
    let mut text = String::new();
    if let Some(total) = total(&outcomes, "pmasynrm") {
        let _ = writeln!(text, "{}", sentences(&total));
    }
    let mut modes: BTreeMap<&str, [usize; 3]> = BTreeMap::new();
    let (mut borders, mut ends, mut faults) = (BTreeMap::new(), BTreeMap::new(), BTreeMap::new());
    for Run { outcome, drawn } in runs {
        let counts = modes.entry(&outcome.mode).or_default();
        for (count, action) in counts.iter_mut().zip(Action::ALL) {
            *count += usize::from(outcome.action == action);
        }
        let path: Vec<&str> = drawn.modes.split('>').collect();
        for pair in path.windows(2).filter(|pair| !pair.contains(&"off")) {
            *borders.entry(pair.join(" → ")).or_insert(0_usize) += 1;
        }
        if !outcome.named.is_empty() {
            *ends.entry((outcome.named.as_str(), outcome.safe_state.as_str())).or_insert(0_usize) += 1;
        }
        *faults.entry(outcome.fault.as_str()).or_insert(0_usize) += 1;
    }
    let _ = writeln!(text, "| mode when the fault came | motoring | braking | coasting |\n|---|--:|--:|--:|");
    for (mode, [motoring, braking, coasting]) in modes {
        let _ = writeln!(text, "| {mode} | {motoring} | {braking} | {coasting} |");
    }
    let _ = writeln!(text, "\n| border crossed | times |\n|---|--:|");
    for (border, count) in borders {
        let _ = writeln!(text, "| {border} | {count} |");
    }
    let _ = writeln!(text, "\n| fault named | safe state | times |\n|---|---|--:|");
    for ((named, safe), count) in ends {
        let _ = writeln!(text, "| {named} | {safe} | {count} |");
    }
    let fewest = faults.iter().min_by_key(|(_, count)| **count);
    if let Some((fault, count)) = fewest {
        let _ = writeln!(text, "\n{} faults, each at least {count} times ({fault}).", faults.len());
    }
    text
}
