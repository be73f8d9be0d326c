//! The page of a talk: what the telemetry said beside what really happened.

use super::outcome::{Outcome, Recorded, TalkOptions};
use super::system::System;
use crate::report::Page;
use crate::zs9::{self, trace::MotorRow};
use anyhow::Result;

type Points = Vec<(f64, f64)>;

fn told(outcome: &Outcome, column: &str) -> Points {
    let index = outcome.system.columns().iter().position(|name| *name == column).unwrap_or(0);
    let number = |row: &Vec<String>| Some((row[0].parse().ok()?, row[index].parse().ok()?));
    outcome.talk.rows.iter().filter_map(number).collect()
}

/// The place of a name in a list, over time.
fn named(outcome: &Outcome, column: &str, names: &[&str]) -> Points {
    let index = outcome.system.columns().iter().position(|name| *name == column).unwrap_or(0);
    let place = |row: &Vec<String>| {
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
    let time = "time in s";
    match &outcome.recording {
        Recorded::Pmasynrm(recording) => {
            page.recorder(recording);
            let rows = &recording.rows;
            let speed = rows.iter().map(|row| (row.t_s, row.speed_rpm)).collect();
            page.curves(
                "Speed",
                time,
                "r/min",
                &[("telemetry", told(outcome, "speed_rpm")), ("machine", speed)],
            );
            let torque = rows.iter().map(|row| (row.t_s, row.te_nm)).collect();
            page.curves(
                "Torque: demand as told, and the machine's",
                time,
                "N·m",
                &[("telemetry", told(outcome, "torque_nm")), ("machine", torque)],
            );
        }
        Recorded::Zs9(recording) => {
            zs9::figures::recorder(&mut page, recording);
            let of = |value: fn(&MotorRow) -> f64, k: usize| -> Points {
                recording.rows.iter().map(|row| (row.t_s, value(&row.motors[k]))).collect()
            };
            page.curves(
                "Speeds",
                time,
                "r/min",
                &[
                    ("telemetry 1", told(outcome, "speed1_rpm")),
                    ("telemetry 2", told(outcome, "speed2_rpm")),
                    ("upper motor", of(|motor| motor.speed_rpm, 0)),
                    ("lower motor", of(|motor| motor.speed_rpm, 1)),
                ],
            );
            page.curves(
                "Torques: references as told, and the machines'",
                time,
                "N·m",
                &[
                    ("telemetry 1", told(outcome, "torque1_nm")),
                    ("telemetry 2", told(outcome, "torque2_nm")),
                    ("upper motor", of(|motor| motor.torque_nm, 0)),
                    ("lower motor", of(|motor| motor.torque_nm, 1)),
                ],
            );
            page.curves("Shoot-through duty", time, "%", &[("telemetry", told(outcome, "duty_percent"))]);
        }
    }
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
    let curves = |columns: &[&'static str]| -> Vec<(&'static str, Points)> {
        columns.iter().map(|column| (*column, told(outcome, column))).collect()
    };
    let (link, currents): (&[_], &[_]) = match outcome.system {
        System::Pmasynrm => (&["link_v"], &["current_a", "id_ref_a", "iq_ref_a"]),
        System::Zs9 => (&["link_v", "capacitor_v"], &["current1_a", "current2_a"]),
    };
    page.curves("Link", time, "V", &curves(link));
    page.curves("Currents", time, "A", &curves(currents));
    let script =
        options.script.as_ref().map_or("standard input".to_owned(), |path| path.display().to_string());
    let subtitle =
        format!("tractive {}, run on {}, {script}", env!("CARGO_PKG_VERSION"), options.run.on.name());
    page.finish(&subtitle, &outcome.figures)
}
