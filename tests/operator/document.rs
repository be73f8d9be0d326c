//! docs/operator.md has every state and refusal that the code has, and no other.

use std::path::Path;
use tractive::built_in::traction::BUILT_IN;
use tractive::operator::{Limits, Line, Refusal, State};

fn text() -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/operator.md");
    std::fs::read_to_string(path).unwrap()
}

/// The names in the first column of the table under a heading.
fn table<'a>(text: &'a str, heading: &str) -> Vec<&'a str> {
    let section = text.split("\n## ").find(|section| section.starts_with(heading)).unwrap();
    let rows = section.lines().filter_map(|line| line.strip_prefix("| `"));
    rows.filter_map(|row| row.split('`').next()).collect()
}

#[test]
fn the_tables_are_the_codes() {
    let text = text();
    let states: Vec<_> = State::ALL.iter().map(|state| state.name()).collect();
    assert_eq!(table(&text, "States"), states);
    let refusals: Vec<_> = Refusal::ALL.iter().map(|refusal| refusal.name()).collect();
    assert_eq!(table(&text, "Refusals"), refusals);
}

#[test]
fn the_voltages_are_those_of_the_machine_that_is_built_in() {
    let text = text().replace(",", "");
    let ratings = &BUILT_IN.ratings;
    let line = Line::rated(ratings, 0.3, 0.6);
    let limits = Limits::rated(ratings);
    for volts in [line.chopper_from_v, line.chopper_full_v, limits.link_high_v, limits.link_low_v] {
        let rounded = (f64::from(volts) * 10.0).round() / 10.0;
        assert!(text.contains(&format!("{rounded} V")), "{rounded} V is not in docs/operator.md");
    }
}
