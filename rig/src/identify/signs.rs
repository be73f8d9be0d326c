//! Signs of sensors and the angle's zero and direction, as an experiment's observations tell them.

use super::fit::Fit;
use core::f64::consts::PI;
use tractive::identification::{Observation, Stage};

/// Angles that are near zero where everything is connected as it is said to be.
#[derive(Clone, Copy, Debug)]
pub struct Signs {
    /// From the volt-seconds to the change of current that they make in the pulses along d, stationary frame, in degrees: 180 of currents
    /// that are read with the wrong sign, and far from 0 where phases are exchanged.
    pub response_deg: f64,
    /// From where the angle says that the d axis is to where it is, electrical, in degrees: the error of the angle's zero, as the fit has found
    /// it; near 180 where the magnets lie the other way round.
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

/// Flux linkage along −d without current, as a share of that of the largest current along q, that tells magnets the other way round.
const NEGATIVE_SHARE: f64 = 0.02;

impl Signs {
    /// Of the observations, turned to the d axis that the fit has found, with the machine that it has found and its largest current, in A.
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
        // The pulses tell an axis; which way the magnets lie on it the map does.
        let half_a_turn_off = fit.flux(0.0, 0.0).0 < -NEGATIVE_SHARE * fit.flux(0.0, bound_a).1;
        let zero_deg = fit.zero_rad.to_degrees();
        Self {
            response_deg: degrees(response),
            zero_deg: if half_a_turn_off { zero_deg + 180.0 } else { zero_deg },
        }
    }
}

/// Halves along either axis from which the saliency is told, at least; largest current of one, as a share of the bound; and the least ratio of
/// both inductances.
const LEAST_HALVES: usize = 10;
const SMALL_SHARE: f64 = 0.4;
const LEAST_RATIO: f64 = 1.05;

/// The angle by which the axis of the lower inductance lies ahead of where the angle says that d is, electrical, in degrees from −90 to 90, as
/// the pulses along d and along q show it at small currents: they need no rotor that turns. Without pulses along q a part of the angle, the greater, the
/// more salient the machine is. `None` where there are too few pulses, or no saliency.
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
