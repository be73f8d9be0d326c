//! Diagrams: boxes with words, and arrows between them, placed in px.

use super::ink::draw;
use super::sheet::{BLACK, BLUE, Colour, GREY, LETTERS, Mark, Panel, Point, Side};
use anyhow::Result;
use plotters::style::RGBColor;

/// Left, upper edge, width, height, in px.
pub type Frame = (f64, f64, f64, f64);

/// The ground of a box.
const GROUND: Colour = RGBColor(236, 242, 250);
/// Height of a line of words, in px.
const LINE: f64 = 16.0;

/// A diagram under construction.
pub struct Diagram {
    size: (u32, u32),
    panel: Panel,
}

impl Diagram {
    /// An empty one of a width and height in px, with a title.
    pub fn new(size: (u32, u32), title: &str) -> Self {
        let mut panel = Panel::drawing((0.0, 0.0, size.0.into(), size.1.into()));
        panel.marks.push(Mark::Words((16.0, 16.0), title.to_owned(), Side::Right, BLACK, LETTERS + 1.0));
        Self { size, panel }
    }

    /// A box with words in its middle.
    pub fn block(&mut self, frame: Frame, words: &str) -> &mut Self {
        self.panel.shade((frame.0, frame.1), (frame.0 + frame.2, frame.1 + frame.3), GROUND, 1.0);
        self.outline(frame, BLUE, 1.2);
        let count = words.lines().count() as f64;
        for (k, line) in words.lines().enumerate() {
            let y = frame.1 + 0.5 * frame.3 + (k as f64 - 0.5 * (count - 1.0)) * LINE;
            self.panel.words((frame.0 + 0.5 * frame.2, y), line, Side::Middle, BLACK);
        }
        self
    }

    /// A part of the whole with its name at the upper left, drawn behind what is added later.
    pub fn part(&mut self, frame: Frame, name: &str, colour: Colour) -> &mut Self {
        self.panel.shade((frame.0, frame.1), (frame.0 + frame.2, frame.1 + frame.3), colour, 0.07);
        self.outline(frame, colour, 1.0);
        self.panel.words((frame.0 + 10.0, frame.1 + 13.0), name, Side::Right, colour);
        self
    }

    fn outline(&mut self, (x, y, width, height): Frame, colour: Colour, stroke: f64) {
        let corners = [(x, y), (x + width, y), (x + width, y + height), (x, y + height), (x, y)];
        self.panel.line(corners, colour, stroke);
    }

    /// An arrow along points.
    pub fn flow(&mut self, points: &[Point]) -> &mut Self {
        self.panel.arrow(points.iter().copied(), BLACK);
        self
    }

    /// A line along points.
    pub fn wire(&mut self, points: &[Point]) -> &mut Self {
        self.panel.line(points.iter().copied(), BLACK, 1.4);
        self
    }

    /// Words whose middle is at a point.
    pub fn words(&mut self, at: Point, words: &str) -> &mut Self {
        self.panel.words(at, words, Side::Middle, BLACK);
        self
    }

    /// Words that begin at a point and stand back.
    pub fn note(&mut self, at: Point, words: &str) -> &mut Self {
        self.panel.words(at, words, Side::Right, GREY);
        self
    }

    /// A place where lines meet.
    pub fn node(&mut self, at: Point) -> &mut Self {
        self.panel.spot(at, BLACK);
        self
    }

    /// The SVG.
    pub fn finish(&self) -> Result<String> {
        draw(self.size, std::slice::from_ref(&self.panel))
    }
}
