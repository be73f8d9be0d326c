//! Figures as tables.

use crate::analysis::Figures;
use serde_json::Value;
use std::fmt::Write as _;

/// Numbers by name, then each list as a table of its own.
pub fn tables(figures: &Figures) -> String {
    let mut scalars = String::from("<table>");
    let mut lists = String::new();
    for (name, value) in figures.values() {
        match value {
            Value::Array(rows) => {
                let _ = write!(lists, "<h2>{}</h2>{}", escape(name), table(rows));
            }
            _ => {
                let _ = write!(scalars, "<tr><th>{}</th><td>{}</td></tr>", escape(name), cell(value));
            }
        }
    }
    scalars + "</table>" + &lists
}

fn table(rows: &[Value]) -> String {
    let mut text = String::from("<table>");
    for (index, row) in rows.iter().enumerate() {
        let Value::Object(fields) = row else { continue };
        if index == 0 {
            let heads: String = fields.keys().map(|key| format!("<th>{}</th>", escape(key))).collect();
            let _ = write!(text, "<tr>{heads}</tr>");
        }
        let cells: String = fields.values().map(|value| format!("<td>{}</td>", cell(value))).collect();
        let _ = write!(text, "<tr>{cells}</tr>");
    }
    text + "</table>"
}

/// A figure as people read it: four significant decimals, not seventeen.
pub fn cell(value: &Value) -> String {
    match value {
        Value::Number(number) if number.is_f64() => format!("{:.4}", number.as_f64().unwrap_or(f64::NAN)),
        Value::String(text) => escape(text),
        Value::Null => "–".to_owned(),
        other => other.to_string(),
    }
}

/// As text of a page.
pub fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}
