//! The page of a talk: the telemetry beside what really happened.

use super::outcome::{Happened, Outcome, TalkOptions};
use super::system::System;
use crate::report::Page;
use crate::trace::{Recording, Row};
use crate::zs9::{self, trace::MotorRow};
use anyhow::Result;

type Points = Vec<(f64, f64)>;

fn told(outcome: &Outcome, column: &str) -> Points {
    let index = outcome.system.column(column).unwrap_or(0);
    let number = |row: &Vec<String>| Some((row[0].parse().ok()?, row[index].parse().ok()?));
    outcome.talk.rows.iter().filter_map(number).collect()
}

/// The place of a name in a list, over time.
fn named(outcome: &Outcome, column: &str, names: &[&str]) -> Points {
    let index = outcome.system.column(column).unwrap_or(0);
    let place = |row: &Vec<String>| {
        let place = names.iter().position(|name| *name == row[index])?;
        Some((row[0].parse().ok()?, place as f64))
    };
    outcome.talk.rows.iter().filter_map(place).collect()
}

const TIME: &str = "time in s";

/// The PMaSynRM drive's speed and torque.
fn traction(page: &mut Page, outcome: &Outcome, recording: &Recording) {
    page.recorder(recording);
    let of = |value: fn(&Row) -> f64| recording.rows.iter().map(|row| (row.t_s, value(row))).collect();
    let speeds = [("machine", of(|row| row.speed_rpm)), ("telemetry", told(outcome, "speed_rpm"))];
    page.curves("Speed", TIME, "r/min", &speeds);
    let torques = [("machine", of(|row| row.te_nm)), ("telemetry", told(outcome, "torque_nm"))];
    page.curves("Torque: demand as told, and the machine's", TIME, "N·m", &torques);
}

/// The ZS9's speeds, torques and duty.
fn dual(page: &mut Page, outcome: &Outcome, recording: &zs9::trace::Recording) {
    zs9::figures::recorder(page, recording);
    let both = |what: (&str, &str), value: fn(&MotorRow) -> f64| {
        let of = |k: usize| recording.rows.iter().map(|row| (row.t_s, value(&row.motors[k]))).collect();
        [
            ("upper motor", of(0)),
            ("lower motor", of(1)),
            ("telemetry 1", told(outcome, &format!("{}1_{}", what.0, what.1))),
            ("telemetry 2", told(outcome, &format!("{}2_{}", what.0, what.1))),
        ]
    };
    page.curves("Speeds", TIME, "r/min", &both(("speed", "rpm"), |motor| motor.speed_rpm));
    let torques = both(("torque", "nm"), |motor| motor.torque_nm);
    page.curves("Torques: references as told, and the machines'", TIME, "N·m", &torques);
    page.curves("Shoot-through duty", TIME, "%", &[("telemetry", told(outcome, "duty_percent"))]);
}

/// The whole page.
pub(super) fn page(options: &TalkOptions, outcome: &Outcome) -> Result<String> {
    let mut page = Page::new("talk", "commanded over the protocol");
    let (asked, not_met) = (outcome.talk.expectations, outcome.talk.failures.len());
    page.headline(&match not_met {
        0 => format!("PASS: {asked} expectations met"),
        _ => format!("FALLS SHORT: {not_met} of {asked} expectations"),
    });
    match &outcome.recording {
        Happened::Pmasynrm(recording) => traction(&mut page, outcome, recording),
        Happened::Zs9(recording) => dual(&mut page, outcome, recording),
    }
    let states: Vec<_> = tractive::operator::State::ALL.iter().map(|state| state.name()).collect();
    page.states("State", &states, named(outcome, "state", &states));
    let listening: Vec<_> = tractive::protocol::Listening::ALL.iter().map(|(_, name)| *name).collect();
    page.states("Commands", &listening, named(outcome, "listening", &listening));
    let causes = ["unknown", "truncated", "corrupted", "repeated", "disordered", "out_of_range"];
    let rejected: Vec<_> = causes.iter().map(|cause| (*cause, told(outcome, cause))).collect();
    page.curves("Frames rejected", TIME, "", &rejected);
    let curves = |columns: &[&'static str]| -> Vec<(&'static str, Points)> {
        columns.iter().map(|column| (*column, told(outcome, column))).collect()
    };
    let (link, currents): (&[_], &[_]) = match outcome.system {
        System::Pmasynrm => (&["link_v"], &["current_a", "id_ref_a", "iq_ref_a"]),
        System::Zs9 => (&["link_v", "capacitor_v"], &["current1_a", "current2_a"]),
    };
    page.curves("Link", TIME, "V", &curves(link));
    page.curves("Currents", TIME, "A", &curves(currents));
    let script =
        options.script.as_ref().map_or("standard input".to_owned(), |path| path.display().to_string());
    let subtitle = format!("tractive {}, run on {}, {script}", env!("CARGO_PKG_VERSION"), outcome.on);
    page.finish(&subtitle, &outcome.figures)
}
