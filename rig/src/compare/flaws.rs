//! The effect of each idealisation of the plant: our law with the flaws of `--real`, one at a time and all at once.

use super::drive;
use super::outcome::{Outcome, Outcomes, field, verdict};
use crate::analysis::Figures;
use crate::machine::Machine;
use crate::verdict::worst;
use anyhow::Result;
use std::collections::BTreeMap;

/// The runs: torque and distortion at the characteristic points, changes of mode, load steps.
const RUNS: [&str; 3] = ["characteristic", "sweep --down", "load-steps"];

/// The flaws, as `--real` has them.
const FLAWS: [(&str, &str); 20] = [
    ("none", ""),
    ("dead time, which the drive knows", "--dead-time-us 5"),
    ("steps of the current converters", "--adc-bits 12"),
    ("noise of the currents", "--noise-a 0.4667"),
    ("offset of a current sensor", "--current-offset 2,0,0"),
    ("gains of current sensors", "--current-gains 1,-1,0"),
    (
        "time constant of the current sensors, which the drive knows",
        "--current-filter-us 10 --current-filter-known",
    ),
    (
        "phases sampled one after the other, by 1 µs too early on average, which it knows",
        "--adc-skew-us 2,1,0 --current-filter-known",
    ),
    ("link read too large", "--udc-gain 1"),
    ("ripple of the link", "--udc-ripple 30@300"),
    ("a resolver's error once a turn", "--angle-1f-deg 1"),
    ("twice a turn", "--angle-2f-deg 0.5"),
    ("jitter of the angle's reading, whose mean it knows", "--angle-jitter-us 1 --angle-late-known"),
    ("drops of IGBTs and diodes", "--device-drop 2,5,1.5,3"),
    ("slots", "--slots 2"),
    ("magnets 10 K warmer than the map", "--magnets -1"),
    ("resistance", "--rs-error 20"),
    ("iron loss as torque, which the drive knows", "--iron-loss 50 --iron-loss-known"),
    ("elastic shaft", "--shaft 40,0.05"),
    ("all", "--real"),
];

/// The heads of the table.
pub const FLAW_HEADS: [&str; 7] = [
    "flaw",
    "options",
    "mean torque off",
    "current THD over its bound",
    "torque ripple over its bound",
    "current at changes of mode, torque",
    "load steps settle within 2 %",
];

/// A row: the flaw, its options, and its results in the order of [`FLAW_HEADS`].
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize)]
pub struct FlawRow {
    /// The flaw.
    pub flaw: &'static str,
    /// Its words on the command line.
    pub options: &'static str,
    /// Torque, THD, ripple, changes of mode, settling.
    pub found: [String; 5],
}

impl FlawRow {
    /// Its cells.
    pub fn cells(&self) -> [&str; 7] {
        let [torque, thd, ripple, switch, settle] = self.found.each_ref().map(String::as_str);
        [self.flaw, self.options, torque, thd, ripple, switch, settle]
    }

    /// The row as it stands in a document.
    pub fn markdown(&self) -> String {
        let [flaw, options, found @ ..] = self.cells();
        let options = if options.is_empty() { String::new() } else { format!("`{options}`") };
        format!("| {flaw} | {options} | {} |", found.join(" | "))
    }
}

/// Runs all of them.
pub fn flaws() -> Result<Vec<FlawRow>> {
    let lines = FLAWS.iter().flat_map(|(_, options)| RUNS.map(|run| format!("{run} {options}")));
    let driven = drive(lines.collect())?;
    let machine = Machine::load("pmasynrm-180kw")?;
    Ok(FLAWS
        .map(|(flaw, options)| FlawRow { flaw, options, found: found(options, &driven, &machine) })
        .to_vec())
}

/// The table as it stands in a document.
pub fn table(rows: &[FlawRow]) -> String {
    let lines: Vec<_> = rows.iter().map(FlawRow::markdown).collect();
    format!("| {} |\n|---|---|---:|---:|---:|---:|---:|\n{}\n", FLAW_HEADS.join(" | "), lines.join("\n"))
}

fn found(options: &str, driven: &BTreeMap<String, Outcome>, machine: &Machine) -> [String; 5] {
    let outcomes = Outcomes { law: 0, more: options, driven, machine };
    let [points, sweep, steps] = RUNS.map(|run| outcomes.figures(run));
    let most = |list: &str, name: &str| {
        points.map(|figures| worst(field(figures, list, name).into_iter().map(f64::abs)))
    };
    let over = |name: &str| points.map(|figures| worst(field(figures, "distortion", name).into_iter()));
    let of_switch = |what: &'static str| sweep.map(|figures: &Figures| verdict(figures, what));
    let settled = steps.map(|figures| {
        let times = field(figures, "steps", "settling_2_percent_ms");
        worst(times.into_iter())
    });
    [
        text(most("points", "torque_error_percent"), 2, "%"),
        text(over("thd_excess_percent"), 1, "%"),
        text(over("ripple_rms_excess_percent"), 1, "%"),
        format!(
            "{}, {}",
            text(of_switch("current over the larger steady envelope"), 2, "%"),
            text(of_switch("torque beyond the steady ripple band"), 1, "N·m")
        ),
        text(settled, 1, "ms"),
    ]
}

/// A number with its unit; the fault if the run tripped.
fn text(found: Result<Option<f64>, &str>, decimals: usize, unit: &str) -> String {
    match found {
        Ok(Some(value)) => format!("{value:.decimals$} {unit}").replace('-', "−"),
        Ok(None) => "not seen".to_owned(),
        Err(fault) => format!("trips: {fault}"),
    }
}
