//! The second paper's curves, figures 14 to 36, from runs of this project.

use super::super::ink::draw;
use super::super::sheet::{Axis, BLUE, Colour, GREEN, ORANGE, Panel, RED};
use crate::rows::between;
use crate::zs9::trace::{Recording, Row};
use anyhow::Result;

/// A value of a row.
type Value = fn(&Row) -> f64;
/// A curve of a panel: its name, value and colour.
type Curve<'a> = (&'a str, Value, Colour);
/// A panel's title, unit, and its curves by name.
type Part<'a> = (&'a str, &'a str, Vec<Curve<'a>>);

/// Panels over time, one above the other, from a time to another in s.
fn stacked(recording: &Recording, (from_s, to_s): (f64, f64), parts: &[Part]) -> Result<String> {
    const HEIGHT: f64 = 190.0;
    let rows = between(&recording.rows, from_s, to_s);
    let panels = parts.iter().enumerate().map(|(k, (title, unit, curves))| {
        let place = (0.0, HEIGHT * k as f64, 880.0, HEIGHT);
        let mut panel = Panel::new(place, title, Axis::of("time in s", from_s, to_s), Axis::fitted(unit));
        for (k, (name, value, colour)) in curves.iter().enumerate() {
            let points = rows.iter().map(|row| (row.t_s, value(row)));
            match curves.as_slice() {
                [_] => panel.line(points, *colour, 1.2),
                [(_, first, _), ..] if k > 0 && lies_on(rows, *value, *first) => {
                    panel.named_dashes(name, points, *colour)
                }
                _ => panel.named(name, points, *colour),
            };
        }
        panel
    });
    let panels: Vec<_> = panels.collect();
    draw((880, (HEIGHT * parts.len() as f64) as u32), &panels)
}

/// `true` if one value equals another most of the time, so that its curve would hide the other's.
fn lies_on(rows: &[Row], value: Value, other: Value) -> bool {
    const NEAR: f64 = 0.5;
    let near = |row: &&Row| (value(row) - other(row)).abs() < NEAR;
    rows.iter().filter(near).count() > rows.len() / 2
}

fn torques<'a>() -> Part<'a> {
    let curves: [Curve; 2] =
        [("motor 1", |row| row.motors[0].torque_nm, BLUE), ("motor 2", |row| row.motors[1].torque_nm, RED)];
    ("Torque", "N·m", curves.to_vec())
}

fn link<'a>() -> Part<'a> {
    ("Link voltage U_{in}", "V", vec![("U_in", |row| row.link_v, BLUE)])
}

fn inductor<'a>() -> Part<'a> {
    ("Inductor current", "A", vec![("i_L", |row| row.inductor_a, BLUE)])
}

fn speed1<'a>(title: &'a str) -> Part<'a> {
    (title, "r/min", vec![("motor 1", |row| row.motors[0].speed_rpm, BLUE)])
}

fn speed2<'a>(title: &'a str) -> Part<'a> {
    (title, "r/min", vec![("motor 2", |row| row.motors[1].speed_rpm, RED)])
}

fn phases<'a>(title: &'a str, which: usize) -> Part<'a> {
    let curves: [[Value; 3]; 2] = [
        [|row| row.motors[0].phases_a[0], |row| row.motors[0].phases_a[1], |row| row.motors[0].phases_a[2]],
        [|row| row.motors[1].phases_a[0], |row| row.motors[1].phases_a[1], |row| row.motors[1].phases_a[2]],
    ];
    let [a, b, c] = curves[which];
    (title, "A", vec![("a", a, BLUE), ("b", b, RED), ("c", c, GREEN)])
}

/// Figures 14 to 19: motor 2's load steps at 0.6 s, motor 1 carries on.
pub fn load_step(recording: &Recording) -> Result<String> {
    let parts = [
        link(),
        inductor(),
        torques(),
        speed1("Speed of motor 1"),
        phases("Phase currents of motor 1", 0),
        phases("Phase currents of motor 2", 1),
    ];
    stacked(recording, (0.55, 0.7), &parts)
}

/// Figure 17: motor 2's speed in it.
pub fn load_step_speed(recording: &Recording) -> Result<String> {
    stacked(recording, (0.5, 0.8), &[speed2("Speed of motor 2 when its load steps by 40 N·m")])
}

/// Figures 20 to 23: motor 2 reverses, motor 1 carries on.
pub fn reverse(recording: &Recording) -> Result<String> {
    let parts = [torques(), speed1("Speed of motor 1"), link(), inductor()];
    stacked(recording, (0.3, 1.8), &parts)
}

/// Figure 23: motor 2's speed in it.
pub fn reverse_speed(recording: &Recording) -> Result<String> {
    stacked(recording, (0.3, 1.8), &[speed2("Speed of motor 2, reversed")])
}

/// Figures 24 to 35: the whole cycle.
pub fn cycle(recording: &Recording) -> Result<String> {
    let end_s = recording.rows.last().map_or(1.0, |row| row.t_s);
    let speeds: Part = (
        "Speed",
        "r/min",
        vec![
            ("motor 1", |row| row.motors[0].speed_rpm, BLUE),
            ("motor 2", |row| row.motors[1].speed_rpm, RED),
        ],
    );
    let capacitors: Part = ("Capacitor voltage", "V", vec![("U_C", |row| row.capacitor_v, BLUE)]);
    let currents: Part = (
        "Currents of motor 1 in the rotor's frame",
        "A",
        vec![("i_{d}", |row| row.motors[0].id_a, BLUE), ("i_{q}", |row| row.motors[0].iq_a, ORANGE)],
    );
    let voltage: Part =
        ("Phase voltage of motor 1, peak", "V", vec![("u", |row| row.motors[0].voltage_v, BLUE)]);
    stacked(recording, (0.0, end_s), &[speeds, torques(), currents, voltage, link(), capacitors, inductor()])
}

/// Figure 36: torque and voltage over speed.
pub fn over_speed(recording: &Recording) -> Result<String> {
    let values: [(&str, &str, Value); 2] = [
        ("N·m", "Torque of motor 1", |row| row.motors[0].torque_nm),
        ("V", "Phase voltage of motor 1, peak", |row| row.motors[0].voltage_v),
    ];
    let panels = values.map(|(unit, title, value)| {
        let mut panel = Panel::new(
            (0.0, 0.0, 880.0, 260.0),
            title,
            Axis::of("speed in r/min", 0.0, 1350.0),
            Axis::fitted(unit),
        );
        for (name, colour, brakes) in [("motoring", BLUE, false), ("braking", RED, true)] {
            // A value that is no number ends a curve.
            let of = |row: &Row| match (row.motors[0].torque_ref_nm < 0.0) == brakes {
                true => (row.motors[0].speed_rpm, value(row)),
                false => (f64::NAN, f64::NAN),
            };
            panel.named(name, recording.rows.iter().map(of), colour);
        }
        panel
    });
    let [first, mut second] = panels;
    second.place.1 = 260.0;
    draw((880, 520), &[first, second])
}
