//! Signs of sensors and the angle's zero and direction, as determined from an experiment's observations.

use super::fit::Fit;
use core::f64::consts::PI;
use tractive::identification::{Observation, Stage};

/// Angles that are near zero if everything is connected as stated.
#[derive(Clone, Copy, Debug)]
pub struct Signs {
    /// Angle from the volt-seconds to the resulting change of current in the pulses along d, stationary frame, in degrees: 180 for currents read with
    /// the wrong sign, and far from 0 if phases are swapped.
    pub response_deg: f64,
    /// Angle from the stated d axis to the true one, electrical, in degrees: the error of the angle's zero, as found by the fit; near 180 if the
    /// magnets are reversed.
    pub zero_deg: f64,
}

/// A vector as real and imaginary part.
type Vector = (f64, f64);

fn times((a, b): Vector, (c, d): Vector) -> Vector {
    (a * c - b * d, a * d + b * c)
}

fn conjugate((a, b): Vector) -> Vector {
    (a, -b)
}

fn degrees((a, b): Vector) -> f64 {
    b.atan2(a) * 180.0 / PI
}

/// Direction of the rotor's d axis.
fn direction(of: &Observation) -> Vector {
    (of.frame.cos.into(), of.frame.sin.into())
}

/// Flux linkage along −d without current, as a share of that of the largest current along q, beyond which the magnets are taken as reversed.
const NEGATIVE_SHARE: f64 = 0.02;

impl Signs {
    /// Made from the observations, turned to the d axis of the fit, with the fit's machine and its largest current, in A.
    pub fn of(observations: &[Observation], fit: &Fit, bound_a: f64) -> Self {
        let mut response = (0.0, 0.0);
        for pair in observations.windows(2) {
            let [before, after] = pair else { continue };
            if !matches!(after.stage, Stage::Probe | Stage::AlongD) {
                continue;
            }
            let volt_seconds = (f64::from(after.volt_seconds.alpha), f64::from(after.volt_seconds.beta));
            let [from, to] =
                [before, after].map(|of| times((of.current.d.into(), of.current.q.into()), direction(of)));
            let change = times((to.0 - from.0, to.1 - from.1), conjugate(volt_seconds));
            response = (response.0 + change.0, response.1 + change.1);
        }
        // The pulses determine an axis; the map determines the direction of the magnets on it.
        let half_a_turn_off = fit.flux(0.0, 0.0).0 < -NEGATIVE_SHARE * fit.flux(0.0, bound_a).1;
        let zero_deg = fit.zero_rad.to_degrees();
        Self {
            response_deg: degrees(response),
            zero_deg: if half_a_turn_off { zero_deg + 180.0 } else { zero_deg },
        }
    }
}

/// Fewest halves along either axis from which the saliency is determined; largest current of one, as a share of the bound; and the least ratio of
/// both inductances.
const LEAST_HALVES: usize = 10;
const SMALL_SHARE: f64 = 0.4;
const LEAST_RATIO: f64 = 1.05;

/// The electrical angle by which the axis of the lower inductance lies ahead of the stated d axis, in degrees from −90 to 90, from the pulses along d
/// and along q at small currents: they need no turning rotor. Without pulses along q the result is part of the angle, a larger part the more salient the
/// machine is. `None` if there are too few pulses, or no saliency.
pub fn saliency_deg(observations: &[Observation], bound_a: f64) -> Option<f64> {
    // Least squares of change = Y · volt-seconds: sums of the right sides and of the volt-seconds' squares.
    let (mut halves, mut sides, mut squares) = ([0_usize; 2], [[0.0; 2]; 2], [[0.0; 2]; 2]);
    for pair in observations.windows(2) {
        let [before, after] = pair else { continue };
        let axis = match after.stage {
            Stage::Probe | Stage::AlongD => 0,
            Stage::AlongQ => 1,
            _ => continue,
        };
        let at = direction(before);
        let [from, to] = [before, after]
            .map(|of| times(times((of.current.d.into(), of.current.q.into()), direction(of)), conjugate(at)));
        if from.0.hypot(from.1).max(to.0.hypot(to.1)) > SMALL_SHARE * bound_a {
            continue;
        }
        let volt_seconds = (f64::from(after.volt_seconds.alpha), f64::from(after.volt_seconds.beta));
        let (d, q) = times(volt_seconds, conjugate(at));
        halves[axis] += 1;
        for (k, change) in [to.0 - from.0, to.1 - from.1].into_iter().enumerate() {
            sides[k] = [sides[k][0] + change * d, sides[k][1] + change * q];
        }
        squares[0] = [squares[0][0] + d * d, squares[0][1] + d * q];
        squares[1][1] += q * q;
    }
    let [[dd, dq], [_, qq]] = squares;
    let determinant = dd * qq - dq * dq;
    match halves.map(|count| count >= LEAST_HALVES) {
        [true, true] if determinant > 0.0 => {}
        [true, _] => return Some(degrees((sides[0][0], sides[1][0]))),
        _ => return None,
    }
    let row = |side: [f64; 2]| {
        [(side[0] * qq - side[1] * dq) / determinant, (side[1] * dd - side[0] * dq) / determinant]
    };
    let ([y_dd, y_dq], [y_qd, y_qq]) = (row(sides[0]), row(sides[1]));
    let (mean, half) = (0.5 * (y_dd + y_qq), (0.5 * (y_dd - y_qq), 0.5 * (y_dq + y_qd)));
    let apart = half.0.hypot(half.1);
    (mean + apart > LEAST_RATIO * (mean - apart)).then(|| 0.5 * degrees(half))
}
