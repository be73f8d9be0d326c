//! The summary of all cases of a system.

use super::Tally;
use crate::campaign::{Action, Outcome};
use serde::Serialize;
use std::collections::BTreeMap;
use std::fmt::Write as _;

/// The summary of all cases of a system.
#[derive(Clone, Debug, Serialize)]
pub struct Total {
    /// The counts of their ends.
    #[serde(flatten)]
    pub tally: Tally,
    /// The allowed phase current, in A, of the case with the largest current that was not forced by a failed device.
    pub current_limit_a: f64,
    /// The worst case of each quantity, by name.
    #[serde(flatten)]
    pub worst: BTreeMap<&'static str, Worst>,
}

/// A quantity whose worst case is reported: its name, its name in a sentence, its unit, and its value if a case has one.
type Quantity = (&'static str, &'static str, &'static str, fn(&Outcome) -> Option<f64>);

/// Quantities whose worst cases are reported, in their order.
const QUANTITIES: [Quantity; 9] = [
    ("worst_carrier_periods", "longest until the gates were safe", " carrier periods", |of| {
        of.carrier_periods
    }),
    ("worst_time_ms", "longest until the gates were safe", " ms", |of| of.time_ms),
    (LIMITED, "largest phase current", " A", |of| (!of.is_forced()).then(|| of.worst_current_a())),
    ("worst_forced_current_a", "largest phase current where a device or the source is shorted", " A", |of| {
        of.is_forced().then(|| of.worst_current_a())
    }),
    ("worst_negative_id_a", "most negative i_d, as −i_d", " A", |of| Some(-of.lowest_id_a)),
    ("worst_udc_v", "highest DC voltage", " V", |of| Some(of.udc_until_v.max(of.udc_after_v))),
    ("worst_uc_v", "highest capacitor voltage", " V", |of| Some(of.uc_until_v?.max(of.uc_after_v?))),
    ("worst_current_share", "largest phase current over what it may be", "", |of| Some(of.current_share())),
    ("worst_voltage_share", "highest voltage with safe gates over what is forced", "", |of| {
        Some(of.voltage_share())
    }),
];

/// The quantity for which [`Total::current_limit_a`] is the limit.
const LIMITED: &str = "worst_current_a";

/// The largest value and its case; nothing if there is none.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Worst {
    /// The value.
    pub value: f64,
    /// The case.
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

/// The total of one system; `None` without cases.
pub fn total(outcomes: &[Outcome], system: &str) -> Option<Total> {
    let of = || outcomes.iter().filter(|outcome| outcome.system == system);
    of().next()?;
    let own = of().filter(|outcome| !outcome.is_forced());
    let largest = own.max_by(|a, b| a.worst_current_a().total_cmp(&b.worst_current_a()));
    let current_limit_a = largest.map_or(0.0, |outcome| outcome.current_limit_a);
    let worst = QUANTITIES.into_iter().map(|(name, .., value)| (name, worst(of(), value))).collect();
    Some(Total { tally: Tally::of(of()), current_limit_a, worst })
}

/// A system's total in sentences.
pub fn sentences(total: &Total) -> String {
    let Tally { cases, caught, ridden_through, uncaught } = total.tally;
    let mut text =
        format!("{cases} cases: {caught} caught, {ridden_through} ridden through, {uncaught} uncaught.\n");
    for (name, what, unit, _) in QUANTITIES {
        let Some(Worst { value, case }) = total.worst.get(name).filter(|worst| worst.value > 0.0) else {
            continue;
        };
        let limit_a = total.current_limit_a;
        let after = if name == LIMITED { format!(" of {limit_a:.0} A allowed") } else { String::new() };
        let _ = writeln!(text, "- {what}: {value:.2}{unit}{after} ({case})");
    }
    text
}
