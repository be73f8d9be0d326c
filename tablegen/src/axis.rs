//! Even axes, and tables over one or two of them.

use tractive_control::machine::{Curve, Grid};

/// An even axis: first value, nodes per unit, number of nodes.
#[derive(Clone, Copy)]
pub(crate) struct Axis {
    first: f32,
    inverse_step: f32,
    count: usize,
}

impl Axis {
    pub(crate) fn new(first: f64, last: f64, count: usize) -> Self {
        Self { first: first as f32, inverse_step: ((count - 1) as f64 / (last - first)) as f32, count }
    }
}

/// A table over one axis; its nodes live as long as the program.
pub(crate) fn curve<const N: usize>(axis: Axis, nodes: Vec<[f32; N]>) -> Curve<N> {
    Curve { first: axis.first, inverse_step: axis.inverse_step, nodes: nodes.leak() }
}

/// A table over two axes, row-major; its nodes live as long as the program.
pub(crate) fn grid<const N: usize>(rows: Axis, columns: Axis, nodes: Vec<[f32; N]>) -> Grid<N> {
    Grid {
        first_row: rows.first,
        inverse_row_step: rows.inverse_step,
        rows: rows.count,
        first_column: columns.first,
        inverse_column_step: columns.inverse_step,
        columns: columns.count,
        nodes: nodes.leak(),
    }
}

#[cfg(test)]
mod tests;
