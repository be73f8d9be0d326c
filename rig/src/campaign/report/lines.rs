//! Cases in groups, a line each, and the lines as a table.

use super::Tally;
use crate::campaign::Outcome;
use serde::Serialize;
use std::collections::BTreeSet;
use std::fmt::Write as _;

/// All cases that have something in common, in one line.
#[derive(Clone, Debug, Serialize)]
pub struct Line {
    /// The system.
    pub system: &'static str,
    /// The property that the cases have in common.
    pub what: String,
    /// The counts of their ends.
    #[serde(flatten)]
    pub tally: Tally,
    /// The names that the drive gave.
    pub named: String,
    /// The safe states that it chose.
    pub safe_states: String,
    /// The longest time from the first effect to safe gates, in carrier periods.
    pub carrier_periods: f64,
    /// The same, in ms.
    pub time_ms: f64,
    /// Largest phase current until the gates were safe, in A, or over the whole case if the drive went on.
    pub current_until_a: f64,
    /// And after that.
    pub current_after_a: f64,
    /// Largest DC voltage until the gates were safe, in V, or over the whole case.
    pub udc_until_v: f64,
    /// And after that.
    pub udc_after_v: f64,
    /// The ZS9's largest capacitor voltage until the gates were safe, in V, or over the whole case.
    pub uc_until_v: Option<f64>,
    /// And after that.
    pub uc_after_v: Option<f64>,
    /// The largest ratio of a phase current to its limit, of all cases.
    pub current_share: f64,
    /// The highest ratio of the voltage with safe gates to the forced one, or to the trip level if that is higher; for the ZS9 a capacitor's.
    pub voltage_share: f64,
}

/// Lines of the outcomes in groups, in the order in which they first come.
pub fn lines(outcomes: &[Outcome], group: impl Fn(&Outcome) -> String) -> Vec<Line> {
    let mut groups: Vec<(&'static str, String, Vec<&Outcome>)> = Vec::new();
    for outcome in outcomes {
        let what = group(outcome);
        match groups.iter_mut().find(|(system, name, _)| *system == outcome.system && *name == what) {
            Some((_, _, members)) => members.push(outcome),
            None => groups.push((outcome.system, what, vec![outcome])),
        }
    }
    groups.into_iter().map(|(system, what, members)| line(system, what, &members)).collect()
}

fn line(system: &'static str, what: String, members: &[&Outcome]) -> Line {
    let most = |value: fn(&Outcome) -> f64| members.iter().map(|outcome| value(outcome)).fold(0.0, f64::max);
    let all = |value: fn(&Outcome) -> &str| {
        let texts: BTreeSet<_> =
            members.iter().map(|outcome| value(outcome)).filter(|text| !text.is_empty()).collect();
        texts.into_iter().collect::<Vec<_>>().join(", ")
    };
    Line {
        system,
        what,
        tally: Tally::of(members.iter().copied()),
        named: all(|outcome| &outcome.named),
        safe_states: all(|outcome| &outcome.safe_state),
        carrier_periods: most(|outcome| outcome.carrier_periods.unwrap_or(0.0)),
        time_ms: most(|outcome| outcome.time_ms.unwrap_or(0.0)),
        current_until_a: most(|outcome| outcome.current_until_a),
        current_after_a: most(|outcome| outcome.current_after_a),
        udc_until_v: most(|outcome| outcome.udc_until_v),
        udc_after_v: most(|outcome| outcome.udc_after_v),
        uc_until_v: members.iter().filter_map(|outcome| outcome.uc_until_v).reduce(f64::max),
        uc_after_v: members.iter().filter_map(|outcome| outcome.uc_after_v).reduce(f64::max),
        current_share: most(Outcome::current_share),
        voltage_share: most(Outcome::voltage_share),
    }
}

/// By fault.
pub fn by_fault(outcomes: &[Outcome]) -> Vec<Line> {
    lines(outcomes, |outcome| outcome.fault.clone())
}

/// By mode and action.
pub fn by_mode(outcomes: &[Outcome]) -> Vec<Line> {
    lines(outcomes, |outcome| format!("{} {}", outcome.mode, outcome.action.name()))
}

/// By speed and safe state.
pub fn by_safe_state(outcomes: &[Outcome]) -> Vec<Line> {
    let mut stopped: Vec<_> =
        outcomes.iter().filter(|outcome| !outcome.safe_state.is_empty()).cloned().collect();
    stopped.sort_by(|a, b| {
        let key = |outcome: &Outcome| (outcome.system, outcome.speed_rpm.abs());
        let ((system_a, speed_a), (system_b, speed_b)) = (key(a), key(b));
        system_a.cmp(system_b).then(speed_a.total_cmp(&speed_b)).then(a.safe_state.cmp(&b.safe_state))
    });
    lines(&stopped, |outcome| format!("{:.0} r/min, {}", outcome.speed_rpm.abs(), outcome.safe_state))
}

/// A column after the heading: its head, and its content for a line.
type Column = (&'static str, fn(&Line) -> String);

const COLUMNS: [Column; 16] = [
    ("cases", |line| line.tally.cases.to_string()),
    ("caught", |line| line.tally.caught.to_string()),
    ("ridden", |line| line.tally.ridden_through.to_string()),
    ("uncaught", |line| line.tally.uncaught.to_string()),
    ("periods", |line| number(line.carrier_periods, 2)),
    ("ms", |line| number(line.time_ms, 2)),
    ("A until", |line| number(line.current_until_a, 0)),
    ("A after", |line| number(line.current_after_a, 0)),
    ("V until", |line| number(line.udc_until_v, 0)),
    ("V after", |line| number(line.udc_after_v, 0)),
    ("U_c until", |line| number(line.uc_until_v.unwrap_or(0.0), 0)),
    ("U_c after", |line| number(line.uc_after_v.unwrap_or(0.0), 0)),
    ("A share", |line| number(line.current_share, 2)),
    ("V share", |line| number(line.voltage_share, 2)),
    ("named", |line| text(&line.named)),
    ("safe state", |line| text(&line.safe_states)),
];

fn number(value: f64, decimals: usize) -> String {
    if value > 0.0 { format!("{value:.decimals$}") } else { "–".to_owned() }
}

fn text(text: &str) -> String {
    if text.is_empty() { "–".to_owned() } else { text.to_owned() }
}

/// Lines as a table of Markdown, which people read as text as well.
pub fn table(heading: &str, lines: &[Line]) -> String {
    let heads = COLUMNS.iter().map(|(head, _)| (*head).to_owned());
    let mut rows: Vec<Vec<_>> = vec![std::iter::once(heading.to_owned()).chain(heads).collect()];
    rows.extend(lines.iter().map(|line| {
        let cells = COLUMNS.iter().map(|(_, cell)| cell(line));
        std::iter::once(line.what.clone()).chain(cells).collect()
    }));
    let width = |k: usize| rows.iter().map(|row| row[k].chars().count()).max().unwrap_or(0);
    let widths: Vec<_> = (0..=COLUMNS.len()).map(width).collect();
    let is_text = |k: usize| k == 0 || k + 1 >= COLUMNS.len();
    let mut out = String::new();
    for (index, row) in rows.iter().enumerate() {
        let cells = row.iter().zip(&widths).enumerate().map(|(k, (cell, width))| {
            if is_text(k) { format!("{cell:<width$}") } else { format!("{cell:>width$}") }
        });
        let _ = writeln!(out, "| {} |", cells.collect::<Vec<_>>().join(" | "));
        if index == 0 {
            let rules = widths
                .iter()
                .enumerate()
                .map(|(k, width)| if is_text(k) { "-".repeat(*width) } else { "-".repeat(width - 1) + ":" });
            let _ = writeln!(out, "| {} |", rules.collect::<Vec<_>>().join(" | "));
        }
    }
    out
}
