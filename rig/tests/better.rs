//! The numbers that the drive is to reach, on the host: ideal, and with a real inverter's flaws.

use serde_json::Value;
use tractive_rig::analysis::{self, Figures};
use tractive_rig::rows::mean;
use tractive_rig::scenario::catalogue;
use tractive_rig::trace::{Recorded, Recording};

/// Runs a scenario as on the command line, without a fault.
fn driven(line: &str) -> (Recording, Figures) {
    let chosen = catalogue::of_traction(line).unwrap();
    let machine = chosen.machine().unwrap();
    let recording = chosen.drive(&machine).unwrap();
    assert!(recording.trip().is_none(), "{line}: {:?}", recording.trip());
    let figures = chosen.figures(&recording, &machine);
    (recording, figures)
}

fn run(line: &str) -> Figures {
    driven(line).1
}

fn list<'a>(figures: &'a Figures, name: &str) -> &'a Vec<Value> {
    figures.get(name).and_then(Value::as_array).unwrap()
}

fn number(figures: &Value, name: &str) -> f64 {
    figures[name].as_f64().unwrap()
}

/// Every bound of the scenario is kept.
#[track_caller]
fn keeps_its_bounds(line: &str) -> (Recording, Figures) {
    let (recording, figures) = driven(line);
    let verdicts = list(&figures, "verdicts");
    assert!(!verdicts.is_empty(), "{line}");
    for verdict in verdicts {
        println!("{line}: {}: {} of {}", verdict["what"], verdict["found"], verdict["at_most"]);
        assert!(["pass", "reported"].contains(&verdict["verdict"].as_str().unwrap()), "{line}: {verdict}");
    }
    (recording, figures)
}

#[test]
fn load_steps_are_quick_and_exact() {
    keeps_its_bounds("load-steps");
    // The time that full torque in one step takes depends on where in the carrier the step comes.
    for delay_us in (0..550).step_by(50).chain([25, 75, 290, 310, 545]) {
        keeps_its_bounds(&format!("full-step --pwm-delay-us {delay_us}"));
    }
}

#[test]
fn torque_is_exact_at_the_characteristic_points() {
    keeps_its_bounds("characteristic");
    // On a low link, two to four of them are out of reach.
    for (udc_v, limited) in [(1000, 4), (1200, 2), (1800, 0)] {
        let line = format!("characteristic --udc {udc_v}");
        let (_, figures) = keeps_its_bounds(&line);
        let points = list(&figures, "points").iter();
        let less = points.filter(|point| number(point, "reference_nm") < 0.999 * number(point, "demand_nm"));
        assert_eq!(less.count(), limited, "{line}");
    }
}

#[test]
fn switches_of_mode_are_without_shock() {
    keeps_its_bounds("sweep --down");
    keeps_its_bounds("sweep --down --brake --to 2300");
    keeps_its_bounds("sweep --down --torque-scale 0.5 --to 6000");
    keeps_its_bounds("sweep --down --torque-scale 0.5 --brake --to 2800");
    keeps_its_bounds("mode-borders");
    for speed in [1800, 1890, 1900, 1950, 2200, 2500, 3000, 3500] {
        keeps_its_bounds(&format!("mode-borders --speed {speed}"));
    }
}

/// Torque at every edge of the pulses, which the rows of a trace may miss. Of the sweeps with 10 to 100 % of torque on 1,000, 1,500 and 1,800 V:
/// those with the largest excursions at mode changes, 58 N·m and 13.5 %, and one with the largest now, 23 N·m.
#[test]
fn at_part_load_on_any_link_too() {
    for load in [
        "--torque-scale 0.15 --udc 1800",
        "--torque-scale 0.25",
        "--torque-scale 0.5 --udc 1800",
        "--brake --torque-scale 0.1 --udc 1800",
        "--brake --udc 1800",
    ] {
        let line = format!("sweep --down {load}");
        let figures = run(&line);
        let switches = list(&figures, "mode_switches");
        assert!(switches.len() >= 8, "{line}: {} switches", switches.len());
        for switch in switches {
            assert!(number(switch, "edge_torque_excursion_nm") < 25.0, "{line}: {switch}");
            assert!(number(switch, "excess_percent") < 1.5, "{line}: {switch}");
        }
    }
}

#[test]
fn square_wave_gives_its_power_to_the_highest_speed() {
    for (line, power_w) in [("sweep --to 6000", 246.4e3), ("sweep --to 6000 --brake", -246.4e3)] {
        // Judged by the power itself, too, not only by what the drive makes of the demand.
        let (recording, _) = keeps_its_bounds(line);
        let tenths =
            (0..250).map(|k| analysis::window(&recording, 0.1 * f64::from(k), 0.1 * f64::from(k + 1)));
        let fast: Vec<_> = tenths.filter(|rows| rows.iter().all(|row| row.speed_rpm >= 1_905.0)).collect();
        assert!(fast.len() > 150, "{line}");
        for rows in fast {
            let found_w = mean(rows, |row| row.te_nm * row.speed_rpm * std::f64::consts::TAU / 60.0);
            assert!((found_w / power_w - 1.0).abs() < 0.005, "{line}: {found_w} W at {} s", rows[0].t_s);
        }
    }
}

#[test]
fn power_is_reversed_released_and_applied_again() {
    for speed in [2500, 4000, 6000, -4000] {
        keeps_its_bounds(&format!("reversal --speed {speed}"));
    }
}

#[test]
fn a_coasting_machine_is_caught_at_any_speed_in_the_mode_that_it_needs() {
    keeps_its_bounds("restart");
}

#[test]
fn distortion_is_what_pulses_and_inductances_allow() {
    let points = [
        "200 --torque 1235",
        "200 --torque 100",
        "500 --torque 1235",
        "700 --torque 1235",
        "700 --torque -1235",
        "1000 --torque 1235",
        "1050 --torque 1235",
        "1500 --torque 1235",
        "-1500 --torque 1235",
        "1800 --torque 1235",
        "2000 --torque 859.4",
        "2000 --torque 600",
        // Without torque there is hardly any fundamental: distortion, a share of it, is reported, not judged.
        "3000 --torque 0",
        "2000 --torque 1174.6",
        "4000 --torque 588",
        "6000 --torque 392",
    ];
    for point in points {
        keeps_its_bounds(&format!("steady --speed {point}"));
    }
}

#[test]
fn dead_time_leaves_no_harmonics() {
    let with = run("steady --speed 200 --torque 100 --dead-time-us 5");
    let without = run("steady --speed 200 --torque 100 --dead-time-us 5 --uncompensated");
    let share = |figures: &Figures, name: &str, order: u64| {
        let harmonics = list(figures, name);
        number(harmonics.iter().find(|one| one["order"] == order).unwrap(), "percent_of_fundamental")
    };
    for order in [5, 7] {
        let (with_it, alone) = (share(&with, "harmonics", order), share(&without, "harmonics", order));
        println!("{order}: {with_it} %, uncompensated {alone} %");
        assert!(with_it < 0.5);
        // An inverter's dead time of 5 µs must cost more than that at 200 r/min; otherwise nothing was left out.
        assert!(alone > 0.5, "{alone} %");
        // The report gives both for one run.
        assert_eq!(share(&with, "harmonics_without_compensation", order), alone);
        let row = |what: &str| {
            let verdicts = list(&with, "verdicts");
            let what = format!("harmonic {order} in % of the fundamental{what}");
            verdicts.iter().find(|one| one["what"] == what).unwrap().clone()
        };
        assert_eq!((&row("")["verdict"], number(&row(""), "found")), (&"pass".into(), with_it));
        let reported = row(", without compensation");
        assert_eq!((&reported["verdict"], number(&reported, "found")), (&"reported".into(), alone));
    }
}

/// The sixth harmonic of the dead time is tracked: where the current crosses zero slowly, its sign is not enough. Without tracking, 3.4
/// and 4.1 % were left.
#[test]
fn what_the_currents_sign_does_not_tell_of_the_dead_time_is_followed() {
    let figures = run("steady --speed 100 --torque 100 --dead-time-us 5");
    for harmonic in list(&figures, "harmonics").iter().filter(|one| one["order"] == 5 || one["order"] == 7) {
        assert!(number(harmonic, "percent_of_fundamental") < 0.5, "{harmonic}");
    }
}

#[test]
fn flaws_leave_the_switches_without_shock_and_torque_in_its_bounds() {
    const ALL: &str = "--dead-time-us 5 --adc-bits 12 --noise-a 0.5 --udc-ripple 30@300 --rs-error 50";
    let single =
        ["--dead-time-us 5", "--adc-bits 12", "--noise-a 0.5", "--udc-ripple 30@300", "--rs-error 50"];
    for flaws in single.into_iter().chain(["--angle-error 1"]) {
        keeps_its_bounds(&format!("sweep --down {flaws}"));
    }
    let all_at_once = [
        "sweep --down",
        "sweep --down --brake --to 2300",
        "characteristic",
        "load-steps",
        "sweep --to 6000",
        "sweep --down --torque-scale 0.5",
        "mode-borders --speed 1895",
        "reversal",
        "reversal --speed 6000",
        "restart",
    ];
    // The results page's "current at the switches within 1.5 %, mean torque at full torque within 0.5 %".
    let told = [("current over the larger steady envelope", 1.5), ("mean torque error", 0.5)];
    let mut seen = 0;
    for scenario in all_at_once {
        let (_, figures) = keeps_its_bounds(&format!("{scenario} {ALL}"));
        for verdict in list(&figures, "verdicts") {
            let what = verdict["what"].as_str().unwrap();
            for (_, most) in told.iter().filter(|(begins, _)| what.starts_with(begins)) {
                assert!(number(verdict, "found") <= *most, "{scenario}: {verdict}");
                seen += 1;
            }
        }
    }
    assert!(seen >= 11, "{seen}");
}

#[test]
fn a_wrong_map_is_noticed() {
    for (scale, percent) in [(1.0, 10.0), (1.0, -10.0), (1.0, 5.0), (1.0, -5.0), (0.8, -10.0)] {
        let line = format!("sweep --to 3000 --torque-scale {scale} --map-error {percent}");
        let figures = run(&line);
        let judged = |what: &str| {
            let verdicts = list(&figures, "verdicts").iter();
            verdicts
                .filter(|one| one["what"].as_str().unwrap().starts_with(what) && one["verdict"] == "pass")
                .count()
        };
        for what in ["peak current over that", "map error told", "hunting"] {
            assert_eq!(judged(what), 1, "{line}: {what}");
        }
    }
    for percent in [10, -10] {
        // A machine with a tenth less flux linkage reaches square wave by torque alone at a higher speed.
        let borders = if percent < 0 { "mode-borders --speed 2200" } else { "mode-borders" };
        for scenario in ["restart", "reversal", "link-steps", "load-steps", borders] {
            keeps_its_bounds(&format!("{scenario} --map-error {percent}"));
        }
    }
    let told = run("sweep").get("map_error_estimate_percent").and_then(Value::as_f64).unwrap();
    assert!(told.abs() < 0.1, "{told} % for a map that is right");
}

/// Each of the five borders is passed once on the way up and once on the way down.
#[test]
fn the_choice_of_mode_does_not_follow_the_links_ripple() {
    for ripple in ["60@50", "100@33", "100@50", "100@100", "30@300"] {
        let figures = run(&format!("sweep --down --udc-ripple {ripple}"));
        assert_eq!(list(&figures, "mode_switches").len(), 10, "{ripple}");
    }
}

/// A link that moves by 63 V in a millisecond, and one that reverses before a command acts: torque beyond the ripple band, which includes
/// the torque swing of the link itself. With commands computed for the link as it was sampled, it was up to 118 N·m.
#[test]
fn a_link_that_moves_leaves_the_switches_without_shock() {
    let scenarios = [
        "sweep --down",
        "sweep --down --brake --to 2300",
        "sweep --down --torque-scale 0.5",
        "mode-borders",
        "mode-borders --speed 1895",
    ];
    for ripple in ["100@33", "100@50", "100@100", "30@300"] {
        for scenario in scenarios {
            let line = format!("{scenario} --udc-ripple {ripple}");
            let figures = run(&line);
            for switch in list(&figures, "mode_switches") {
                assert!(number(switch, "torque_excursion_nm") < 22.0, "{line}: {switch}");
                assert!(number(switch, "excess_percent") < 2.0, "{line}: {switch}");
            }
        }
    }
}

/// From a twentieth of rated speed up, in every mode.
#[test]
fn the_torque_that_is_told_is_the_torque_that_flows() {
    for point in [
        "100 --torque 1235",
        "400 --torque -600",
        "800 --torque 1235",
        "1500 --torque 300",
        "2600 --torque 700",
    ] {
        for flaws in ["", "--rs-error 50 --map-error -10 --noise-a 0.5 --dead-time-us 5"] {
            let figures = run(&format!("steady --speed {point} {flaws}"));
            let told = number(&list(&figures, "point")[0], "told_error_percent");
            println!("{point} {flaws}: {told:.2} %");
            assert!(told < if flaws.is_empty() { 0.5 } else { 2.0 }, "{point} {flaws}: {told} %");
        }
    }
}

#[test]
fn the_link_may_be_anywhere_and_may_step() {
    for udc in [1000, 1200, 1800] {
        run(&format!("sweep --down --to 3000 --udc {udc}"));
    }
    for nominal in [1200, 1300, 1500, 1600] {
        keeps_its_bounds(&format!("link-steps --udc {nominal}"));
    }
    for scenario in ["restart --udc 1000", "reversal --udc 1000", "reversal --udc 1800"] {
        keeps_its_bounds(scenario);
    }
}

/// In square wave on a high link, the two signs of torque lie apart on the flux circle: no path leads past the magnets' flux.
#[test]
fn torque_turns_over_where_the_voltage_forces_more_flux_than_the_magnets() {
    for speed in [4600, 5000] {
        let figures = run(&format!("reversal --speed {speed} --udc 1800"));
        for point in list(&figures, "points") {
            let error = number(point, "torque_error_percent");
            assert!(error.abs() < 0.5, "{speed} r/min: {error} %");
        }
    }
}

/// Torque errors in percent at 200, 600, 859 and 1,235 N·m and the worst excess current that the specification names for the
/// paper's method.
const PAPERS: [(&str, [f64; 4], f64); 2] = [
    ("one pass from L(0, 0)", [-9.5, -26.5, -33.0, -40.0], 0.7),
    ("two passes from L(0, 0), as we read the paper", [-1.3, -7.1, -10.2, -14.8], 1.9),
];

#[test]
fn our_two_passes_beat_the_papers() {
    let figures = run("characteristic");
    let methods = list(&figures, "mtpa_methods");
    let of = |method: &str, name: &str| -> Vec<f64> {
        let own = methods.iter().filter(|one| one["method"] == method);
        own.map(|one| number(one, name)).collect()
    };
    let worst = |values: &[f64]| values.iter().fold(0.0_f64, |worst, value| worst.max(value.abs()));
    let both = |method: &str| (of(method, "torque_error_percent"), of(method, "excess_current_percent"));
    for (method, papers, excess) in PAPERS {
        let (torque, current) = both(method);
        println!("{method}: torque {torque:.2?} %, current {current:.3?} %");
        assert_eq!(torque.len(), 4);
        for (ours, papers) in torque.iter().zip(papers) {
            assert!((ours - papers).abs() < 0.5, "{method}: {ours} % where {papers} % is known");
        }
        assert!((worst(&current) - excess).abs() < 0.2, "{method}: {current:?} %");
    }
    let (started, _) = both("two passes as we start them");
    let (torque, current) = both("the same, trimmed: ours");
    println!("two passes as we start them: torque {started:.2?} %");
    println!("trimmed: torque {torque:.3?} %, current {current:.4?} %");
    assert!(started.len() == 4 && torque.len() == 4);
    assert!(worst(&torque) < 0.3 && worst(&current) < 0.05);
}

/// The drive reports all the time that the link does not allow the torque, and it gives the torque that it reports.
#[test]
fn a_torque_that_is_not_to_be_had_is_reported() {
    for (line, most_nm) in [
        ("steady --speed 2000 --torque 859.4 --udc 1000", 851.0),
        ("steady --speed 2000 --torque -1000 --udc 1000", 902.0),
        ("steady --speed 1500 --torque 1235 --udc 1000", 1116.0),
    ] {
        let (recording, _) = driven(line);
        let steady = analysis::window(&recording, 0.6, 1.1);
        let given_nm = mean(steady, |row| row.te_nm);
        for row in steady {
            assert!(row.te_ref_nm.abs() < most_nm, "{line}: {} N·m at {} s", row.te_ref_nm, row.t_s);
            assert!(
                (row.te_ref_nm / given_nm - 1.0).abs() < 0.002,
                "{line}: {} of {given_nm}",
                row.te_ref_nm
            );
        }
        println!("{line}: {given_nm}");
    }
}
