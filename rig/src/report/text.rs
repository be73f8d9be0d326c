//! Figures as people read them on a terminal: a headline, then aligned tables with units.

use crate::analysis::Figures;
use crate::verdict::{FALLS_SHORT, NOT_SEEN};
use comfy_table::presets::NOTHING;
use comfy_table::{CellAlignment, Table};
use serde_json::{Map, Value, json};
use std::collections::BTreeSet;
use tractive::protection::{Fault, Trip};

/// Ends of figures' names, and the units they stand for.
const UNITS: [(&str, &str); 21] = [
    ("_percent", "%"),
    ("_rpm", "r/min"),
    ("_per_s", "/s"),
    ("_nm", "N·m"),
    ("_ms", "ms"),
    ("_us", "µs"),
    ("_kj", "kJ"),
    ("_kw", "kW"),
    ("_hz", "Hz"),
    ("_deg", "°"),
    ("_wb", "Wb"),
    ("_mwb", "mWb"),
    ("_mh", "mH"),
    ("_ohm", "Ω"),
    ("_kg_m2", "kg·m²"),
    ("_a", "A"),
    ("_v", "V"),
    ("_s", "s"),
    ("_j", "J"),
    ("_w", "W"),
    ("_k", "K"),
];

/// Unit of a fault's value and limit; none for those that count something.
pub const fn unit(fault: Fault) -> &'static str {
    match fault {
        Fault::Overcurrent | Fault::PhaseSum | Fault::CurrentOffset => "A",
        Fault::DcOvervoltage | Fault::DcUndervoltage | Fault::SourceUndervoltage => "V",
        Fault::CapacitorOvervoltage | Fault::LinkImplausible => "V",
        Fault::PrechargeTimeout | Fault::DischargeTimeout => "V",
        Fault::Overspeed => "rad/s",
        Fault::SensorLost1 | Fault::SensorLost2 | Fault::AngleLost => "rad",
        Fault::ControlDeadline | Fault::StaleCommand => "s",
        Fault::Frozen => "control periods",
        _ => "",
    }
}

/// A fault with the value that broke its limit.
pub fn broken(trip: Trip) -> String {
    let of = |value: f32| measured(&json!(f64::from(value)), unit(trip.fault));
    // A value that is no number breaks any limit.
    if !trip.value.is_finite() {
        return format!("{}: a value that is no number", trip.fault.name());
    }
    format!("{}: {}, limit {}", trip.fault.name(), of(trip.value), of(trip.limit))
}

/// Pass, or the bounds that were not kept.
pub fn headline(figures: &Figures, trip: Option<Trip>) -> String {
    if let Some(trip) = trip {
        return format!("FALLS SHORT: the drive tripped, {}", broken(trip));
    }
    let verdicts = figures.get("verdicts").and_then(Value::as_array).map_or(&[][..], Vec::as_slice);
    let count = |what: &str| verdicts.iter().filter(|verdict| verdict["verdict"] == what).count();
    match (count("pass"), count(FALLS_SHORT), count(NOT_SEEN)) {
        (0, 0, _) => "PASS: no fault".to_owned(),
        (passed, 0, 0) => format!("PASS: {passed} of {passed} bounds kept"),
        (passed, 0, unseen) => format!("PASS: {passed} bounds kept, {unseen} not seen"),
        (passed, short, _) => format!("FALLS SHORT: {short} of {} bounds", passed + short),
    }
}

/// All figures: first verdicts, then numbers, then lists, each as a table.
pub fn text(figures: &Figures) -> String {
    let mut parts = Vec::new();
    if let Some(Value::Array(verdicts)) = figures.get("verdicts") {
        parts.push(table(&["verdict", "", "found", "at most"], verdicts.iter().map(verdict)));
    }
    let numbers = figures.values().iter().filter(|(_, value)| !value.is_array());
    let number = |(name, value): (&String, &Value)| {
        // A count has no unit, whatever its name ends with.
        let (words, unit) = if value.is_f64() { quantity(name) } else { (name.replace('_', " "), "") };
        vec![words, measured(value, unit)]
    };
    parts.push(table(&["figure", ""], numbers.map(number)));
    for (name, value) in figures.values().iter().filter(|(name, _)| *name != "verdicts") {
        if let Value::Array(rows) = value {
            parts.push(list(&quantity(name).0, rows));
        }
    }
    parts.join("\n\n")
}

/// A verdict's cells.
fn verdict(verdict: &Value) -> Vec<String> {
    let what = verdict["what"].as_str().unwrap_or_default();
    let (what, unit) = split_unit(what);
    let cell = |name: &str| measured(&verdict[name], unit);
    let say = |name: &str| verdict[name].as_str().unwrap_or_default().to_owned();
    vec![say("verdict"), what, cell("found"), cell("at_most")]
}

/// `t90 in ms` is `t90`, in ms; `overshoot in % of the step` is `overshoot of the step`, in %.
pub(super) fn split_unit(what: &str) -> (String, &'static str) {
    let units = UNITS.iter().map(|(_, unit)| *unit);
    let found = units.filter_map(|unit| {
        let (before, after) = what.split_once(&format!(" in {unit}"))?;
        (after.is_empty() || after.starts_with([' ', ','])).then(|| (format!("{before}{after}"), unit))
    });
    found.into_iter().next().unwrap_or((what.to_owned(), ""))
}

/// A figure's name in words, and its unit.
pub(super) fn quantity(name: &str) -> (String, &'static str) {
    let known = UNITS.iter().find_map(|(end, unit)| Some((name.strip_suffix(end)?, *unit)));
    let (words, unit) = known.unwrap_or((name, ""));
    // In a name, the decimal point of a percentage is a letter: `back_within_0p2_percent`.
    (words.replace('_', " ").replace("0p2 percent", "0.2 %"), unit)
}

/// Rows of a list under the names of their fields.
pub fn list(heading: &str, rows: &[Value]) -> String {
    let Some(Value::Object(first)) = rows.first() else {
        let said: Vec<_> = rows.iter().map(|row| format!("  {}", measured(row, ""))).collect();
        return format!("{heading}: {}\n{}", if rows.is_empty() { "none" } else { "" }, said.join("\n"))
            .trim_end()
            .to_owned();
    };
    let heads = first.keys().map(|key| match quantity(key) {
        (words, "") => words,
        (words, unit) => format!("{words} {unit}"),
    });
    let heads: Vec<_> = heads.collect();
    let heads: Vec<_> = heads.iter().map(String::as_str).collect();
    let cells = |row: &Map<String, Value>| row.values().map(|value| measured(value, "")).collect();
    let rows = rows.iter().filter_map(Value::as_object).map(cells);
    format!("{heading}\n{}", table(&heads, rows))
}

/// A value with its unit; numbers have four significant digits.
fn measured(value: &Value, unit: &str) -> String {
    let number = match value {
        Value::Number(number) if number.is_f64() => digits(number.as_f64().unwrap_or(f64::NAN)),
        Value::Null => return "–".to_owned(),
        Value::String(text) if text.is_empty() => return "none".to_owned(),
        Value::String(text) => return text.clone(),
        other => other.to_string(),
    };
    if unit.is_empty() { number } else { format!("{number} {unit}") }
}

/// Four significant digits; below a thousandth, three digits and a power of ten.
pub(super) fn digits(value: f64) -> String {
    let size = value.abs();
    let before = if size < 1.0 { 0 } else { size.log10() as usize + 1 };
    match size {
        0.0 => "0".to_owned(),
        size if size < 1e-3 => format!("{value:.2e}"),
        _ => format!("{value:.*}", 4_usize.saturating_sub(before)),
    }
}

/// Aligned columns; those that hold numbers are aligned to the right.
fn table(heads: &[&str], rows: impl Iterator<Item = Vec<String>>) -> String {
    let rows: Vec<_> = rows.collect();
    let mut table = Table::new();
    table.load_style(NOTHING).set_header(heads.iter().copied());
    let is_number = |cell: &String| cell.starts_with(|c: char| c.is_ascii_digit() || c == '-' || c == '–');
    let texts: BTreeSet<usize> = rows
        .iter()
        .flat_map(|row| row.iter().enumerate().filter(|(_, cell)| !is_number(cell)).map(|(index, _)| index))
        .collect();
    table.add_rows(rows);
    for (index, column) in table.column_iter_mut().enumerate() {
        let to_the_right = !texts.contains(&index);
        column.set_cell_alignment(if to_the_right { CellAlignment::Right } else { CellAlignment::Left });
    }
    table.trim_fmt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;
    use tractive::protection::SafeState;
    use tractive::time::Instant;

    fn figures(verdicts: &[&str]) -> Figures {
        let mut figures = Figures::default();
        let verdict =
            |verdict: &&str| json!({"what": "t90 in ms", "found": 2.25, "at_most": 2.5, "verdict": verdict});
        figures.set("verdicts", verdicts.iter().map(verdict).collect::<Vec<_>>());
        figures.set("peak_current_a", 247.123_f64);
        figures
    }

    #[test]
    fn the_headline_says_whether_every_bound_is_kept() {
        assert_eq!(headline(&figures(&["pass", "pass"]), None), "PASS: 2 of 2 bounds kept");
        assert_eq!(headline(&figures(&["pass", FALLS_SHORT]), None), "FALLS SHORT: 1 of 2 bounds");
        assert_eq!(headline(&Figures::default(), None), "PASS: no fault");
    }

    #[test]
    fn a_faults_unit_is_that_of_its_value_in_the_guide() {
        let page = include_str!("../../../docs/faults.md");
        for fault in Fault::ALL {
            let row = page.lines().find(|line| line.starts_with(&format!("| `{}` |", fault.name())));
            let value = row.and_then(|row| row.split('|').nth(2)).unwrap_or_default();
            let said = ["A", "V", "rad/s", "rad", "s", "control periods"].into_iter().find(|unit| {
                value.split([',', ';', ' ']).any(|word| word == *unit) || value.contains(&format!(" {unit} "))
            });
            // A value that is a count in one case and a time in another has none.
            let mixed = value.trim_start().starts_with('1');
            assert_eq!(unit(fault), said.filter(|_| !mixed).unwrap_or_default(), "{}: {value}", fault.name());
        }
        let (fault, at, safe) = (Fault::DcOvervoltage, Instant(0), SafeState::GatesOff);
        let trip = Trip { fault, value: 2200.0, limit: 2070.0, at, safe };
        let told = "FALLS SHORT: the drive tripped, dc_overvoltage: 2200 V, limit 2070 V";
        assert_eq!(headline(&Figures::default(), Some(trip)), told);
        let trip = Trip { fault: Fault::NotFinite, value: f32::NAN, limit: f32::MAX, at, safe };
        assert_eq!(broken(trip), "not_finite: a value that is no number");
    }

    #[test]
    fn quantities_have_units_and_columns_line_up() {
        let text = text(&figures(&["pass"]));
        assert!(text.contains("2.250 ms") && text.contains("2.500 ms"), "{text}");
        assert!(text.contains("peak current") && text.contains("247.1 A"), "{text}");
        assert_eq!(split_unit("overshoot in % of the step"), ("overshoot of the step".to_owned(), "%"));
        assert_eq!(quantity("back_within_0p2_percent_ms"), ("back within 0.2 %".to_owned(), "ms"));
        assert_eq!(quantity("stator_resistance_ohm"), ("stator resistance".to_owned(), "Ω"));
        assert_eq!(quantity("rotor_inertia_kg_m2"), ("rotor inertia".to_owned(), "kg·m²"));
        assert_eq!(digits(0.000_123_4), "1.23e-4");
    }
}
