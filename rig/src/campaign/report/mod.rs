//! The table: as text, as files, and as the part of docs/fault-campaign.md between its markers.

mod document;
mod lines;
mod total;

pub use document::{Part, document, renew, renew_with};
pub use lines::{Line, by_fault, by_mode, by_safe_state, lines, table};
pub use total::{Total, Worst, sentences, total};

use super::Outcome;
use super::judge::Verdict;
use crate::analysis::Figures;
use crate::files::write_text;
use crate::report::Page;
use anyhow::Result;
use serde::Serialize;
use std::fmt::Write as _;
use std::path::Path;

/// The systems, with their headings.
pub const SYSTEMS: [(&str, &str); 2] = [("pmasynrm", "PMaSynRM drive"), ("zs9", "ZS9")];

/// The systems with the headings of a campaign: of another machine than the papers', its folder is named.
fn headings(machine: Option<&str>) -> [(&'static str, String); 2] {
    let name = machine.and_then(|folder| Path::new(folder).file_name()?.to_str());
    SYSTEMS.map(|(system, heading)| {
        (system, name.map_or_else(|| heading.to_owned(), |name| format!("{heading} with {name}")))
    })
}

/// The number of cases, by their end.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct Tally {
    /// Cases.
    pub cases: usize,
    /// Caught.
    pub caught: usize,
    /// Ridden through.
    pub ridden_through: usize,
    /// Uncaught.
    pub uncaught: usize,
}

impl Tally {
    /// The tally of some outcomes.
    fn of<'a>(outcomes: impl Iterator<Item = &'a Outcome>) -> Self {
        outcomes.fold(Self::default(), |mut tally, outcome| {
            tally.cases += 1;
            *match outcome.verdict {
                Verdict::Caught => &mut tally.caught,
                Verdict::RiddenThrough => &mut tally.ridden_through,
                Verdict::Uncaught => &mut tally.uncaught,
            } += 1;
            tally
        })
    }
}

impl Outcome {
    fn worst_current_a(&self) -> f64 {
        self.current_until_a.max(self.current_after_a)
    }

    /// True if a failed device forces the current.
    fn is_forced(&self) -> bool {
        self.fault.ends_with("-shorted")
    }

    fn current_share(&self) -> f64 {
        self.worst_current_a() / self.current_limit_a
    }

    fn voltage_share(&self) -> f64 {
        match (self.uc_after_v, self.uc_limit_v) {
            (Some(uc_v), Some(limit_v)) => uc_v / limit_v,
            _ => self.udc_after_v / self.udc_limit_v,
        }
    }
}

/// Everything as text; of the papers' machines, or of the one in a folder.
pub fn text(outcomes: &[Outcome], machine: Option<&str>) -> String {
    let mut out = String::new();
    for (system, heading) in headings(machine) {
        let of: Vec<_> = outcomes.iter().filter(|outcome| outcome.system == system).cloned().collect();
        let Some(total) = total(&of, system) else { continue };
        let _ = writeln!(out, "\n### {heading}\n\n{}", sentences(&total));
        let _ = writeln!(out, "{}", table("fault", &by_fault(&of)));
        let _ = writeln!(out, "{}", table("mode", &by_mode(&of)));
        let _ = write!(out, "{}", table("speed, safe state", &by_safe_state(&of)));
    }
    out
}

/// Writes campaign.csv, summary.json and report.html.
pub fn write(outcomes: &[Outcome], options: serde_json::Value, out: &Path) -> Result<()> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    for outcome in outcomes {
        writer.serialize(outcome)?;
    }
    let bytes = writer.into_inner().map_err(|error| error.into_error())?;
    write_text(&out.join("campaign.csv"), &String::from_utf8(bytes)?)?;
    let totals = SYSTEMS.map(|(system, _)| (system.to_owned(), serde_json::json!(total(outcomes, system))));
    let machine = options["machine"].as_str().map(str::to_owned);
    let summary = serde_json::json!({
        "scenario": "campaign",
        "version": env!("CARGO_PKG_VERSION"),
        "options": options,
        "totals": totals.into_iter().collect::<serde_json::Map<_, _>>(),
        "faults": by_fault(outcomes),
        "uncaught": outcomes.iter().filter(|outcome| outcome.verdict == Verdict::Uncaught).collect::<Vec<_>>(),
    });
    write_text(&out.join("summary.json"), &(serde_json::to_string_pretty(&summary)? + "\n"))?;
    write_text(&out.join("report.html"), &page(outcomes, machine.as_deref())?)
}

fn page(outcomes: &[Outcome], machine: Option<&str>) -> Result<String> {
    let mut page = Page::new("campaign", "what faults come to");
    let mut figures = Figures::default();
    for (system, heading) in headings(machine) {
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
