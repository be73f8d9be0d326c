//! The first paper's measurements, figures 8 to 10, from runs of this project.

use super::super::ink::draw;
use super::super::sheet::{Axis, BLUE, GREY, Panel, RED, Side, number};
use crate::analysis::SteadyPoint;
use crate::trace::{Recording, Row};
use anyhow::Result;
use tractive::modulation::Mode;

/// Time that is drawn before a switch of mode and after it, in s.
pub const AROUND_S: (f64, f64) = (0.03, 0.04);

/// The paper's figure of a change of mode; it shows these four, on the way up, and no other.
pub fn change(from: Mode, to: Mode) -> Option<&'static str> {
    const FIGURES: [(Mode, Mode, &str); 4] = [
        (Mode::Sync15, Mode::Sync12, "figure 9a"),
        (Mode::Sync12, Mode::Mid7, "figure 9b"),
        (Mode::Mid7, Mode::Mid3, "figure 9c"),
        (Mode::Mid3, Mode::Square, "figure 9d"),
    ];
    let known = FIGURES.iter().find(|(below, above, _)| (*below, *above) == (from, to));
    known.map(|(_, _, figure)| *figure)
}

/// A curve of a recording's rows over time in s.
fn curve(recording: &Recording, (from_s, to_s): (f64, f64), value: fn(&Row) -> f64) -> Vec<(f64, f64)> {
    let rows = crate::analysis::window(recording, from_s, to_s);
    rows.iter().map(|row| (row.t_s, value(row))).collect()
}

/// The step that figure 8 shows as a close-up: its time in s, and the time before and after it that is drawn.
const CLOSER: (f64, f64, f64) = (0.3, 0.004, 0.012);

/// Line voltage, phase current and torque around one step, one above the other from a height on.
fn closer(recording: &Recording, mut top: f64) -> Vec<Panel> {
    let (at_s, before_s, after_s) = CLOSER;
    let window = (at_s - before_s, at_s + after_s);
    let since = |(t_s, value): (f64, f64)| (1e3 * (t_s - at_s), value);
    let demands = curve(recording, window, |row| row.te_ref_nm);
    let [from_nm, to_nm] = [demands.first(), demands.last()].map(|of| of.map_or(0.0, |(_, value)| *value));
    let title = format!("Line voltage, closer: the step from {} to {} N·m", number(from_nm), number(to_nm));
    let panels = [
        (title.as_str(), "u_{uv} in V", recording.line_voltage(window), Some((-1800.0, 1800.0)), 180.0),
        ("Phase current", "i_{u} in A", curve(recording, window, |row| row.ia_a), None, 180.0),
        ("Torque and demand", "T in N·m", curve(recording, window, |row| row.te_nm), None, 200.0),
    ];
    let mut sheet = Vec::new();
    for (title, unit, points, range, height) in panels {
        let y = Axis { range, ..Axis::fitted(unit) };
        let x = Axis::of("time from the step in ms", -1e3 * before_s, 1e3 * after_s);
        let mut panel = Panel::new((0.0, top, 900.0, height), title, x, y);
        panel.line(points.into_iter().map(since), BLUE, 1.4);
        if title.starts_with("Torque") {
            panel.line(demands.iter().copied().map(since), RED, 1.4);
        }
        sheet.push(panel);
        top += height;
    }
    sheet
}

/// Figure 8: link voltage, line voltage, phase current and torque of the load steps, one above the other, and a close-up of one step.
pub fn load_steps(recording: &Recording) -> Result<String> {
    let end_s = recording.rows.last().map_or(1.0, |row| row.t_s);
    let window = (0.0, end_s);
    let line = recording.line_voltage(window);
    let panels = [
        ("DC link", "u_{dc} in V", curve(recording, window, |row| row.udc_v), Some((1400.0, 1600.0))),
        ("Line voltage", "u_{uv} in V", line, Some((-1800.0, 1800.0))),
        ("Phase current", "i_{u} in A", curve(recording, window, |row| row.ia_a), None),
        ("Torque and demand", "T in N·m", curve(recording, window, |row| row.te_nm), None),
    ];
    let mut sheet = Vec::new();
    let (mut top, heights) = (0.0, [140.0, 180.0, 220.0, 220.0]);
    for ((title, unit, points, range), height) in panels.into_iter().zip(heights) {
        let y = Axis { range, ..Axis::fitted(unit) };
        let x = Axis::of("time in s", 0.0, end_s);
        let mut panel = Panel::new((0.0, top, 900.0, height), title, x, y);
        panel.line(points, BLUE, 1.0);
        if title.starts_with("Torque") {
            panel.line(curve(recording, window, |row| row.te_ref_nm), RED, 1.2);
        }
        sheet.push(panel);
        top += height;
    }
    let closer = closer(recording, top);
    top += closer.iter().map(|panel| panel.place.3).sum::<f64>();
    sheet.extend(closer);
    draw((900, top as u32), &sheet)
}

/// Figure 9: four changes of mode, a to d; each with the line voltage above the phase current.
pub fn changes(recording: &Recording) -> Result<String> {
    let mut sheet = Vec::new();
    let switches = recording.switches.iter().filter(|switch| switch.is_between_pulses());
    let known = switches.filter_map(|switch| Some((switch, change(switch.from, switch.to)?)));
    for (k, (switch, figure)) in known.enumerate() {
        let (left, top) = (500.0 * (k % 2) as f64, 390.0 * (k / 2) as f64);
        let window = (switch.t_s - AROUND_S.0, switch.t_s + AROUND_S.1);
        let letter = figure.chars().next_back().unwrap_or('a');
        let title = format!(
            "{letter}) {} → {} at {} r/min",
            switch.from.name(),
            switch.to.name(),
            number(switch.speed_rpm.round())
        );
        let since = |(t_s, value): (f64, f64)| (1e3 * (t_s - switch.t_s), value);
        let x = |label: &str| Axis::of(label, -1e3 * AROUND_S.0, 1e3 * AROUND_S.1);
        let y = Axis::of("u_{uv} in V", -1800.0, 1800.0);
        let mut line = Panel::new((left, top, 500.0, 190.0), &title, x(""), y);
        line.line(recording.line_voltage(window).into_iter().map(since), BLUE, 1.2);
        line.dashes([(0.0, -1800.0), (0.0, 1800.0)], RED);
        let y = Axis::of("i_{u} in A", -300.0, 300.0);
        let mut current =
            Panel::new((left, top + 176.0, 500.0, 200.0), "", x("time from the change in ms"), y);
        current.line(curve(recording, window, |row| row.ia_a).into_iter().map(since), BLUE, 1.6);
        current.dashes([(0.0, -300.0), (0.0, 300.0)], RED);
        sheet.extend([line, current]);
    }
    draw((1000, 780), &sheet)
}

/// A value of a steady point, if it has one.
type OfPoint = fn(&SteadyPoint) -> Option<f64>;

/// Figure 10: torque accuracy, efficiency and current at the characteristic points above rated torque; the rated point beside them.
pub fn accuracy(points: &[SteadyPoint], rated_nm: f64) -> Result<String> {
    let values: [(&str, &str, OfPoint); 3] = [
        ("Torque accuracy: 100 % less the error", "%", |point| {
            Some(100.0 - point.torque_error_percent.abs())
        }),
        ("Efficiency", "%", |point| point.efficiency_percent),
        ("Phase current", "A rms", |point| Some(point.current_rms_a)),
    ];
    let fastest = 1.1 * points.iter().map(|point| point.speed_rpm).fold(0.0, f64::max);
    let mut sheet = Vec::new();
    for (k, (title, unit, value)) in values.into_iter().enumerate() {
        let place = (0.0, 230.0 * k as f64, 860.0, 226.0);
        let mut panel =
            Panel::new(place, title, Axis::of("speed in r/min", 0.0, fastest), Axis::fitted(unit));
        let of = |point: &SteadyPoint| Some((point.speed_rpm, value(point)?));
        let all = points.iter().filter_map(value);
        let (low, high) = all.fold((f64::MAX, f64::MIN), |(low, high), of| (low.min(of), high.max(of)));
        let span = high - low;
        let full: Vec<_> =
            points.iter().filter(|point| point.demand_nm > 1.001 * rated_nm).filter_map(of).collect();
        panel.line(full.iter().copied(), BLUE, 1.6);
        full.iter().for_each(|at| {
            panel.spot(*at, BLUE);
        });
        for at in points.iter().filter(|point| point.demand_nm <= 1.001 * rated_nm).filter_map(of) {
            panel.spot(at, RED);
            panel.words((at.0 + 0.01 * fastest, at.1 - 0.08 * span), "rated", Side::Right, RED);
        }
        if title == "Efficiency" {
            panel.dashes([(0.0, 95.0), (fastest, 95.0)], GREY);
            panel.words((0.01 * fastest, 93.6), "95 %, the paper", Side::Right, GREY);
        }
        sheet.push(panel);
    }
    draw((860, 690), &sheet)
}
