//! One picture of a whole run.

use super::Curve;
use super::chart::{COLOURS, SIZE, thinned};
use crate::trace::Recording;
use anyhow::Result;
use plotters::prelude::*;

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
        area.present()?;
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
    let rows = &recording.rows;
    let values = || rows.iter().flat_map(|row| curves.iter().map(|(_, value)| value(row)));
    let (low, high) =
        values().fold((0.0_f64, 0.0_f64), |(low, high), value| (low.min(value), high.max(value)));
    let room = 0.18 * (high - low).max(1e-9);
    let mut chart = ChartBuilder::on(panel)
        .margin(6)
        .x_label_area_size(24)
        .y_label_area_size(64)
        .build_cartesian_2d(0.0..end_s, low - 0.2 * room..high + room)?;
    let mut begin = 0;
    while begin < rows.len() {
        let mode = rows[begin].mode;
        let length = rows[begin..].iter().take_while(|row| row.mode == mode).count();
        let (from_s, to_s) = (rows[begin].t_s, rows[begin + length - 1].t_s);
        let shade = RGBColor(225, 232, 240).mix(if (mode as u8).is_multiple_of(2) { 0.9 } else { 0.35 });
        let corners = [(from_s, low - 0.2 * room), (to_s, high + room)];
        let band = Rectangle::new(corners, shade.filled());
        chart.draw_series(std::iter::once(band))?;
        if to_s - from_s > 0.04 * end_s {
            let name = Text::new(mode.name(), (from_s, high + 0.9 * room), ("sans-serif", 12));
            chart.draw_series(std::iter::once(name))?;
        }
        begin += length;
    }
    chart.configure_mesh().disable_mesh().x_desc("time in s").y_desc(label).draw()?;
    for ((_, value), colour) in curves.iter().zip(COLOURS) {
        let points: Vec<_> = rows.iter().map(|row| (row.t_s, value(row))).collect();
        chart.draw_series(LineSeries::new(thinned(&points), &colour))?;
    }
    Ok(())
}
