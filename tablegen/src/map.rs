//! `flux_map.csv`: the nodes of the flux map, and the requirements on a flux map.

use crate::InputError;
use std::cmp::Ordering;
use std::path::Path;

/// Flux linkage over a full, even grid of currents, both signs of iq.
#[derive(Clone, Debug, PartialEq)]
pub struct FluxMap {
    /// The grid's id values, ascending, in A.
    pub id_a: Vec<f64>,
    /// The grid's iq values, ascending, from −max to +max, in A.
    pub iq_a: Vec<f64>,
    /// ψd, row-major: node (d, q) at `d * iq_a.len() + q`, in Wb.
    pub psi_d_wb: Vec<f64>,
    /// ψq, likewise, in Wb.
    pub psi_q_wb: Vec<f64>,
}

const COLUMNS: [&str; 4] = ["id_a", "iq_a", "psi_d_wb", "psi_q_wb"];
/// Largest current and flux linkage of any machine that this controller could drive.
const LARGEST_CURRENT_A: f64 = 1e5;
const LARGEST_FLUX_WB: f64 = 1e3;
/// Deviation from an even grid that still counts as rounding, as a share of the step.
const STEP_TOLERANCE: f64 = 1e-3;
/// Deviation from ψd even, ψq odd in iq that still counts as measurement error, as a share of the largest flux.
const SYMMETRY_TOLERANCE: f64 = 0.01;
/// Deviation between ∂ψd/∂iq and ∂ψq/∂id that still counts as measurement error, as a share of the largest self inductance.
const RECIPROCITY_TOLERANCE: f64 = 0.05;

/// A line of the file.
#[derive(Clone, Copy, Debug)]
struct Node {
    line: u64,
    id: f64,
    iq: f64,
    psi_d: f64,
    psi_q: f64,
}

impl Node {
    /// The order of two nodes in the grid, iq running faster.
    fn place(&self, other: &Self) -> Ordering {
        self.id.total_cmp(&other.id).then(self.iq.total_cmp(&other.iq))
    }
}

impl FluxMap {
    /// Reads and checks the file.
    ///
    /// # Errors
    /// Names the line, the column, the value and what is allowed.
    pub fn read(file: &Path) -> Result<Self, InputError> {
        let refuse = |error| InputError::new(file, None, format!("cannot be read: {error}"));
        Self::parse(&crate::read_bounded(file).map_err(refuse)?, file)
    }

    /// The same from a given text; errors name `file`.
    ///
    /// # Errors
    /// As [`Self::read`].
    pub fn parse(text: &[u8], file: &Path) -> Result<Self, InputError> {
        let mut nodes = read_nodes(text, file)?;
        let (id_a, iq_a) = axes(&nodes, file)?;
        let sorted = nodes.is_sorted_by(|a, b| a.place(b).is_le());
        nodes.sort_by(Node::place);
        check_grid(&nodes, &id_a, &iq_a, sorted, file)?;
        check_monotone(&nodes, iq_a.len(), file)?;
        let whole =
            if iq_a[0] < 0.0 { check_even(&nodes, &iq_a, file)? } else { mirror(&nodes, &iq_a, file)? };
        let map = Self { id_a, ..whole };
        map.check_reciprocity(&nodes, file)?;
        map.check_invertible(&nodes, file)?;
        Ok(map)
    }

    /// Checks that the grid covers currents up to `max_current_a`.
    ///
    /// # Errors
    /// Names the axis that ends too early.
    pub(crate) fn check_range(&self, max_current_a: f64, file: &Path) -> Result<(), InputError> {
        let reach = |axis: &[f64]| (axis[0], axis[axis.len() - 1]);
        let ((d_low, d_high), (_, q_high)) = (reach(&self.id_a), reach(&self.iq_a));
        let problem = if d_low > -max_current_a {
            format!("id_a: begins at {d_low}: must begin at or below −max_current_a, {}", -max_current_a)
        } else if d_high < 0.0 {
            format!("id_a: ends at {d_high}: must end at or above 0")
        } else if q_high < max_current_a {
            format!("iq_a: ends at {q_high}: must end at or above max_current_a, {max_current_a}")
        } else {
            return Ok(());
        };
        Err(InputError::new(file, None, problem))
    }
}

fn read_nodes(text: &[u8], file: &Path) -> Result<Vec<Node>, InputError> {
    let refuse = |line: Option<u64>, problem: String| InputError::new(file, line, problem);
    let line_of = |position: &csv::Position| line_of(text, position);
    let mut reader =
        csv::ReaderBuilder::new().comment(Some(b'#')).trim(csv::Trim::All).flexible(true).from_reader(text);
    let headers = reader.headers().map_err(|error| refuse(None, error.to_string()))?;
    if headers.iter().ne(COLUMNS) {
        let line = headers.position().map(line_of);
        let found = headers.iter().collect::<Vec<_>>().join(",");
        return Err(refuse(line, format!("header: {found}: must be {}", COLUMNS.join(","))));
    }
    let mut nodes = Vec::new();
    for record in reader.records() {
        let record = record.map_err(|error| {
            let line = error.position().map(line_of);
            refuse(line, format!("{}: {error}: must be four numbers", COLUMNS.join(",")))
        })?;
        let line = record.position().map_or(0, line_of);
        if record.len() != COLUMNS.len() {
            let found = record.iter().collect::<Vec<_>>().join(",");
            let problem = format!("{}: {found}: must be four numbers", COLUMNS.join(","));
            return Err(refuse(Some(line), problem));
        }
        let mut values = [0.0; 4];
        for ((value, field), column) in values.iter_mut().zip(&record).zip(COLUMNS) {
            let largest = if column.ends_with("_a") { LARGEST_CURRENT_A } else { LARGEST_FLUX_WB };
            *value = match field.parse::<f64>() {
                // Adding zero turns −0 into 0.
                Ok(number) if number.is_finite() && number.abs() <= largest => number + 0.0,
                Ok(number) if number.is_finite() => {
                    let problem = format!("{column}: {field}: must be from {} to {largest}", -largest);
                    return Err(refuse(Some(line), problem));
                }
                _ => return Err(refuse(Some(line), format!("{column}: {field}: must be a finite number"))),
            };
        }
        let [id, iq, psi_d, psi_q] = values;
        nodes.push(Node { line, id, iq, psi_d, psi_q });
    }
    Ok(nodes)
}

/// The line of the record for which the reader starts looking at a position: the reader counts from before the comments and empty lines that it
/// skips.
pub fn line_of(text: &[u8], position: &csv::Position) -> u64 {
    let rest = text.get(position.byte() as usize..).unwrap_or_default();
    let skipped = |line: &&[u8]| line.first().is_none_or(|first| *first == b'#' || *first == b'\r');
    position.line() + rest.split(|byte| *byte == b'\n').take_while(skipped).count() as u64
}

/// The grid's axes: the distinct values, evenly spaced.
fn axes(nodes: &[Node], file: &Path) -> Result<(Vec<f64>, Vec<f64>), InputError> {
    let axis = |name: &str, value: fn(&Node) -> f64| {
        let mut values: Vec<_> = nodes.iter().map(|node| (value(node), node.line)).collect();
        values.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        values.dedup_by(|a, b| a.0 == b.0);
        if values.len() < 4 {
            let count = values.len();
            return Err(InputError::new(file, None, format!("{name}: {count} values: must be at least 4")));
        }
        let last = values.len() - 1;
        let mean = (values[last].0 - values[0].0) / last as f64;
        let off = |k: usize, step: f64| (values[k].0 - values[0].0 - step * k as f64).abs();
        if (0..=last).any(|k| off(k, mean) > STEP_TOLERANCE * mean) {
            // The first step that deviates from the first one is the one to report.
            let step = values[1].0 - values[0].0;
            let odd = (2..=last).find(|k| off(*k, step) > STEP_TOLERANCE * step).unwrap_or(last);
            let (found, line) = values[odd];
            let even = values[0].0 + step * odd as f64;
            let problem = format!("{name}: {found}: must be {even}, on an even grid of step {step}");
            return Err(InputError::new(file, Some(line), problem));
        }
        Ok(values.into_iter().map(|(value, _)| value).collect::<Vec<_>>())
    };
    let (id, iq) = (axis("id_a", |node| node.id)?, axis("iq_a", |node| node.iq)?);
    if iq[0] > 0.0 {
        let problem = format!("iq_a: begins at {}: must begin at 0, or at minus its end", iq[0]);
        return Err(InputError::new(file, None, problem));
    }
    Ok((id, iq))
}

/// Checks that every node occurs once; they come in the grid's order, iq running faster, whether they were `sorted` so in the file or not.
fn check_grid(nodes: &[Node], id: &[f64], iq: &[f64], sorted: bool, file: &Path) -> Result<(), InputError> {
    if let Some(twins) = nodes.windows(2).find(|pair| pair[0].place(&pair[1]).is_eq()) {
        let (Node { id, iq, line, .. }, earlier) = (twins[1], twins[0].line);
        let problem = format!("id_a,iq_a: {id},{iq}: duplicate of line {earlier}: must be there once");
        return Err(InputError::new(file, Some(line), problem));
    }
    let mut expected = id.iter().flat_map(|d| iq.iter().map(move |q| (*d, *q)));
    let mut found = nodes.iter();
    let missing = expected.find_map(|(d, q)| match found.next() {
        Some(node) if (node.id, node.iq) == (d, q) => None,
        next => Some((d, q, next.filter(|_| sorted))),
    });
    match missing {
        None => Ok(()),
        Some((d, q, None)) => {
            Err(InputError::new(file, None, format!("id_a,iq_a: {d},{q}: missing: must be there")))
        }
        Some((d, q, Some(next))) => {
            let problem = format!("id_a,iq_a: {d},{q}: missing before this line: must be there");
            Err(InputError::new(file, Some(next.line), problem))
        }
    }
}

/// Checks that flux rises with its own current.
fn check_monotone(nodes: &[Node], columns: usize, file: &Path) -> Result<(), InputError> {
    for (k, node) in nodes.iter().enumerate() {
        let neighbours = [
            (k >= columns, k.wrapping_sub(columns), "psi_d_wb", "id_a"),
            (!k.is_multiple_of(columns), k.wrapping_sub(1), "psi_q_wb", "iq_a"),
        ];
        for (exists, index, column, current) in neighbours {
            if !exists {
                continue;
            }
            let before = &nodes[index];
            let (value, last) =
                if column == "psi_d_wb" { (node.psi_d, before.psi_d) } else { (node.psi_q, before.psi_q) };
            if value <= last {
                let problem = format!(
                    "{column}: {value}: must rise with {current}, above {last} of line {}",
                    before.line
                );
                return Err(InputError::new(file, Some(node.line), problem));
            }
        }
    }
    Ok(())
}

fn largest(nodes: &[Node]) -> f64 {
    nodes.iter().map(|node| node.psi_d.abs().max(node.psi_q.abs())).fold(0.0, f64::max)
}

/// Checks that ψd is even and ψq odd in iq, within the tolerance; then makes them exactly so.
fn check_even(nodes: &[Node], iq: &[f64], file: &Path) -> Result<FluxMap, InputError> {
    let columns = iq.len();
    let span = iq[columns - 1] + iq[0];
    if span.abs() > STEP_TOLERANCE * (iq[1] - iq[0]) {
        let problem =
            format!("iq_a: from {} to {}: must be symmetric about 0, or begin at 0", iq[0], iq[columns - 1]);
        return Err(InputError::new(file, None, problem));
    }
    let tolerance = SYMMETRY_TOLERANCE * largest(nodes);
    let (mut psi_d_wb, mut psi_q_wb) = (Vec::with_capacity(nodes.len()), Vec::with_capacity(nodes.len()));
    for (k, node) in nodes.iter().enumerate() {
        let twin = &nodes[k - k % columns + columns - 1 - k % columns];
        let odd = [("psi_d_wb", node.psi_d, twin.psi_d), ("psi_q_wb", node.psi_q, -twin.psi_q)];
        for (column, value, image) in odd {
            if (value - image).abs() > tolerance {
                let problem = format!(
                    "{column}: {value}: must be {image} ± {tolerance:.4}, the mirror image of line {}",
                    twin.line
                );
                return Err(InputError::new(file, Some(node.line), problem));
            }
        }
        psi_d_wb.push(0.5 * (node.psi_d + twin.psi_d));
        psi_q_wb.push(0.5 * (node.psi_q - twin.psi_q));
    }
    Ok(FluxMap { id_a: Vec::new(), iq_a: iq.to_vec(), psi_d_wb, psi_q_wb })
}

/// Makes both signs of iq from one: ψd even, ψq odd, which is 0 at iq = 0.
fn mirror(nodes: &[Node], iq: &[f64], file: &Path) -> Result<FluxMap, InputError> {
    let tolerance = SYMMETRY_TOLERANCE * largest(nodes);
    let (mut psi_d_wb, mut psi_q_wb) = (Vec::new(), Vec::new());
    for row in nodes.chunks(iq.len()) {
        let centre = &row[0];
        if centre.psi_q.abs() > tolerance {
            let problem = format!("psi_q_wb: {}: must be 0 ± {tolerance:.4} at iq = 0", centre.psi_q);
            return Err(InputError::new(file, Some(centre.line), problem));
        }
        let rest = &row[1..];
        psi_d_wb.extend(rest.iter().rev().chain(row).map(|node| node.psi_d));
        psi_q_wb.extend(rest.iter().rev().map(|node| -node.psi_q));
        psi_q_wb.push(0.0);
        psi_q_wb.extend(rest.iter().map(|node| node.psi_q));
    }
    let negative = iq[1..].iter().rev().map(|value| -value);
    Ok(FluxMap { id_a: Vec::new(), iq_a: negative.chain(iq.iter().copied()).collect(), psi_d_wb, psi_q_wb })
}

/// Mean incremental inductances of a cell, in H, and the current of its first corner.
struct Cell {
    id: f64,
    iq: f64,
    ldd: f64,
    ldq: f64,
    lqd: f64,
    lqq: f64,
}

impl FluxMap {
    fn cells(&self) -> impl Iterator<Item = Cell> + '_ {
        let (rows, columns) = (self.id_a.len(), self.iq_a.len());
        let (step_d, step_q) = (self.id_a[1] - self.id_a[0], self.iq_a[1] - self.iq_a[0]);
        let all = (0..rows - 1).flat_map(move |r| (0..columns - 1).map(move |c| (r, c)));
        all.map(move |(r, c)| {
            let corner = |values: &[f64], dr: usize, dc: usize| values[(r + dr) * columns + c + dc];
            let along_d = |values: &[f64]| {
                0.5 * (corner(values, 1, 0) - corner(values, 0, 0) + corner(values, 1, 1)
                    - corner(values, 0, 1))
                    / step_d
            };
            let along_q = |values: &[f64]| {
                0.5 * (corner(values, 0, 1) - corner(values, 0, 0) + corner(values, 1, 1)
                    - corner(values, 1, 0))
                    / step_q
            };
            Cell {
                id: self.id_a[r],
                iq: self.iq_a[c],
                ldd: along_d(&self.psi_d_wb),
                ldq: along_q(&self.psi_d_wb),
                lqd: along_d(&self.psi_q_wb),
                lqq: along_q(&self.psi_q_wb),
            }
        })
    }

    /// Checks ∂ψd/∂iq = ∂ψq/∂id: a machine stores energy and returns it. With the means over a cell this says that ψ does not circulate around it.
    fn check_reciprocity(&self, nodes: &[Node], file: &Path) -> Result<(), InputError> {
        let self_h = self.cells().map(|cell| cell.ldd.max(cell.lqq)).fold(0.0, f64::max);
        let tolerance = RECIPROCITY_TOLERANCE * self_h;
        let gap = |cell: &Cell| (cell.ldq - cell.lqd).abs();
        let worst = self.cells().max_by(|a, b| gap(a).total_cmp(&gap(b)));
        match worst {
            Some(cell) if gap(&cell) > tolerance => Err(InputError::new(
                file,
                line_at(nodes, &cell),
                format!(
                    "psi_d_wb,psi_q_wb: dpsi_d/diq {:.3e} H and dpsi_q/did {:.3e} H from id {}, iq {} on: must agree within {tolerance:.3e} H",
                    cell.ldq, cell.lqd, cell.id, cell.iq
                ),
            )),
            _ => Ok(()),
        }
    }

    /// Checks Ldd Lqq > Ldq Lqd: exactly one current for each flux linkage.
    fn check_invertible(&self, nodes: &[Node], file: &Path) -> Result<(), InputError> {
        match self.cells().find(|cell| cell.ldd * cell.lqq <= cell.ldq * cell.lqd) {
            Some(cell) => Err(InputError::new(
                file,
                line_at(nodes, &cell),
                format!(
                    "psi_d_wb,psi_q_wb: cross inductances {:.3e} H and {:.3e} H from id {}, iq {} on: their product must be below that of the self inductances {:.3e} H and {:.3e} H",
                    cell.ldq, cell.lqd, cell.id, cell.iq, cell.ldd, cell.lqq
                ),
            )),
            None => Ok(()),
        }
    }
}

/// The line of a cell's first corner, or of its mirror image.
fn line_at(nodes: &[Node], cell: &Cell) -> Option<u64> {
    let own = nodes.iter().find(|node| (node.id, node.iq) == (cell.id, cell.iq));
    let image = || nodes.iter().find(|node| (node.id, node.iq) == (cell.id, -cell.iq));
    own.or_else(image).map(|node| node.line)
}

#[cfg(test)]
mod tests;
