//! The current's spectrum in steady state next to that of the bound.

use crate::bound::PulseLimits;
use crate::distortion::{self, Samples};
use crate::machine::Machine;
use crate::report::Page;
use crate::trace::Recording;
use crate::{analysis, bound};
use core::f64::consts::TAU;
use rustfft::FftPlanner;
use rustfft::num_complex::Complex;

/// Highest frequency that is drawn, over `max_switching_hz`: slightly more than three times it, 3 kHz for 900 Hz.
const HIGHEST: f64 = 10.0 / 3.0;
/// Smallest line that is drawn, in percent of the fundamental.
const SMALLEST_PERCENT: f64 = 0.02;
/// Offset of the bound's lines from the measured ones, as a share of the highest frequency.
const BESIDE: f64 = 8.0 / 3_000.0;

/// Half the foot of a line, as a share of the highest frequency: a curve has one value at a frequency.
const FOOT: f64 = 0.1 / 3_000.0;

/// Draws the spectrum in a window of a recording, under a title, and that of its bound, without the fundamental.
pub fn draw(
    page: &mut Page,
    recording: &Recording,
    (title, window): (&str, (f64, f64)),
    limits: PulseLimits,
    machine: &Machine,
) {
    let rows = analysis::window(recording, window.0, window.1);
    let Some(f1_hz) =
        rows.last().map(|row| row.speed_rpm.abs() * f64::from(machine.folder.parameters.pole_pairs) / 60.0)
    else {
        return;
    };
    let highest_hz = HIGHEST * machine.folder.parameters.max_switching_hz;
    let measured = distortion::samples(recording, window, &machine.folder);
    let mut series = vec![("measured", lines(&measured, f1_hz, (0.0, highest_hz)))];
    if let Some(ideal) = bound::ideal(rows, limits, machine) {
        series.push(("bound", lines(&ideal, f1_hz, (BESIDE * highest_hz, highest_hz))));
    }
    let heading = format!("Spectrum of phase current u without its fundamental · {title}");
    page.curves(&heading, "frequency in Hz", "% of the fundamental", &series);
}

/// A spectrum as lines that stand on the axis, offset by this many Hz, up to a frequency in Hz.
fn lines(samples: &Samples, f1_hz: f64, (beside_hz, highest_hz): (f64, f64)) -> Vec<(f64, f64)> {
    let (fundamental_a, rest) = samples.without_fundamental();
    let count = rest.len();
    let mut bins: Vec<_> = rest.into_iter().map(|current_a| Complex::new(current_a, 0.0)).collect();
    FftPlanner::new().plan_fft_forward(count).process(&mut bins);
    let turned = samples.angle.last().zip(samples.angle.first()).map_or(0.0, |(last, first)| last - first);
    // One more sample would complete the last turn.
    let turns = turned / TAU * count as f64 / (count.max(2) - 1) as f64;
    let foot_hz = FOOT * highest_hz;
    let mut points = vec![(0.0, 0.0)];
    for (bin, value) in bins.iter().enumerate().take(count / 2).skip(1) {
        let hertz = bin as f64 / turns.abs() * f1_hz;
        let percent = 200.0 * value.norm() / count as f64 / fundamental_a;
        if hertz < highest_hz && percent > SMALLEST_PERCENT {
            let at = hertz + beside_hz;
            points.extend([(at - foot_hz, 0.0), (at, percent), (at + foot_hz, 0.0)]);
        }
    }
    points.push((highest_hz, 0.0));
    points
}
