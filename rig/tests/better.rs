//! The numbers that the drive is to reach, on the host: ideal, and with a real inverter's flaws.

use clap::Parser;
use serde_json::Value;
use tractive_rig::analysis::Figures;
use tractive_rig::machine::Machine;
use tractive_rig::options::RunOptions;
use tractive_rig::scenario;

#[derive(Parser)]
struct Line {
    scenario: String,
    #[command(flatten)]
    options: RunOptions,
}

/// Runs a scenario as on the command line, without a fault.
fn run(line: &str) -> Figures {
    let parsed = Line::parse_from(std::iter::once("test").chain(line.split(' ')));
    let machine = Machine::load(parsed.options.machine()).unwrap();
    let scenario = scenario::find(&parsed.scenario).unwrap();
    let recording = scenario::drive(scenario.as_ref(), &parsed.options, &machine).unwrap();
    assert!(recording.trip().is_none(), "{line}: {:?}", recording.trip());
    scenario.figures(&recording, &parsed.options, &machine)
}

fn list<'a>(figures: &'a Figures, name: &str) -> &'a Vec<Value> {
    figures.get(name).and_then(Value::as_array).unwrap()
}

fn number(figures: &Value, name: &str) -> f64 {
    figures[name].as_f64().unwrap()
}

/// Every bound of the scenario is kept.
#[track_caller]
fn keeps_its_bounds(line: &str) {
    let figures = run(line);
    let verdicts = list(&figures, "verdicts");
    assert!(!verdicts.is_empty(), "{line}");
    for verdict in verdicts {
        println!("{line}: {}: {} of {}", verdict["what"], verdict["found"], verdict["at_most"]);
        assert_ne!(verdict["verdict"], "falls short", "{line}: {verdict}");
    }
}

#[test]
fn load_steps_are_quick_and_exact() {
    keeps_its_bounds("load-steps");
    // How long full torque in one step takes depends on where in the carrier it comes.
    for delay_us in (0..550).step_by(50).chain([25, 75, 290, 310, 545]) {
        keeps_its_bounds(&format!("full-step --pwm-delay-us {delay_us}"));
    }
}

#[test]
fn torque_is_exact_at_the_characteristic_points() {
    keeps_its_bounds("characteristic");
}

#[test]
fn switches_of_mode_are_without_shock() {
    keeps_its_bounds("sweep --down");
    keeps_its_bounds("sweep --down --brake --to 2300");
    keeps_its_bounds("sweep --down --torque-scale 0.5");
    for speed in [1700, 1885, 1890, 1900, 1950, 2200] {
        keeps_its_bounds(&format!("mode-borders --speed {speed}"));
    }
}

#[test]
fn square_wave_gives_its_power_to_the_highest_speed() {
    keeps_its_bounds("sweep --to 6000");
    keeps_its_bounds("sweep --to 6000 --brake");
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
    let share = |figures: &Figures, order: u64| {
        let harmonics = list(figures, "harmonics");
        number(harmonics.iter().find(|one| one["order"] == order).unwrap(), "percent_of_fundamental")
    };
    for order in [5, 7] {
        println!("{order}: {} %, uncompensated {} %", share(&with, order), share(&without, order));
        assert!(share(&with, order) < 0.5 && share(&with, order) < share(&without, order));
    }
}

#[test]
fn flaws_leave_the_switches_without_shock_and_torque_in_its_bounds() {
    const ALL: &str = "--dead-time-us 5 --adc-bits 12 --noise-a 0.5 --udc-ripple 30@300 --rs-error 50";
    let single =
        ["--dead-time-us 5", "--adc-bits 12", "--noise-a 0.5", "--udc-ripple 30@300", "--rs-error 50"];
    for flaws in single.into_iter().chain(["--angle-error 1", ALL]) {
        keeps_its_bounds(&format!("sweep --down {flaws}"));
    }
    keeps_its_bounds(&format!("sweep --down --brake --to 2300 {ALL}"));
    for scenario in ["characteristic", "load-steps", "sweep --to 6000", "sweep --down --torque-scale 0.5"] {
        keeps_its_bounds(&format!("{scenario} {ALL}"));
    }
    for scenario in ["mode-borders --speed 1895", "reversal", "reversal --speed 6000", "restart"] {
        keeps_its_bounds(&format!("{scenario} {ALL}"));
    }
}

#[test]
fn a_wrong_map_is_noticed() {
    const NOMINAL_PEAK_A: f64 = 247.0;
    for percent in [10.0, -10.0, 5.0, -5.0] {
        let figures = run(&format!("sweep --to 3000 --map-error {percent}"));
        let value = |name: &str| figures.get(name).and_then(Value::as_f64).unwrap();
        let (told, peak) = (value("map_error_estimate_percent"), value("peak_current_a"));
        println!("{percent} %: told {told} %, peak {peak} A");
        assert!((told - percent).abs() < 1.0, "{told} % for {percent} %");
        assert!(peak < 1.1 * NOMINAL_PEAK_A, "{peak} A");
    }
    for percent in [10, -10] {
        for scenario in ["restart", "reversal", "link-steps", "load-steps", "mode-borders"] {
            keeps_its_bounds(&format!("{scenario} --map-error {percent}"));
        }
    }
    let told = run("sweep").get("map_error_estimate_percent").and_then(Value::as_f64).unwrap();
    assert!(told.abs() < 0.1, "{told} % for a map that is right");
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

/// In square wave on a high link the two signs of torque lie apart on the circle of flux: no way leads past the magnets' flux.
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

#[test]
fn our_two_passes_beat_the_papers() {
    let figures = run("characteristic");
    let methods = list(&figures, "mtpa_methods");
    let worst = |method: &str, name: &str| {
        let own = methods.iter().filter(|one| one["method"] == method);
        own.map(|one| number(one, name).abs()).fold(0.0, f64::max)
    };
    for method in ["one pass from L(0, 0)", "two passes from L(0, 0), the paper's", "two passes, ours"] {
        let (torque, current) =
            (worst(method, "torque_error_percent"), worst(method, "excess_current_percent"));
        println!("{method}: torque {torque:.2} %, current {current:.3} %");
    }
    assert!(worst("two passes, ours", "torque_error_percent") < 0.3);
    assert!(worst("two passes, ours", "excess_current_percent") < 0.05);
    assert!(worst("two passes from L(0, 0), the paper's", "torque_error_percent") > 5.0);
}
