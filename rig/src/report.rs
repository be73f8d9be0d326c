//! The scenario's page: one self-contained HTML file, its plots drawn as SVG.

use crate::analysis::Figures;
use crate::bench::GATES;
use crate::trace::{Recording, Row};
use anyhow::{Result, anyhow};
use plotters::prelude::*;
use serde_json::Value;
use std::fmt::Write as _;
use tractive::protection::Fault;
use tractive::recorder::Record;

/// What is drawn of a flight recorder's records: title, unit, and each curve's name and value.
pub type Panel<'a, R> = (&'a str, &'a str, &'a [(&'static str, fn(&R) -> f32)]);

/// Size of a plot, in pixels.
const SIZE: (u32, u32) = (1000, 280);
/// Points per curve; denser data is shown by its extremes.
const POINTS: usize = 1500;
const COLOURS: [RGBColor; 6] = [
    RGBColor(31, 119, 180),
    RGBColor(214, 39, 40),
    RGBColor(44, 160, 44),
    RGBColor(148, 103, 189),
    RGBColor(255, 127, 14),
    RGBColor(23, 190, 207),
];

/// A curve of a recording: its name and what it shows.
pub type Curve<'a> = (&'a str, fn(&Row) -> f64);

/// One picture of a whole run: torque, phase current, fundamental voltage, one above the other, the modes as bands.
pub fn overview(recording: &Recording) -> Result<String> {
    let rows = &recording.rows;
    let end_s = rows.last().map_or(1.0, |row| row.t_s);
    let panels: [(&str, Vec<Curve>); 3] = [
        ("torque in N·m", vec![("torque", |row| row.te_nm), ("demand", |row| row.te_ref_nm)]),
        ("current u in A", vec![("ia", |row| row.ia_a)]),
        ("voltage in V", vec![("u", |row| row.u_v)]),
    ];
    let mut svg = String::new();
    {
        let area = SVGBackend::with_string(&mut svg, (SIZE.0, 2 * SIZE.1)).into_drawing_area();
        for (panel, (label, curves)) in area.split_evenly((3, 1)).iter().zip(&panels) {
            draw_panel(panel, label, recording, curves, end_s)?;
        }
        area.present().map_err(|error| anyhow!("plot: {error}"))?;
    }
    Ok(svg)
}

fn draw_panel(
    panel: &DrawingArea<SVGBackend, plotters::coord::Shift>,
    label: &str,
    recording: &Recording,
    curves: &[Curve],
    end_s: f64,
) -> Result<()> {
    let failed = |error: &dyn std::fmt::Display| anyhow!("plot: {error}");
    let rows = &recording.rows;
    let values = || rows.iter().flat_map(|row| curves.iter().map(|(_, value)| value(row)));
    let (low, high) =
        values().fold((0.0_f64, 0.0_f64), |(low, high), value| (low.min(value), high.max(value)));
    let room = 0.18 * (high - low).max(1e-9);
    let mut chart = ChartBuilder::on(panel)
        .margin(6)
        .x_label_area_size(24)
        .y_label_area_size(64)
        .build_cartesian_2d(0.0..end_s, low - 0.2 * room..high + room)
        .map_err(|error| failed(&error))?;
    let mut begin = 0;
    while begin < rows.len() {
        let mode = rows[begin].mode;
        let length = rows[begin..].iter().take_while(|row| row.mode == mode).count();
        let (from_s, to_s) = (rows[begin].t_s, rows[begin + length - 1].t_s);
        let shade = RGBColor(225, 232, 240).mix(if (mode as u8).is_multiple_of(2) { 0.9 } else { 0.35 });
        let corners = [(from_s, low - 0.2 * room), (to_s, high + room)];
        let band = Rectangle::new(corners, shade.filled());
        chart.draw_series(std::iter::once(band)).map_err(|error| failed(&error))?;
        if to_s - from_s > 0.04 * end_s {
            let name = Text::new(mode.name(), (from_s, high + 0.9 * room), ("sans-serif", 12));
            chart.draw_series(std::iter::once(name)).map_err(|error| failed(&error))?;
        }
        begin += length;
    }
    chart
        .configure_mesh()
        .disable_mesh()
        .x_desc("time in s")
        .y_desc(label)
        .draw()
        .map_err(|error| failed(&error))?;
    for ((_, value), colour) in curves.iter().zip(COLOURS) {
        let points: Vec<_> = rows.iter().map(|row| (row.t_s, value(row))).collect();
        chart.draw_series(LineSeries::new(thinned(&points), &colour)).map_err(|error| failed(&error))?;
    }
    Ok(())
}

/// A page under construction.
pub struct Page {
    title: String,
    figure: String,
    body: String,
    error: Option<anyhow::Error>,
}

impl Page {
    /// A page whose plots answer a figure of the paper, such as "figure 8: load steps".
    pub fn new(scenario: &str, figure: &str) -> Self {
        let number = figure.split(':').next().unwrap_or(figure);
        Self {
            title: format!("{scenario}: {figure}"),
            figure: format!("The paper's {number}"),
            body: String::new(),
            error: None,
        }
    }

    /// From here on the plots answer this figure of the paper.
    pub fn answers(&mut self, figure: &str) {
        self.figure = format!("The paper's {figure}");
    }

    /// Curves over the whole recording.
    pub fn plot(&mut self, title: &str, unit: &str, recording: &Recording, curves: &[Curve]) {
        let end_s = recording.rows.last().map_or(1.0, |row| row.t_s);
        self.plot_window(title, unit, recording, (0.0, end_s), curves);
    }

    /// Torque and demand.
    pub fn torque(&mut self, recording: &Recording) {
        self.plot(
            "Torque",
            "N·m",
            recording,
            &[("torque", |row| row.te_nm), ("demand", |row| row.te_ref_nm)],
        );
    }

    /// The current of phase u.
    pub fn phase_current(&mut self, recording: &Recording) {
        self.plot("Phase current u", "A", recording, &[("ia", |row| row.ia_a)]);
    }

    /// The current of phase u over a part of the recording.
    pub fn phase_current_in(&mut self, title: &str, recording: &Recording, window: (f64, f64)) {
        self.plot_window(title, "A", recording, window, &[("ia", |row| row.ia_a)]);
    }

    /// Currents in the rotor's frame, and what is wanted of them.
    pub fn rotor_currents(&mut self, recording: &Recording) {
        let curves: [Curve; 4] = [
            ("id", |row| row.id_a),
            ("iq", |row| row.iq_a),
            ("id*", |row| row.id_ref_a),
            ("iq*", |row| row.iq_ref_a),
        ];
        self.plot("Currents, rotor frame", "A", recording, &curves);
    }

    /// The whole run in one picture.
    pub fn overview(&mut self, recording: &Recording) {
        match overview(recording) {
            Ok(svg) => self.body += &svg,
            Err(error) => self.error = Some(error),
        }
    }

    /// Curves over a part of the recording.
    pub fn plot_window(
        &mut self,
        title: &str,
        unit: &str,
        recording: &Recording,
        window: (f64, f64),
        curves: &[Curve],
    ) {
        let rows = crate::analysis::window(recording, window.0, window.1);
        let series = curves
            .iter()
            .map(|(name, value)| {
                let points: Vec<_> = rows.iter().map(|row| (row.t_s, value(row))).collect();
                (*name, thinned(&points))
            })
            .collect::<Vec<_>>();
        self.draw(title, unit, &series);
    }

    /// What the drive's flight recorder holds of a fault; nothing if there was none.
    pub fn recorder(&mut self, recording: &Recording) {
        self.recorded(
            &recording.recorded,
            |record| record.state.fault,
            &[
                (
                    "phase currents as sampled",
                    "A",
                    &[
                        ("ia", |record: &Record| record.currents_a.a),
                        ("ib", |record| record.currents_a.b),
                        ("ic", |record| record.currents_a.c),
                    ],
                ),
                ("current references", "A", &[("id", |record| record.id_a), ("iq", |record| record.iq_a)]),
                (
                    "DC link as sampled and commanded voltage",
                    "V",
                    &[("udc", |record| record.udc_v), ("u", |record| record.voltage_v)],
                ),
            ],
        );
    }

    /// Panels of what a flight recorder holds, each with its unit and its curves; nothing without a fault.
    pub fn recorded<R>(
        &mut self,
        recorded: &[(f64, R)],
        fault: fn(&R) -> Option<Fault>,
        panels: &[Panel<R>],
    ) {
        let Some((t_s, fault)) = recorded.iter().find_map(|(t_s, record)| Some((*t_s, fault(record)?)))
        else {
            return;
        };
        for (what, unit, curves) in panels {
            let series: Vec<_> = curves
                .iter()
                .map(|(name, value)| {
                    let of = |(at_s, record): &(f64, R)| (1e3 * (at_s - t_s), f64::from(value(record)));
                    // What is not finite may be the fault itself, and cannot be drawn.
                    let points = recorded.iter().map(of).filter(|(_, value)| value.is_finite()).collect();
                    (*name, points)
                })
                .collect();
            let heading = format!("Flight recorder · {what} around {} at {t_s:.4} s", fault.name());
            self.add(&heading, ("time from the fault in ms", unit), &series);
        }
    }

    /// Line voltage between phases u and v from the gates' edges, over a part of the recording.
    pub fn line_voltage(&mut self, title: &str, recording: &Recording, window: (f64, f64)) {
        let udc_v = recording.rows.first().map_or(0.0, |row| row.udc_v);
        let mut on = [false; GATES.len()];
        let mut points = Vec::new();
        let mut last = 0.0;
        for edge in &recording.edges {
            let t_s = recording.seconds(edge.tick);
            on[usize::from(edge.gate)] = edge.on;
            let level = udc_v * (f64::from(u8::from(on[0])) - f64::from(u8::from(on[2])));
            if t_s >= window.0 && t_s <= window.1 {
                points.extend([(t_s, last), (t_s, level)]);
            }
            last = level;
        }
        self.draw(title, "V", &[("u-v", points)]);
    }

    /// The whole page.
    pub fn finish(self, subtitle: &str, figures: &Figures) -> Result<String> {
        if let Some(error) = self.error {
            return Err(error);
        }
        let mut page = String::new();
        write!(
            page,
            "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>{title}</title><style>\
             body{{font-family:sans-serif;max-width:1040px;margin:2em auto;padding:0 1em}}\
             table{{border-collapse:collapse;font-size:90%}}td,th{{border:1px solid #ccc;padding:2px 8px;text-align:right}}\
             h2{{font-size:105%;margin:1.4em 0 0}}svg{{max-width:100%;height:auto}}</style></head><body>\
             <h1>{title}</h1><p>{subtitle}</p>{body}<h2>Figures</h2>{tables}</body></html>\n",
            title = escape(&self.title),
            subtitle = escape(subtitle),
            body = self.body,
            tables = tables(figures),
        )?;
        Ok(page)
    }

    /// Curves over anything, beside a figure of the paper; `axes` are the labels of x and y.
    pub fn draw_xy(
        &mut self,
        figure: &str,
        title: &str,
        axes: (&str, &str),
        series: &[(String, Vec<(f64, f64)>)],
    ) {
        let series: Vec<_> = series.iter().map(|(name, points)| (name.as_str(), points.clone())).collect();
        self.add(&format!("The paper's {figure} · {title}"), axes, &series);
    }

    /// Curves under a heading of their own, over time or anything else; over time dense data is shown by its extremes.
    pub fn curves(&mut self, heading: &str, x: &str, unit: &str, series: &[(&str, Vec<(f64, f64)>)]) {
        let series: Vec<_> = series.iter().map(|(name, points)| (*name, thinned(points))).collect();
        self.add(heading, (x, unit), &series);
    }

    fn draw(&mut self, title: &str, unit: &str, series: &[(&str, Vec<(f64, f64)>)]) {
        let heading = format!("{} · {title}", self.figure);
        self.add(&heading, ("time in s", unit), series);
    }

    fn add(&mut self, heading: &str, axes: (&str, &str), series: &[(&str, Vec<(f64, f64)>)]) {
        match chart(axes, series) {
            Ok(svg) => {
                let _ = write!(self.body, "<h2>{}</h2>{}{svg}", escape(heading), legend(series));
            }
            Err(error) => self.error = Some(error),
        }
    }
}

fn chart((x_label, y_label): (&str, &str), series: &[(&str, Vec<(f64, f64)>)]) -> Result<String> {
    let points = || series.iter().flat_map(|(_, points)| points.iter());
    let (mut x, mut y) = ((f64::INFINITY, f64::NEG_INFINITY), (0.0_f64, 0.0_f64));
    for (t_s, value) in points() {
        x = (x.0.min(*t_s), x.1.max(*t_s));
        y = (y.0.min(*value), y.1.max(*value));
    }
    if x.1.is_nan() || x.1 <= x.0 {
        x = (0.0, 1.0);
    }
    let room = 0.05 * (y.1 - y.0).max(1e-9);
    let mut svg = String::new();
    {
        let area = SVGBackend::with_string(&mut svg, SIZE).into_drawing_area();
        let failed = |error: &dyn std::fmt::Display| anyhow!("plot: {error}");
        let mut chart = ChartBuilder::on(&area)
            .margin(8)
            .x_label_area_size(34)
            .y_label_area_size(64)
            .build_cartesian_2d(x.0..x.1, y.0 - room..y.1 + room)
            .map_err(|error| failed(&error))?;
        chart
            .configure_mesh()
            .x_desc(x_label)
            .y_desc(y_label)
            .light_line_style(TRANSPARENT)
            .draw()
            .map_err(|error| failed(&error))?;
        for ((_, points), colour) in series.iter().zip(COLOURS) {
            chart
                .draw_series(LineSeries::new(points.iter().copied(), &colour))
                .map_err(|error| failed(&error))?;
        }
        area.present().map_err(|error| failed(&error))?;
    }
    Ok(svg)
}

fn legend(series: &[(&str, Vec<(f64, f64)>)]) -> String {
    let mut text = String::new();
    if series.len() > 1 {
        for ((name, _), colour) in series.iter().zip(COLOURS) {
            let _ = write!(
                text,
                " <span style=\"color:rgb({},{},{})\">■ {}</span>",
                colour.0,
                colour.1,
                colour.2,
                escape(name)
            );
        }
    }
    text
}

/// No more than about [`POINTS`] points: of each stretch the lowest and the highest, in their order.
fn thinned(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
    if points.len() <= POINTS {
        return points.to_vec();
    }
    let stretch = points.len().div_ceil(POINTS / 2);
    points
        .chunks(stretch)
        .flat_map(|part| {
            let by_value = |a: &usize, b: &usize| part[*a].1.total_cmp(&part[*b].1);
            let low = (0..part.len()).min_by(by_value).unwrap_or(0);
            let high = (0..part.len()).max_by(by_value).unwrap_or(0);
            [part[low.min(high)], part[low.max(high)]]
        })
        .collect()
}

fn tables(figures: &Figures) -> String {
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

fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}
