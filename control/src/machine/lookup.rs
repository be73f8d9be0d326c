//! Interpolation in evenly spaced tables. Outside its axis a table continues the line of its last cell (linear
//! extrapolation), so that a map keeps its slope and stays invertible; a NaN index gives NaN.

/// A table over one axis: node `k` stands at `first + k / inverse_step`.
#[derive(Clone, Copy, Debug)]
pub struct Curve<const N: usize> {
    /// Axis value of the first node.
    pub first: f32,
    /// Nodes per unit of the axis.
    pub inverse_step: f32,
    /// The nodes; at least two.
    pub nodes: &'static [[f32; N]],
}

/// A table over two axes, row-major: node `(r, c)` is `nodes[r * columns + c]`.
#[derive(Clone, Copy, Debug)]
pub struct Grid<const N: usize> {
    /// Row-axis value of the first row.
    pub first_row: f32,
    /// Rows per unit of the row axis.
    pub inverse_row_step: f32,
    /// Number of rows; at least two.
    pub rows: usize,
    /// Column-axis value of the first column.
    pub first_column: f32,
    /// Columns per unit of the column axis.
    pub inverse_column_step: f32,
    /// Number of columns; at least two.
    pub columns: usize,
    /// The nodes, `rows * columns` of them.
    pub nodes: &'static [[f32; N]],
}

/// Position on an axis, in cells. The compiler knows the axis' beginning in cells if it knows the table.
#[inline(always)]
fn position(x: f32, first: f32, inverse_step: f32) -> f32 {
    x * inverse_step - first * inverse_step
}

/// Cell index and the fraction inside it, for a position in cells and `count` nodes.
#[inline(always)]
fn cell(position: f32, count: usize) -> (usize, f32) {
    let last = count.saturating_sub(2);
    let index = (position as usize).min(last);
    (index, position - index as f32)
}

/// The value between two neighbouring nodes; NaN if the table is shorter than it says: NaN ends in a named fault, not
/// in a panic.
#[inline(always)]
fn between<const N: usize>(nodes: &[[f32; N]], index: usize, fraction: f32) -> [f32; N] {
    match nodes.get(index..) {
        Some([low, high, ..]) => lerp(*low, *high, fraction),
        _ => [f32::NAN; N],
    }
}

#[inline(always)]
fn lerp<const N: usize>(a: [f32; N], b: [f32; N], fraction: f32) -> [f32; N] {
    let mut out = a;
    for (value, end) in out.iter_mut().zip(b) {
        *value += (end - *value) * fraction;
    }
    out
}

impl<const N: usize> Curve<N> {
    /// Linear interpolation at `x` (axis units); linear extrapolation beyond both ends.
    #[inline]
    pub fn at(&self, x: f32) -> [f32; N] {
        let (k, fraction) = cell(position(x, self.first, self.inverse_step), self.nodes.len());
        between(self.nodes, k, fraction)
    }

    /// Axis value of the last node.
    #[inline]
    pub const fn last(&self) -> f32 {
        self.first + self.nodes.len().saturating_sub(1) as f32 / self.inverse_step
    }
}

impl<const N: usize> Grid<N> {
    /// Bilinear interpolation at (`row`, `column`), in axis units; linear extrapolation beyond the edges.
    #[inline]
    pub fn at(&self, row: f32, column: f32) -> [f32; N] {
        let (r, row_fraction) = cell(position(row, self.first_row, self.inverse_row_step), self.rows);
        let (c, column_fraction) =
            cell(position(column, self.first_column, self.inverse_column_step), self.columns);
        let low = r * self.columns + c;
        let high = low + self.columns;
        lerp(
            between(self.nodes, low, column_fraction),
            between(self.nodes, high, column_fraction),
            row_fraction,
        )
    }
}
