//! Constraints compared with finite differences, exactness, and optima of two angles compared with a search along the line that the fundamental leaves.

use super::super::torque::TorqueRipple;
use super::*;

const BOUNDS: [(f64, f64); 2] = [(0.02, 1.56), (0.02, 1.56)];

fn problem(first: f64, index: f64) -> Problem<'static> {
    Problem { first, index, shortest_rad: 0.05, bounds: &BOUNDS, beside: None }
}

fn fundamental(first: f64, angles_rad: &[f64]) -> f64 {
    Waveform { first, angles_rad }.fundamental()
}

#[test]
fn constraints_and_their_slopes() {
    let bounds = [(0.0, 1.5); 3];
    for first in [1.0, -1.0] {
        let problem = Problem { bounds: &bounds, ..problem(first, 0.7) };
        let at = [0.3, 0.5, 1.1];
        let constraints = problem.constraints(3);
        assert_eq!(constraints.len(), 4);
        let off = fundamental(first, &at) - 0.7;
        let expected = [off, -off, 0.3 - 0.5 + 0.05, 0.5 - 1.1 + 0.05];
        for (constraint, expected) in constraints.iter().zip(expected) {
            let mut slopes = [9.0; 3];
            let value = constraint(&at, Some(&mut slopes), &mut ());
            assert!((value - expected).abs() < 1e-12, "{value}, not {expected}");
            for (k, slope) in slopes.into_iter().enumerate() {
                let moved = |by: f64| {
                    let mut moved = at;
                    moved[k] += by;
                    constraint(&moved, None, &mut ())
                };
                let difference = (moved(1e-5) - moved(-1e-5)) / 2e-5;
                assert!((slope - difference).abs() < 1e-8, "{slope}, not {difference}");
            }
        }
    }
}

/// Angles move along the fundamental's slope alone.
#[test]
fn angles_are_made_exact() {
    for first in [1.0, -1.0] {
        let start = [0.4, 1.1];
        for off in [8e-5, -8e-5] {
            let exact = problem(first, fundamental(first, &start) + off).made_exact(start.to_vec()).unwrap();
            assert!((fundamental(first, &exact) - fundamental(first, &start) - off).abs() < 1e-15);
            let [by_a, by_b] = [0.4_f64, 1.1].map(f64::sin);
            let (a, b) = (exact[0] - start[0], exact[1] - start[1]);
            assert!((a * -by_b - b * by_a).abs() < 1e-8 && a.abs() > 1e-6, "{a}, {b}");
        }
        for off in [1.2e-4, -1.2e-4] {
            let far = problem(first, fundamental(first, &start) + off);
            assert!(far.made_exact(start.to_vec()).is_none());
        }
    }
}

#[test]
fn exact_angles_keep_their_bounds() {
    let angles = [0.4, 1.1];
    let made = |bounds: [(f64, f64); 2], shortest_rad: f64| {
        let index = fundamental(1.0, &angles);
        let problem = Problem { first: 1.0, index, shortest_rad, bounds: &bounds, beside: None };
        problem.made_exact(angles.to_vec()).is_some()
    };
    for (by, good) in [(-1e-2, true), (0.8e-4, true), (1.2e-4, false), (1e-2, false)] {
        assert_eq!(made([(0.4 + by, 1.5), (0.0, 1.5)], 0.1), good, "low, {by}");
        assert_eq!(made([(0.0, 0.4 - by), (0.0, 1.5)], 0.1), good, "high, {by}");
        assert_eq!(made([(0.0, 1.5), (1.1 + by, 1.5)], 0.1), good, "low, {by}");
        assert_eq!(made([(0.0, 1.5); 2], 0.7 + by), good, "pulse, {by}");
    }
}

/// The best of two angles: the fundamental fixes the second one; the search takes ever finer steps from a start.
fn by_search(first: f64, index: f64, start: f64, cost: &dyn Fn(&[f64]) -> f64) -> Vec<f64> {
    // first (1 − 2 cos a + 2 cos b) = index.
    let both = |a: f64| vec![a, (0.5 * (index / first - 1.0) + a.cos()).acos()];
    let (mut best, mut step) = (start, 1e-3);
    while step > 1e-8 {
        let next = [best - step, best + step].into_iter().find(|a| cost(&both(*a)) < cost(&both(best)));
        match next {
            Some(a) => best = a,
            None => step *= 0.5,
        }
    }
    both(best)
}

#[test]
fn optima_of_two_angles() {
    let ripple = TorqueRipple::new();
    let torque = |wave: &Waveform| ripple.squared(wave);
    for (first, index, start) in [(1.0, 0.6, [0.5, 0.9]), (-1.0, 0.85, [0.17, 1.45])] {
        for beside in [None, Some(&torque as &dyn Fn(&Waveform) -> f64)] {
            let cost = |angles_rad: &[f64]| {
                let wave = Waveform { first, angles_rad };
                wave.ripple(None) + beside.map_or(0.0, |beside| beside(&wave))
            };
            let problem = Problem { beside, ..problem(first, index) };
            let Some(found) = problem.optimum(&start) else { panic!("{first} {index}") };
            assert!((fundamental(first, &found) - index).abs() < 1e-14);
            let best = by_search(first, index, found[0], &cost);
            let off = (found[0] - best[0]).abs().max((found[1] - best[1]).abs());
            assert!(off < 1e-5, "{found:?}, not {best:?}");
        }
    }
}

/// From both starts, the one that costs less.
#[test]
fn the_calmest_is_the_better_of_two() {
    let ripple = TorqueRipple::new();
    let torque = |wave: &Waveform| ripple.squared(wave);
    let bounds = [(0.02, 1.5); 3];
    let mut other = 0;
    for k in 0..24 {
        let index = 0.5 + 0.02 * f64::from(k);
        let first = if k % 2 == 0 { 1.0 } else { -1.0 };
        let problem = Problem { first, index, shortest_rad: 0.03, bounds: &bounds, beside: Some(&torque) };
        let cost = |angles_rad: &Vec<f64>| {
            let wave = Waveform { first, angles_rad };
            (wave.ripple(None), torque(&wave))
        };
        let start = [0.3, 0.6, 0.9];
        let found = [0.0, 0.01].map(|by| problem.optimum(&start.map(|angle| angle + by)));
        let whole = |angles: &Vec<f64>| cost(angles).0 + cost(angles).1;
        let least = found.iter().flatten().map(whole).fold(f64::INFINITY, f64::min);
        if let [Some(a), Some(b)] = &found {
            let ((a_own, a_torque), (b_own, b_torque)) = (cost(a), cost(b));
            other += i32::from((a_own - a_torque < b_own - b_torque) != (whole(a) < whole(b)));
        }
        match problem.calmest(&start) {
            Some(calmest) => assert_eq!(whole(&calmest), least, "{index}"),
            None => assert!(found.iter().all(Option::is_none)),
        }
    }
    assert!(other > 0, "a difference would do as well");
}
