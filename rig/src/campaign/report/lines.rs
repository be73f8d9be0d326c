//! Cases in groups, a line each, and the lines as a table.

use super::Tally;
use crate::campaign::Outcome;
use serde::Serialize;
use std::collections::BTreeSet;
use std::fmt::Write as _;

/// All cases of something in one line.
#[derive(Clone, Debug, Serialize)]
pub struct Line {
    /// Which system.
    pub system: &'static str,
    /// What the cases have in common.
    pub what: String,
    /// How they ended.
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
    /// Largest phase current until the gates were safe, in A, or over the whole case where the drive went on.
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
    /// The largest phase current over what it may be, of all cases.
    pub current_share: f64,
    /// The highest voltage with safe gates over what is forced then, or over the trip level where that is more; the ZS9's of a capacitor.
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

/// Lines as a table of Markdown, which people read as text as well.
pub fn table(heading: &str, lines: &[Line]) -> String {
    let head = [
        heading,
        "cases",
        "caught",
        "ridden",
        "uncaught",
        "periods",
        "ms",
        "A until",
        "A after",
        "V until",
        "V after",
        "U_c until",
        "U_c after",
        "A share",
        "V share",
        "named",
        "safe state",
    ];
    let mut rows = vec![head.map(str::to_owned)];
    for line in lines {
        let number = |value: f64| if value > 0.0 { format!("{value:.0}") } else { "–".to_owned() };
        let fine = |value: f64| if value > 0.0 { format!("{value:.2}") } else { "–".to_owned() };
        let text = |text: &str| if text.is_empty() { "–".to_owned() } else { text.to_owned() };
        rows.push([
            line.what.clone(),
            line.tally.cases.to_string(),
            line.tally.caught.to_string(),
            line.tally.ridden_through.to_string(),
            line.tally.uncaught.to_string(),
            fine(line.carrier_periods),
            fine(line.time_ms),
            number(line.current_until_a),
            number(line.current_after_a),
            number(line.udc_until_v),
            number(line.udc_after_v),
            line.uc_until_v.map_or("–".to_owned(), number),
            line.uc_after_v.map_or("–".to_owned(), number),
            fine(line.current_share),
            fine(line.voltage_share),
            text(&line.named),
            text(&line.safe_states),
        ]);
    }
    let width = |k: usize| rows.iter().map(|row| row[k].chars().count()).max().unwrap_or(0);
    let widths: Vec<_> = (0..head.len()).map(width).collect();
    let mut out = String::new();
    for (index, row) in rows.iter().enumerate() {
        let cells = row.iter().zip(&widths).enumerate().map(|(k, (cell, width))| {
            let left = k == 0 || k > 14;
            if left { format!("{cell:<width$}") } else { format!("{cell:>width$}") }
        });
        let _ = writeln!(out, "| {} |", cells.collect::<Vec<_>>().join(" | "));
        if index == 0 {
            let rules = widths.iter().enumerate().map(|(k, width)| {
                if k == 0 || k > 14 { "-".repeat(*width) } else { "-".repeat(width - 1) + ":" }
            });
            let _ = writeln!(out, "| {} |", rules.collect::<Vec<_>>().join(" | "));
        }
    }
    out
}
