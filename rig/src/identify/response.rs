//! The response of the currents to the first pulses: the order and the signs of the current sensors.
//!
//! A machine's current answers volt-seconds by the inverse of its inductance, which is symmetric and has positive eigenvalues, wherever the rotor
//! stands. Of sensors in another order or of another sign what answers is no such matrix; the wires with which it would be one are those.

use crate::bench::Wiring;
use tractive::identification::{Observation, Stage};

/// A matrix by its rows.
type Matrix = [[f64; 2]; 2];

/// Largest asymmetry, as a share of the trace, and largest ratio of the eigenvalues of what may be a machine.
const ASYMMETRY: f64 = 0.15;
const RATIO: f64 = 40.0;
/// Volt-seconds of a pulse that counts, at least, as a share of those of the longest.
const LEAST_SHARE: f32 = 0.5;

/// The wires of the current sensors as the probe's pulses show them: of those that explain the response the ones with the fewest changes. `None`
/// where nothing explains it, or there are no pulses.
pub fn wiring(observations: &[Observation]) -> Option<Wiring> {
    let answers = response(observations)?;
    Wiring::every()
        .into_iter()
        .find(|wiring| inverse(wiring.matrix()).is_some_and(|wires| is_machine(times(wires, answers))))
}

fn is_machine([[xx, xy], [yx, yy]]: Matrix) -> bool {
    let (trace, determinant) = (xx + yy, xx * yy - xy * yx);
    // Of eigenvalues 1 and k: (1 + k)² / k.
    let spread = trace * trace / determinant;
    trace > 0.0
        && determinant > 0.0
        && (xy - yx).abs() < ASYMMETRY * trace
        && spread < (1.0 + RATIO).powi(2) / RATIO
}

fn times(a: Matrix, b: Matrix) -> Matrix {
    a.map(|row| [0, 1].map(|k| row[0] * b[0][k] + row[1] * b[1][k]))
}

fn inverse([[a, b], [c, d]]: Matrix) -> Option<Matrix> {
    let determinant = a * d - b * c;
    (determinant.abs() > 1e-9).then(|| [[d, -b], [-c, a]].map(|row| row.map(|value| value / determinant)))
}

/// Change of current of a volt-second, stationary frame, by least squares over the probe's halves. Of the shortest pulses the dead time leaves too
/// little.
fn response(observations: &[Observation]) -> Option<Matrix> {
    let (mut squares, mut sides) = ([[0.0; 2]; 2], [[0.0; 2]; 2]);
    let size = |of: &Observation| of.volt_seconds.alpha.hypot(of.volt_seconds.beta);
    let probe = observations.iter().filter(|of| of.stage == Stage::Probe);
    let least = LEAST_SHARE * probe.map(size).fold(0.0, f32::max);
    for pair in observations.windows(2) {
        let [before, after] = pair else { continue };
        if before.stage != Stage::Probe || size(after) < least {
            continue;
        }
        let [from, to] = [before, after].map(|of| of.current.unpark(of.frame));
        let acted = [after.volt_seconds.alpha, after.volt_seconds.beta].map(f64::from);
        let change = [to.alpha - from.alpha, to.beta - from.beta].map(f64::from);
        for (row, k) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
            squares[row][k] += acted[row] * acted[k];
            sides[row][k] += change[row] * acted[k];
        }
    }
    let scale = squares[0][0] + squares[1][1];
    let scaled = squares.map(|row| row.map(|value| value / scale));
    let found = times(sides, inverse(scaled)?);
    found.iter().flatten().all(|value| value.is_finite()).then_some(found)
}
