//! The outcome of a law's runs, and the table's rows made from it.

use crate::analysis::Figures;
use crate::machine::Machine;
use serde_json::Value;
use std::collections::BTreeMap;

/// The laws as words of a command line: the project's own, then the ordinary one.
pub(super) const LAWS: [&str; 2] = ["--law tractive", "--law pi"];

/// The end of a run: its figures, and the fault that tripped it.
pub(super) struct Outcome {
    pub(super) figures: Figures,
    pub(super) trip: Option<&'static str>,
}

/// The outcomes of a law, by the words of their runs.
pub(super) struct Outcomes<'a> {
    pub(super) law: usize,
    /// The words that the runs had besides their own.
    pub(super) more: &'a str,
    pub(super) driven: &'a BTreeMap<String, Outcome>,
    pub(super) machine: &'a Machine,
}

/// A law's result in a row: its printed form, and its numbers; less is better.
pub(super) struct Cell {
    pub(super) text: String,
    pub(super) values: Vec<f64>,
}

/// A row of the table.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize)]
pub struct Row {
    /// The quantity.
    pub quantity: &'static str,
    /// The results: the project's own law, then the ordinary one.
    pub found: [String; 2],
    /// The paper's statement on it, if there is one.
    pub paper: &'static str,
    /// `true` if the project's own law is ahead in each number.
    pub ahead: bool,
    /// The reason if it is not; empty if none is known.
    pub why: &'static str,
}

impl Row {
    /// The last cell: `yes`, or why not.
    pub fn mark(&self) -> String {
        match (self.ahead, self.why) {
            (true, _) => "yes".to_owned(),
            (false, "") => "no, for no reason known".to_owned(),
            (false, why) => format!("no: {why}"),
        }
    }

    /// The row as it stands in a document: quantity, own, others.
    pub fn markdown(&self) -> String {
        let [own, pi] = &self.found;
        let paper =
            if self.paper.is_empty() { String::new() } else { format!("; the paper: {}", self.paper) };
        let why = if self.ahead { String::new() } else { format!("; not ahead: {}", self.why) };
        format!("| {} | {own} | {pi}{paper}{why} |", self.quantity)
    }
}

impl Outcomes<'_> {
    /// The outcome of a run.
    pub(super) fn of(&self, line: &str) -> Option<&Outcome> {
        self.driven.get(&format!("{line} {}", self.more))
    }

    /// The figures of a run; the fault if it tripped.
    pub(super) fn figures(&self, line: &str) -> Result<&Figures, &'static str> {
        let outcome = self.of(line).ok_or("not run")?;
        outcome.trip.map_or(Ok(&outcome.figures), Err)
    }

    /// The numbers of these runs, one after another; the fault if one of them tripped.
    pub(super) fn read(
        &self,
        lines: &[&str],
        number: impl Fn(&Figures) -> Option<f64>,
    ) -> Result<Vec<f64>, &'static str> {
        lines.iter().map(|line| number(self.figures(line)?).ok_or("not seen")).collect()
    }
}

/// Numbers one after another, with their unit.
pub(super) fn cell(values: Vec<f64>, count: usize, unit: &str) -> Cell {
    let texts: Vec<_> = values.iter().map(|value| format!("{value:.count$} {unit}")).collect();
    Cell { text: texts.join(", "), values }
}

/// The cell of a run that tripped.
pub(super) fn trips(fault: &str) -> Cell {
    Cell { text: format!("trips: {fault}"), values: vec![f64::INFINITY] }
}

/// The figure of a verdict whose name begins like this.
pub(super) fn verdict(figures: &Figures, what: &str) -> Option<f64> {
    let verdicts = figures.get("verdicts")?.as_array()?.iter();
    verdicts
        .filter(|one| one["what"].as_str().is_some_and(|name| name.starts_with(what)))
        .find_map(|one| one["found"].as_f64())
}

/// The numbers of a field over a list.
pub(super) fn field(figures: &Figures, list: &str, name: &str) -> Vec<f64> {
    let rows = figures.get(list).and_then(Value::as_array).map_or(&[][..], Vec::as_slice);
    rows.iter().filter_map(|row| row[name].as_f64()).collect()
}
