//! Figures and plots from a recording of the ZS9.

use super::trace::{Recording, Row};
use crate::analysis::{self, Figures};
use crate::report::{self, Page, Panel};
use crate::rows::{between, mean};
use crate::trace::Recorded;
use core::f64::consts::TAU;
use tractive::recorder::DualRecord;

/// A curve: its name and what it shows.
pub type Curve<'a> = report::Curve<'a, Row>;

/// The paper's figure that a plot answers, its title, its unit. Of figures 14 to 36 only the captions of 17, 23 and 36 are known; the others
/// are named only by the group that the text mentions.
pub type Heading<'a> = (&'a str, &'a str, &'a str);

/// The motors' torques.
pub const TORQUES: [Curve; 2] =
    [("motor 1", |row| row.motors[0].torque_nm), ("motor 2", |row| row.motors[1].torque_nm)];
/// The torques that control demands of the motors.
pub const DEMANDS: [Curve; 2] =
    [("demand 1", |row| row.motors[0].torque_ref_nm), ("demand 2", |row| row.motors[1].torque_ref_nm)];
/// The motors' speeds.
pub const SPEEDS: [Curve; 2] =
    [("motor 1", |row| row.motors[0].speed_rpm), ("motor 2", |row| row.motors[1].speed_rpm)];
/// The voltages of the link and of the capacitors.
pub const VOLTAGES: [Curve; 2] = [("U_in", |row| row.link_v), ("U_c", |row| row.capacitor_v)];
/// The voltage of the source, and the current out of the line.
const SOURCE: [Curve; 1] = [("U_dc", |row| row.source_v)];
const LINE: [Curve; 1] = [("line current", |row| row.line_a.unwrap_or(0.0))];
/// Time at the end of a run in which the swing of a source behind a line filter is told, and the shortest run in which it has died out by then, in s.
const SETTLED_S: f64 = 0.1;
const SHORTEST_S: f64 = 0.3;
/// The current of the inductors.
pub const INDUCTOR: [Curve; 1] = [("i_L", |row| row.inductor_a)];

/// Figures of every scenario.
pub fn common(recording: &Recording) -> Figures {
    let rows = &recording.rows;
    let peak = |row: &Row| {
        let phases = row.motors.iter().flat_map(|motor| motor.phases_a);
        phases.fold(0.0, |most: f64, current| most.max(current.abs()))
    };
    let simulated_s = rows.last().map_or(0.0, |row| row.t_s + step_s(recording));
    let mut figures = Figures::of_run(simulated_s, recording.trip(), largest(rows, peak));
    let line_a = rows.iter().filter_map(|row| row.line_a).map(f64::abs).reduce(f64::max);
    if let Some(line_a) = line_a {
        figures.set("peak_line_current_a", line_a);
        figures.set("lowest_source_v", -largest(rows, |row| -row.source_v));
        figures.set("highest_source_v", largest(rows, |row| row.source_v));
        if simulated_s >= SHORTEST_S {
            let last = window(recording, simulated_s - SETTLED_S, f64::INFINITY);
            figures.set(SOURCE_SWING, 100.0 * swing(last));
        }
    }
    figures
}

/// Name of the swing of a source behind a line filter at the end of a run, in % of its voltage.
pub const SOURCE_SWING: &str = "source_swing_percent";

/// Half the peak-to-peak swing of the source in some rows, as a share of its voltage.
pub fn swing(rows: &[Row]) -> f64 {
    analysis::swing(rows.iter().map(|row| row.source_v))
}

/// Voltage of the source and current out of the line; none without a line filter.
pub fn line(page: &mut Page, recording: &Recording) {
    if recording.rows.iter().any(|row| row.line_a.is_some()) {
        page.plot_rows("source", "V", &recording.rows, &SOURCE);
        page.plot_rows("current out of the line", "A", &recording.rows, &LINE);
    }
}

/// The range of the link voltage in some rows, in which `wanted_v` (V) is demanded.
pub fn link(figures: &mut Figures, rows: &[Row], wanted_v: f64) {
    let high = largest(rows, |row| row.link_v - wanted_v);
    let low = -largest(rows, |row| wanted_v - row.link_v);
    figures.set("link_above_v", high);
    figures.set("link_below_v", low);
    figures.set("link_deviation_percent", high.max(-low) / wanted_v * 100.0);
    figures.set("mean_duty", mean(rows, |row| row.duty));
}

/// Step of the trace, in s.
pub fn step_s(recording: &Recording) -> f64 {
    match recording.rows.as_slice() {
        [first, second, ..] => second.t_s - first.t_s,
        _ => 0.0,
    }
}

/// The rows from `from_s` (included) to `to_s` (excluded).
pub fn window(recording: &Recording, from_s: f64, to_s: f64) -> &[Row] {
    between(&recording.rows, from_s, to_s)
}

/// Largest value over rows.
pub fn largest(rows: &[Row], value: impl Fn(&Row) -> f64) -> f64 {
    rows.iter().map(value).fold(f64::NEG_INFINITY, f64::max)
}

/// Total harmonic distortion, in percent of the fundamental, over a whole number of its periods.
pub fn thd_percent(recording: &Recording, cycles: f64, value: impl Fn(&Row) -> f64) -> f64 {
    let rows = &recording.rows;
    let count = rows.len() as f64;
    let (mut cos, mut sin, mut squares) = (0.0, 0.0, 0.0);
    let constant = mean(rows, &value);
    for (k, row) in rows.iter().enumerate() {
        let (s, c) = (TAU * cycles * (k as f64 + 0.5) / count).sin_cos();
        let x = value(row) - constant;
        cos += x * c;
        sin += x * s;
        squares += x * x;
    }
    let fundamental = 2.0 / (count * count) * (cos * cos + sin * sin);
    (squares / count / fundamental - 1.0).max(0.0).sqrt() * 100.0
}

/// Curves over time, under the figure that they answer, with their title and unit.
pub fn plot(page: &mut Page, (figure, title, unit): Heading, rows: &[Row], curves: &[Curve]) {
    page.answers(figure);
    page.plot_rows(title, unit, rows, curves);
}

/// Both motors' phase currents, under the figure that the page's plots currently answer.
pub fn phases(page: &mut Page, rows: &[Row]) {
    page.plot_rows("phase currents of motor 1", "A", rows, &phase_curves::<0>());
    page.plot_rows("phase currents of motor 2", "A", rows, &phase_curves::<1>());
}

fn phase_curves<const K: usize>() -> [Curve<'static>; 3] {
    [
        ("a", |row| row.motors[K].phases_a[0]),
        ("b", |row| row.motors[K].phases_a[1]),
        ("c", |row| row.motors[K].phases_a[2]),
    ]
}

/// A curve of motor 1 over its speed, up to the highest one and back.
pub fn over_speed(page: &mut Page, (figure, title, unit): Heading, rows: &[Row], (_, value): &Curve) {
    let speed = |row: &Row| row.motors[0].speed_rpm;
    let brakes = rows.iter().position(|row| row.motors[0].torque_ref_nm < -1.0).unwrap_or(rows.len());
    let (up, down) = rows.split_at(brakes);
    let points = |rows: &[Row]| {
        let mut points: Vec<_> = rows.iter().map(|row| (speed(row), value(row))).collect();
        points.sort_by(|one, other| one.0.total_cmp(&other.0));
        points
    };
    let series = [("up", up), ("down", down)].map(|(name, rows)| (name.to_owned(), points(rows)));
    page.draw_xy(figure, title, ("speed in r/min", unit), &series);
}

/// The flight recorder's records of a fault; nothing if there was none.
pub fn recorder(page: &mut Page, recording: &Recording) {
    let currents = |[a, b, c]: [fn(&DualRecord) -> f32; 3]| [("ia", a), ("ib", b), ("ic", c)];
    let upper = currents([|of| of.currents_a[0].a, |of| of.currents_a[0].b, |of| of.currents_a[0].c]);
    let lower = currents([|of| of.currents_a[1].a, |of| of.currents_a[1].b, |of| of.currents_a[1].c]);
    let panels: [Panel<DualRecord>; 4] = [
        ("the upper motor's currents as sampled", "A", &upper),
        ("the lower motor's currents as sampled", "A", &lower),
        (
            "torque references",
            "N·m",
            &[("upper motor", |of| of.torque_nm[0]), ("lower motor", |of| of.torque_nm[1])],
        ),
        (
            "link, capacitors, source as sampled",
            "V",
            &[("U_in", DualRecord::link_v), ("U_c", |of| of.capacitor_v), ("U_dc", |of| of.source_v)],
        ),
    ];
    page.recorded(&recording.recorded, |record| record.state.fault, &panels);
}
