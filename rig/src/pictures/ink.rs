//! The drawing of a sheet as SVG: each panel's axes and marks in units of the sheet.

use super::sheet::{BLACK, Colour, LETTERS, Mark, Panel, Point, Side, number};
use anyhow::Result;
use plotters::coord::Shift;
use plotters::coord::ranged1d::{DefaultFormatting, KeyPointHint, Ranged};
use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

/// Units of the drawing in a pixel: coordinates are whole numbers, and a curve of whole pixels would be stepped.
pub const FINE: u32 = 4;
/// Opacity of a stroke that stands for dashes, which plotters' SVG does not have.
pub const DASHED: f64 = 0.99;

/// The sheet.
type Sheet<'a> = DrawingArea<SVGBackend<'a>, Shift>;
/// A place on the sheet, in its units.
type Place = (i32, i32);
/// Room around a panel with axes, in px: left of it and below it for its numbers, above it for its title, and to its right.
const ROOM: (f64, f64, f64, f64) = (72.0, 50.0, 26.0, 16.0);
/// Free edge left of a panel's words and below them, in px.
const EDGE: f64 = 8.0;
/// Mean width of a letter, as a share of its height.
const LETTER_WIDTH: f64 = 0.55;

/// Sheet units of a length in px.
fn fine(px: f64) -> i32 {
    (px * f64::from(FINE)).round() as i32
}

/// The font size that makes letters a number of px high: plotters takes a size to be 1.24 times that of its SVG.
fn letters(px: f64) -> i32 {
    fine(1.24 * px)
}

/// Panels as one SVG of a width and height in px. Equal panels make equal bytes.
pub fn draw((width, height): (u32, u32), panels: &[Panel]) -> Result<String> {
    let mut svg = String::new();
    {
        let fine = (width * FINE, height * FINE);
        let area = SVGBackend::with_string(&mut svg, fine).into_drawing_area();
        area.fill(&WHITE)?;
        for panel in panels {
            draw_panel(&area, panel)?;
        }
        area.present()?;
    }
    let of = |scale: u32| format!("<svg width=\"{}\" height=\"{}\" ", width * scale, height * scale);
    let svg = svg.replacen(&of(FINE), &of(1), 1).replace("opacity=\"1\" ", "");
    let dashes = format!("stroke-dasharray=\"{} {}\"", 6 * FINE, 4 * FINE);
    let svg = svg.replace(&format!("opacity=\"{DASHED}\""), &dashes);
    Ok(subscripts(&svg))
}

/// Letters after `_` in braces, set lower and smaller: `U_{in}`.
fn subscripts(svg: &str) -> String {
    const END: &str = "</tspan>";
    let mut out = String::with_capacity(svg.len());
    for line in svg.split_inclusive('\n') {
        let mut parts = line.split("_{");
        out += parts.next().unwrap_or_default();
        for part in parts {
            let (low, rest) = part.split_once('}').unwrap_or((part, ""));
            out += &format!("<tspan dy=\".3em\" font-size=\"75%\">{low}{END}");
            let (line, end) = rest.split_at(rest.trim_end().len());
            // A renderer may drop a space at the beginning of a part, so a shift replaces it.
            let shift = if line.starts_with(' ') { " dx=\".28em\"" } else { "" };
            out += &format!("<tspan{shift} dy=\"-.225em\">{}{END}{end}", line.trim_start());
        }
    }
    out
}

/// Draws a panel.
fn draw_panel(sheet: &Sheet, panel: &Panel) -> Result<()> {
    let (left, top, width, height) = panel.place;
    let Some((x, y)) = &panel.axes else {
        let place = |(x, y): Point| (fine(left + x), fine(top + y));
        return panel.marks.iter().try_for_each(|mark| draw_mark(sheet, mark, &place));
    };
    let above = ROOM.2 + if panel.names.is_empty() || panel.title.is_empty() { 0.0 } else { 16.0 };
    let size = (width - ROOM.0 - ROOM.3, height - ROOM.1 - above);
    let (x_range, y_range) = ranges(panel, size);
    let size_fine = (fine(width - EDGE) as u32, fine(height - EDGE) as u32);
    let part = sheet.clone().shrink((fine(left + EDGE), fine(top)), size_fine);
    let across = Numbered { whole: (x_range.0..x_range.1).into(), each: x.each };
    let mut chart = ChartBuilder::on(&part)
        .margin_top(fine(above))
        .margin_right(fine(ROOM.3))
        .set_label_area_size(LabelAreaPosition::Left, fine(ROOM.0 - EDGE))
        .set_label_area_size(LabelAreaPosition::Bottom, fine(ROOM.1 - EDGE))
        .build_cartesian_2d(across, y_range.0..y_range.1)?;
    let numbers = ("sans-serif", letters(LETTERS - 1.0)).into_font().color(&BLACK);
    let labels = ("sans-serif", letters(LETTERS)).into_font().color(&BLACK);
    let count = |length: f64, each: f64, bare: bool| if bare { 0 } else { (length / each) as usize };
    chart
        .configure_mesh()
        .x_labels(count(size.0, 70.0, x.bare))
        .y_labels(count(size.1, 26.0, y.bare).max(if y.bare { 0 } else { 4 }))
        .x_label_formatter(&|value| number(*value))
        .y_label_formatter(&|value| number(*value))
        .x_desc(x.label.as_str())
        .y_desc(y.label.as_str())
        .label_style(numbers)
        .axis_desc_style(labels)
        .axis_style(BLACK.stroke_width(FINE))
        .bold_line_style(RGBColor(225, 225, 225).stroke_width(FINE))
        .light_line_style(TRANSPARENT)
        .set_all_tick_mark_size(fine(4.0))
        .draw()?;
    let place = |point: Point| chart.backend_coord(&point);
    for mark in &panel.marks {
        for part in within(mark, x_range, y_range) {
            draw_mark(sheet, &part, &place)?;
        }
    }
    headings(sheet, panel, above)
}

/// An axis whose numbers have a spacing of their own, if one is set.
struct Numbered {
    whole: RangedCoordf64,
    each: Option<f64>,
}

impl Ranged for Numbered {
    type FormatOption = DefaultFormatting;
    type ValueType = f64;

    fn map(&self, value: &f64, limit: Place) -> i32 {
        self.whole.map(value, limit)
    }

    fn key_points<Hint: KeyPointHint>(&self, hint: Hint) -> Vec<f64> {
        let Some(each) = self.each else { return self.whole.key_points(hint) };
        let range = self.range();
        let places = (range.start / each).ceil() as i64..=(range.end / each).floor() as i64;
        let bold = !hint.weight().allow_light_points();
        places.filter(|_| bold).map(|k| each * k as f64).collect()
    }

    fn range(&self) -> core::ops::Range<f64> {
        self.whole.range()
    }
}

/// Title and names above a panel.
fn headings(sheet: &Sheet, panel: &Panel, above: f64) -> Result<()> {
    let (left, top, ..) = panel.place;
    let begin = left + ROOM.0;
    let place = |(x, y): Point| (fine(x), fine(y));
    if !panel.title.is_empty() {
        let at = (begin, top + 12.0);
        let title = Mark::Words(at, panel.title.clone(), Side::Right, BLACK, LETTERS + 1.0);
        draw_mark(sheet, &title, &place)?;
    }
    let mut x = begin;
    for (k, (name, colour)) in panel.names.iter().enumerate() {
        let y = top + above - 10.0;
        let dashed = panel.last_dashed && k + 1 == panel.names.len();
        let stroke = Mark::Line(vec![(x, y), (x + 18.0, y)], *colour, 2.0, dashed);
        draw_mark(sheet, &stroke, &place)?;
        let words = Mark::Words((x + 23.0, y), name.clone(), Side::Right, BLACK, LETTERS);
        draw_mark(sheet, &words, &place)?;
        let count = name.chars().filter(|letter| !"_{}".contains(*letter)).count() as f64;
        x += 23.0 + LETTER_WIDTH * LETTERS * count + 22.0;
    }
    Ok(())
}

/// First and last value of both axes.
fn ranges(panel: &Panel, (width, height): (f64, f64)) -> (Point, Point) {
    let points = || {
        panel.marks.iter().flat_map(|mark| match mark {
            Mark::Line(points, ..) | Mark::Area(points, ..) | Mark::Arrow(points, ..) => points.as_slice(),
            Mark::Spot(at, _) | Mark::Words(at, ..) => std::slice::from_ref(at),
        })
    };
    let extremes = |value: fn(&Point) -> f64| {
        let all = points().map(value).filter(|value| value.is_finite());
        all.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)))
    };
    let (x, y) = match &panel.axes {
        Some((x, y)) => (x.range, y.range),
        None => (None, None),
    };
    let mut x = x.unwrap_or_else(|| with_room(extremes(|point| point.0), 0.0));
    let mut y = y.unwrap_or_else(|| with_room(extremes(|point| point.1), 0.06));
    if panel.even {
        let unit = ((x.1 - x.0) / width).max((y.1 - y.0) / height);
        let spread = |(low, high): Point, length: f64| {
            let more = 0.5 * (unit * length - (high - low));
            (low - more, high + more)
        };
        (x, y) = (spread(x, width), spread(y, height));
    }
    (x, y)
}

/// A range with a share of it as room at both ends; never empty.
fn with_room((low, high): Point, share: f64) -> Point {
    if low > high {
        return (0.0, 1.0);
    }
    let least = 1e-6 * low.abs().max(high.abs()).max(1e-6);
    // A level curve gets enough room for its axis' numbers to differ.
    let level = 0.1 * low.abs().max(high.abs()).max(1e-5);
    let room = (share * (high - low)).max(if high - low < least { level } else { 0.0 });
    (low - room, high + room)
}

/// The part of a mark within the axes; a curve that leaves them ends there.
fn within(mark: &Mark, (x0, x1): Point, (y0, y1): Point) -> Vec<Mark> {
    let Mark::Line(points, colour, width, dashes) = mark else { return vec![mark.clone()] };
    let slack = (1e-9 * (x1 - x0), 1e-9 * (y1 - y0));
    let inside = |(x, y): &Point| {
        (x0 - slack.0..=x1 + slack.0).contains(x) && (y0 - slack.1..=y1 + slack.1).contains(y)
    };
    let parts = points.split(|point| !inside(point)).filter(|part| part.len() > 1);
    parts.map(|part| Mark::Line(part.to_vec(), *colour, *width, *dashes)).collect()
}

fn draw_mark(sheet: &Sheet, mark: &Mark, place: &dyn Fn(Point) -> Place) -> Result<()> {
    match mark {
        Mark::Line(points, colour, width, dashes) => {
            let placed = thinned(points.iter().map(|point| place(*point)));
            let cover = if *dashes { DASHED } else { 1.0 };
            sheet.draw(&PathElement::new(placed, colour.mix(cover).stroke_width(fine(*width) as u32)))?;
        }
        Mark::Area(corners, colour, cover) => {
            let placed: Vec<_> = corners.iter().map(|point| place(*point)).collect();
            sheet.draw(&Polygon::new(placed, colour.mix(*cover)))?;
        }
        Mark::Arrow(points, colour) => draw_arrow(sheet, points, *colour, place)?,
        Mark::Words(at, text, side, colour, height) => {
            let side = match side {
                Side::Left => HPos::Right,
                Side::Middle => HPos::Center,
                Side::Right => HPos::Left,
            };
            let style = ("sans-serif", letters(*height)).into_font().color(colour);
            let style = style.pos(Pos::new(side, VPos::Center));
            sheet.draw(&Text::new(text.clone(), place(*at), style))?;
        }
        Mark::Spot(at, colour) => sheet.draw(&Circle::new(place(*at), fine(3.5), colour.filled()))?,
    }
    Ok(())
}

/// A line whose last point is the tip of a head.
fn draw_arrow(sheet: &Sheet, points: &[Point], colour: Colour, place: &dyn Fn(Point) -> Place) -> Result<()> {
    const HEAD: (f64, f64) = (9.0, 3.2);
    let mut placed: Vec<_> = points.iter().map(|point| place(*point)).collect();
    let [.., before, tip] = placed.as_slice() else { return Ok(()) };
    let (dx, dy) = (f64::from(tip.0 - before.0), f64::from(tip.1 - before.1));
    let length = dx.hypot(dy).max(1.0);
    let (dx, dy) = (dx / length * f64::from(FINE), dy / length * f64::from(FINE));
    let at = |back: f64, aside: f64| {
        let (x, y) = (back * dx + aside * dy, back * dy - aside * dx);
        (tip.0 - x.round() as i32, tip.1 - y.round() as i32)
    };
    let head = vec![*tip, at(HEAD.0, HEAD.1), at(HEAD.0, -HEAD.1)];
    let neck = at(0.8 * HEAD.0, 0.0);
    let last = placed.len() - 1;
    placed[last] = neck;
    sheet.draw(&PathElement::new(placed, colour.stroke_width(fine(1.4) as u32)))?;
    sheet.draw(&Polygon::new(head, colour.filled()))?;
    Ok(())
}

/// A path without the points that nobody sees: each column of the sheet keeps its first, extreme and last points, each straight line
/// its ends.
fn thinned(path: impl Iterator<Item = Place>) -> Vec<Place> {
    let column = |x: i32| x.div_euclid(FINE as i32);
    let mut kept: Vec<Place> = Vec::new();
    let mut run: Vec<Place> = Vec::new();
    for point in path {
        if run.first().is_some_and(|first| column(first.0) != column(point.0)) {
            keep_extremes(&run, &mut kept);
            run.clear();
        }
        run.push(point);
    }
    keep_extremes(&run, &mut kept);
    kept.dedup();
    bends(&kept)
}

/// The points of a path that lie more than a unit of the sheet off the straight line between those kept before and after.
fn bends(path: &[Place]) -> Vec<Place> {
    let Some(last) = path.len().checked_sub(1) else { return Vec::new() };
    let mut kept = vec![false; path.len()];
    (kept[0], kept[last]) = (true, true);
    let mut parts = vec![(0, last)];
    while let Some((from, to)) = parts.pop() {
        let (a, b) = (path[from], path[to]);
        let (dx, dy) = (f64::from(b.0 - a.0), f64::from(b.1 - a.1));
        let length = dx.hypot(dy);
        let off = |k: usize| {
            let (x, y) = (f64::from(path[k].0 - a.0), f64::from(path[k].1 - a.1));
            let along =
                if length > 0.0 { ((x * dx + y * dy) / (length * length)).clamp(0.0, 1.0) } else { 0.0 };
            (x - along * dx).hypot(y - along * dy)
        };
        let farthest = (from + 1..to).max_by(|k, other| off(*k).total_cmp(&off(*other)));
        if let Some(farthest) = farthest.filter(|k| off(*k) > 1.0) {
            kept[farthest] = true;
            parts.extend([(from, farthest), (farthest, to)]);
        }
    }
    path.iter().zip(kept).filter(|(_, kept)| *kept).map(|(point, _)| *point).collect()
}

fn keep_extremes(run: &[Place], kept: &mut Vec<Place>) {
    if run.len() <= 4 {
        kept.extend(run);
        return;
    }
    let by_height = |a: &usize, b: &usize| run[*a].1.cmp(&run[*b].1);
    let low = (0..run.len()).min_by(by_height).unwrap_or(0);
    let high = (0..run.len()).max_by(by_height).unwrap_or(0);
    kept.extend([run[0], run[low.min(high)], run[low.max(high)], run[run.len() - 1]]);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pictures::sheet::{Axis, BLUE, RED};

    #[test]
    fn subscripts_are_set_lower_and_the_line_goes_on() {
        let text = subscripts("U_{in} = 2\n1\n");
        assert!(text.starts_with("U<tspan dy=\".3em\" font-size=\"75%\">in</tspan>"), "{text}");
        assert!(text.ends_with("<tspan dx=\".28em\" dy=\"-.225em\">= 2</tspan>\n1\n"), "{text}");
    }

    #[test]
    fn numbers_beside_a_level_curve_differ() {
        let mut panel =
            Panel::new((0.0, 0.0, 400.0, 300.0), "", Axis::fitted("id in A"), Axis::fitted("L in mH"));
        panel.line([(-40.0, 0.2), (0.0, 0.2)], BLUE, 1.0);
        let svg = draw((400, 300), &[panel]).unwrap();
        assert_eq!(svg.lines().filter(|line| *line == "0.2").count(), 1, "{svg}");
    }

    #[test]
    fn equal_panels_make_equal_bytes_of_the_size_asked_for() {
        let panel = || {
            let mut panel =
                Panel::plane((0.0, 0.0, 200.0, 100.0), "", Axis::fitted("id in A"), Axis::fitted("iq in A"));
            panel.line([(0.0, 0.0), (1.0, 1.0)], BLUE, 1.0).arrow([(0.0, 0.0), (0.5, 0.0)], RED);
            panel
        };
        let svg = draw((200, 100), &[panel()]).unwrap();
        assert_eq!(svg, draw((200, 100), &[panel()]).unwrap());
        assert!(svg.starts_with("<svg width=\"200\" height=\"100\" viewBox=\"0 0 800 400\""), "{svg}");
    }

    #[test]
    fn a_path_keeps_its_bends_and_its_peaks_and_nothing_else() {
        let line = (0..400).map(|x| (x, 2 * x));
        assert_eq!(thinned(line), [(0, 0), (399, 798)]);
        let peak = (0..400).map(|x| (x, if x == 201 { 500 } else { 0 }));
        let seen = thinned(peak);
        assert!(seen.contains(&(201, 500)) && seen.len() <= 5, "{seen:?}");
    }

    #[test]
    fn a_range_has_room_and_is_never_nothing() {
        assert_eq!(with_room((0.0, 100.0), 0.06), (-6.0, 106.0));
        let (low, high) = with_room((1500.0, 1500.0), 0.06);
        assert!(low < 1500.0 && high > 1500.0);
        assert_eq!(with_room((f64::INFINITY, f64::NEG_INFINITY), 0.06), (0.0, 1.0));
    }
}
