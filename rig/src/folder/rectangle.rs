//! A flux map on any rectangular grid, even or not.

use super::samples::Sample;
use anyhow::{Result, anyhow, bail, ensure};
use std::path::Path;

/// Flux linkages over id and iq, row-major: node (d, q) at `d * iq_a.len() + q`.
pub struct Rectangle {
    /// The values of id, ascending, in A.
    pub id_a: Vec<f64>,
    /// The values of iq, ascending, in A.
    pub iq_a: Vec<f64>,
    psi_d: Vec<f64>,
    psi_q: Vec<f64>,
    lines: Vec<u64>,
}

/// Currents that differ by this much, as a share of the axis, count as the same one, rounded or found by an iteration.
const SAME: f64 = 1e-4;
/// Deviation from an even grid that counts as rounding, as a share of the step.
const EVEN: f64 = 1e-3;

impl Rectangle {
    /// Made of samples in any order.
    ///
    /// # Errors
    /// The line of a node that occurs twice with different values, the currents of a missing one, an axis with too few values.
    pub fn of(samples: &[Sample], path: &Path) -> Result<Self> {
        let file = path.display();
        let (id_a, iq_a) = (axis(samples, 0), axis(samples, 1));
        for (name, values) in [("id", &id_a), ("iq", &iq_a)] {
            let count = values.len();
            ensure!(
                count >= 4,
                "{file}: {name}: {count} values: must be at least 4 on each axis of the grid"
            );
        }
        let columns = iq_a.len();
        let mut nodes: Vec<Option<&Sample>> = vec![None; id_a.len() * columns];
        for sample in samples {
            let node = nearest(&id_a, sample.values[0]) * columns + nearest(&iq_a, sample.values[1]);
            let twin = nodes[node].replace(sample);
            if let Some(twin) = twin.filter(|twin| twin.values != sample.values) {
                let [id, iq, ..] = sample.values;
                bail!(
                    "{file}:{}: id {id}, iq {iq}: must be there once: is in line {} too",
                    sample.line,
                    twin.line
                );
            }
        }
        let missing = nodes.iter().position(Option::is_none);
        if let Some(missing) = missing {
            let (id, iq) = (id_a[missing / columns], iq_a[missing % columns]);
            return Err(anyhow!(
                "{file}: id {id}, iq {iq}: missing: must be there, on a grid of {} values of id by {columns} of iq",
                id_a.len()
            ));
        }
        let whole = |place: usize| nodes.iter().flatten().map(|sample| sample.values[place]).collect();
        let lines = nodes.iter().flatten().map(|sample| sample.line).collect();
        Ok(Self { psi_d: whole(2), psi_q: whole(3), lines, id_a, iq_a })
    }

    /// Its half with iq ≥ 0: the mean of both signs if it has them, otherwise the one that it has.
    ///
    /// # Errors
    /// The line of a node that is not the image of its twin, an axis that does not begin at or pass 0.
    pub fn folded(&self, tolerance: f64, path: &Path) -> Result<Self> {
        let file = path.display();
        let (first, last) = (self.iq_a[0], self.iq_a[self.iq_a.len() - 1]);
        let same = SAME * (last - first);
        let iq_a: Vec<f64> = match (first < -same, last > same) {
            (true, false) => self.iq_a.iter().rev().map(|iq| -iq + 0.0).collect(),
            _ => self.iq_a.iter().copied().filter(|iq| *iq >= -same).collect(),
        };
        ensure!(
            iq_a[0].abs() <= same,
            "{file}: iq: {}: the value nearest to 0: must be 0, so that the other sign can be its mirror image",
            iq_a[0]
        );
        let largest = self.psi_d.iter().chain(&self.psi_q).fold(0.0, |most: f64, psi| most.max(psi.abs()));
        let twins = Twins { of: self, same, tolerance_wb: tolerance * largest, path };
        let (mut psi_d, mut psi_q, mut lines) = (Vec::new(), Vec::new(), Vec::new());
        for row in 0..self.id_a.len() {
            for iq in &iq_a {
                let ([d, q], line) = twins.mean(row, *iq)?;
                psi_d.push(d);
                psi_q.push(q);
                lines.push(line);
            }
        }
        let iq_a = iq_a.into_iter().map(|iq| if iq.abs() <= same { 0.0 } else { iq }).collect();
        Ok(Self { id_a: self.id_a.clone(), iq_a, psi_d, psi_q, lines })
    }

    /// Checks that each flux linkage rises with its own current.
    ///
    /// # Errors
    /// The line of a node that is not above the previous one.
    pub fn check_rising(&self, path: &Path) -> Result<()> {
        let columns = self.iq_a.len();
        for node in 0..self.lines.len() {
            let before_d = node.checked_sub(columns);
            let before_q = node.checked_sub(1).filter(|_| !node.is_multiple_of(columns));
            for (name, current, values, before) in
                [("psi_d", "id", &self.psi_d, before_d), ("psi_q", "iq", &self.psi_q, before_q)]
            {
                let Some(before) = before else { continue };
                ensure!(
                    values[node] > values[before],
                    "{}:{}: {name}: {}: must rise with {current}, above {} of line {}",
                    path.display(),
                    self.lines[node],
                    values[node],
                    values[before],
                    self.lines[before]
                );
            }
        }
        Ok(())
    }

    fn node(&self, row: usize, iq: f64, same: f64) -> Option<usize> {
        let column = nearest(&self.iq_a, iq);
        ((self.iq_a[column] - iq).abs() <= same).then_some(row * self.iq_a.len() + column)
    }

    /// First and last id, last iq, in A.
    pub fn ends(&self) -> (f64, f64, f64) {
        (self.id_a[0], self.id_a[self.id_a.len() - 1], self.iq_a[self.iq_a.len() - 1])
    }

    /// `true` if both axes are even.
    pub fn is_even(&self) -> bool {
        [&self.id_a, &self.iq_a].into_iter().all(|axis| {
            let step = (axis[axis.len() - 1] - axis[0]) / (axis.len() - 1) as f64;
            axis.iter().enumerate().all(|(k, value)| (value - axis[0] - step * k as f64).abs() <= EVEN * step)
        })
    }

    /// Flux linkages ψ_d and ψ_q on another grid, row-major: first along id, then along iq, by cubics that rise and fall only where their nodes do.
    pub fn at(&self, id_a: &[f64], iq_a: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let columns = self.iq_a.len();
        let surface = |values: &[f64]| {
            let along_d: Vec<Vec<f64>> = (0..columns)
                .map(|column| {
                    let nodes: Vec<f64> = values.iter().skip(column).step_by(columns).copied().collect();
                    between(&self.id_a, &nodes, id_a)
                })
                .collect();
            let row = |k: usize| -> Vec<f64> { along_d.iter().map(|column| column[k]).collect() };
            (0..id_a.len()).flat_map(|k| between(&self.iq_a, &row(k), iq_a)).collect()
        };
        (surface(&self.psi_d), surface(&self.psi_q))
    }
}

/// Nodes and their mirror images at −iq, within a tolerance.
struct Twins<'a> {
    of: &'a Rectangle,
    same: f64,
    tolerance_wb: f64,
    path: &'a Path,
}

impl Twins<'_> {
    /// The mean of a node at iq ≥ 0 and the image of its twin, or the one of both that exists, and its line.
    fn mean(&self, row: usize, iq: f64) -> Result<([f64; 2], u64)> {
        let Self { of, same, tolerance_wb, path } = *self;
        let file = path.display();
        let is_axis = iq.abs() <= same;
        let here = of.node(row, iq, same);
        let twin = if is_axis { None } else { of.node(row, -iq, same) };
        let (Some(line), Some(other)) = (here.or(twin), twin.or(here)) else {
            bail!(
                "{file}: id {}, iq {iq}: missing, and at −iq too: must be there on either side",
                of.id_a[row]
            );
        };
        let (line, other) = (of.lines[line], of.lines[other]);
        let mut node = [0.0; 2];
        let quantities = [("psi_d", 1.0, &of.psi_d), ("psi_q", -1.0, &of.psi_q)];
        for (value, (name, parity, values)) in node.iter_mut().zip(quantities) {
            let image = twin.map(|twin| parity * values[twin]);
            let own = here.map(|here| values[here]).or(image).unwrap_or(f64::NAN);
            let image = image.unwrap_or(own);
            ensure!(
                (own - image).abs() <= tolerance_wb,
                "{file}:{line}: {name}: {own}: must be {image} within {tolerance_wb:.2e} Wb, the mirror image of line {other}"
            );
            *value = 0.5 * (own + image);
        }
        ensure!(
            !is_axis || node[1].abs() <= tolerance_wb,
            "{file}:{line}: psi_q: {}: must be 0 at iq = 0 within {tolerance_wb:.2e} Wb, with d along the magnets",
            node[1]
        );
        if is_axis {
            node[1] = 0.0;
        }
        Ok((node, line))
    }
}

/// The distinct values of a quantity, ascending.
fn axis(samples: &[Sample], place: usize) -> Vec<f64> {
    let mut values: Vec<f64> = samples.iter().map(|sample| sample.values[place]).collect();
    values.sort_by(f64::total_cmp);
    let span = values[values.len() - 1] - values[0];
    values.dedup_by(|a, b| (*a - *b).abs() <= SAME * span);
    values
}

/// The index of the nearest value.
fn nearest(axis: &[f64], value: f64) -> usize {
    let after = axis.partition_point(|one| *one < value).min(axis.len() - 1);
    let before = after.saturating_sub(1);
    if (axis[before] - value).abs() < (axis[after] - value).abs() { before } else { after }
}

/// Values between nodes: cubic Hermite with the slopes of Fritsch and Butland, which keep a monotone row monotone.
fn between(x: &[f64], y: &[f64], wanted: &[f64]) -> Vec<f64> {
    let last = x.len() - 1;
    let secant = |k: usize| (y[k + 1] - y[k]) / (x[k + 1] - x[k]);
    let slope = |k: usize| {
        if k == 0 || k == last {
            return end_slope(x, y, k == 0);
        }
        let (a, b, p, q) = (secant(k - 1), secant(k), x[k] - x[k - 1], x[k + 1] - x[k]);
        if a * b <= 0.0 { 0.0 } else { 3.0 * (p + q) / ((2.0 * q + p) / a + (q + 2.0 * p) / b) }
    };
    let slopes: Vec<f64> = (0..=last).map(slope).collect();
    let at = |value: &f64| {
        let cell = x.partition_point(|node| node <= value).saturating_sub(1).min(last - 1);
        let width = x[cell + 1] - x[cell];
        let t = (value - x[cell]) / width;
        let (m0, m1) = (slopes[cell] * width, slopes[cell + 1] * width);
        let rise = y[cell + 1] - y[cell];
        y[cell] + t * (m0 + t * (3.0 * rise - 2.0 * m0 - m1 + t * (m0 + m1 - 2.0 * rise)))
    };
    wanted.iter().map(at).collect()
}

/// The slope at an end: that of the parabola through three nodes, or zero if it would reverse the direction.
fn end_slope(x: &[f64], y: &[f64], is_first: bool) -> f64 {
    let last = x.len() - 1;
    let [a, b, c] = if is_first { [0, 1, 2] } else { [last, last - 1, last - 2] };
    let (near, far) = ((y[b] - y[a]) / (x[b] - x[a]), (y[c] - y[b]) / (x[c] - x[b]));
    let (p, q) = (x[b] - x[a], x[c] - x[b]);
    let slope = ((2.0 * p + q) * near - p * far) / (p + q);
    if slope * near <= 0.0 { 0.0 } else { slope }
}
