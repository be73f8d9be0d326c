//! The page of a talk: what the telemetry said beside what really happened.

use super::{COLUMNS, Outcome, TalkOptions};
use crate::report::Page;
use anyhow::Result;

type Points = Vec<(f64, f64)>;

fn told(outcome: &Outcome, column: &str) -> Points {
    let index = COLUMNS.iter().position(|name| *name == column).unwrap_or(0);
    let number = |row: &[String; COLUMNS.len()]| Some((row[0].parse().ok()?, row[index].parse().ok()?));
    outcome.talk.rows.iter().filter_map(number).collect()
}

/// The place of a name in a list, over time.
fn named(outcome: &Outcome, column: &str, names: &[&str]) -> Points {
    let index = COLUMNS.iter().position(|name| *name == column).unwrap_or(0);
    let place = |row: &[String; COLUMNS.len()]| {
        let place = names.iter().position(|name| *name == row[index])?;
        Some((row[0].parse().ok()?, place as f64))
    };
    outcome.talk.rows.iter().filter_map(place).collect()
}

fn listed(names: &[&str]) -> String {
    let list: Vec<_> = names.iter().enumerate().map(|(code, name)| format!("{code} {name}")).collect();
    list.join(", ")
}

/// The whole page.
pub(super) fn page(options: &TalkOptions, outcome: &Outcome) -> Result<String> {
    let mut page = Page::new("talk", "commanded over the protocol");
    let rows = &outcome.recording.rows;
    let time = "time in s";
    let speed = rows.iter().map(|row| (row.t_s, row.speed_rpm)).collect();
    page.curves("Speed", time, "r/min", &[("telemetry", told(outcome, "speed_rpm")), ("machine", speed)]);
    let torque = rows.iter().map(|row| (row.t_s, row.te_nm)).collect();
    page.curves(
        "Torque: demand as told, and the machine's",
        time,
        "N·m",
        &[("telemetry", told(outcome, "torque_nm")), ("machine", torque)],
    );
    let states: Vec<_> = tractive::operator::State::ALL.iter().map(|state| state.name()).collect();
    page.curves(
        &format!("State ({})", listed(&states)),
        time,
        "",
        &[("state", named(outcome, "state", &states))],
    );
    let listening: Vec<_> = tractive::protocol::Listening::ALL.iter().map(|(_, name)| *name).collect();
    page.curves(
        &format!("Commands ({})", listed(&listening)),
        time,
        "",
        &[("listening", named(outcome, "listening", &listening))],
    );
    let causes = ["unknown", "truncated", "corrupted", "repeated", "disordered", "out_of_range"];
    let rejected: Vec<_> = causes.iter().map(|cause| (*cause, told(outcome, cause))).collect();
    page.curves("Frames rejected", time, "", &rejected);
    page.curves("Link", time, "V", &[("telemetry", told(outcome, "link_v"))]);
    page.curves(
        "Currents",
        time,
        "A",
        &[
            ("largest phase", told(outcome, "current_a")),
            ("id*", told(outcome, "id_ref_a")),
            ("iq*", told(outcome, "iq_ref_a")),
        ],
    );
    let script =
        options.script.as_ref().map_or("standard input".to_owned(), |path| path.display().to_string());
    let subtitle =
        format!("tractive {}, run on {}, {script}", env!("CARGO_PKG_VERSION"), options.run.on.name());
    page.finish(&subtitle, &outcome.figures)
}
