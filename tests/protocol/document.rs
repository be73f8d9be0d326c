//! docs/protocol.md against the code.

use std::path::Path;
use tractive::operator::{Refusal, State};
use tractive::protocol::{FROM_DRIVE, FROM_IDENTIFICATION, FROM_ZS9, Message, PARAMETERS, TO_DRIVE, TO_ZS9};

fn text() -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/protocol.md");
    std::fs::read_to_string(path).unwrap_or_default()
}

fn has(rows: &[String]) {
    let text = text();
    let missing: Vec<_> =
        rows.iter().filter(|row| !text.lines().any(|line| line.starts_with(*row))).collect();
    assert!(missing.is_empty(), "docs/protocol.md lacks lines that begin with:\n{rows:#?}");
}

fn row(message: &Message, direction: &str) -> String {
    let period = match message.period_ms {
        0 => "–".to_owned(),
        ms => format!("{ms} ms"),
    };
    let signals: Vec<_> = message.signals.iter().map(|signal| format!("`{}`", signal.name)).collect();
    format!(
        "| {} | 0x{:03X} | {direction} | {} | {period} | {} |",
        message.name,
        message.id,
        message.number,
        signals.join(", ")
    )
}

#[test]
fn the_messages_are_listed() {
    let commands = TO_DRIVE.map(|message| row(message, "in"));
    let from = FROM_DRIVE.into_iter().chain(FROM_IDENTIFICATION).map(|message| row(message, "out"));
    has(&commands.iter().cloned().chain(from).collect::<Vec<_>>());
    let commands = TO_ZS9.map(|message| row(message, "in"));
    has(&[&commands[..], &FROM_ZS9.map(|message| row(message, "out"))[..]].concat());
}

#[test]
fn the_parameters_are_listed() {
    has(&PARAMETERS.map(|parameter| {
        let (low, high) = (parameter.min, parameter.max);
        format!(
            "| {} | {} | {} | {low} … {high} | {} |",
            parameter.id, parameter.name, parameter.unit, parameter.purpose
        )
    }));
}

#[test]
fn states_and_refusals_have_names_in_the_dbc_file() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/tractive.dbc");
    let dbc = std::fs::read_to_string(path).unwrap_or_default();
    let names = State::ALL.iter().map(|state| state.name());
    for name in names.chain(Refusal::ALL.iter().map(|refusal| refusal.name())) {
        assert!(dbc.contains(&format!("\"{name}\"")), "{name}");
    }
}
