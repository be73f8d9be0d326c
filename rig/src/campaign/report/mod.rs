//! The table: as text, as files, and as the part of docs/fault-campaign.md between its markers.

use super::judge::Verdict;
use super::{Action, Outcome};
use crate::analysis::Figures;
use crate::report::Page;
use crate::trace::write_text;
use anyhow::{Context, Result, bail};
use serde::Serialize;
use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::path::Path;

/// All cases of something in one line.
#[derive(Clone, Debug, Serialize)]
pub struct Line {
    /// Which system.
    pub system: &'static str,
    /// What the cases have in common.
    pub what: String,
    /// How many there are.
    pub cases: usize,
    /// How many ended in each way.
    pub caught: usize,
    /// Likewise.
    pub ridden_through: usize,
    /// Likewise.
    pub uncaught: usize,
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

impl Outcome {
    fn current_share(&self) -> f64 {
        self.current_until_a.max(self.current_after_a) / self.current_limit_a
    }

    fn voltage_share(&self) -> f64 {
        match (self.uc_after_v, self.uc_limit_v) {
            (Some(uc_v), Some(limit_v)) => uc_v / limit_v,
            _ => self.udc_after_v / self.udc_limit_v,
        }
    }
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
    let count = |verdict| members.iter().filter(|outcome| outcome.verdict == verdict).count();
    let most = |value: fn(&Outcome) -> f64| members.iter().map(|outcome| value(outcome)).fold(0.0, f64::max);
    let all = |value: fn(&Outcome) -> &str| {
        let texts: BTreeSet<_> =
            members.iter().map(|outcome| value(outcome)).filter(|text| !text.is_empty()).collect();
        texts.into_iter().collect::<Vec<_>>().join(", ")
    };
    Line {
        system,
        what,
        cases: members.len(),
        caught: count(Verdict::Caught),
        ridden_through: count(Verdict::RiddenThrough),
        uncaught: count(Verdict::Uncaught),
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
            line.cases.to_string(),
            line.caught.to_string(),
            line.ridden_through.to_string(),
            line.uncaught.to_string(),
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

/// What all cases of a system come to.
#[derive(Clone, Debug, Serialize)]
pub struct Total {
    /// Cases.
    pub cases: usize,
    /// Caught.
    pub caught: usize,
    /// Ridden through.
    pub ridden_through: usize,
    /// Uncaught.
    pub uncaught: usize,
    /// The longest time to safe gates, in carrier periods, and its case.
    pub worst_carrier_periods: Worst,
    /// The same, in ms.
    pub worst_time_ms: Worst,
    /// The largest phase current where it may not be above 1.5 times the trip level, in A.
    pub worst_current_a: Worst,
    /// What it may be, in A.
    pub current_limit_a: f64,
    /// The largest phase current where a failed device forces more, in A.
    pub worst_forced_current_a: Worst,
    /// The highest DC voltage, in V.
    pub worst_udc_v: Worst,
    /// The ZS9's highest capacitor voltage, in V.
    pub worst_uc_v: Worst,
    /// The largest phase current over what it may be.
    pub worst_current_share: Worst,
    /// The highest voltage with safe gates over what is forced then, or over the trip level.
    pub worst_voltage_share: Worst,
}

/// The largest value and where it was; nothing where there is none.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Worst {
    /// It.
    pub value: f64,
    /// Where.
    pub case: String,
}

fn worst<'a>(outcomes: impl Iterator<Item = &'a Outcome>, value: impl Fn(&Outcome) -> Option<f64>) -> Worst {
    let name = |outcome: &Outcome| {
        let Outcome { fault, mode, speed_rpm, action, .. } = outcome;
        format!("{fault}, {mode}, {speed_rpm:.0} r/min, {}", Action::name(*action))
    };
    outcomes.fold(Worst::default(), |most, outcome| match value(outcome) {
        Some(value) if value > most.value => Worst { value, case: name(outcome) },
        _ => most,
    })
}

/// Of one system; `None` without cases.
pub fn total(outcomes: &[Outcome], system: &str) -> Option<Total> {
    let of = || outcomes.iter().filter(|outcome| outcome.system == system);
    let count = |verdict| of().filter(|outcome| outcome.verdict == verdict).count();
    let limit_a = of().map(|outcome| outcome.current_limit_a).reduce(f64::min)?;
    let is_forced = |outcome: &Outcome| outcome.fault.ends_with("-shorted");
    let current = |outcome: &Outcome| outcome.current_until_a.max(outcome.current_after_a);
    Some(Total {
        cases: of().count(),
        caught: count(Verdict::Caught),
        ridden_through: count(Verdict::RiddenThrough),
        uncaught: count(Verdict::Uncaught),
        worst_carrier_periods: worst(of(), |outcome| outcome.carrier_periods),
        worst_time_ms: worst(of(), |outcome| outcome.time_ms),
        worst_current_a: worst(of().filter(|outcome| !is_forced(outcome)), |outcome| Some(current(outcome))),
        current_limit_a: limit_a,
        worst_forced_current_a: worst(of().filter(|outcome| is_forced(outcome)), |outcome| {
            Some(current(outcome))
        }),
        worst_udc_v: worst(of(), |outcome| Some(outcome.udc_until_v.max(outcome.udc_after_v))),
        worst_uc_v: worst(of(), |outcome| Some(outcome.uc_until_v?.max(outcome.uc_after_v?))),
        worst_current_share: worst(of(), |outcome| Some(outcome.current_share())),
        worst_voltage_share: worst(of(), |outcome| Some(outcome.voltage_share())),
    })
}

/// The systems, with their headings.
pub const SYSTEMS: [(&str, &str); 2] = [("pmasynrm", "PMaSynRM drive"), ("zs9", "ZS9")];

/// A system's total in sentences.
pub fn sentences(total: &Total) -> String {
    let Total { cases, caught, ridden_through, uncaught, .. } = total;
    let mut text =
        format!("{cases} cases: {caught} caught, {ridden_through} ridden through, {uncaught} uncaught.\n");
    let mut add = |what: &str, worst: &Worst, unit: &str, after: &str| {
        if worst.value > 0.0 {
            let _ = writeln!(
                text,
                "- {what}: {:.2}{}{unit}{after} ({})",
                worst.value,
                if unit.is_empty() { "" } else { " " },
                worst.case
            );
        }
    };
    add("longest until the gates were safe", &total.worst_carrier_periods, "carrier periods", "");
    add("longest until the gates were safe", &total.worst_time_ms, "ms", "");
    let allowed = format!(" of {:.0} A allowed", total.current_limit_a);
    add("largest phase current", &total.worst_current_a, "A", &allowed);
    add(
        "largest phase current where a device or the source is shorted",
        &total.worst_forced_current_a,
        "A",
        "",
    );
    add("highest DC voltage", &total.worst_udc_v, "V", "");
    add("highest capacitor voltage", &total.worst_uc_v, "V", "");
    add("largest phase current over what it may be", &total.worst_current_share, "", "");
    add("highest voltage with safe gates over what is forced", &total.worst_voltage_share, "", "");
    text
}

/// Everything as text.
pub fn text(outcomes: &[Outcome]) -> String {
    let mut out = String::new();
    for (system, heading) in SYSTEMS {
        let of: Vec<_> = outcomes.iter().filter(|outcome| outcome.system == system).cloned().collect();
        let Some(total) = total(&of, system) else { continue };
        let _ = writeln!(out, "\n### {heading}\n\n{}", sentences(&total));
        let _ = writeln!(out, "{}", table("fault", &by_fault(&of)));
        let _ = writeln!(out, "{}", table("mode", &by_mode(&of)));
        let _ = write!(out, "{}", table("speed, safe state", &by_safe_state(&of)));
    }
    out
}

/// Writes cases.csv, summary.json and report.html.
///
/// # Errors
/// Where a file cannot be written.
pub fn write(outcomes: &[Outcome], options: serde_json::Value, out: &Path) -> Result<()> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    for outcome in outcomes {
        writer.serialize(outcome)?;
    }
    let bytes = writer.into_inner().map_err(|error| error.into_error())?;
    write_text(&out.join("cases.csv"), &String::from_utf8(bytes)?)?;
    let totals = SYSTEMS.map(|(system, _)| (system.to_owned(), serde_json::json!(total(outcomes, system))));
    let summary = serde_json::json!({
        "scenario": "campaign",
        "version": env!("CARGO_PKG_VERSION"),
        "options": options,
        "totals": totals.into_iter().collect::<serde_json::Map<_, _>>(),
        "faults": by_fault(outcomes),
        "uncaught": outcomes.iter().filter(|outcome| outcome.verdict == Verdict::Uncaught).collect::<Vec<_>>(),
    });
    write_text(&out.join("summary.json"), &(serde_json::to_string_pretty(&summary)? + "\n"))?;
    write_text(&out.join("report.html"), &page(outcomes)?)
}

fn page(outcomes: &[Outcome]) -> Result<String> {
    let mut page = Page::new("campaign", "what faults come to");
    let mut figures = Figures::default();
    for (system, heading) in SYSTEMS {
        let of: Vec<_> = outcomes.iter().filter(|outcome| outcome.system == system).cloned().collect();
        let Some(total) = total(&of, system) else { continue };
        let stopped = |value: fn(&Outcome) -> f64| {
            let mut states: Vec<_> = of.iter().map(|outcome| outcome.safe_state.as_str()).collect();
            states.sort_unstable();
            states.dedup();
            states.retain(|state| !state.is_empty());
            states.into_iter().map(|state| (state, worst_by_speed(&of, state, value))).collect::<Vec<_>>()
        };
        let curves = stopped(|outcome| outcome.current_after_a);
        page.curves(&format!("{heading} · largest current with safe gates"), "r/min", "A", &curves);
        let curves = stopped(|outcome| outcome.udc_after_v);
        page.curves(&format!("{heading} · highest DC voltage with safe gates"), "r/min", "V", &curves);
        figures.set(&format!("{system}_total"), vec![total]);
        figures.set(&format!("{system}_faults"), by_fault(&of));
        figures.set(&format!("{system}_modes"), by_mode(&of));
        figures.set(&format!("{system}_safe_states"), by_safe_state(&of));
    }
    figures.set("cases", outcomes.to_vec());
    page.finish(&format!("tractive {}, run on host", env!("CARGO_PKG_VERSION")), &figures)
}

/// The worst of each speed with a safe state, by speed.
fn worst_by_speed(outcomes: &[Outcome], state: &str, value: fn(&Outcome) -> f64) -> Vec<(f64, f64)> {
    let mut points: Vec<(f64, f64)> = Vec::new();
    for outcome in outcomes.iter().filter(|outcome| outcome.safe_state == state) {
        let speed_rpm = outcome.speed_rpm.abs();
        match points.iter_mut().find(|(speed, _)| *speed == speed_rpm) {
            Some((_, most)) => *most = most.max(value(outcome)),
            None => points.push((speed_rpm, value(outcome))),
        }
    }
    points.sort_by(|a, b| a.0.total_cmp(&b.0));
    points
}

/// What is written into a document.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// The tables of the fast campaign.
    Tables,
    /// What the full campaign comes to, in sentences.
    Sentences,
}

impl Part {
    /// Where it begins and ends.
    const fn markers(self) -> [&'static str; 2] {
        match self {
            Self::Tables => ["<!-- campaign: begin -->\n", "<!-- campaign: end -->"],
            Self::Sentences => ["<!-- full campaign: begin -->\n", "<!-- full campaign: end -->"],
        }
    }

    fn text(self, outcomes: &[Outcome]) -> String {
        if self == Self::Tables {
            return text(outcomes);
        }
        let mut out = String::new();
        for (system, heading) in SYSTEMS {
            let Some(total) = total(outcomes, system) else { continue };
            let _ = write!(out, "\n{heading}: {}", sentences(&total));
        }
        out
    }
}

/// The document with its generated part replaced.
///
/// # Errors
/// Without its markers.
pub fn document(text: &str, outcomes: &[Outcome], part: Part) -> Result<String> {
    let [begin, end] = part.markers();
    let (Some(from), Some(to)) = (text.find(begin), text.find(end)) else {
        bail!("must have the lines {} and {end}", begin.trim());
    };
    let before = text.get(..from + begin.len()).unwrap_or_default();
    let after = text.get(to..).unwrap_or_default();
    Ok(format!("{before}{}\n{after}", part.text(outcomes)))
}

/// Renews the generated part of a document, or says whether it is as it would be written.
///
/// # Errors
/// A document that cannot be read or written, or without its markers.
pub fn renew(path: &Path, outcomes: &[Outcome], part: Part, only_check: bool) -> Result<bool> {
    let named = || path.display().to_string();
    let before = std::fs::read_to_string(path).with_context(named)?;
    let after = document(&before, outcomes, part).with_context(named)?;
    let same = before == after;
    if !only_check && !same {
        write_text(path, &after)?;
    }
    Ok(same)
}
