//! `flux_map.csv`: the nodes of the flux map, and what a flux map must be.

use crate::InputError;
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
/// Deviation from an even grid that is rounding, as a share of the step.
const STEP_TOLERANCE: f64 = 1e-6;
/// Deviation from ψd even, ψq odd in iq that is measurement, as a share of the largest flux.
const SYMMETRY_TOLERANCE: f64 = 0.01;
/// Deviation between ∂ψd/∂iq and ∂ψq/∂id that is measurement, as a share of the largest self inductance.
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

impl FluxMap {
    /// Reads and checks the file.
    ///
    /// # Errors
    /// Names the line, the column, the value and what is allowed.
    pub fn read(file: &Path) -> Result<Self, InputError> {
        let nodes = read_nodes(file)?;
        let (id_a, iq_a) = axes(&nodes, file)?;
        check_order(&nodes, &id_a, &iq_a, file)?;
        check_monotone(&nodes, iq_a.len(), file)?;
        let whole =
            if iq_a[0] < 0.0 { check_even(&nodes, &iq_a, file)? } else { mirror(&nodes, &iq_a, file)? };
        check_reciprocity(&whole, &nodes, file)?;
        Ok(Self { id_a, ..whole })
    }

    /// The grid must cover currents up to `max_current_a`.
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

fn read_nodes(file: &Path) -> Result<Vec<Node>, InputError> {
    let refuse = |line: Option<u64>, problem: String| InputError::new(file, line, problem);
    let mut reader = csv::ReaderBuilder::new()
        .comment(Some(b'#'))
        .trim(csv::Trim::All)
        .from_path(file)
        .map_err(|error| refuse(None, format!("cannot be read: {error}")))?;
    let headers = reader.headers().map_err(|error| refuse(None, error.to_string()))?;
    if headers.iter().ne(COLUMNS) {
        let line = headers.position().map(csv::Position::line);
        let found = headers.iter().collect::<Vec<_>>().join(",");
        return Err(refuse(line, format!("header: {found}: must be {}", COLUMNS.join(","))));
    }
    let mut nodes = Vec::new();
    for record in reader.records() {
        let record = record.map_err(|error| {
            let line = error.position().map(csv::Position::line);
            refuse(line, format!("{error}: must be four numbers"))
        })?;
        let line = record.position().map_or(0, csv::Position::line);
        let mut values = [0.0; 4];
        for ((value, field), column) in values.iter_mut().zip(&record).zip(COLUMNS) {
            *value = match field.parse::<f64>() {
                Ok(number) if number.is_finite() => number,
                _ => return Err(refuse(Some(line), format!("{column}: {field}: must be a finite number"))),
            };
        }
        let [id, iq, psi_d, psi_q] = values;
        nodes.push(Node { line, id, iq, psi_d, psi_q });
    }
    Ok(nodes)
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
        let step = (values[last].0 - values[0].0) / last as f64;
        for (k, (found, line)) in values.iter().enumerate() {
            let even = values[0].0 + step * k as f64;
            if (found - even).abs() > STEP_TOLERANCE * step {
                let problem = format!("{name}: {found}: must be {even}, on an even grid of step {step}");
                return Err(InputError::new(file, Some(*line), problem));
            }
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

/// Every node once, iq running faster.
fn check_order(nodes: &[Node], id: &[f64], iq: &[f64], file: &Path) -> Result<(), InputError> {
    let expected = id.iter().flat_map(|d| iq.iter().map(move |q| (*d, *q)));
    let mut found = nodes.iter();
    for (d, q) in expected {
        let Some(node) = found.next() else {
            return Err(InputError::new(file, None, format!("id_a,iq_a: {d},{q}: missing: must be there")));
        };
        if (node.id, node.iq) == (d, q) {
            continue;
        }
        let here = format!("id_a,iq_a: {},{}", node.id, node.iq);
        let earlier = nodes.iter().find(|other| (other.id, other.iq) == (node.id, node.iq));
        let problem = match earlier {
            Some(other) if other.line < node.line => {
                format!("{here}: duplicate of line {}: must be there once", other.line)
            }
            _ if nodes.iter().any(|other| (other.id, other.iq) == (d, q)) => {
                format!("{here}: unsorted: must be {d},{q} (id ascending, iq ascending within)")
            }
            _ => format!("id_a,iq_a: {d},{q}: missing before this line: must be there"),
        };
        return Err(InputError::new(file, Some(node.line), problem));
    }
    match found.next() {
        Some(node) => Err(InputError::new(
            file,
            Some(node.line),
            format!("id_a,iq_a: {},{}: duplicate: must be there once", node.id, node.iq),
        )),
        None => Ok(()),
    }
}

/// Flux rises with its own current.
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

/// ψd even and ψq odd in iq, within the tolerance; then made so exactly.
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

/// Both signs of iq from one: ψd even, ψq odd, which is 0 at iq = 0.
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

/// ∂ψd/∂iq = ∂ψq/∂id: a machine that stores energy and gives it back. Checked on every cell by the circulation of
/// ψ around it.
fn check_reciprocity(map: &FluxMap, nodes: &[Node], file: &Path) -> Result<(), InputError> {
    let columns = map.iq_a.len();
    let rows = map.psi_d_wb.len() / columns;
    let step_d = (nodes[nodes.len() - 1].id - nodes[0].id) / (rows - 1) as f64;
    let step_q = map.iq_a[1] - map.iq_a[0];
    let node = |r: usize, c: usize| (map.psi_d_wb[r * columns + c], map.psi_q_wb[r * columns + c]);
    let mut self_h: f64 = 0.0;
    let mut worst = (0.0, 0, 0, 0.0, 0.0);
    for r in 0..rows - 1 {
        for c in 0..columns - 1 {
            let (a, b, d, e) = (node(r, c), node(r, c + 1), node(r + 1, c), node(r + 1, c + 1));
            self_h = self_h.max((d.0 - a.0) / step_d).max((b.1 - a.1) / step_q);
            let ldq = 0.5 * ((b.0 - a.0) + (e.0 - d.0)) / step_q;
            let lqd = 0.5 * ((d.1 - a.1) + (e.1 - b.1)) / step_d;
            if (ldq - lqd).abs() > worst.0 {
                worst = ((ldq - lqd).abs(), r, c, ldq, lqd);
            }
        }
    }
    let (gap, r, c, ldq, lqd) = worst;
    if gap <= RECIPROCITY_TOLERANCE * self_h {
        return Ok(());
    }
    let (id, iq) = (nodes[0].id + step_d * r as f64, map.iq_a[c]);
    let at = nodes
        .iter()
        .find(|node| (node.id - id).abs() < 0.5 * step_d && (node.iq - iq.abs()).abs() < 0.5 * step_q);
    Err(InputError::new(
        file,
        at.map(|node| node.line),
        format!(
            "psi_d_wb,psi_q_wb: near id {id}, iq {iq}: dpsi_d/diq {ldq:.3e} H and dpsi_q/did {lqd:.3e} H: must agree within {:.3e} H",
            RECIPROCITY_TOLERANCE * self_h
        ),
    ))
}
