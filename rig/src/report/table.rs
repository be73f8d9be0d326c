//! Figures as tables of a page.

use super::text::{digits, quantity, split_unit};
use crate::analysis::Figures;
use crate::verdict::{FALLS_SHORT, NOT_SEEN};
use serde_json::{Map, Value};
use std::fmt::Write as _;

/// Verdicts, the worst first; nothing without any.
pub fn verdicts(figures: &Figures) -> String {
    let mut rows: Vec<_> = figures.get("verdicts").and_then(Value::as_array).into_iter().flatten().collect();
    if rows.is_empty() {
        return String::new();
    }
    rows.sort_by(|one, other| severity(one).total_cmp(&severity(other)));
    let mut text =
        "<table class=\"verdicts stacked\"><thead><tr><th>Verdict</th><th>Quantity</th><th class=\"n\">Found</th><th class=\"n\">Bound</th><th>Used</th></tr></thead><tbody>"
            .to_owned();
    for row in rows {
        let (what, unit) = split_unit(row["what"].as_str().unwrap_or_default());
        let bound = [("at_most", "≤"), ("at_least", "≥")]
            .into_iter()
            .find_map(|(field, sign)| Some(format!("{sign} {}", with_unit(row.get(field)?, unit)?)));
        let verdict = row["verdict"].as_str().unwrap_or_default();
        let found = with_unit(&row["found"], unit).unwrap_or("–".to_owned());
        let used = share(row).map_or("–".to_owned(), bar);
        let _ = write!(
            text,
            "<tr class=\"{class}\"><td data-head=\"Verdict\"><b class=\"pill\">{}</b></td><th scope=\"row\">{}</th>\
             <td class=\"n\" data-head=\"Found\">{found}</td><td class=\"n\" data-head=\"Bound\">{}</td><td data-head=\"Used\">{used}</td></tr>",
            escape(verdict),
            escape(&what),
            bound.unwrap_or("–".to_owned()),
            class = class(verdict),
        );
    }
    text + "</tbody></table>"
}

/// The share of its bound that a figure uses; for a bound from below, the inverse.
fn share(row: &Value) -> Option<f64> {
    let found = row["found"].as_f64()?;
    let share =
        match (row.get("at_most").and_then(Value::as_f64), row.get("at_least").and_then(Value::as_f64)) {
            (Some(most), _) if most > 0.0 => found / most,
            (None, Some(least)) if found > 0.0 => least / found,
            _ => return None,
        };
    share.is_finite().then_some(share.max(0.0))
}

fn bar(share: f64) -> String {
    let percent = (100.0 * share).round();
    format!(
        "<i class=\"share\"><i style=\"width:{}%\"></i></i> <small>{percent} %</small>",
        percent.min(100.0)
    )
}

/// Order of a verdict: first those that fall short, then those not seen, then those closest to their bound, last those only reported.
fn severity(row: &Value) -> f64 {
    match row["verdict"].as_str() {
        Some(FALLS_SHORT) => 0.0,
        Some(NOT_SEEN) => 1.0,
        Some("pass") => 3.0 - share(row).unwrap_or(0.0).min(1.0),
        _ => 4.0,
    }
}

fn class(verdict: &str) -> &'static str {
    match verdict {
        FALLS_SHORT => "short",
        "pass" => "pass",
        _ => "open",
    }
}

/// Numbers by name, then each list as a table of its own under a heading; without the verdicts, which stand on top.
pub fn tables(figures: &Figures) -> String {
    let (mut numbers, mut lists) = (String::new(), String::new());
    for (name, value) in figures.values().iter().filter(|(name, _)| *name != "verdicts") {
        match value {
            Value::Array(rows) => {
                let _ = write!(lists, "<h3>{}</h3>{}", escape(&quantity(name).0), table(rows));
            }
            _ => {
                let (words, unit) =
                    if value.is_f64() { quantity(name) } else { (name.replace('_', " "), "") };
                let value = with_unit(value, unit).unwrap_or("–".to_owned());
                let _ = write!(numbers, "<div><dt>{}</dt><dd>{value}</dd></div>", escape(&words));
            }
        }
    }
    let numbers = if numbers.is_empty() { numbers } else { format!("<dl class=\"numbers\">{numbers}</dl>") };
    numbers + &lists
}

fn table(rows: &[Value]) -> String {
    let Some(Value::Object(first)) = rows.first() else {
        let said: String = rows.iter().map(|row| format!("<li>{}</li>", cell(row))).collect();
        return if said.is_empty() { "<p>none</p>".to_owned() } else { format!("<ul>{said}</ul>") };
    };
    let heads: Vec<_> = first
        .iter()
        .map(|(key, value)| {
            let (words, unit) = quantity(key);
            let unit = if unit.is_empty() { String::new() } else { format!(" <small>{unit}</small>") };
            format!("<th{}>{}{unit}</th>", number(value), escape(&words))
        })
        .collect();
    let mut text = "<table class=\"stacked\"><thead><tr>".to_owned();
    heads.iter().for_each(|head| text += head);
    text += "</tr></thead><tbody>";
    for row in rows.iter().filter_map(Value::as_object) {
        let _ = write!(text, "<tr>{}</tr>", cells(row));
    }
    text + "</tbody></table>"
}

fn cells(row: &Map<String, Value>) -> String {
    let cell = |(key, value): (&String, &Value)| {
        format!("<td{} data-head=\"{}\">{}</td>", number(value), escape(&key.replace('_', " ")), cell(value))
    };
    row.iter().map(cell).collect()
}

/// The class of a cell that stands to the right.
fn number(value: &Value) -> &'static str {
    if value.is_number() { " class=\"n\"" } else { "" }
}

/// A figure as people read it: four significant digits, not seventeen.
fn cell(value: &Value) -> String {
    match value {
        Value::Number(number) if number.is_f64() => digits(number.as_f64().unwrap_or(f64::NAN)),
        Value::String(text) if text.is_empty() => "none".to_owned(),
        Value::String(text) => escape(text),
        Value::Null => "–".to_owned(),
        other => escape(&other.to_string()),
    }
}

/// The same with its unit; none without a value.
fn with_unit(value: &Value, unit: &str) -> Option<String> {
    (!value.is_null()).then(|| if unit.is_empty() { cell(value) } else { format!("{} {unit}", cell(value)) })
}

/// As text of a page.
pub fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::verdict::Verdict;

    #[test]
    fn the_worst_verdict_comes_first() {
        let mut figures = Figures::default();
        let of = |what: &str, found: Option<f64>, most: f64| Verdict::at_most(what, found, most);
        figures.set(
            "verdicts",
            vec![
                of("reported in A", Some(1.0), f64::INFINITY),
                of("easily kept", Some(0.1), 1.0),
                of("hardly kept in %", Some(0.99), 1.0),
                of("unseen", None, 1.0),
                of("missed in ms", Some(3.0), 2.5),
            ],
        );
        let page = verdicts(&figures);
        let place =
            |what: &str| page.find(&format!(">{what}</th>")).unwrap_or_else(|| panic!("{what}: {page}"));
        let order = ["missed", "unseen", "hardly kept", "easily kept", "reported"].map(place);
        assert!(order.is_sorted(), "{order:?}: {page}");
        assert!(page.contains("3.000 ms") && page.contains("≤ 2.500 ms"), "{page}");
        assert!(page.contains("<tr class=\"short\">") && page.contains(">99 %<"), "{page}");
    }
}
