//! The scenario's page: one self-contained HTML file, its plots drawn as SVG.

mod chart;
mod overview;
mod table;
mod text;

pub use overview::overview;
pub use text::{headline, list, text};

use crate::analysis::Figures;
use crate::rows::Timed;
use crate::trace::{Recording, Row};
use anyhow::Result;
use chart::{chart, legend, thinned};
use std::fmt::Write as _;
use table::{escape, tables};
use tractive::protection::Fault;
use tractive::recorder::Record;

/// The panel of a flight recorder's records: title, unit, and each curve's name and value.
pub type Panel<'a, R> = (&'a str, &'a str, &'a [(&'static str, fn(&R) -> f32)]);

/// A curve of a recording of either system: its name and its value in a row.
pub type Curve<'a, R = Row> = (&'a str, fn(&R) -> f64);

/// The words of a scenario that answers none of the paper's figures.
pub const NO_FIGURE: &str = "no figure";

/// A page under construction.
pub struct Page {
    title: String,
    /// The paper's figure that the plots answer from here on; nothing where it has none.
    figure: Option<String>,
    /// `true` if none of the plots answers a figure of the paper.
    is_another_machine: bool,
    body: String,
    error: Option<anyhow::Error>,
}

impl Page {
    /// A page whose plots answer a figure of the paper, such as "figure 8: load steps"; or "no figure: a fault acknowledged".
    pub fn new(scenario: &str, figure: &str) -> Self {
        let (number, what) = figure.split_once(':').unwrap_or((figure, ""));
        let mut page = Self {
            title: format!("{scenario}: {figure}"),
            figure: None,
            is_another_machine: false,
            body: String::new(),
            error: None,
        };
        if number == NO_FIGURE {
            page.title = format!("{scenario}:{what}");
        } else {
            page.answers(number);
        }
        page
    }

    /// From here on the plots answer this figure of the paper, or none.
    pub fn answers<'a>(&mut self, figure: impl Into<Option<&'a str>>) {
        let figure = figure.into().filter(|_| !self.is_another_machine);
        self.figure = figure.map(|figure| format!("The paper's {figure}"));
    }

    /// Nothing on this page answers a figure of the paper: the machine is not the paper's.
    pub fn answers_none(&mut self) {
        (self.figure, self.is_another_machine) = (None, true);
    }

    /// Curves over the whole recording.
    pub fn plot(&mut self, title: &str, unit: &str, recording: &Recording, curves: &[Curve]) {
        let end_s = recording.rows.last().map_or(1.0, |row| row.t_s);
        self.plot_window(title, unit, recording, (0.0, end_s), curves);
    }

    /// Torque and demand.
    pub fn torque(&mut self, recording: &Recording) {
        let curves: [Curve; 2] = [("torque", |row| row.te_nm), ("demand", |row| row.te_ref_nm)];
        self.plot("Torque", "N·m", recording, &curves);
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
        self.place(&self.heading("the whole run"), overview(recording));
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
        self.plot_rows(title, unit, crate::analysis::window(recording, window.0, window.1), curves);
    }

    /// Curves over rows of either system.
    pub fn plot_rows<R: Timed>(&mut self, title: &str, unit: &str, rows: &[R], curves: &[Curve<R>]) {
        let points = |value: fn(&R) -> f64| rows.iter().map(|row| (row.t_s(), value(row))).collect();
        let series: Vec<_> = curves.iter().map(|(name, value)| (*name, points(*value))).collect();
        self.curves(&self.heading(title), "time in s", unit, &series);
    }

    /// Link voltage and current out of the line; nothing without a line filter.
    pub fn line(&mut self, recording: &Recording) {
        if recording.rows.iter().any(|row| row.line_a.is_some()) {
            self.plot("DC link behind the line filter", "V", recording, &[("udc", |row| row.udc_v)]);
            let curves: [Curve; 1] = [("line current", |row| row.line_a.unwrap_or(0.0))];
            self.plot("Current out of the line", "A", recording, &curves);
        }
    }

    /// The flight recorder's records of a fault; nothing if there was none.
    pub fn recorder(&mut self, recording: &Recording) {
        let panels: [Panel<Record>; 3] = [
            (
                "phase currents as sampled",
                "A",
                &[("ia", |of| of.currents_a.a), ("ib", |of| of.currents_a.b), ("ic", |of| of.currents_a.c)],
            ),
            ("current references", "A", &[("id", |of| of.id_a), ("iq", |of| of.iq_a)]),
            (
                "DC link as sampled and commanded voltage",
                "V",
                &[("udc", |of| of.udc_v), ("u", |of| of.voltage_v)],
            ),
        ];
        self.recorded(&recording.recorded, |record| record.state.fault, &panels);
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
        let points = recording.line_voltage(window);
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

    /// Curves over anything, beside a figure of the paper or none; `axes` are the labels of x and y.
    pub fn draw_xy<'a>(
        &mut self,
        figure: impl Into<Option<&'a str>>,
        title: &str,
        axes: (&str, &str),
        series: &[(String, Vec<(f64, f64)>)],
    ) {
        let series: Vec<_> = series.iter().map(|(name, points)| (name.as_str(), points.clone())).collect();
        let figure = figure.into().filter(|_| !self.is_another_machine);
        let figure = figure.map_or(String::new(), |figure| format!("The paper's {figure} · "));
        self.add(&format!("{figure}{title}"), axes, &series);
    }

    /// A picture of its own, beside a figure of the paper or none.
    pub fn picture<'a>(&mut self, figure: impl Into<Option<&'a str>>, title: &str, svg: Result<String>) {
        let figure = figure.into().map_or(String::new(), |figure| format!("The paper's {figure} · "));
        self.place(&format!("{figure}{title}"), svg);
    }

    /// Curves under a heading of their own, over time or anything else; over time dense data is shown by its extremes.
    pub fn curves(&mut self, heading: &str, x: &str, unit: &str, series: &[(&str, Vec<(f64, f64)>)]) {
        let series: Vec<_> = series.iter().map(|(name, points)| (*name, thinned(points))).collect();
        self.add(heading, (x, unit), &series);
    }

    fn draw(&mut self, title: &str, unit: &str, series: &[(&str, Vec<(f64, f64)>)]) {
        self.add(&self.heading(title), ("time in s", unit), series);
    }

    /// A title, with the paper's figure named before it.
    fn heading(&self, title: &str) -> String {
        self.figure.as_ref().map_or(title.to_owned(), |figure| format!("{figure} · {title}"))
    }

    fn add(&mut self, heading: &str, axes: (&str, &str), series: &[(&str, Vec<(f64, f64)>)]) {
        let svg = chart(axes, series).map(|svg| legend(series) + &svg);
        self.place(heading, svg);
    }

    fn place(&mut self, heading: &str, svg: Result<String>) {
        match svg {
            Ok(svg) => {
                let _ = write!(self.body, "<h2>{}</h2>{svg}", escape(heading));
            }
            Err(error) => self.error = Some(error),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn page(figure: &str) -> String {
        let mut page = Page::new("s", figure);
        page.draw("torque", "N·m", &[("t", vec![(0.0, 1.0), (1.0, 2.0)])]);
        page.finish("", &Figures::default()).unwrap()
    }

    #[test]
    fn the_papers_figure_stands_above_the_plot_where_there_is_one() {
        assert!(page("figure 8: load steps").contains("<h2>The paper's figure 8 · torque</h2><svg"));
        let mut another = Page::new("s", "figure 8: load steps");
        another.answers_none();
        another.answers("figure 9a");
        another.draw("torque", "N·m", &[("t", vec![(0.0, 1.0), (1.0, 2.0)])]);
        another.draw_xy("figure 10", "power", ("x", "y"), &[("p".to_owned(), vec![(0.0, 1.0), (1.0, 2.0)])]);
        let another = another.finish("", &Figures::default()).unwrap();
        assert!(another.contains("<h2>torque</h2>") && another.contains("<h2>power</h2>"), "{another}");
        let without = page("no figure: a fault acknowledged");
        assert!(without.contains("<h1>s: a fault acknowledged</h1>"), "{without}");
        assert!(without.contains("<h2>torque</h2><svg") && !without.contains("figure: "), "{without}");
    }
}
