//! The optimised patterns: the committed angles are the optimiser's, and as good as optima found independently.
#![allow(missing_docs)]

use std::sync::OnceLock;
use tractive_tablegen::patterns::{Followed, Waveform, angle_table, follow_all};

/// Optimising takes seconds: once for all tests.
fn followed() -> &'static [Followed] {
    static BRANCHES: OnceLock<Vec<Followed>> = OnceLock::new();
    BRANCHES.get_or_init(|| follow_all().unwrap())
}

fn wave(followed: &Followed, angles_rad: &[f64]) -> (f64, f64, f64) {
    let wave = Waveform { first: followed.branch.first(), angles_rad };
    (wave.fundamental(), wave.weighted_distortion(), wave.shortest_rad())
}

#[test]
fn the_committed_angles_are_what_the_optimiser_makes() {
    let committed = include_str!("../../control/src/modulation/optimal/table.rs");
    assert!(angle_table(followed()) == committed, "run cargo rig patterns --write");
}

/// Modulation index, and weighted distortion in percent of the best pattern of so many pulses, from an optimiser that shares no code.
const INDEPENDENT: [(usize, f64, f64); 9] = [
    (7, 0.6, 5.50),
    (7, 0.7, 4.58),
    (7, 0.8, 3.30),
    (7, 0.9, 2.13),
    (9, 0.6, 4.56),
    (9, 0.7, 3.65),
    (9, 0.8, 2.86),
    (13, 0.6, 3.12),
    (13, 0.7, 2.55),
];

#[test]
fn each_branch_is_as_good_as_independent_optima() {
    for (pulses, index, percent) in INDEPENDENT {
        let branches = followed().iter().filter(|followed| followed.branch.pulses == pulses);
        let nodes = branches.flat_map(|branch| branch.nodes.iter().map(move |node| (branch, node)));
        let here = nodes.filter(|(_, (at, _))| (at - index).abs() < 1e-6);
        let best = here.map(|(branch, (_, angles))| wave(branch, angles).1).fold(f64::INFINITY, f64::min);
        assert!(100.0 * best < 1.02 * percent, "{pulses} pulses at {index}: {:.3} %", 100.0 * best);
    }
}

#[test]
fn fundamental_pulses_and_continuity_hold_from_node_to_node() {
    for followed in followed() {
        let name = followed.branch.name;
        for pair in followed.nodes.windows(2) {
            let [(index, angles), (next, others)] = pair else { unreachable!() };
            for part in [0.0, 0.25, 0.5, 0.75, 1.0] {
                let between: Vec<_> = angles.iter().zip(others).map(|(a, b)| a + part * (b - a)).collect();
                let wanted = index + part * (next - index);
                let (fundamental, _, shortest) = wave(followed, &between);
                assert!((fundamental / wanted - 1.0).abs() < 0.000_5, "{name} {wanted}: {fundamental}");
                assert!(shortest > 0.99 * followed.branch.shortest_rad(), "{name} {wanted}: {shortest}");
            }
            let step = angles.iter().zip(others).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(step < 0.04, "{name} {index}: jumps by {step} rad");
        }
        // An optimum that the search missed at one node stands out from its neighbours'.
        let bends = followed.nodes.windows(3).map(|three| {
            let [(_, a), (_, b), (_, c)] = three else { unreachable!() };
            a.iter().zip(b).zip(c).map(|((a, b), c)| (a - 2.0 * b + c).abs()).fold(0.0, f64::max)
        });
        let sum: f64 = bends.sum();
        assert!(followed.nodes.len() < 15 || sum < 0.02, "{name}: angles bend by {sum} rad");
    }
}
