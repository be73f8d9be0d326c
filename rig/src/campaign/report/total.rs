//! What all cases of a system come to.

use super::Tally;
use crate::campaign::{Action, Outcome};
use serde::Serialize;
use std::fmt::Write as _;

/// What all cases of a system come to.
#[derive(Clone, Debug, Serialize)]
pub struct Total {
    /// How they ended.
    #[serde(flatten)]
    pub tally: Tally,
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
    let limit_a = of().map(|outcome| outcome.current_limit_a).reduce(f64::min)?;
    let is_forced = |outcome: &Outcome| outcome.fault.ends_with("-shorted");
    Some(Total {
        tally: Tally::of(of()),
        worst_carrier_periods: worst(of(), |outcome| outcome.carrier_periods),
        worst_time_ms: worst(of(), |outcome| outcome.time_ms),
        worst_current_a: worst(of().filter(|outcome| !is_forced(outcome)), |outcome| {
            Some(outcome.worst_current_a())
        }),
        current_limit_a: limit_a,
        worst_forced_current_a: worst(of().filter(|outcome| is_forced(outcome)), |outcome| {
            Some(outcome.worst_current_a())
        }),
        worst_udc_v: worst(of(), |outcome| Some(outcome.udc_until_v.max(outcome.udc_after_v))),
        worst_uc_v: worst(of(), |outcome| Some(outcome.uc_until_v?.max(outcome.uc_after_v?))),
        worst_current_share: worst(of(), |outcome| Some(outcome.current_share())),
        worst_voltage_share: worst(of(), |outcome| Some(outcome.voltage_share())),
    })
}

/// A system's total in sentences.
pub fn sentences(total: &Total) -> String {
    let Tally { cases, caught, ridden_through, uncaught } = total.tally;
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
