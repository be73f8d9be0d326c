//! The ZS9's scenarios on the host, held against their bounds.

mod zs9_runs;

use rayon::prelude::*;
use serde_json::Value;
use tractive_rig::rows::mean;
use tractive_rig::scenario::{catalogue, command};
use tractive_rig::trace::Recorded;
use tractive_rig::zs9::bound;
use tractive_rig::zs9::figures;
use tractive_rig::zs9::trace::{Recording, Row};
use zs9_runs::{figure, run};

/// Largest difference of a value between two runs, row by row.
fn difference(a: &Recording, b: &Recording, value: fn(&Row) -> f64) -> f64 {
    assert_eq!(a.rows.len(), b.rows.len());
    a.rows.iter().zip(&b.rows).map(|(a, b)| (value(a) - value(b)).abs()).fold(0.0, f64::max)
}

/// By how much the second run disturbs motor 1 against the first: N·m, r/min.
fn disturbance(with: &Recording, without: &Recording) -> (f64, f64) {
    (
        difference(with, without, |row| row.motors[0].torque_nm),
        difference(with, without, |row| row.motors[0].speed_rpm),
    )
}

/// Every scenario judges itself by so many bounds, and keeps them.
#[test]
fn every_scenario_has_bounds_and_keeps_them() {
    const BOUNDS: [(&str, usize); 10] = [
        ("zs9-load-step", 4),
        ("zs9-load-step --carrier-hz 20000 --uin 800", 4),
        ("zs9-reverse", 3),
        ("zs9-cycle", 5),
        ("zs9-cycle --second other --cruise 8", 6),
        ("zs9-steady --scheme s", 5),
        ("zs9-steady --scheme rs", 5),
        ("zs9-steady --scheme rthd", 5),
        ("zs9-steady --scheme zvo", 5),
        ("zs9-timing", 2),
    ];
    let judged = |name: &str| BOUNDS.iter().any(|(line, _)| line.split(' ').next() == Some(name));
    let forgotten: Vec<_> = catalogue::names()
        .map(|(name, _)| name)
        .filter(|name| name.starts_with("zs9") && !judged(name))
        .collect();
    assert!(forgotten.is_empty(), "{forgotten:?}");
    BOUNDS.into_par_iter().for_each(|(line, bounds)| {
        let outcome = run(line);
        let verdicts = outcome.figures.get("verdicts").and_then(Value::as_array).unwrap();
        let of = |word: &str| verdicts.iter().filter(|verdict| verdict["verdict"] == word).count();
        assert_eq!((of("pass"), of("reported")), (bounds, verdicts.len() - bounds), "{line}: {verdicts:#?}");
    });
}

/// A load step against the run without one: motor 1's disturbance, motor 2's recovery in ms, the link's deviation in percent.
fn load_step(options: &str) -> (f64, f64, f64, f64) {
    let with = run(&format!("zs9-load-step{options}"));
    let without = run(&format!("zs9-load-step --step 0{options}"));
    assert!(with.recording.trip().is_none() && without.recording.trip().is_none());
    let (torque_nm, speed_rpm) = disturbance(&with.recording, &without.recording);
    let back_ms = figure(&with, "motor2_back_within_0p2_percent_ms");
    let link_percent = figure(&with, "link_deviation_percent");
    println!("{options}: {torque_nm:.4} N·m, {speed_rpm:.5} r/min, {back_ms:.2} ms, {link_percent:.3} %");
    (torque_nm, speed_rpm, back_ms, link_percent)
}

#[test]
fn a_load_step_of_motor_2_hardly_reaches_motor_1() {
    let (torque_nm, speed_rpm, back_ms, link_percent) = load_step("");
    assert!(torque_nm <= 0.03 && speed_rpm <= 0.002, "{torque_nm} N·m, {speed_rpm} r/min");
    assert!(back_ms <= 36.0 && link_percent <= 0.8, "{back_ms} ms, {link_percent} %");
}

#[test]
fn a_faster_carrier_and_more_shoot_through_do_better() {
    let (torque_nm, speed_rpm, back_ms, link_percent) = load_step(" --carrier-hz 20000 --uin 800");
    assert!(torque_nm <= 0.01 && speed_rpm <= 0.002, "{torque_nm} N·m, {speed_rpm} r/min");
    assert!(back_ms <= 12.0 && link_percent <= 0.5, "{back_ms} ms, {link_percent} %");
}

/// A line of the results' table.
fn is_in_results(line: &str) {
    const RESULTS: &str = include_str!("../../docs/results.md");
    assert!(RESULTS.lines().any(|one| one == line), "docs/results.md has no line\n{line}");
}

#[test]
fn the_results_say_how_little_a_motor_feels_of_the_other() {
    let [slow, fast] = ["", " --carrier-hz 20000 --uin 800"].map(load_step);
    let ((torque, speed, back, link), (torque_fast, speed_fast, back_fast, link_fast)) = (slow, fast);
    is_in_results(&format!(
        "| motor 2's load 60 → 100 N·m: motor 1's torque moves by | {torque:.4} N·m | {torque_fast:.4} N·m |"
    ));
    is_in_results(&format!("| … its speed by | {speed:.5} r/min | {speed_fast:.5} r/min |"));
    is_in_results(&format!("| motor 2 within 0.2 % again after | {back:.1} ms | {back_fast:.1} ms |"));
    is_in_results(&format!("| link voltage within | ±{link:.2} % | ±{link_fast:.2} % |"));
}

#[test]
fn every_scheme_takes_the_load_step() {
    for scheme in ["s", "rs", "zvo", "rthd-central", "rthd-slide"] {
        let outcome = run(&format!("zs9-load-step --scheme {scheme}"));
        assert!(outcome.recording.trip().is_none(), "{scheme}: {:?}", outcome.recording.trip());
        let (back_ms, link) = (
            figure(&outcome, "motor2_back_within_0p2_percent_ms"),
            figure(&outcome, "link_deviation_percent"),
        );
        println!("{scheme}: {back_ms:.1} ms, {link:.2} %");
        assert!(back_ms <= 36.0 && link <= 0.8, "{scheme}: {back_ms} ms, {link} %");
        assert!(outcome.recording.rows.iter().all(|row| row.scheme.name() == scheme));
    }
}

#[test]
fn motor_1_holds_while_motor_2_reverses() {
    let (with, without) = (run("zs9-reverse"), run("zs9-reverse --no-reverse"));
    let (torque_nm, speed_rpm) = disturbance(&with.recording, &without.recording);
    println!("{torque_nm:.4} N·m, {speed_rpm:.5} r/min");
    assert!(torque_nm <= 0.01 && speed_rpm <= 0.001, "{torque_nm} N·m, {speed_rpm} r/min");
    is_in_results(&format!(
        "| motor 2 reverses: motor 1 moves by | {torque_nm:.3} N·m, {speed_rpm:.4} r/min | |"
    ));
    assert!(figure(&with, "motor2_speed_error_rms_rpm") <= 1.6);
    assert!((figure(&with, "motor2_speed_rpm") + 800.0).abs() < 0.01);
    assert!((figure(&with, "motor1_speed_rpm") - 800.0).abs() < 0.01);
}

#[test]
fn the_cycle_goes_up_and_back_and_returns_energy() {
    let outcome = run("zs9-cycle");
    let recording = &outcome.recording;
    assert!(recording.trip().is_none(), "{:?}", recording.trip());
    println!("{}", serde_json::to_string_pretty(outcome.figures.values()).unwrap());
    let highest = figures::largest(&recording.rows, |row| row.motors[0].speed_rpm);
    assert!((1300.0..1301.0).contains(&highest), "{highest} r/min");
    assert!((figure(&outcome, "end_speed_rpm") - 10.0).abs() < 0.1);
    let full = figures::window(recording, 1.0, 5.0);
    for k in 0..2 {
        let torque = mean(full, |row| row.motors[k].torque_nm);
        assert!((torque - 120.0).abs() < 0.1, "{torque} N·m");
    }
    assert!(figure(&outcome, "accelerated_s") <= 9.2);
    let from = figure(&outcome, "weakening_from_rpm");
    assert!((850.0..950.0).contains(&from), "weakening from {from} r/min");
    assert!(figure(&outcome, "capacitor_overshoot_percent") <= 0.3);
    assert!(figure(&outcome, "returned_percent") >= 75.0);
    assert!(figure(&outcome, "power_residual_percent") < 0.1);
    assert!(figure(&outcome, "link_deviation_percent") < 0.5);
    let [returned, over] =
        ["returned_percent", "capacitor_overshoot_percent"].map(|name| figure(&outcome, name));
    is_in_results(&format!(
        "| cycle: energy returned, capacitor overshoot | {returned:.0} %, {over:.2} % | |"
    ));
}

/// Torque stands beside what is asked for.
#[test]
fn the_cycles_page_draws_the_demand() {
    let folder = tempfile::tempdir().unwrap();
    let words = ["zs9-cycle", "--cruise", "1", "--out", folder.path().to_str().unwrap()];
    command::run(words.map(Into::into).to_vec()).unwrap();
    let page = std::fs::read_to_string(folder.path().join("report.html")).unwrap();
    assert!(["demand 1", "demand 2"].iter().all(|curve| page.contains(curve)));
}

#[test]
fn motors_in_different_cycles_do_not_disturb_each_other() {
    let outcome = run("zs9-cycle --second other --cruise 8");
    let rows = &outcome.recording.rows;
    assert!(outcome.recording.trip().is_none(), "{:?}", outcome.recording.trip());
    let [highest, lowest] = [0, 1].map(|k| {
        let turns = |row: &Row| if k == 0 { row.motors[0].speed_rpm } else { -row.motors[1].speed_rpm };
        figures::largest(rows, turns)
    });
    assert!((1300.0..1301.0).contains(&highest) && (650.0..651.0).contains(&lowest), "{highest} {lowest}");
    // Each is somewhere else in its cycle: one motors while the other brakes, and one cruises while the other has come back.
    let opposite = rows.iter().filter(|row| row.motors[0].torque_nm > 50.0 && row.motors[1].torque_nm > 50.0);
    assert!(opposite.count() > 500, "motor 2, which turns backwards, brakes while motor 1 motors");
    for (name, most) in [("motor1_torque_apart_nm", 0.02), ("motor1_speed_apart_rpm", 0.02)] {
        let found = figure(&outcome, name);
        assert!(found <= most && found > 0.0, "{name}: {found}");
    }
}

#[test]
fn harmonics_are_those_of_the_schemes() {
    // Scheme, THD of the upper and of the lower motor, ripple of the inductor current, peak to peak.
    for (scheme, upper, lower, ripple_a) in [
        ("s", 2.05, 1.50, 4.9),
        ("rs", 2.37, 1.91, 10.7),
        ("rthd", 1.76, 1.18, 10.7),
        ("zvo", 2.08, 1.60, 10.7),
    ] {
        let outcome = run(&format!("zs9-steady --scheme {scheme}"));
        let [thd1, thd2, ripple, torque1, torque2] =
            ["thd1_percent", "thd2_percent", "inductor_ripple_a", "torque1_nm", "torque2_nm"]
                .map(|name| figure(&outcome, name));
        println!("{scheme}: THD {thd1:.3} and {thd2:.3} %, ripple {ripple:.2} A");
        assert!(thd1 <= 1.03 * upper && thd2 <= 1.03 * lower, "{scheme}: {thd1} % {thd2} %");
        assert!(ripple <= ripple_a, "{scheme}: {ripple} A");
        assert!((torque1 - 60.0).abs() < 0.02 && (torque2 - 60.0).abs() < 0.02, "{torque1} {torque2}");
    }
}

#[test]
fn every_fault_has_its_name_and_ends_with_all_gates_off() {
    for (kind, name) in [
        ("source-short", "source_undervoltage"),
        ("source-low", "source_undervoltage"),
        ("source-high", "capacitor_overvoltage"),
        ("sensor-lost-1", "sensor_lost_1"),
        ("sensor-lost-2", "sensor_lost_2"),
        ("sensor-frozen-1", "sensor_lost_1"),
        ("sensor-frozen-2", "sensor_lost_2"),
        ("sensor-jump-2", "sensor_lost_2"),
        ("overcurrent", "overcurrent"),
        ("not-finite", "not_finite"),
        ("leg-stuck-on", "leg_stuck"),
        ("leg-stuck-off", "leg_stuck"),
    ] {
        const AT_S: f64 = 0.1;
        let outcome = run(&format!("zs9-load-step --inject {kind}@{AT_S}"));
        let recording = &outcome.recording;
        let trip = recording.trip().unwrap_or_else(|| panic!("{kind}: no trip"));
        assert_eq!(trip.fault.name(), name, "{kind}");
        // NaN breaks every limit.
        assert!(trip.value.is_nan() || trip.value != trip.limit, "{kind}: {trip:?}");
        let last = recording.edges.last().unwrap();
        let mut levels = [false; 9];
        for edge in &recording.edges {
            levels[usize::from(edge.gate)] = edge.on;
        }
        // The frozen angle takes five periods to be believed frozen; the capacitors take some milliseconds to charge.
        let within_s = if kind == "source-high" { 5e-3 } else { 1e-3 };
        println!(
            "{kind}: {name}, {} (limit {}), off after {:.0} µs",
            trip.value,
            trip.limit,
            (last.t_s - AT_S) * 1e6
        );
        assert!(levels == [false; 9], "{kind}: gates left on");
        assert!((AT_S..AT_S + within_s).contains(&last.t_s), "{kind}: last edge at {}", last.t_s);
        let end = recording.rows.last().unwrap();
        assert!(end.trip.is_some() && end.duty == 0.0, "{kind}");
    }
}

/// A low source is low and a high one high, whatever its voltage was: 312 V of 500 were above the trip level, and the run a pass without a fault.
#[test]
fn a_source_that_fails_is_noticed_whatever_its_voltage() {
    for (line, name) in [
        ("source-low@0 --udc 500", "source_undervoltage"),
        ("source-low@0.3 --udc 600 --uin 700", "source_undervoltage"),
        ("source-high@0.3 --udc 300 --uin 500", "capacitor_overvoltage"),
    ] {
        let outcome = run(&format!("zs9-load-step --inject {line}"));
        assert_eq!(outcome.recording.trip().map(|trip| trip.fault.name()), Some(name), "{line}");
    }
}

/// A fault that was injected and that nobody latched is no pass.
#[test]
fn a_fault_without_effect_falls_short() {
    let chosen = catalogue::of_zs9("zs9-load-step --inject overcurrent@0.3").unwrap();
    let machine = chosen.machine().unwrap();
    let judged = |recording: &Recording| {
        let figures = chosen.figures(recording, &machine);
        let verdicts = figures.get("verdicts").and_then(Value::as_array).unwrap().clone();
        let no_effect = |verdict: &Value| verdict["what"] == "the injected fault had no effect";
        verdicts.into_iter().find(no_effect).map(|verdict| verdict["verdict"].clone())
    };
    assert_eq!(judged(&chosen.drive(&machine).unwrap()), Some("pass".into()));
    let healthy = run("zs9-load-step").recording;
    assert_eq!(judged(&healthy), Some("falls short".into()));
}

#[test]
fn flaws_of_the_sensors_do_not_stop_the_drive() {
    let outcome =
        run("zs9-load-step --adc-bits 12 --noise-a 0.3 --rs-error 30 --map-error 5 --angle-error 1");
    assert!(outcome.recording.trip().is_none(), "{:?}", outcome.recording.trip());
    let back_ms = figure(&outcome, "motor2_back_within_0p2_percent_ms");
    assert!(back_ms < 50.0, "{back_ms} ms");
}

/// Each motor learns in every other period, from the volt-seconds of both. Without noise it is 1.62 %; torque is that of the machine, not of the map.
#[test]
fn noise_distorts_no_more_than_the_pulses_do() {
    let outcome = run("zs9-steady --noise-a 0.3 --adc-bits 12 --map-error 10");
    let thd = figure(&outcome, "thd1_percent");
    assert!((1.7..1.9).contains(&thd), "{thd} %");
    for motor in ["torque1_nm", "torque2_nm"] {
        let torque_nm = figure(&outcome, motor);
        assert!((torque_nm - 60.0).abs() < 1.0, "{torque_nm} N·m");
    }
}

#[test]
fn the_trace_has_its_columns_and_is_written_whole() {
    let folder = tempfile::tempdir().unwrap();
    let words = ["zs9-reverse", "--dt", "1e-3", "--out", folder.path().to_str().unwrap()];
    command::run(words.map(Into::into).to_vec()).unwrap();
    let trace = std::fs::read_to_string(folder.path().join("trace.csv")).unwrap();
    let mut lines = trace.lines();
    assert_eq!(
        lines.next().unwrap(),
        "t_s,speed1_rpm,speed2_rpm,te1_ref_nm,te2_ref_nm,te1_nm,te2_nm,id1_a,iq1_a,id2_a,iq2_a,ia1_a,ib1_a,ic1_a,\
         ia2_a,ib2_a,ic2_a,uin_v,vc_v,il_a,udc_v,d_sh,scheme,tl1_nm,tl2_nm,fault"
    );
    assert_eq!(lines.clone().count(), 2000);
    assert!(lines.all(|line| line.split(',').count() == 26));
    let edges = std::fs::read_to_string(folder.path().join("edges.csv")).unwrap();
    assert!(edges.starts_with("t_s,gate,level\n") && edges.lines().count() > 100_000);
    let page = std::fs::read_to_string(folder.path().join("report.html")).unwrap();
    assert!(page.contains("<dt>DC source</dt><dd>400 V"), "the source's, not the machine's");
    assert!(["figures 20 to 23 ·", "figure 23 ·"].iter().all(|figure| page.contains(figure)));
    let summary: Value =
        serde_json::from_str(&std::fs::read_to_string(folder.path().join("summary.json")).unwrap()).unwrap();
    assert_eq!(summary["machine"], "ipm-zs9");
    assert_eq!(summary["options"]["carrier_hz"], 10_000);
    assert_eq!(summary["options"]["udc"], 400.0);
}

/// Distortion of a phase current over so many periods of its fundamental, in percent.
fn distortion(current_a: &[f64], periods: f64) -> f64 {
    let count = current_a.len() as f64;
    let (mut cos, mut sin, mut squares) = (0.0, 0.0, 0.0);
    for (k, value) in current_a.iter().enumerate() {
        let (s, c) = (core::f64::consts::TAU * periods * (k as f64 + 0.5) / count).sin_cos();
        (cos, sin, squares) = (cos + value * c, sin + value * s, squares + value * value);
    }
    let fundamental = 2.0 / (count * count) * (cos * cos + sin * sin);
    (squares / count / fundamental - 1.0).max(0.0).sqrt() * 100.0
}

/// The trace of another step has that step, and changes no figure; it is what it would be by itself but for rounding.
#[test]
fn another_step_of_the_trace_judges_the_same() {
    for (line, step_s) in [("zs9-steady", 1e-4), ("zs9-load-step", 1e-3), ("zs9-reverse", 4e-3)] {
        let (plain, coarse) = (run(line), run(&format!("{line} --dt {step_s}")));
        let names = plain.figures.values().keys();
        for name in names.filter(|name| plain.figures.number(name).is_some()) {
            let (one, other) = (figure(&plain, name), figure(&coarse, name));
            let most = 1e-3 * one.abs() + 1e-4;
            assert!((one - other).abs() <= most, "{line}, {name}: {one}, with --dt {step_s} {other}");
        }
        let (all, written) = (&plain.recording.rows, coarse.recording.written());
        let each = all.len() / written.len();
        assert_eq!(each * written.len(), all.len(), "{line}");
        for (k, row) in written.iter().enumerate() {
            let of = &all[k * each..(k + 1) * each];
            assert!((row.t_s - of[0].t_s).abs() < 1e-12, "{line}: {}", row.t_s);
            for value in [|row: &Row| row.motors[1].torque_nm, |row: &Row| row.link_v] {
                assert!((value(row) - mean(of, value)).abs() < 2e-3, "{line} at {} s", row.t_s);
            }
        }
    }
}

#[test]
fn distortion_is_that_of_the_pulses_alone() {
    for scheme in ["s", "rs", "rthd", "zvo"] {
        let chosen = catalogue::of_zs9(&format!("zs9-steady --dt 1e-5 --scheme {scheme}")).unwrap();
        let machine = chosen.machine().unwrap();
        let rows = chosen.drive(&machine).unwrap().written.unwrap();
        let stretch = bound::Stretch { carrier_hz: 1e4, step_s: 1e-5, count: rows.len() };
        let least = bound::currents(&rows, stretch, &machine).unwrap();
        for (motor, periods) in [20.0, 14.0].into_iter().enumerate() {
            let measured: Vec<f64> = rows.iter().map(|row| row.motors[motor].phases_a[0]).collect();
            let (measured, least) = (distortion(&measured, periods), distortion(&least[motor], periods));
            println!("{scheme}, motor {}: {measured:.3} %, by the pulses alone {least:.3} %", motor + 1);
            assert!(measured <= 1.005 * least, "{scheme}, motor {}: {measured} %, {least} %", motor + 1);
            assert!(least <= 1.01 * measured, "{scheme}, motor {}: {measured} %, {least} %", motor + 1);
        }
    }
}
