//! A carrier period of the nine switches, seen as the papers do: the states of the legs, and the vectors by their names.

use super::super::sheet::Point;
use core::f64::consts::TAU;
use tractive::frames::Angle;
use tractive::nine_switch::{LegState, MotorVoltage, Period, Request, Scheme, step};

/// The legs' states of V1 to V15, the paper's table 1.
pub const VECTORS: [[i8; 3]; 15] = [
    [1, 0, 0],
    [1, 1, 0],
    [0, 1, 0],
    [0, 1, 1],
    [0, 0, 1],
    [1, 0, 1],
    [-1, 1, 1],
    [-1, -1, 1],
    [1, -1, 1],
    [1, -1, -1],
    [1, 1, -1],
    [-1, 1, -1],
    [1, 1, 1],
    [0, 0, 0],
    [-1, -1, -1],
];

/// The number of the first zero vector.
pub const FIRST_ZERO: usize = 13;

/// The voltages of the upper and the lower motor that a state of the legs gives, α and β as shares of the link's.
pub fn voltages(legs: [i8; 3]) -> [Point; 2] {
    let nodes = legs.map(|leg| {
        let state = match leg {
            1 => LegState::One,
            0 => LegState::Zero,
            _ => LegState::MinusOne,
        };
        let (upper, lower) = state.nodes();
        [f64::from(upper), f64::from(lower)]
    });
    [0, 1].map(|motor| {
        let [u, v, w] = nodes.map(|leg| leg[motor]);
        ((2.0 * u - v - w) / 3.0, (v - w) / 3.0_f64.sqrt())
    })
}

/// A period's gates for two motors, their voltages' angles in degrees beside their indices.
pub fn period(scheme: Scheme, upper: (f64, f32), lower: (f64, f32), shoot_through: f32) -> Option<Period> {
    let motor = |(degrees, modulation_index): (f64, f32)| MotorVoltage {
        angle: Angle::from_radians((degrees / 360.0 * TAU) as f32),
        modulation_index,
    };
    step(&Request { scheme, upper: motor(upper), lower: motor(lower), shoot_through }).ok()
}

/// All instants of a period at which a gate toggles, with its ends, in their order.
pub fn instants(period: &Period) -> Vec<f64> {
    let toggles = period.gates.iter().flat_map(|gate| gate.toggles().map(f64::from).collect::<Vec<_>>());
    let mut all: Vec<f64> = [0.0, 1.0].into_iter().chain(toggles).collect();
    all.sort_by(f64::total_cmp);
    all.dedup_by(|a, b| (*a - *b).abs() < 1e-6);
    all
}

/// A gate's level at a time in periods; the gates stand in the order of `GATES`.
pub fn is_on(period: &Period, gate: usize, t: f64) -> bool {
    let gate = &period.gates[gate];
    gate.starts_on() ^ (gate.toggles().filter(|at| f64::from(*at) <= t).count() % 2 == 1)
}

/// A leg's state at a time in periods: −1, 0 or 1; none if it is shorted.
pub fn leg(period: &Period, leg: usize, t: f64) -> Option<i8> {
    match LegState::of_gates(is_on(period, leg, t), is_on(period, leg + 3, t), is_on(period, leg + 6, t)) {
        Some(LegState::One) => Some(1),
        Some(LegState::Zero) => Some(0),
        Some(LegState::MinusOne) => Some(-1),
        _ => None,
    }
}

/// The vectors of a period: from, to, and the number of each, 1 to 15; 0 if a leg is shorted.
pub fn vectors(period: &Period) -> Vec<(f64, f64, usize)> {
    let mut found: Vec<(f64, f64, usize)> = Vec::new();
    for pair in instants(period).windows(2) {
        let middle = 0.5 * (pair[0] + pair[1]);
        let legs = [0, 1, 2].map(|k| leg(period, k, middle));
        let number = VECTORS.iter().position(|known| known.map(Some) == legs).map_or(0, |k| k + 1);
        match found.last_mut() {
            Some((_, to, last)) if *last == number => *to = pair[1],
            _ => found.push((pair[0], pair[1], number)),
        }
    }
    found
}

/// A level that changes only at instants, as the corners of its curve.
pub fn steps(period: &Period, level: impl Fn(f64) -> f64) -> Vec<Point> {
    let parts = instants(period);
    let corners = parts.windows(2).map(|pair| (pair[0], pair[1], level(0.5 * (pair[0] + pair[1]))));
    corners.flat_map(|(from, to, level)| [(from, level), (to, level)]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_vector_is_one_motors_and_stands_where_its_name_says() {
        for (k, legs) in VECTORS.into_iter().enumerate() {
            let [upper, lower] = voltages(legs);
            let (own, other) = if k < 6 { (upper, lower) } else { (lower, upper) };
            assert!(other.0.hypot(other.1) < 1e-6, "V{} gives the other motor {other:?}", k + 1);
            if k + 1 < FIRST_ZERO {
                let angle = (TAU * (k % 6) as f64 / 6.0).sin_cos();
                let at = (2.0 / 3.0 * angle.1, 2.0 / 3.0 * angle.0);
                assert!((own.0 - at.0).hypot(own.1 - at.1) < 1e-6, "V{} is at {own:?}", k + 1);
            } else {
                assert!(own.0.hypot(own.1) < 1e-6);
            }
        }
    }

    #[test]
    fn the_vectors_come_in_the_schemes_order() {
        let order = |scheme| {
            let period = period(scheme, (20.0, 0.4), (40.0, 0.3), 0.0).unwrap();
            vectors(&period).iter().map(|(_, _, number)| *number).collect::<Vec<_>>()
        };
        assert_eq!(order(Scheme::S)[..7], [15, 8, 7, 13, 2, 1, 14]);
        assert_eq!(order(Scheme::Rs)[..5], [8, 7, 13, 2, 1]);
        assert_eq!(order(Scheme::Rthd)[..6], [15, 8, 7, 2, 1, 14]);
    }
}
