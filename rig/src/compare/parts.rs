//! The project's law with its parts taken away one at a time, in the runs where each part counts.

use super::outcome::{Cell, LAWS, Outcome, Outcomes, cell, trips, verdict};
use super::rows::{Plan, ROWS, words};
use crate::machine::Machine;
use anyhow::{Context, Result};
use std::collections::{BTreeMap, BTreeSet};

/// The run that shows the benefit of damping: constant power behind a choke.
const BEHIND_CHOKE: &str = "steady --speed 1900 --torque 1200 --line 3,4,30";

/// The run that shows the benefit of the integral part.
const RESISTIVE: &str = "load-steps --rs-error 50";

/// A row that is not in the comparison of both laws.
const DAMPING: Plan = Plan::of(
    "1,200 N·m at 1,900 r/min behind 3 mH, 4 mF and 30 mΩ: swing of the link",
    || words(&[BEHIND_CHOKE]),
    |law| {
        let swing = |figures: &_| verdict(figures, "swing of the link").map(|share| 100.0 * share);
        Ok(cell(law.read(&[BEHIND_CHOKE], swing)?, 2, "%"))
    },
);

/// Another such row: half as much resistance again as the tables have.
const RESISTANCE: Plan = Plan::of(
    "half as much resistance again, load steps at 200 r/min: overshoot, within 2 % after",
    || words(&[RESISTIVE]),
    |law| {
        let of = |what: &str| law.read(&[RESISTIVE], |figures| verdict(figures, what));
        let (over, settled) = (cell(of("overshoot")?, 1, "%"), cell(of("settled")?, 1, "ms"));
        Ok(Cell {
            text: format!("{}, {}", over.text, settled.text),
            values: [over.values, settled.values].concat(),
        })
    },
);

/// Each part: its name, the words that take it away, and the beginning of the quantity that it counts for.
const PARTS: [(&str, &str, &str); 13] = [
    ("prediction over committed pulses", "--ablate prediction", "load steps at 200 r/min"),
    ("prediction over committed pulses", "--ablate prediction", "full torque in one step"),
    ("ripple subtracted", "--ablate ripple", "current when the mode changes"),
    ("ripple subtracted", "--ablate ripple", "torque when the mode changes"),
    ("observer of the disturbance", "--ablate observer", "torque at the characteristic points"),
    ("observer of the disturbance", "--ablate observer", "flux map wrong by 10 %"),
    ("observer of the disturbance", "--ablate observer", "half as much resistance"),
    ("sixth harmonic in the observer", "--ablate sixth", "dead time of 5 µs"),
    ("that and the pulses' own compensation", "--uncompensated", "dead time of 5 µs"),
    ("torque of the ripple, foreseen", "--ablate foreseen", "torque when the mode changes"),
    ("trim of mean torque", "--ablate trim", "torque at the characteristic points"),
    ("trim of mean torque", "--ablate trim", "square wave"),
    ("damping of the link", "--ablate damping", "1,200 N·m at 1,900 r/min"),
];

/// A row: the part, the quantity, and its result with the part, without it, and with the papers' ordinary law.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PartRow {
    /// The part that is taken away.
    pub part: &'static str,
    /// The quantity.
    pub quantity: &'static str,
    /// With all parts, without this one, `--law pi`.
    pub found: [String; 3],
}

impl PartRow {
    /// The row as it stands in a document.
    pub fn markdown(&self) -> String {
        let [all, without, pi] = &self.found;
        format!("| {} | {} | {all} | {without} | {pi} |", self.part, self.quantity)
    }
}

/// A part's name, the words that take it away, and the row that it counts for.
type Less = (&'static str, &'static str, &'static Plan);

/// Each part with its row.
pub(super) fn planned() -> Result<Vec<Less>> {
    let row = |quantity| {
        ROWS.iter()
            .chain([&DAMPING, &RESISTANCE])
            .find(|row| row.quantity.starts_with(quantity))
            .context(quantity)
    };
    PARTS.into_iter().map(|(part, less, quantity)| Ok((part, less, row(quantity)?))).collect()
}

/// The command lines that the rows need.
pub(super) fn lines(plan: &[Less]) -> BTreeSet<String> {
    let lines = plan.iter().flat_map(|(_, less, row)| row.lines().into_iter().map(move |line| (line, *less)));
    lines.flat_map(|(line, less)| [LAWS[0], less, LAWS[1]].map(|more| format!("{line} {more}"))).collect()
}

/// The rows, made from the outcomes of the lines.
pub(super) fn found(plan: &[Less], driven: &BTreeMap<String, Outcome>, machine: &Machine) -> Vec<PartRow> {
    let row = |(part, less, row): &Less| {
        let found = [LAWS[0], *less, LAWS[1]].map(|more| read(row, more, driven, machine));
        PartRow { part, quantity: row.quantity, found }
    };
    plan.iter().map(row).collect()
}

/// A row's cell for a law, or without a part of ours, given the further words of the runs.
fn read(row: &Plan, more: &str, driven: &BTreeMap<String, Outcome>, machine: &Machine) -> String {
    let outcomes = Outcomes { law: 0, more, driven, machine };
    row.read(&outcomes).unwrap_or_else(trips).text
}
