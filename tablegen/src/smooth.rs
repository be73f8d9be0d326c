//! The smooth flux map between the nodes.

use crate::map::FluxMap;
use core::ops::{Add, Mul};
use libm::hypot;

/// Flux linkage at a current, with its Jacobian.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FluxPoint {
    /// Flux linkage, d axis, in Wb.
    pub psi_d_wb: f64,
    /// Flux linkage, q axis, in Wb.
    pub psi_q_wb: f64,
    /// ∂ψd/∂id, in H.
    pub ldd_h: f64,
    /// ∂ψd/∂iq, in H.
    pub ldq_h: f64,
    /// ∂ψq/∂id, in H.
    pub lqd_h: f64,
    /// ∂ψq/∂iq, in H.
    pub lqq_h: f64,
}

/// A bicubic spline (not-a-knot) through the nodes of a flux map. Beyond the grid it continues along its tangent, which turns as the edge does, until a slope
/// along the edge has lost half of itself; then it bends to the mean slope of that edge. If the tangent went on, flux linkage would fall somewhere, and no
/// current would have the flux linkage that a short circuit requires.
#[derive(Clone, Debug)]
pub struct SmoothMap {
    first_d: f64,
    first_q: f64,
    step_d: f64,
    step_q: f64,
    cells_d: usize,
    cells_q: usize,
    cells: Vec<[Both; 16]>,
    /// Edges below and above the grid, along each axis.
    edges_d: [Edge; 2],
    edges_q: [Edge; 2],
}

/// Share that a slope along an edge loses over the distance for which the tangent holds; and the length of the following bend, over that distance.
const LOSS: f64 = 0.5;
const TURN: f64 = 0.3;

impl SmoothMap {
    /// The spline of a map, mirrored to both signs of iq.
    pub fn new(map: &FluxMap) -> Self {
        let (rows, columns) = (map.id_a.len(), map.iq_a.len());
        // Computed over the whole axis, so that the error of a step that was rounded in the file does not add up.
        let step = |axis: &[f64]| (axis[axis.len() - 1] - axis[0]) / (axis.len() - 1) as f64;
        let (step_d, step_q) = (step(&map.id_a), step(&map.iq_a));
        let surfaces = [&map.psi_d_wb, &map.psi_q_wb].map(|nodes| Surface::new(nodes, rows, columns));
        let mut cells = Vec::with_capacity((rows - 1) * (columns - 1));
        for r in 0..rows - 1 {
            for c in 0..columns - 1 {
                let [d, q] = [surfaces[0].cell(r, c), surfaces[1].cell(r, c)];
                cells.push(core::array::from_fn(|k| Both([d[k], q[k]])));
            }
        }
        let row = |r: usize| (0..columns).map(move |c| r * columns + c);
        let column = |c: usize| (0..rows).map(move |r| r * columns + c);
        let [psi_d, psi_q] = &surfaces;
        let edge_d = |r: usize, out| Edge::new(row(r), out, (&psi_d.by_row, &psi_q.by_column, &psi_q.mixed));
        let edge_q =
            |c: usize, out| Edge::new(column(c), out, (&psi_q.by_column, &psi_d.by_row, &psi_d.mixed));
        Self {
            edges_d: [edge_d(0, -1.0), edge_d(rows - 1, 1.0)],
            edges_q: [edge_q(0, -1.0), edge_q(columns - 1, 1.0)],
            first_d: map.id_a[0],
            first_q: map.iq_a[0],
            step_d,
            step_q,
            cells_d: rows - 1,
            cells_q: columns - 1,
            cells,
        }
    }

    /// Flux linkage and Jacobian at a current in A.
    pub fn at(&self, id_a: f64, iq_a: f64) -> FluxPoint {
        let (r, x, beyond_d) = place((id_a - self.first_d) / self.step_d, self.cells_d);
        let (c, y, beyond_q) = place((iq_a - self.first_q) / self.step_q, self.cells_q);
        let k = &self.cells[r * self.cells_q + c];
        let inside = Value::of(k, x, y);
        let at = if beyond_d == 0.0 && beyond_q == 0.0 {
            inside
        } else {
            let side = |edges: &[Edge; 2], way: f64| edges[usize::from(way > 0.0)].along(way);
            let (along_d, along_q) = (side(&self.edges_d, beyond_d), side(&self.edges_q, beyond_q));
            inside.beyond(k, (x, y), along_d, along_q)
        };
        let ([psi_d_wb, psi_q_wb], [by_d_d, by_d_q], [by_q_d, by_q_q]) = (at.value.0, at.by_x.0, at.by_y.0);
        FluxPoint {
            psi_d_wb,
            psi_q_wb,
            ldd_h: by_d_d / self.step_d,
            ldq_h: by_q_d / self.step_q,
            lqd_h: by_d_q / self.step_d,
            lqq_h: by_q_q / self.step_q,
        }
    }

    /// The current for a given flux linkage in Wb, by Newton from `start`; `None` if it does not converge.
    pub fn inverse(&self, psi_d_wb: f64, psi_q_wb: f64, start: (f64, f64)) -> Option<(f64, f64)> {
        let (mut id, mut iq) = start;
        for _ in 0..60 {
            let at = self.at(id, iq);
            let (ed, eq) = (psi_d_wb - at.psi_d_wb, psi_q_wb - at.psi_q_wb);
            if ed.abs() < 1e-12 && eq.abs() < 1e-12 {
                return Some((id, iq));
            }
            let det = at.ldd_h * at.lqq_h - at.ldq_h * at.lqd_h;
            let (dd, dq) = ((at.lqq_h * ed - at.ldq_h * eq) / det, (at.ldd_h * eq - at.lqd_h * ed) / det);
            // A long step would jump across the knee of saturation; shorter ones find it.
            let longest = 4.0 * self.step_d.max(self.step_q);
            let scale = (longest / hypot(dd, dq)).min(1.0);
            (id, iq) = (id + scale * dd, iq + scale * dq);
        }
        None
    }
}

/// Cell, fraction within it, and the distance beyond the grid, in cells.
fn place(position: f64, cells: usize) -> (usize, f64, f64) {
    let inside = position.clamp(0.0, cells as f64);
    let cell = (inside as usize).min(cells - 1);
    (cell, inside - cell as f64, position - inside)
}

/// A quantity of both surfaces, ψd's and ψq's: the simulations spend a third of their time here, and a processor computes two at once.
#[derive(Clone, Copy, Debug)]
struct Both([f64; 2]);

impl Add for Both {
    type Output = Self;

    #[inline(always)]
    fn add(self, Self([d, q]): Self) -> Self {
        Self([self.0[0] + d, self.0[1] + q])
    }
}

impl Mul<Both> for f64 {
    type Output = Both;

    #[inline(always)]
    fn mul(self, Both([d, q]): Both) -> Both {
        Both([self * d, self * q])
    }
}

/// The surfaces' values and slopes, per cell.
#[derive(Clone, Copy)]
struct Value {
    value: Both,
    by_x: Both,
    by_y: Both,
}

impl Value {
    /// The value of a bicubic polynomial.
    #[inline(always)]
    fn of(k: &[Both; 16], x: f64, y: f64) -> Self {
        let row = |i: usize| {
            let (a, b, c, d) = (k[4 * i], k[4 * i + 1], k[4 * i + 2], k[4 * i + 3]);
            (a + y * (b + y * (c + y * d)), b + y * (2.0 * c + 3.0 * y * d))
        };
        let ((a, ay), (b, by), (c, cy), (d, dy)) = (row(0), row(1), row(2), row(3));
        Self {
            value: a + x * (b + x * (c + x * d)),
            by_x: b + x * (2.0 * c + 3.0 * x * d),
            by_y: ay + x * (by + x * (cy + x * dy)),
        }
    }

    /// The value outside the grid, this far along both axes, either of which may be 0; the slopes are those of that value, too.
    fn beyond(self, k: &[Both; 16], (x, y): (f64, f64), along_x: Beyond, along_y: Beyond) -> Self {
        let row = |i: usize| k[4 * i + 1] + y * (2.0 * k[4 * i + 2] + 3.0 * y * k[4 * i + 3]);
        let mixed = row(1) + x * (2.0 * row(2) + 3.0 * x * row(3));
        let far_x = Both([along_x.slope, 0.0]);
        let far_y = Both([0.0, along_y.slope]);
        let near = self.value + along_x.near * self.by_x + along_y.near * self.by_y;
        Self {
            value: near + along_y.near * (along_x.near * mixed) + along_x.far * far_x + along_y.far * far_y,
            by_x: along_x.share * (self.by_x + along_y.near * mixed) + (1.0 - along_x.share) * far_x,
            by_y: along_y.share * (self.by_y + along_x.near * mixed) + (1.0 - along_y.share) * far_y,
        }
    }
}

/// An edge of the grid.
#[derive(Clone, Copy, Debug)]
struct Edge {
    /// Mean slope of the flux linkage along the axis that leaves the grid here, per cell.
    slope: f64,
    /// The distance for which the tangent holds, in cells.
    straight: f64,
}

impl Edge {
    /// Made of some nodes, outwards in this direction of their axis; each node gives the slope of the axis' own flux linkage along it, that of the other one
    /// along the edge, and the change of the latter along the axis, per cell.
    fn new(
        nodes: impl Iterator<Item = usize>,
        out: f64,
        (own, other, mixed): (&[f64], &[f64], &[f64]),
    ) -> Self {
        let (mut sum, mut count, mut straight) = (0.0, 0.0, f64::INFINITY);
        for node in nodes {
            (sum, count) = (sum + own[node], count + 1.0);
            let falls = -out * mixed[node];
            if falls > 0.0 {
                straight = f64::min(straight, LOSS * other[node] / falls);
            }
        }
        Self { slope: sum / count, straight: straight.max(f64::MIN_POSITIVE) }
    }

    /// The way for this many cells beyond the edge.
    fn along(&self, way: f64) -> Beyond {
        let &Self { slope, straight } = self;
        if way.abs() <= straight {
            return Beyond { near: way, far: 0.0, share: 1.0, slope };
        }
        let after = way.abs() - straight;
        let share = 1.0 / (1.0 + after / (TURN * straight));
        let far = (after * (1.0 - share)).copysign(way);
        Beyond { near: way - far, far, share: share * share, slope }
    }
}

/// A way beyond an edge, in cells: the part along the tangent, the rest, the share of the tangent's slope at its end, and the mean slope.
#[derive(Clone, Copy)]
struct Beyond {
    near: f64,
    far: f64,
    share: f64,
    slope: f64,
}

/// Node values and derivatives, per cell, of one surface.
struct Surface {
    columns: usize,
    value: Vec<f64>,
    by_row: Vec<f64>,
    by_column: Vec<f64>,
    mixed: Vec<f64>,
}

impl Surface {
    fn new(nodes: &[f64], rows: usize, columns: usize) -> Self {
        let along_columns = |values: &[f64]| values.chunks(columns).flat_map(derivatives).collect::<Vec<_>>();
        let along_rows = |values: &[f64]| {
            let mut out = vec![0.0; values.len()];
            for c in 0..columns {
                let column: Vec<_> = (0..rows).map(|r| values[r * columns + c]).collect();
                for (r, slope) in derivatives(&column).into_iter().enumerate() {
                    out[r * columns + c] = slope;
                }
            }
            out
        };
        let by_column = along_columns(nodes);
        Self {
            columns,
            value: nodes.to_vec(),
            by_row: along_rows(nodes),
            mixed: along_rows(&by_column),
            by_column,
        }
    }

    /// Coefficients k[4 i + j] of x^i y^j.
    fn cell(&self, r: usize, c: usize) -> [f64; 16] {
        let corner = |values: &[f64], dr: usize, dc: usize| values[(r + dr) * self.columns + c + dc];
        let hermite = |p0: f64, p1: f64, m0: f64, m1: f64| {
            [p0, m0, 3.0 * (p1 - p0) - 2.0 * m0 - m1, 2.0 * (p0 - p1) + m0 + m1]
        };
        let along_y = |value: &[f64], slope: &[f64], dr: usize| {
            hermite(corner(value, dr, 0), corner(value, dr, 1), corner(slope, dr, 0), corner(slope, dr, 1))
        };
        let (p0, p1) = (along_y(&self.value, &self.by_column, 0), along_y(&self.value, &self.by_column, 1));
        let (m0, m1) = (along_y(&self.by_row, &self.mixed, 0), along_y(&self.by_row, &self.mixed, 1));
        let mut k = [0.0; 16];
        for j in 0..4 {
            for (i, coefficient) in hermite(p0[j], p1[j], m0[j], m1[j]).into_iter().enumerate() {
                k[4 * i + j] = coefficient;
            }
        }
        k
    }
}

/// Slopes per cell of the not-a-knot cubic spline through evenly spaced values.
fn derivatives(values: &[f64]) -> Vec<f64> {
    let n = values.len();
    if n < 4 {
        return (0..n)
            .map(|k| {
                let (low, high) = (k.saturating_sub(1), (k + 1).min(n - 1));
                (values[high] - values[low]) / (high - low) as f64
            })
            .collect();
    }
    let (mut lower, mut diagonal, mut upper) = (vec![1.0; n], vec![4.0; n], vec![1.0; n]);
    let mut right: Vec<_> = (0..n)
        .map(|k| if k == 0 || k == n - 1 { 0.0 } else { 3.0 * (values[k + 1] - values[k - 1]) })
        .collect();
    (diagonal[0], upper[0]) = (1.0, 2.0);
    right[0] = 0.5 * (-5.0 * values[0] + 4.0 * values[1] + values[2]);
    (lower[n - 1], diagonal[n - 1]) = (2.0, 1.0);
    right[n - 1] = 0.5 * (5.0 * values[n - 1] - 4.0 * values[n - 2] - values[n - 3]);
    for k in 1..n {
        let factor = lower[k] / diagonal[k - 1];
        diagonal[k] -= factor * upper[k - 1];
        right[k] -= factor * right[k - 1];
    }
    right[n - 1] /= diagonal[n - 1];
    for k in (0..n - 1).rev() {
        right[k] = (right[k] - upper[k] * right[k + 1]) / diagonal[k];
    }
    right
}

#[cfg(test)]
mod tests;
