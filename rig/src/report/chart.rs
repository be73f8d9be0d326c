//! Size, colours and points that curves as SVG share.

use plotters::prelude::*;

/// Size of a plot, in pixels.
pub const SIZE: (u32, u32) = (1000, 280);
/// Points per curve; denser data is shown by its extremes.
const POINTS: usize = 1500;
/// Colours of the curves, in their order.
pub const COLOURS: [RGBColor; 2] = [RGBColor(31, 119, 180), RGBColor(214, 39, 40)];

/// No more than about [`POINTS`] points: the lowest and the highest of each stretch, in their order.
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
