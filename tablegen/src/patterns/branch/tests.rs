//! Values of starts and bounds.

use super::*;

fn branch(name: &str) -> Branch {
    BRANCHES.into_iter().find(|branch| branch.name == name).unwrap()
}

#[test]
fn starts_are_the_additive_recurrence_of_the_golden_ratios() {
    // The positive roots of x² = x + 1 and x³ = x + 1.
    for start in [1, 2, 7, 200] {
        let golden = f64::from(start) / 1.618_033_988_749_895;
        let plastic = 1.324_717_957_244_746_f64;
        let [a, b] = [1, 2].map(|power| (0.5 + f64::from(start) / plastic.powi(power)).fract() * FRAC_PI_2);
        let one = spread(start, 1);
        assert!((one[0] - (0.5 + golden).fract() * FRAC_PI_2).abs() < 1e-9, "{one:?}");
        let two = spread(start, 2);
        assert!((two[0] - a.min(b)).abs() < 1e-9 && (two[1] - a.max(b)).abs() < 1e-9, "{two:?}");
        assert_eq!(two.len(), 2);
    }
}

#[test]
fn each_edge_has_a_carrier_half_of_its_own() {
    // 30° in two halves of 15°, and pulses of 12 µs at 180 Hz.
    let branch = branch("opp5a");
    let shortest = 12e-6 * 180.0 * std::f64::consts::TAU;
    assert!((branch.shortest_rad() - shortest).abs() < 1e-15);
    let width = 15.0_f64.to_radians();
    let at = |degrees: &[f64]| {
        branch.bounds(&degrees.iter().map(|degrees| degrees.to_radians()).collect::<Vec<_>>())
    };
    let bounds = at(&[20.0, 50.0]).unwrap();
    for ((low, high), cell) in bounds.into_iter().zip([1.0, 3.0]) {
        assert!((low - cell * width - 0.5 * shortest).abs() < 1e-12);
        assert!((high - (cell + 1.0) * width + 0.5 * shortest).abs() < 1e-12);
    }
    assert!(at(&[20.0, 29.0]).is_none(), "two edges in one half");
    assert!(at(&[20.0, 31.0]).is_some());
    let least = shortest.to_degrees();
    assert!(at(&[0.9 * least, 50.0]).is_none(), "the edge at 0 is too near");
    assert!(at(&[1.1 * least, 50.0]).is_some(), "far enough from the edge at 0");
}

#[test]
fn a_branchs_problem_is_its_own() {
    for (name, first) in [("opp5a", 1.0), ("opp5b", -1.0)] {
        let branch = branch(name);
        let bounds = [(0.1, 0.2)];
        let problem = branch.problem(85, &bounds);
        assert_eq!((problem.first, branch.first()), (first, first));
        assert!((problem.index - 0.85).abs() < 1e-12);
        assert_eq!(problem.shortest_rad, branch.shortest_rad());
        assert!(problem.beside.is_none() && problem.bounds == bounds);
    }
}

/// No start leads to a better optimum that the carrier halves can hold; and the one found has the anchor's fundamental.
#[test]
fn the_anchor_is_the_best_of_all_starts() {
    let branch = branch("opp3b");
    let best = branch.best_at_anchor().unwrap();
    // One angle: 2 cos α − 1 is the fundamental.
    assert_eq!(best.len(), 1);
    assert!((best[0] - (0.5 * 1.95_f64).acos()).abs() < 1e-9, "{best:?}");
}

#[test]
fn a_branch_has_a_node_at_each_hundredth_of_its_window() {
    let branch = branch("opp3b");
    let followed = branch.followed().unwrap();
    assert_eq!(followed.nodes.len(), 9);
    for (at, (index, angles)) in (90..).zip(&followed.nodes) {
        assert!((index - f64::from(at) / 100.0).abs() < 1e-12);
        assert!((angles[0] - (0.5 + 0.5 * index).acos()).abs() < 1e-9);
    }
}
