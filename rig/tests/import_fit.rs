//! `machine import`: nodes that are no full grid, or too rough for a machine's map, are fitted, and the fit is told; blunders are not.

#[path = "../../tablegen/tests/common/mod.rs"]
mod folders;
mod imported;

use folders::axis;
use imported::{error, import, map, truth};
use rand::{Rng, SeedableRng, rngs::StdRng};
use std::fmt::Write as _;

/// A map of currents anywhere, each flux linkage off by so much of the largest at most.
fn scattered(currents: &[(f64, f64)], noise: f64) -> String {
    let mut random = StdRng::seed_from_u64(7);
    let (top_d, top_q) = truth(0.0, 20.0);
    let mut rough = || noise * top_d.hypot(top_q) * random.random_range(-1.0..=1.0);
    let mut text = "id,iq,psi_d,psi_q\n".to_owned();
    for (id, iq) in currents {
        let (psi_d, psi_q) = truth(*id, *iq);
        let _ = writeln!(text, "{id},{iq},{:.9},{:.9}", psi_d + rough(), psi_q + rough());
    }
    text
}

fn grid() -> Vec<(f64, f64)> {
    axis(-22.0, 1.0, 26)
        .into_iter()
        .flat_map(|id| axis(0.0, 1.0, 23).into_iter().map(move |iq| (id, iq)))
        .collect()
}

fn polar(head: &str, from_d: bool, unit: f64) -> String {
    map(head, &axis(0.0, 1.0, 22), &axis(0.0, 7.5, 13), |size, degrees| {
        let (sin, cos) = degrees.to_radians().sin_cos();
        let (psi_d, psi_q) = truth(-size * sin, size * cos);
        let angle = unit * if from_d { 90.0 + degrees } else { degrees };
        format!("{size},{angle},{psi_d:.9},{psi_q:.9}")
    })
}

/// Maps: what is odd, the file, its options, the nodes of the fit (none without one), and the largest error.
fn rough() -> Vec<(&'static str, String, &'static str, Option<usize>, f64)> {
    let full = grid();
    let mut random = StdRng::seed_from_u64(3);
    let within =
        |most: f64| full.iter().copied().filter(|(id, iq)| id.hypot(*iq) <= most).collect::<Vec<_>>();
    let mut jitter = |by: f64| {
        let off = full.iter().map(|(id, iq)| {
            (id + by * random.random_range(-1.0..=1.0), iq + by * random.random_range(-1.0..=1.0))
        });
        off.collect::<Vec<_>>()
    };
    let anywhere: Vec<_> =
        jitter(0.9).into_iter().step_by(3).chain(jitter(0.0).into_iter().step_by(25)).collect();
    let rounded = map("id,iq,psi_d,psi_q", &axis(-22.0, 1.0, 26), &axis(0.0, 1.0, 23), |id, iq| {
        let (psi_d, psi_q) = truth(id, iq);
        let rounded = |psi: f64| (200.0 * psi).round() / 200.0;
        format!("{id},{iq},{},{}", rounded(psi_d), rounded(psi_q))
    });
    vec![
        ("a grid", scattered(&full, 0.0), "", None, 1e-4),
        ("a grid with rounding in its currents", scattered(&jitter(1e-3), 0.0), "", None, 3e-4),
        ("a node missing", scattered(&full[1..], 0.0), "", Some(594), 3e-3),
        ("a node twice", scattered(&[&full[..], &full[40..41]].concat(), 0.0), "", None, 1e-4),
        ("a circle of a grid", scattered(&within(21.0), 0.0), "", Some(within(21.0).len()), 3e-3),
        ("anywhere", scattered(&anywhere, 0.0), "", Some(223), 3e-3),
        ("noise", scattered(&full, 0.008), "", Some(595), 5e-3),
        ("rounding", rounded, "", Some(595), 5e-3),
        ("magnitude and advance", polar("Is [A],gamma [deg],psi_d,psi_q", false, 1.0), "", Some(286), 3e-3),
        (
            "magnitude and angle in rad",
            polar("I,beta [rad],Fd,Fq", true, 1_f64.to_radians()),
            "--angle-from d",
            Some(286),
            3e-3,
        ),
    ]
}

#[test]
fn rough_maps_are_the_machine_that_they_are_of_and_their_fit_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let (file, out) = (folder.path().join("map.csv"), folder.path().join("made"));
    for (what, text, options, fitted, bound) in rough() {
        std::fs::write(&file, text).unwrap();
        let output = import(&file, options, &out);
        let said = String::from_utf8_lossy(&output.stdout);
        assert_eq!(output.status.code(), Some(0), "{what}: {}", String::from_utf8_lossy(&output.stderr));
        let error = error(&out, truth);
        println!("{what}: {error:.1e}: {said}");
        assert!(error < bound, "{what}: {error}");
        let words =
            fitted.map(|nodes| format!("fitted to {nodes} nodes, as the gradient of one co-energy: "));
        assert_eq!(said.contains("fitted"), words.is_some(), "{what}: {said}");
        assert!(words.is_none_or(|words| said.contains(&words)), "{what}: {said}");
        let map = std::fs::read_to_string(out.join("flux_map.csv")).unwrap();
        assert_eq!(map.contains("# fitted to"), fitted.is_some(), "{what}");
    }
}

/// Ribs that saturate at a fifteenth of the largest current are a knee that no polynomial follows: the one that best predicts left-out nodes
/// oscillates, so that flux linkage falls somewhere, and a smoother one is taken.
#[test]
fn a_sharp_knee_is_a_smooth_machine() {
    let flux = |id: f64, iq: f64| {
        (
            0.12 + 0.008 * id + 0.03 * (id / 1.33).tanh(),
            0.02 * iq + 0.7 * (iq / 8.0).atan() + 0.16 * (iq / 1.8).tanh(),
        )
    };
    let folder = tempfile::tempdir().unwrap();
    let (file, out) = (folder.path().join("map.csv"), folder.path().join("made"));
    let text =
        map("Is,gamma [deg],psi_d,psi_q", &axis(0.0, 1.75, 13), &axis(0.0, 5.0, 19), |size, degrees| {
            let (sin, cos) = degrees.to_radians().sin_cos();
            let (psi_d, psi_q) = flux(-size * sin, size * cos);
            format!("{size},{degrees},{psi_d:.9},{psi_q:.9}")
        });
    std::fs::write(&file, text).unwrap();
    let output = import(&file, "", &out);
    let said = String::from_utf8_lossy(&output.stdout);
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    println!("{said}");
    assert!(said.contains("fitted to 247 nodes"), "{said}");
    assert!(error(&out, flux) < 0.02, "{}", error(&out, flux));
}

#[test]
fn what_no_fit_explains_is_refused_with_what_it_leaves() {
    let folder = tempfile::tempdir().unwrap();
    let (file, out) = (folder.path().join("map.csv"), folder.path().join("made"));
    let full = grid();
    let few: Vec<_> = full.iter().copied().step_by(25).collect();
    let hollow: Vec<_> = full.iter().copied().filter(|(id, iq)| *id > -12.0 || *iq < 5.0).collect();
    let cut: Vec<_> = full.iter().copied().filter(|(id, iq)| iq - id <= 24.0).collect();
    let mut blunder: Vec<String> = scattered(&full, 0.0).lines().map(str::to_owned).collect();
    blunder[300] = blunder[300].rsplit_once(',').map(|(rest, _)| format!("{rest},0.1")).unwrap();
    for (text, told) in [
        (
            scattered(&few, 0.0),
            "a fit of one co-energy: 24 nodes within 1.5 × --max-current 20: must be at least 30",
        ),
        (
            scattered(&hollow, 0.0),
            "a fit of one co-energy: id -17, iq 10: must have a node within 0.2 × --max-current 20",
        ),
        (
            scattered(&cut, 0.0),
            "a fit of one co-energy: --max-current 20: must be at most 17.37: no nodes about id -14.1, iq 14.1",
        ),
        (blunder.join("\n"), " % off line 301 (at most 5 %)"),
        (scattered(&full, 0.05), "off nodes that are left out (rms; must be at most 1 %)"),
    ] {
        std::fs::write(&file, text).unwrap();
        let output = import(&file, "", &out);
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{told}: {said}");
        assert!(said.contains(told), "{told}: {said}");
        assert!(!out.exists(), "{told}");
    }
}
