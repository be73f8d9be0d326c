//! The response of the currents to the first pulses: the order and the signs of the current sensors.
//!
//! A machine's current responds to volt-seconds by the inverse of its inductance, which is symmetric and has positive eigenvalues at any rotor
//! position. With sensors in another order or with another sign the response is no such matrix; the true wiring is the one with which it would be.

use crate::bench::Wiring;
use tractive::identification::{Noise, Observation, QUIET_CHANGES, Stage};

/// A matrix by its rows.
type Matrix = [[f64; 2]; 2];

/// Limits for a matrix that may be a machine's: largest asymmetry, as a share of the trace, and largest ratio of the eigenvalues.
const ASYMMETRY: f64 = 0.5;
const RATIO: f64 = 100.0;
/// Number of halves that are used.
const LAST: usize = 20;
/// Least share of the squares of the changes of current that a response explains: a machine's, through any wiring, explains 0.98 with as much noise as the
/// experiment takes.
const EXPLAINED: f64 = 0.8;
/// Volt-seconds over those of the link from which on there is a pulse: the first is 0.0015, and rounding far less.
const PULSE: f32 = 1e-4;

/// The wiring of the current sensors with which the response to the probe's pulses is a machine's, among those in which the sensors have the same
/// sign. `None` if there is none, or if there are no pulses.
pub fn wiring(observations: &[Observation]) -> Option<Wiring> {
    let answers = response(observations)?;
    let explains =
        |wiring: &Wiring| inverse(wiring.matrix()).is_some_and(|wires| is_machine(times(wires, answers)));
    Wiring::of_one_sign().into_iter().find(explains)
}

/// The noise of a phase's reading, root mean square, in A, by the newest readings before the first pulse.
pub fn noise_a(observations: &[Observation], bound_a: f64) -> f64 {
    let probe = observations.iter().take_while(|of| of.stage == Stage::Probe && !has_pulse(of)).count();
    let quiet = &observations[probe.saturating_sub(QUIET_CHANGES + 1)..probe];
    let mut noise = Noise::UNKNOWN;
    for pair in quiet.windows(2) {
        let [before, after] = pair else { continue };
        noise.shows(after.current - before.current, bound_a as f32);
    }
    noise.phase_a().into()
}

/// `true` if a voltage has acted.
pub fn has_pulse(of: &Observation) -> bool {
    of.volt_seconds.squared() > (PULSE * of.udc_v * of.length_s).powi(2)
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

/// Change of current per volt-second, stationary frame, by least squares over the probe's last halves, in which pulses lie along both axes; `None` if it does
/// not explain the changes.
fn response(observations: &[Observation]) -> Option<Matrix> {
    let (mut squares, mut sides, mut changes) = ([[0.0; 2]; 2], [[0.0; 2]; 2], 0.0);
    let probe = observations.iter().filter(|of| of.stage == Stage::Probe).count();
    for pair in observations[probe.saturating_sub(LAST)..].windows(2).take(LAST) {
        let [before, after] = pair else { continue };
        let [from, to] = [before, after].map(|of| of.current.unpark(of.frame));
        let acted = [after.volt_seconds.alpha, after.volt_seconds.beta].map(f64::from);
        let change = [to.alpha - from.alpha, to.beta - from.beta].map(f64::from);
        changes += change[0] * change[0] + change[1] * change[1];
        for (row, k) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
            squares[row][k] += acted[row] * acted[k];
            sides[row][k] += change[row] * acted[k];
        }
    }
    let scale = squares[0][0] + squares[1][1];
    let scaled = squares.map(|row| row.map(|value| value / scale));
    let found = times(sides, inverse(scaled)?);
    let explained: f64 = found.iter().flatten().zip(sides.iter().flatten()).map(|(of, side)| of * side).sum();
    // What was found is so many times the response, and not a number without pulses.
    (explained > EXPLAINED * changes * scale).then_some(found)
}

#[cfg(test)]
mod tests {
    use super::*;
    use tractive::frames::{AlphaBeta, Dq, SinCos};

    /// Pulses along both axes, whose current answers so much, in A, beside a current of its own, in A, to and fro.
    fn observed(answer_a: f32, own_a: f32) -> Vec<Observation> {
        let mut current = Dq { d: 0.0, q: 0.0 };
        let of = |k: usize| {
            let [alpha, beta] = [[0.0, 1.0], [1.0, 0.0], [0.0, -1.0], [-1.0, 0.0]][k % 4];
            current = Dq { d: current.d + answer_a * alpha, q: current.q + answer_a * beta };
            let own = if (k / 3).is_multiple_of(2) { own_a } else { -own_a };
            Observation {
                stage: Stage::Probe,
                volt_seconds: AlphaBeta { alpha: 0.1 * alpha, beta: 0.1 * beta },
                length_s: 5e-4,
                current: Dq { d: current.d + own, q: current.q - own },
                frame: SinCos { sin: 0.0, cos: 1.0 },
                udc_v: 1_500.0,
            }
        };
        (0..24).map(of).collect()
    }

    #[test]
    fn an_order_is_told_only_where_the_currents_answer_the_pulses() {
        assert_eq!(wiring(&observed(10.0, 0.0)).map(|wiring| wiring.to_string()).as_deref(), Some("u,v,w"));
        assert_eq!(
            wiring(&observed(-10.0, 0.5)).map(|wiring| wiring.to_string()).as_deref(),
            Some("-u,-v,-w")
        );
        assert_eq!(wiring(&observed(-1.0, 10.0)), None);
        assert!(observed(1.0, 0.0).iter().all(has_pulse));
    }
}
