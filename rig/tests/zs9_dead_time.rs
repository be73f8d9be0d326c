//! The dead time of the ZS9's nine gates: kept, made up for, and what is left of it.

mod zs9_runs;

use rayon::prelude::*;
use tractive_rig::trace::Recorded;
use tractive_rig::zs9::trace::Recording;
use zs9_runs::{figure, run};

/// Dead time where two gates of a leg exchange, none where a leg is shorted on purpose; the diodes choose the state meanwhile.
#[test]
fn dead_time_is_kept_and_stops_nothing() {
    const DEAD_TIME_S: f64 = 2e-6;
    for scheme in ["s", "rs", "rthd", "zvo"] {
        let outcome = run(&format!("zs9-steady --dead-time-us 2 --scheme {scheme}"));
        assert!(outcome.recording.trip().is_none(), "{scheme}: {:?}", outcome.recording.trip());
        for (torque, thd) in [("torque1_nm", "thd1_percent"), ("torque2_nm", "thd2_percent")] {
            let (torque, thd) = (figure(&outcome, torque), figure(&outcome, thd));
            println!("{scheme}: {torque} N·m, {thd} %");
            assert!((torque / 60.0 - 1.0).abs() < 0.003 && thd < 2.6, "{scheme}: {torque} N·m, {thd} %");
        }
        assert!(exchanges_that_wait(&outcome.recording, DEAD_TIME_S) > 100, "{scheme}");
    }
}

/// The guide's table: torque and distortion with the dead time, distortion without it, and both without compensation.
#[test]
fn the_guide_says_what_dead_time_costs_with_and_without_compensation() {
    const PAGE: &str = include_str!("../../docs/papers.md");
    ["s", "rs", "rthd", "zvo"].into_par_iter().for_each(|scheme| {
        let of = |options: &str| {
            let outcome = run(&format!("zs9-steady --scheme {scheme}{options}"));
            let names = ["torque1_nm", "torque2_nm", "thd1_percent", "thd2_percent"];
            let trip = outcome.recording.trip().map(|trip| trip.fault.name());
            trip.map_or(Ok(names.map(|name| figure(&outcome, name))), Err)
        };
        let [_, _, ideal1, ideal2] = of("").unwrap();
        let [torque1, torque2, thd1, thd2] = of(" --dead-time-us 5").unwrap();
        let left = match of(" --dead-time-us 5 --uncompensated") {
            Ok([torque1, torque2, thd1, thd2]) => {
                format!("{torque1:.2}, {torque2:.2} N·m; {thd1:.2}, {thd2:.2} %")
            }
            Err(fault) => format!("trips: `{fault}`"),
        };
        let line = format!(
            "| {} | {torque1:.2}, {torque2:.2} | {thd1:.2}, {thd2:.2} | {ideal1:.2}, {ideal2:.2} | {left} |",
            scheme.to_uppercase()
        );
        assert!(PAGE.lines().any(|one| one == line), "docs/papers.md has no line\n{line}");
    });
    let central = run("zs9-steady --scheme rthd-central --dead-time-us 5");
    let [torque1, torque2, thd1, thd2] =
        ["torque1_nm", "torque2_nm", "thd1_percent", "thd2_percent"].map(|name| figure(&central, name));
    let told = format!("{torque1:.2} and {torque2:.2} N·m, with {thd1:.2} and {thd2:.2} %");
    assert!(PAGE.contains(&told), "docs/papers.md does not say {told}");
}

#[test]
fn dead_time_is_made_up_for() {
    for law in ["tractive", "pi"] {
        for scheme in ["s", "rs", "rthd", "zvo", "rthd-slide"] {
            let outcome = run(&format!("zs9-steady --dead-time-us 5 --scheme {scheme} --law {law}"));
            assert!(outcome.recording.trip().is_none(), "{scheme}, {law}: {:?}", outcome.recording.trip());
            for (torque, thd) in [("torque1_nm", "thd1_percent"), ("torque2_nm", "thd2_percent")] {
                let (torque, thd) = (figure(&outcome, torque), figure(&outcome, thd));
                println!("{scheme}, {law}: {torque:.2} N·m, {thd:.2} %");
                assert!((torque - 60.0).abs() <= 0.6 && thd < 3.6, "{scheme}, {law}: {torque} N·m, {thd} %");
            }
        }
    }
}

/// Counts the edges after which two gates of a leg are on and one is off, and holds each against the dead time since that one
/// turned off.
fn exchanges_that_wait(recording: &Recording, dead_time_s: f64) -> usize {
    let mut exchanges = 0;
    for leg in 0..3 {
        let (mut on, mut off_at_s) = ([None; 3], [None; 3]);
        for edge in recording.edges.iter().filter(|edge| edge.gate % 3 == leg) {
            let gate = usize::from(edge.gate / 3);
            on[gate] = Some(edge.on);
            if !edge.on {
                off_at_s[gate] = Some(edge.t_s);
                continue;
            }
            let off = (0..3).filter(|gate| on[*gate] == Some(false)).collect::<Vec<_>>();
            if let ([off], true) = (off.as_slice(), on.iter().all(Option::is_some)) {
                let wait_s = edge.t_s - off_at_s[*off].unwrap();
                assert!(wait_s > dead_time_s - 2e-9, "leg {leg}, gate {gate} waits {wait_s} s");
                exchanges += 1;
            }
        }
    }
    exchanges
}
