//! The scenarios on the host, held against their bounds.

use tractive::modulation::Mode;
use tractive_rig::analysis::{self, SwitchFigures};
use tractive_rig::scenario::catalogue;
use tractive_rig::trace::{Recorded, Recording};

/// Runs a scenario as on the command line; its figures and what was recorded.
fn run(line: &str) -> (analysis::Figures, Recording) {
    let chosen = catalogue::of_traction(line).unwrap();
    let machine = chosen.machine().unwrap();
    let recording = chosen.drive(&machine).unwrap();
    assert!(recording.trip().is_none(), "{:?}", recording.trip());
    (chosen.figures(&recording, &machine), recording)
}

/// The modes in order of use, without repetition.
fn order_of_modes(recording: &Recording) -> Vec<&'static str> {
    let mut order: Vec<_> = recording.rows.iter().map(|row| row.mode.name()).collect();
    order.dedup();
    order
}

/// Legal angles, switching frequency, and current at every switch.
fn check_switches(line: &str, recording: &Recording) {
    assert!(analysis::most_turn_ons(recording, 0.1) <= 91);
    let inside = recording.switches.iter().filter(|switch| switch.t_s > 0.0);
    for switch in inside.filter(|switch| switch.from.carriers() > 0) {
        let angle = switch.pulse_angle_deg.unwrap();
        let common =
            if switch.to == Mode::Async { switch.from.carriers() } else { gcd(switch.from, switch.to) };
        let grid = 360.0 / f64::from(common);
        let off = (angle / grid - (angle / grid).round()).abs() * grid;
        assert!(off < 1e-6, "{line}: {:?} -> {:?} at {angle}°", switch.from, switch.to);
    }
    for SwitchFigures { from, to, excess_percent, .. } in analysis::mode_switches(recording) {
        println!("{line}: {from} -> {to}: {excess_percent:.2} %");
        assert!(excess_percent < 1.5, "{line}: {from} -> {to}: {excess_percent} %");
    }
}

fn gcd(a: Mode, b: Mode) -> u32 {
    (1..=18).rev().find(|n| a.carriers().is_multiple_of(*n) && b.carriers().is_multiple_of(*n)).unwrap()
}

const UP: [&str; 6] = ["async", "sync15", "sync12", "mid7", "mid3", "square"];

#[test]
fn the_sweep_goes_through_all_modes_and_back() {
    let (_, recording) = run("sweep --down");
    let back = UP.iter().rev().skip(1);
    let wanted: Vec<_> = UP.iter().chain(back).copied().collect();
    assert_eq!(order_of_modes(&recording), wanted);
    check_switches("sweep --down", &recording);
    let top = analysis::window(&recording, 8.5, 9.0);
    let torque = top.iter().map(|row| row.te_nm).sum::<f64>() / top.len() as f64;
    assert!((torque / 1176.4 - 1.0).abs() < 0.01, "246.4 kW at 2,000 r/min: {torque} N·m");
}

#[test]
fn braking_and_backward_rotation_do_the_same() {
    for line in [
        "sweep --brake --to 2300",
        "sweep --to -2000",
        "sweep --brake --to -2300",
        "sweep --torque-scale 0.5 --down",
    ] {
        let (_, recording) = run(line);
        if !line.contains("scale") {
            assert_eq!(order_of_modes(&recording), UP, "{line}");
        }
        check_switches(line, &recording);
    }
}

#[test]
fn backward_is_the_mirror_image_of_forward() {
    let (forward, backward) = (run("sweep").1, run("sweep --to -2000").1);
    for (a, b) in forward.rows.iter().zip(&backward.rows).step_by(997) {
        assert!((a.te_nm + b.te_nm).abs() < 15.0, "{} {} {}", a.t_s, a.te_nm, b.te_nm);
        assert_eq!(a.mode, b.mode, "{}", a.t_s);
    }
}

#[test]
fn figures_are_the_same_however_densely_the_trace_is_written() {
    let (figures, recording) = run("load-steps");
    let (verdicts, rows) = (figures.get("verdicts").unwrap(), recording.rows.len());
    assert!(recording.written.is_none());
    for (step_s, every) in [("1e-4", 2), ("3e-4", 6)] {
        let (figures, recording) = run(&format!("load-steps --dt {step_s}"));
        assert_eq!(figures.get("verdicts").unwrap(), verdicts, "{step_s} s");
        let written = recording.written.unwrap();
        assert_eq!((recording.rows.len(), written.len()), (rows, rows.div_ceil(every)), "{step_s} s");
        for (written, judged) in written.iter().zip(recording.rows.iter().step_by(every)) {
            assert_eq!(written.te_nm.to_bits(), judged.te_nm.to_bits(), "at {} s", judged.t_s);
        }
    }
}

#[test]
fn an_angle_read_late_costs_the_torque_ripple_that_the_page_on_latency_tells() {
    let page = include_str!("../../docs/latency.md");
    for (jitter_us, read) in [(0, "0 µs, as captured"), (2, "2 µs"), (8, "8 µs")] {
        let line = format!("steady --speed 3000 --torque 784 --angle-jitter-us {jitter_us}");
        let ripple_nm =
            run(&line).0.get("distortion").unwrap()[0]["ripple_peak_to_peak_nm"].as_f64().unwrap();
        let told = format!("| {read} | {ripple_nm:.1} N·m |");
        println!("{told}");
        assert!(page.contains(&told), "{told}");
    }
}

#[test]
fn characteristic_currents_are_the_ratings() {
    let (figures, _) = run("characteristic");
    let points = figures.get("points").unwrap().as_array().unwrap();
    assert_eq!(points.len(), 7);
    for point in points {
        assert!(point["current_rms_a"].as_f64().unwrap() < 165.0, "{point}");
    }
    // The rated point does not need the voltage of square wave; full power at the same speed does.
    let modes: Vec<_> = points[5..].iter().map(|point| point["mode"].as_str().unwrap()).collect();
    assert_eq!(modes, ["mid3", "square"]);
}

/// The guide's numbers of what the papers claim and this drive does not reach.
#[test]
fn the_guide_says_what_is_not_reached() {
    let page = include_str!("../../docs/papers.md").split_whitespace().collect::<Vec<_>>().join(" ");
    let of = |line: &str, list: &str, name: &str| -> Vec<f64> {
        let (figures, _) = run(line);
        figures.get(list).unwrap().as_array().unwrap().iter().map(|one| one[name].as_f64().unwrap()).collect()
    };
    let [at_200, at_500, at_1000, at_1500, fast @ ..] =
        &of("characteristic", "points", "efficiency_percent")[..]
    else {
        panic!("seven points")
    };
    let (low, high) =
        fast.iter().fold((f64::MAX, 0.0_f64), |(low, high), one| (low.min(*one), high.max(*one)));
    let highest_nm = of("load-steps", "steps", "highest_nm");
    for told in [
        format!(
            "{at_200:.1} % at 200 r/min, {at_500:.1} at 500, {at_1000:.1} at 1,000, {at_1500:.1} at 1,500"
        ),
        format!("and {low:.1} to {high:.1} from 1,905 r/min on"),
        format!("{:.1} A in 0.1 Ω", of("characteristic", "points", "current_rms_a")[0]),
        format!("from 200 to 0 N·m to {:.0} N·m", highest_nm[11]),
        format!("the ripple of 200 N·m alone reaches {:.0}", highest_nm[0]),
    ] {
        assert!(page.contains(&told), "docs/papers.md does not say: {told}");
    }
}

#[test]
fn a_link_out_of_range_trips_at_once_and_by_name() {
    for (line, name) in [("sweep --udc 2200", "dc_overvoltage"), ("sweep --udc 700", "dc_undervoltage")] {
        let chosen = catalogue::of_traction(line).unwrap();
        let machine = chosen.machine().unwrap();
        let recording = chosen.drive(&machine).unwrap();
        assert_eq!(recording.trip().unwrap().fault.name(), name);
        assert!(recording.rows.iter().all(|row| row.mode == Mode::Off));
        assert!(recording.edges.is_empty(), "no gate ever moves");
    }
}

#[test]
fn overspeed_trips_into_the_short_circuit() {
    let chosen = catalogue::of_traction("sweep --to 6900").unwrap();
    let recording = chosen.drive(&chosen.machine().unwrap()).unwrap();
    let trip = recording.trip().unwrap();
    assert_eq!(trip.fault.name(), "overspeed");
    assert!((trip.value - trip.limit).abs() < 0.1, "{trip:?}");
    let last = recording.rows.last().unwrap();
    // Short-circuit current of the map at high speed, and the torque of its losses.
    let current = last.id_a.hypot(last.iq_a);
    assert!((current - 193.0).abs() < 3.0, "{current} A");
}
