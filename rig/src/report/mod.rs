//! The scenario's page: one self-contained HTML file whose plots a script draws from packed numbers.

mod chart;
mod data;
mod html;
mod overview;
mod scope;
mod table;
mod text;
mod views;

pub use overview::overview;
pub use text::{broken, headline, list, text, unit};

use crate::analysis::Figures;
use crate::rows::Timed;
use crate::trace::Row;
use anyhow::Result;
use data::Place;
use html::{Block, Document};
use scope::{Mark, Over, Panel as Plotted, Scope, Series, label};
use tractive::protection::Fault;

/// The panel of a flight recorder's records: title, unit, and each curve's name and value.
pub type Panel<'a, R> = (&'a str, &'a str, &'a [(&'static str, fn(&R) -> f32)]);

/// A curve of a recording of either system: its name and its value in a row.
pub type Curve<'a, R = Row> = (&'a str, fn(&R) -> f64);

/// The words of a scenario that answers none of the paper's figures.
pub const NO_FIGURE: &str = "no figure";

/// The axis of plots over a run's time.
const TIME: &str = "time in s";

/// Points of a curve: the position on the axis, and the value there.
type Points = Vec<(f64, f64)>;

/// A page under construction.
pub struct Page {
    document: Document,
    /// The paper's figure that the plots answer from here on; none if the paper has none.
    figure: Option<String>,
    /// `true` if none of the plots answers a figure of the paper.
    is_another_machine: bool,
    /// Rate of a carrier that is not locked to the rotor, in Hz.
    carrier_hz: f64,
    /// The line voltage of the recording at this address, and its torques.
    line_voltage: Option<(usize, Series)>,
    torques: Option<(usize, Vec<Series>)>,
    error: Option<anyhow::Error>,
}

impl Page {
    /// A page whose plots answer a figure of the paper, such as "figure 8: load steps"; or "no figure: a fault acknowledged".
    pub fn new(scenario: &str, figure: &str) -> Self {
        let (number, what) = figure.split_once(": ").unwrap_or(("", figure));
        let (title, about) = (scenario.to_owned(), what.to_owned());
        let mut page = Self {
            document: Document { title, about, ..Document::default() },
            figure: None,
            is_another_machine: false,
            carrier_hz: 900.0,
            line_voltage: None,
            torques: None,
            error: None,
        };
        if !number.is_empty() && number != NO_FIGURE {
            page.document.about = format!("the paper's {number}: {what}");
            page.answers(number);
        }
        page
    }

    /// From here on the plots answer this figure of the paper, or none.
    pub fn answers<'a>(&mut self, figure: impl Into<Option<&'a str>>) {
        let figure = figure.into().filter(|_| !self.is_another_machine);
        self.figure = figure.map(str::to_owned);
    }

    /// Nothing on this page answers a figure of the paper: the machine is not the paper's.
    pub fn answers_none(&mut self) {
        (self.figure, self.is_another_machine) = (None, true);
    }

    /// The words that stand first: `PASS: …` or `FALLS SHORT: …`.
    pub fn headline(&mut self, headline: &str) {
        self.document.headline = Some(headline.to_owned());
    }

    /// A line of what was run, such as the machine.
    pub fn ran(&mut self, what: &str, value: impl Into<String>) {
        self.document.run.push((what.to_owned(), value.into()));
    }

    /// Rate of a carrier that is not locked to the rotor, in Hz; torque is averaged over it.
    pub const fn carrier(&mut self, hz: f64) {
        self.carrier_hz = hz;
    }

    /// An instant with a name, which every plot over time marks; one of a fault is bad.
    pub fn mark(&mut self, at_s: f64, name: &str, bad: bool) {
        let mark = Mark { at: at_s, name: name.to_owned(), bad };
        if !self.document.marks.contains(&mark) {
            self.document.marks.push(mark);
        }
    }

    /// Curves over rows of either system.
    pub fn plot_rows<R: Timed>(&mut self, title: &str, unit: &str, rows: &[R], curves: &[Curve<R>]) {
        let (Some(first), Some(last)) = (rows.first(), rows.last()) else { return };
        let short = |t_s: f64| (t_s * 1e3).round() / 1e3;
        let heading = format!("{} to {} s", short(first.t_s()), short(last.t_s()));
        let over = Over::Rows(rows.as_ptr() as usize, rows.len());
        let series = self.series(rows, curves);
        self.show(over, &heading, None, (title, unit), series);
    }

    /// The flight recorder's records of a fault; nothing without one.
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
        let heading = format!("Flight recorder · around {} at {t_s:.4} s", fault.name());
        let panels = panels.iter().map(|(what, unit, curves)| {
            let mut series = Vec::new();
            for (index, (name, value)) in curves.iter().enumerate() {
                let of = |(at_s, record): &(f64, R)| (1e3 * (at_s - t_s), f64::from(value(record)));
                // A value that is not finite may be the fault itself, and cannot be drawn.
                let points: Points = recorded.iter().map(of).filter(|(_, value)| value.is_finite()).collect();
                series.push(Series::new(name, self.points(&points), index));
            }
            Plotted { label: label(what, unit), series, levels: Vec::new() }
        });
        let panels = panels.collect();
        let x = "time from the fault in ms".to_owned();
        let scope = Scope { heading, figure: None, over: Over::Own, time: false, x, span: None, panels };
        self.document.blocks.push(Block::Plots(scope));
    }

    /// Curves over any axis, beside a figure of the paper or none; `axes` are the labels of x and y.
    pub fn draw_xy<'a>(
        &mut self,
        figure: impl Into<Option<&'a str>>,
        title: &str,
        axes: (&str, &str),
        series: &[(String, Points)],
    ) {
        let figure = figure.into().filter(|_| !self.is_another_machine).map(str::to_owned);
        let series: Vec<_> = series.iter().map(|(name, points)| (name.as_str(), points.clone())).collect();
        self.chart(figure, title, axes, &series);
    }

    /// A picture of its own, beside a figure of the paper or none.
    pub fn picture<'a>(&mut self, figure: impl Into<Option<&'a str>>, title: &str, svg: Result<String>) {
        let figure = figure.into().filter(|_| !self.is_another_machine);
        match svg {
            Ok(svg) => self.document.blocks.push(Block::Picture(html::heading(figure, title), svg)),
            Err(error) => self.error = Some(error),
        }
    }

    /// Curves over time as it was told, or over anything else.
    pub fn curves(&mut self, heading: &str, x: &str, unit: &str, series: &[(&str, Points)]) {
        if x == TIME {
            let series = self.told(series);
            self.show(Over::Telemetry, "as it was told", None, (heading, unit), series);
        } else {
            self.chart(None, heading, (x, unit), series);
        }
    }

    /// States over time as they were told: a value is its name's place in the list.
    pub fn states(&mut self, title: &str, names: &[&str], points: Points) {
        let series = self.told(&[("state", points)]);
        self.show(Over::Telemetry, "as it was told", None, (title, ""), series);
        self.name_levels(names);
    }

    /// The whole page; the subtitle stands below its title.
    pub fn finish(self, subtitle: &str, figures: &Figures) -> Result<String> {
        match self.error {
            Some(error) => Err(error),
            None => html::page(&self.document, subtitle, figures),
        }
    }

    fn told(&mut self, series: &[(&str, Points)]) -> Vec<Series> {
        let of =
            |(index, (name, points)): (usize, &(&str, Points))| Series::new(name, self.points(points), index);
        series.iter().enumerate().map(of).collect()
    }

    fn chart(
        &mut self,
        figure: Option<String>,
        title: &str,
        (x, unit): (&str, &str),
        series: &[(&str, Points)],
    ) {
        let series = self.told(series);
        let panel = Plotted { label: label("", unit).trim().to_owned(), series, levels: Vec::new() };
        let (heading, x, panels) = (title.to_owned(), x.to_owned(), vec![panel]);
        let scope = Scope { heading, figure, over: Over::Own, time: false, x, span: None, panels };
        self.document.blocks.push(Block::Plots(scope));
    }

    /// A column of points with an axis of their own.
    fn points(&mut self, points: &[(f64, f64)]) -> Place {
        let points: Points = points.iter().copied().filter(|(x, y)| x.is_finite() && y.is_finite()).collect();
        let (x, y): (Vec<_>, Vec<_>) = points.into_iter().unzip();
        let table = self.document.data.table(&x);
        self.document.data.add(table, &y)
    }

    /// Columns of rows.
    fn series<R: Timed>(&mut self, rows: &[R], curves: &[Curve<R>]) -> Vec<Series> {
        let times: Vec<_> = rows.iter().map(Timed::t_s).collect();
        let table = self.document.data.table(&times);
        let of = |(index, (name, value)): (usize, &Curve<R>)| {
            let mut last = 0.0;
            // A value that is not finite cannot be drawn: the one before replaces it.
            let finite = |value: f64| {
                last = if value.is_finite() { value } else { last };
                last
            };
            let values: Vec<_> = rows.iter().map(value).map(finite).collect();
            Series::new(name, self.document.data.add(table, &values), index)
        };
        curves.iter().enumerate().map(of).collect()
    }

    /// Adds a panel to the scope over these rows, or to a new one with this heading; once only.
    fn show(
        &mut self,
        over: Over,
        heading: &str,
        span: Option<(f64, f64)>,
        (title, unit): (&str, &str),
        series: Vec<Series>,
    ) {
        let of = |block: &Block| matches!(block, Block::Plots(scope) if scope.over == over);
        let at = self.document.blocks.iter().position(of).unwrap_or_else(|| {
            let (heading, figure, x, panels) =
                (heading.to_owned(), self.figure.clone(), TIME.to_owned(), Vec::new());
            self.document.blocks.push(Block::Plots(Scope {
                heading,
                figure,
                over,
                time: true,
                x,
                span,
                panels,
            }));
            self.document.blocks.len() - 1
        });
        let Some(Block::Plots(scope)) = self.document.blocks.get_mut(at) else { return };
        if scope.panels.iter().any(|panel| panel.shows(&series)) {
            return;
        }
        let figure = self.figure.as_deref().filter(|_| self.figure != scope.figure);
        let title = figure.map_or(title.to_owned(), |figure| format!("{figure} · {title}"));
        scope.panels.push(Plotted { label: label(&title, unit), series, levels: Vec::new() });
    }

    /// The last panel's values are states of these names.
    fn name_levels(&mut self, names: &[&str]) {
        if let Some(Block::Plots(scope)) = self.document.blocks.last_mut()
            && let Some(panel) = scope.panels.last_mut()
        {
            panel.levels = names.iter().map(|name| (*name).to_owned()).collect();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn page(figure: &str) -> String {
        let mut page = Page::new("s", figure);
        page.draw_xy("figure 10", "power", ("x", "W"), &[("p".to_owned(), vec![(0.0, 1.0), (1.0, 2.0)])]);
        page.finish("", &Figures::default()).unwrap()
    }

    #[test]
    fn the_papers_figure_stands_above_the_plot_where_there_is_one() {
        assert!(page("figure 8: load steps").contains("<h2>The paper's figure 10 · power</h2>"));
        let mut another = Page::new("s", "no figure: load steps");
        another.answers_none();
        another.answers("figure 9a");
        another.draw_xy("figure 10", "power", ("x", "y"), &[("p".to_owned(), vec![(0.0, 1.0), (1.0, 2.0)])]);
        let another = another.finish("", &Figures::default()).unwrap();
        assert!(another.contains("<h2>power</h2>") && !another.contains("The paper's"), "{another}");
        let without = page("no figure: a fault acknowledged");
        assert!(without.contains("<title>s: a fault acknowledged</title>"), "{without}");
    }

    #[test]
    fn no_curve_is_drawn_twice_and_the_headline_stands_before_the_verdicts() {
        struct At(f64);
        impl Timed for At {
            fn t_s(&self) -> f64 {
                self.0
            }
        }
        let rows: Vec<_> = (0..100).map(|k| At(f64::from(k) * 1e-3)).collect();
        let mut page = Page::new("s", "no figure: nothing");
        page.headline("FALLS SHORT: 1 of 2 bounds");
        for _ in 0..2 {
            page.plot_rows("torque", "N·m", &rows, &[("torque", |row| row.0)]);
        }
        page.plot_rows("speed", "r/min", &rows, &[("speed", |row| 2.0 * row.0)]);
        let page = page.finish("", &Figures::default()).unwrap();
        assert_eq!(page.matches("<h3>torque in N·m</h3>").count(), 1);
        assert_eq!(page.matches("class=\"card scope").count(), 1);
        let place = |what: &str| page.find(what).unwrap_or_else(|| panic!("{what}: {page}"));
        assert!(place("FALLS SHORT") < place("<h3>torque"));
    }
}
