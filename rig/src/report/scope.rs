//! Plots as the page's script draws them: panels over a common axis.

use super::data::Place;
use serde::Serialize;

/// The rows or points that panels share; panels over the same share a scope, with its axis and its zoom.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Over {
    /// Rows at this address, so many.
    Rows(usize, usize),
    /// A part of them, in s.
    Window(usize, f64, f64),
    /// Points over a time that comes from elsewhere, such as telemetry.
    Telemetry,
    /// An axis of its own.
    Own,
}

/// The kind of a curve, in the order in which curves are drawn over each other.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Style {
    /// An instantaneous value with ripple, thin.
    Ripple,
    /// A curve.
    Plain,
    /// Dashed, over the curve that it is compared with: a reference, the other motor.
    Dashed,
    /// Edges of a level.
    Edges,
}

/// A curve of a panel.
#[derive(Clone, Debug, Serialize)]
pub struct Series {
    /// Its name.
    pub name: String,
    /// Its values.
    pub place: Place,
    /// Its colour: a custom property of the page's style.
    pub ink: &'static str,
    /// The way that it is drawn.
    pub style: Style,
    /// A column of the same page by which a level is multiplied.
    pub scale: Option<Place>,
}

impl Series {
    /// A curve of this name, the number `index` of its panel.
    pub fn new(name: &str, place: Place, index: usize) -> Self {
        let (ink, style) = look(name, index);
        Self { name: name.to_owned(), place, ink, style, scale: None }
    }
}

/// Curves with a quantity in common.
#[derive(Clone, Debug, Serialize)]
pub struct Panel {
    /// The quantity, as `torque in N·m`.
    pub label: String,
    /// The curves, the last one on top.
    pub series: Vec<Series>,
    /// Names of the values 0, 1, 2, … if they are states.
    pub levels: Vec<String>,
}

impl Panel {
    /// `true` if both show the same curves.
    pub fn shows(&self, series: &[Series]) -> bool {
        let same = |(one, other): (&Series, &Series)| one.place == other.place && one.scale == other.scale;
        self.series.len() == series.len() && self.series.iter().zip(series).all(same)
    }
}

/// Panels one above the other over a common axis.
#[derive(Clone, Debug, Serialize)]
pub struct Scope {
    /// Its heading.
    #[serde(skip)]
    pub heading: String,
    /// The paper's figure that its panels answer unless they name another.
    #[serde(skip)]
    pub figure: Option<String>,
    /// Its rows.
    #[serde(skip)]
    pub over: Over,
    /// `true` if the axis is the run's time, with marks and the cursor that all share.
    pub time: bool,
    /// The axis' quantity and unit.
    pub x: String,
    /// The part that is shown at first; nothing: all.
    pub span: Option<(f64, f64)>,
    /// The panels.
    pub panels: Vec<Panel>,
}

/// An instant with a name.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Mark {
    /// In s.
    pub at: f64,
    /// Its name.
    pub name: String,
    /// `true` of a fault.
    pub bad: bool,
}

/// A stretch of time with a name, such as a mode.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Band {
    /// Its beginning, in s.
    pub from: f64,
    /// Its end, in s.
    pub to: f64,
    /// Its name.
    pub name: &'static str,
}

/// Colours of curves that have none of their own, in their order.
const INKS: [&str; 8] = ["w", "u", "v", "torque", "speed", "link", "flux", "muted"];

/// Colour and style by a curve's name.
fn look(name: &str, index: usize) -> (&'static str, Style) {
    match name {
        "torque" => ("ripple", Style::Ripple),
        "carrier mean" => ("torque", Style::Plain),
        "ia" | "a" => ("u", Style::Plain),
        "ib" | "b" => ("v", Style::Plain),
        "ic" | "c" => ("w", Style::Plain),
        "udc" | "U_in" => ("link", Style::Plain),
        "speed" => ("speed", Style::Plain),
        "demand" | "demand 1" | "demand 2" | "after limits" | "telemetry" | "telemetry 1" | "telemetry 2"
        | "id*" | "iq*" => ("text", Style::Dashed),
        "motor 2" | "lower motor" => ("u", Style::Dashed),
        _ => (INKS[index % INKS.len()], Style::Plain),
    }
}

/// A quantity with its unit: `torque in N·m`.
pub fn label(title: &str, unit: &str) -> String {
    if matches!(unit, "" | "–") { title.to_owned() } else { format!("{title} in {unit}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_reference_is_drawn_over_the_ripple_and_states_have_no_unit() {
        assert_eq!(look("torque", 0).1, Style::Ripple);
        assert_eq!(look("demand", 2).1, Style::Dashed);
        assert_ne!(look("motor 1", 0).0, look("motor 2", 1).0);
        assert_eq!(label("torque", "N·m"), "torque in N·m");
        assert_eq!(label("state", "–"), "state");
    }
}
