//! A flux map from nodes at any currents: the gradient of one co-energy, fitted by least squares.

use super::axes::GAP;
use super::ratings::rounded_down;
use super::reach::{hole_a, reach_a};
use super::samples::Sample;
use super::write::digits;
use crate::coenergy::{Basis, Equations, Polynomial};
use anyhow::{Result, anyhow, bail, ensure};
use tractive_tablegen::FluxMap;

/// Least number of nodes within the range.
const LEAST: usize = 30;
/// Largest current of a node that counts, over the largest current of the machine: nodes further away do not belong to the map.
const NEAR: f64 = 1.5;
/// Largest distance from a current to a node, over the largest current.
const HOLE: f64 = 0.2;
/// Largest rms of the nodes that are left out, and largest deviation of one node from the fit, as shares of the largest flux linkage.
const MOST_RMS: f64 = 0.01;
const MOST: f64 = 0.05;
/// Weights of the change of the flux linkages' bends relative to a node's residual; the weight that predicts left-out nodes best is used.
const SMOOTH: [f64; 7] = [1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9];
/// Share by which the polynomial's rectangle is larger than the nodes'.
const MARGIN: f64 = 0.02;
/// Steps of the grid up to the largest current, and beyond it.
const STEPS: i32 = 25;
const MORE: i32 = 2;
/// Current over the largest one up to which the polynomial is the map, as far as there are nodes: beyond it the map continues straight.
const KNOWN: f64 = 1.1;

/// A polynomial, and its deviations from the nodes, along d and q, in Wb.
struct Found {
    coenergy: Polynomial,
    left_wb: Vec<[f64; 2]>,
    /// The same for each node, as predicted by the others alone.
    left_out_wb: Vec<[f64; 2]>,
}

/// The deviations of a polynomial from the nodes, as shares of the largest flux linkage.
struct Left {
    rms: f64,
    left_out: f64,
    worst: f64,
    /// The line of the worst one.
    line: u64,
}

/// The nearest number with three digits.
fn short(value: f64) -> f64 {
    format!("{value:.2e}").parse::<f64>().unwrap_or(value) + 0.0
}

fn rms(pairs: &[[f64; 2]]) -> f64 {
    (pairs.iter().map(|[d, q]| d * d + q * q).sum::<f64>() / pairs.len() as f64).sqrt()
}

/// The map of samples up to a largest current, in A, and a description of the fit's residual. Among the polynomials that are close enough to the nodes it
/// is the one that predicts left-out nodes best of those that `check` accepts as a machine's.
///
/// # Errors
/// The reason why they are no machine's, or too few.
pub fn fitted(
    samples: &[Sample],
    most_a: f64,
    check: impl Fn(&FluxMap) -> Result<()>,
) -> Result<(FluxMap, String)> {
    let near = |sample: &&Sample| sample.values[0].hypot(sample.values[1]) <= NEAR * most_a;
    let nodes: Vec<&Sample> = samples.iter().filter(near).collect();
    let count = nodes.len();
    ensure!(count >= LEAST, "{count} nodes within {NEAR} × --max-current {most_a}: must be at least {LEAST}");
    let currents = nodes.iter().map(|node| (node.values[0], node.values[1]));
    let last_a = currents.clone().map(|(id, _)| id).fold(f64::NEG_INFINITY, f64::max);
    let (allowed_a, (d, q)) = reach_a(currents.clone(), GAP * most_a);
    ensure!(
        allowed_a >= most_a,
        "--max-current {most_a}: must be at most {}: no nodes about id {}, iq {}",
        rounded_down(allowed_a.max(f64::MIN_POSITIVE)),
        short(d * most_a),
        short(q * most_a)
    );
    if let Some((d, q)) = hole_a(currents, most_a, HOLE * most_a) {
        bail!("id {}, iq {}: must have a node within {HOLE} × --max-current {most_a}", short(d), short(q));
    }
    let from_a = rounded_down(allowed_a.min(KNOWN * most_a));
    let mut all = all(&nodes)?;
    all.sort_by(|a, b| rms(&a.left_out_wb).total_cmp(&rms(&b.left_out_wb)));
    let mut refused = None;
    for found in &all {
        let left = found.left(&nodes);
        if let Err(why) = left.check() {
            return Err(refused.unwrap_or(why));
        }
        let map = map(&found.coenergy, (most_a, from_a), last_a);
        match check(&map) {
            Ok(()) => return Ok((map, left.told(count, from_a))),
            Err(why) => refused = refused.or(Some(why)),
        }
    }
    Err(refused.unwrap_or_else(|| anyhow!("no polynomial")))
}

/// The polynomials of all weights.
fn all(nodes: &[&Sample]) -> Result<Vec<Found>> {
    let ends = |place: usize| {
        let values = nodes.iter().map(move |node| node.values[place]);
        (values.clone().fold(f64::INFINITY, f64::min), values.fold(f64::NEG_INFINITY, f64::max))
    };
    let ((first_d, last_d), (first_q, last_q)) = (ends(0), ends(1));
    let width_q = (1.0 + MARGIN) * last_q.max(-first_q);
    let width_d = (1.0 + MARGIN) * 0.5 * (last_d - first_d);
    let basis = Basis::over(0.5 * (first_d + last_d), width_d, width_q);
    let found = |weight: f64| {
        let mut equations = Equations::new(basis.len());
        for node in nodes {
            let [id, iq, psi_d, psi_q] = node.values;
            let [along_d, along_q] = basis.flux((id, iq));
            equations.add(along_d, psi_d);
            equations.add(along_q, psi_q);
        }
        equations.close_samples();
        equations.smooth(&basis, 4, weight * width_q.max(width_d).powi(3));
        let solution = equations.solve()?;
        Ok(Found {
            left_out_wb: equations.left_out(&solution),
            left_wb: solution.left.chunks_exact(2).map(|pair| [pair[0], pair[1]]).collect(),
            coenergy: Polynomial { basis: basis.clone(), terms: solution.unknowns },
        })
    };
    SMOOTH.into_iter().map(found).collect()
}

impl Found {
    fn left(&self, nodes: &[&Sample]) -> Left {
        let size = |[d, q]: [f64; 2]| d.hypot(q);
        let largest = nodes.iter().map(|node| size([node.values[2], node.values[3]])).fold(0.0, f64::max);
        let all = self.left_wb.iter().map(|pair| size(*pair)).zip(nodes);
        let (worst, line) =
            all.fold((0.0, 0), |most, (off, node)| if off > most.0 { (off, node.line) } else { most });
        let share = |wb: f64| wb / largest;
        Left {
            rms: share(rms(&self.left_wb)),
            left_out: share(rms(&self.left_out_wb)),
            worst: share(worst),
            line,
        }
    }
}

impl Left {
    /// Checks that this is noise.
    fn check(&self) -> Result<()> {
        ensure!(
            self.left_out <= MOST_RMS && self.worst <= MOST,
            "its gradient is {:.2} % of the largest flux linkage off nodes that are left out (rms; must be at most {} %), and {:.1} % off line {} (at most {} %)",
            100.0 * self.left_out,
            100.0 * MOST_RMS,
            100.0 * self.worst,
            self.line,
            100.0 * MOST
        );
        Ok(())
    }

    fn told(&self, nodes: usize, from_a: f64) -> String {
        format!(
            "fitted to {nodes} nodes, as the gradient of one co-energy: {:.2} % of the largest flux linkage is left (rms), {:.2} % of nodes that are left out, {:.2} % in line {}; beyond {from_a} A it goes on straight",
            100.0 * self.rms,
            100.0 * self.left_out,
            100.0 * self.worst,
            self.line
        )
    }
}

/// The map on a grid up to the largest current and a little more, along +d as far as there are nodes; beyond `from_a` it continues straight.
fn map(coenergy: &Polynomial, (most_a, from_a): (f64, f64), last_a: f64) -> FluxMap {
    let step_a = most_a / f64::from(STEPS);
    let last = (last_a / step_a + 1e-6).floor().clamp(0.0, f64::from(STEPS + MORE)) as i32;
    let current_a = |step: i32| digits(step_a * f64::from(step));
    let id_a: Vec<f64> = (-STEPS - MORE..=last).map(current_a).collect();
    let iq_a: Vec<f64> = (-STEPS - MORE..=STEPS + MORE).map(current_a).collect();
    let nodes = id_a.iter().flat_map(|id| iq_a.iter().map(|iq| coenergy.flux_further((*id, *iq), from_a)));
    let (psi_d_wb, psi_q_wb) = nodes.map(|(d, q)| (digits(d), digits(q))).unzip();
    FluxMap { psi_d_wb, psi_q_wb, id_a, iq_a }
}
