//! The blocks in double precision, by the mathematics library.

use crate::Input;
use core::f64::consts::TAU;
use tractive::built_in::traction::BUILT_IN;
use tractive::machine::Grid;

/// Sine and cosine of the angle.
pub fn sin_cos(input: &Input) -> [f64; 2] {
    let radians = f64::from(input.turn) / 4_294_967_296.0 * TAU;
    [libm::sin(radians), libm::cos(radians)]
}

/// Direction of the vector, in radians.
pub fn direction(input: &Input) -> [f64; 2] {
    [libm::atan2(input.vector[1].into(), input.vector[0].into()), 0.0]
}

/// Square root.
pub fn root(input: &Input) -> [f64; 2] {
    [libm::sqrt(input.positive.into()), 0.0]
}

/// Flux linkage over current: bilinear between the nodes.
pub fn flux(input: &Input) -> [f64; 2] {
    let grid: &Grid<2> = &BUILT_IN.flux;
    let [d, q] = input.current_a.map(f64::from);
    let cell = |x: f64, first: f32, inverse_step: f32, nodes: usize| {
        let x = (x - f64::from(first)) * f64::from(inverse_step);
        let k = (libm::floor(x).max(0.0) as usize).min(nodes - 2);
        (k, x - k as f64)
    };
    let (r, y) = cell(d, grid.first_row, grid.inverse_row_step, grid.rows);
    let (c, x) = cell(q.abs(), grid.first_column, grid.inverse_column_step, grid.columns);
    let node = |r: usize, c: usize, k: usize| {
        grid.nodes.get(r * grid.columns + c).map_or(0.0, |node| f64::from(node[k]))
    };
    let at = |k| {
        let low = node(r, c, k) * (1.0 - x) + node(r, c + 1, k) * x;
        let high = node(r + 1, c, k) * (1.0 - x) + node(r + 1, c + 1, k) * x;
        low * (1.0 - y) + high * y
    };
    [at(0), if q < 0.0 { -at(1) } else { at(1) }]
}
