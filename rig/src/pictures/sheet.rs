//! The sheet that a picture is drawn on: panels with axes, and the marks in them.
//!
//! A panel is data until it is drawn, which separates the contents of a picture from its looks.

use plotters::style::RGBColor;

/// Height of a panel's letters, in px.
pub const LETTERS: f64 = 12.0;

/// A colour.
pub type Colour = RGBColor;
/// A point in the panel's own units.
pub type Point = (f64, f64);

/// Black, of axes and words.
pub const BLACK: Colour = RGBColor(30, 30, 30);
/// Grey, of what stands back.
pub const GREY: Colour = RGBColor(135, 135, 135);
/// The first motor's, or the main curve's.
pub const BLUE: Colour = RGBColor(31, 119, 180);
/// The second motor's, or the limit's.
pub const RED: Colour = RGBColor(214, 39, 40);
/// A third curve's.
pub const GREEN: Colour = RGBColor(34, 139, 34);
/// A fourth curve's.
pub const VIOLET: Colour = RGBColor(128, 82, 170);
/// A fifth curve's.
pub const ORANGE: Colour = RGBColor(217, 112, 0);

/// The side of a point on which its words begin.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// Words end at the point.
    Left,
    /// Words stand around it.
    Middle,
    /// Words begin at it.
    Right,
}

/// Something in a panel.
#[derive(Clone, Debug)]
pub enum Mark {
    /// A curve: its points, colour, width in px, and whether it is dashed.
    Line(Vec<Point>, Colour, f64, bool),
    /// An area: its corners, colour, and how much of the ground it covers, 0 to 1.
    Area(Vec<Point>, Colour, f64),
    /// A line with a head at its last point.
    Arrow(Vec<Point>, Colour),
    /// Words beside a point, with the height of their letters in px.
    Words(Point, String, Side, Colour, f64),
    /// A spot.
    Spot(Point, Colour),
}

/// An axis of a panel.
#[derive(Clone, Debug, Default)]
pub struct Axis {
    /// The quantity with its unit.
    pub label: String,
    /// First and last value; if there are none, those of the curves and some room.
    pub range: Option<(f64, f64)>,
    /// `true` if the axis has no numbers.
    pub bare: bool,
    /// Spacing of its numbers; if there is none, a round one.
    pub each: Option<f64>,
}

impl Axis {
    /// An axis that fits its curves.
    pub fn fitted(label: &str) -> Self {
        Self { label: label.to_owned(), ..Self::default() }
    }

    /// An axis from a value to another.
    pub fn of(label: &str, first: f64, last: f64) -> Self {
        Self { label: label.to_owned(), range: Some((first, last)), ..Self::default() }
    }

    /// The axis of an angle over a turn, in degrees, with a number each 60°.
    pub fn turn(label: &str) -> Self {
        Self { each: Some(60.0), ..Self::of(label, 0.0, 360.0) }
    }

    /// The same without numbers.
    pub fn bare(self) -> Self {
        Self { bare: true, ..self }
    }
}

/// A part of a sheet with axes of its own, or none.
#[derive(Clone, Debug, Default)]
pub struct Panel {
    /// Left, upper edge, width and height on the sheet, in px.
    pub place: (f64, f64, f64, f64),
    /// The words above it.
    pub title: String,
    /// The axis to the right, and the one upwards; a drawing without them is in px from its upper left corner.
    pub axes: Option<(Axis, Axis)>,
    /// `true` if both axes have the same scale, as a plane of vectors needs it.
    pub even: bool,
    /// The marks, the hindmost first.
    pub marks: Vec<Mark>,
    /// Names of curves by their colours, in a row above the panel.
    pub names: Vec<(String, Colour)>,
    /// `true` if the last of them is dashed.
    pub last_dashed: bool,
}

impl Panel {
    /// A panel with axes.
    pub fn new(place: (f64, f64, f64, f64), title: &str, x: Axis, y: Axis) -> Self {
        Self { place, title: title.to_owned(), axes: Some((x, y)), ..Self::default() }
    }

    /// The plane of two axes with the same scale.
    pub fn plane(place: (f64, f64, f64, f64), title: &str, x: Axis, y: Axis) -> Self {
        Self { even: true, ..Self::new(place, title, x, y) }
    }

    /// A drawing in px.
    pub fn drawing(place: (f64, f64, f64, f64)) -> Self {
        Self { place, ..Self::default() }
    }

    /// Adds a curve.
    pub fn line(&mut self, points: impl IntoIterator<Item = Point>, colour: Colour, width: f64) -> &mut Self {
        self.marks.push(Mark::Line(points.into_iter().collect(), colour, width, false));
        self
    }

    /// Adds a curve whose name stands above the panel.
    pub fn named(
        &mut self,
        name: &str,
        points: impl IntoIterator<Item = Point>,
        colour: Colour,
    ) -> &mut Self {
        self.names.push((name.to_owned(), colour));
        self.line(points, colour, 1.6)
    }

    /// Adds a dashed curve, which may lie on the one before; its name stands above the panel. It is the last one named.
    pub fn named_dashes(
        &mut self,
        name: &str,
        points: impl IntoIterator<Item = Point>,
        colour: Colour,
    ) -> &mut Self {
        self.last_dashed = true;
        self.named(name, points, colour);
        if let Some(Mark::Line(.., dashed)) = self.marks.last_mut() {
            *dashed = true;
        }
        self
    }

    /// Adds a dashed curve.
    pub fn dashes(&mut self, points: impl IntoIterator<Item = Point>, colour: Colour) -> &mut Self {
        self.marks.push(Mark::Line(points.into_iter().collect(), colour, 1.0, true));
        self
    }

    /// Adds an area.
    pub fn area(
        &mut self,
        corners: impl IntoIterator<Item = Point>,
        colour: Colour,
        cover: f64,
    ) -> &mut Self {
        self.marks.push(Mark::Area(corners.into_iter().collect(), colour, cover));
        self
    }

    /// Adds a box between two corners as an area.
    pub fn shade(&mut self, (x0, y0): Point, (x1, y1): Point, colour: Colour, cover: f64) -> &mut Self {
        self.area([(x0, y0), (x1, y0), (x1, y1), (x0, y1)], colour, cover)
    }

    /// Adds an arrow along points.
    pub fn arrow(&mut self, points: impl IntoIterator<Item = Point>, colour: Colour) -> &mut Self {
        self.marks.push(Mark::Arrow(points.into_iter().collect(), colour));
        self
    }

    /// Adds words.
    pub fn words(&mut self, at: Point, text: &str, side: Side, colour: Colour) -> &mut Self {
        self.marks.push(Mark::Words(at, text.to_owned(), side, colour, LETTERS));
        self
    }

    /// Adds a spot.
    pub fn spot(&mut self, at: Point, colour: Colour) -> &mut Self {
        self.marks.push(Mark::Spot(at, colour));
        self
    }
}

/// A number as the text of this project writes it: 1,500, −20 or 0.25.
pub fn number(value: f64) -> String {
    let text = format!("{:.3}", value.abs());
    let text = text.trim_end_matches('0').trim_end_matches('.');
    let (whole, rest) = text.split_at(text.find('.').unwrap_or(text.len()));
    let mut out = String::from(if value < 0.0 && text != "0" { "−" } else { "" });
    for (k, digit) in whole.chars().enumerate() {
        if k > 0 && (whole.len() - k).is_multiple_of(3) {
            out.push(',');
        }
        out.push(digit);
    }
    out + rest
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_written_as_the_text_does() {
        let written = [1500.0, -20.0, 0.25, -0.0, 1_234_567.5].map(number);
        assert_eq!(written, ["1,500", "−20", "0.25", "0", "1,234,567.5"]);
    }
}
