//! Curves as SVG.

use super::table::escape;
use anyhow::Result;
use plotters::prelude::*;
use std::fmt::Write as _;

/// Size of a plot, in pixels.
pub const SIZE: (u32, u32) = (1000, 280);
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
        let mut chart = ChartBuilder::on(&area)
            .margin(8)
            .x_label_area_size(34)
            .y_label_area_size(64)
            .build_cartesian_2d(x.0..x.1, y.0 - room..y.1 + room)?;
        chart.configure_mesh().x_desc(x_label).y_desc(y_label).light_line_style(TRANSPARENT).draw()?;
        for ((_, points), colour) in series.iter().zip(COLOURS.into_iter().cycle()) {
            chart.draw_series(LineSeries::new(points.iter().copied(), &colour))?;
        }
        area.present()?;
    }
    Ok(svg)
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
