//! The response of the currents to the first pulses: the order and the signs of the current sensors.
//!
//! A machine's current responds to volt-seconds by the inverse of its inductance, which is symmetric and has positive eigenvalues at any rotor
//! position. With sensors in another order or with another sign the response is no such matrix; the true wiring is the one with which it would be.

use crate::bench::Wiring;
use tractive::identification::{Observation, Stage};

/// A matrix by its rows.
type Matrix = [[f64; 2]; 2];

/// Limits for a matrix that may be a machine's: largest asymmetry, as a share of the trace, and largest ratio of the eigenvalues.
const ASYMMETRY: f64 = 0.5;
const RATIO: f64 = 100.0;
/// Number of halves that are used.
const LAST: usize = 20;

/// The wiring of the current sensors with which the response to the probe's pulses is a machine's, among those in which the sensors have the same
/// sign. `None` if there is none, or if there are no pulses.
pub fn wiring(observations: &[Observation]) -> Option<Wiring> {
    let answers = response(observations)?;
    let explains =
        |wiring: &Wiring| inverse(wiring.matrix()).is_some_and(|wires| is_machine(times(wires, answers)));
    Wiring::of_one_sign().into_iter().find(explains)
}

fn is_machine([[xx, xy], [yx, yy]]: Matrix) -> bool {
    let (trace, determinant) = (xx + yy, xx * yy - xy * yx);
    // For eigenvalues 1 and k: (1 + k)² / k.
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

/// Change of current per volt-second, stationary frame, by least squares over the probe's last halves, in which pulses lie along both axes.
fn response(observations: &[Observation]) -> Option<Matrix> {
    let (mut squares, mut sides) = ([[0.0; 2]; 2], [[0.0; 2]; 2]);
    let probe = observations.iter().filter(|of| of.stage == Stage::Probe).count();
    for pair in observations[probe.saturating_sub(LAST)..].windows(2).take(LAST) {
        let [before, after] = pair else { continue };
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
