//! Curves as SVG.

use super::table::escape;
use anyhow::Result;
use plotters::prelude::*;
use std::fmt::Write as _;

/// Size of a plot, in pixels.
pub const SIZE: (u32, u32) = (1000, 280);
/// Size of the letters, as plotters counts them: 11.3 px.
const LETTERS: u32 = 14;
/// Points per curve; denser data is shown by its extremes.
const POINTS: usize = 1500;
/// Colours of the curves, in their order.
pub const COLOURS: [RGBColor; 6] = [
    RGBColor(31, 119, 180),
    RGBColor(214, 39, 40),
    RGBColor(44, 160, 44),
    RGBColor(148, 103, 189),
    RGBColor(255, 127, 14),
    RGBColor(23, 190, 207),
];

/// Curves over a common axis; `x_label`, `y_label` name the axes.
pub fn chart((x_label, y_label): (&str, &str), series: &[(&str, Vec<(f64, f64)>)]) -> Result<String> {
    let points = || series.iter().flat_map(|(_, points)| points.iter());
    let none = (f64::INFINITY, f64::NEG_INFINITY);
    let (mut x, mut y) = (none, none);
    for (t_s, value) in points() {
        x = (x.0.min(*t_s), x.1.max(*t_s));
        y = (y.0.min(*value), y.1.max(*value));
    }
    if x.1.is_nan() || x.1 <= x.0 {
        x = (0.0, 1.0);
    }
    let y = fitted(y);
    let room = 0.05 * (y.1 - y.0).max(1e-9);
    let mut svg = String::new();
    {
        let area = SVGBackend::with_string(&mut svg, SIZE).into_drawing_area();
        let mut chart = ChartBuilder::on(&area)
            .margin(8)
            .x_label_area_size(38)
            .y_label_area_size(70)
            .build_cartesian_2d(x.0..x.1, y.0 - room..y.1 + room)?;
        chart
            .configure_mesh()
            .x_desc(x_label)
            .y_desc(y_label)
            .label_style(("sans-serif", LETTERS))
            .light_line_style(TRANSPARENT)
            .draw()?;
        for ((_, points), colour) in series.iter().zip(COLOURS.into_iter().cycle()) {
            chart.draw_series(LineSeries::new(points.iter().copied(), &colour))?;
        }
        area.present()?;
    }
    Ok(svg)
}

/// The range of an axis for values from one to another: with 0 where that is no farther away than they are apart, so that a current or
/// a torque stands over its 0, and a link that hardly moves fills its plot.
fn fitted((low, high): (f64, f64)) -> (f64, f64) {
    let span = high - low;
    if span.is_nan() || span < 0.0 {
        return (0.0, 1.0);
    }
    let least = 1e-3 * high.abs().max(low.abs());
    let (low, high) = if span < least { (low - least, high + least) } else { (low, high) };
    if low > 0.0 && low <= span {
        (0.0, high)
    } else if high < 0.0 && -high <= span {
        (low, 0.0)
    } else {
        (low, high)
    }
}

/// The curves' names in their colours; nothing for one alone.
pub fn legend(series: &[(&str, Vec<(f64, f64)>)]) -> String {
    let mut text = String::new();
    if series.len() > 1 {
        for ((name, _), colour) in series.iter().zip(COLOURS.into_iter().cycle()) {
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
pub fn thinned(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_axis_has_its_zero_where_it_is_near_and_fits_the_values_where_it_is_not() {
        assert_eq!(fitted((10.0, 100.0)), (0.0, 100.0));
        assert_eq!(fitted((-100.0, -10.0)), (-100.0, 0.0));
        assert_eq!(fitted((-5.0, 100.0)), (-5.0, 100.0));
        assert_eq!(fitted((660.0, 670.0)), (660.0, 670.0));
        assert_eq!(fitted((1500.0, 1500.0)), (1498.5, 1501.5));
        assert_eq!(fitted((f64::INFINITY, f64::NEG_INFINITY)), (0.0, 1.0));
    }
}
