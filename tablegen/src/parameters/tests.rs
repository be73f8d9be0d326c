//! Values of ratings relative to each other, words, ranges at their ends.

use super::*;
use crate::testing::{IPM, near};
use std::path::PathBuf;

fn reference() -> Parameters {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tables/pmasynrm-180kw/machine.toml");
    Parameters::read(&file).unwrap()
}

/// The reference machine's parameters, with some keys' lines replaced.
fn with(lines: &[&str]) -> Result<Parameters, InputError> {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tables/pmasynrm-180kw/machine.toml");
    let good = std::fs::read_to_string(file).unwrap();
    let key = |line: &str| line.split(' ').next().unwrap_or_default().to_owned();
    let kept = good.lines().filter(|line| lines.iter().all(|own| key(own) != key(line)));
    let text: Vec<_> = kept.chain(lines.iter().copied()).collect();
    Parameters::parse(&text.join("\n"), &PathBuf::from("machine.toml"))
}

#[test]
fn patterns_by_their_names() {
    let patterns = |line: &str| with(&[line]).map(|parameters| parameters.patterns).ok();
    assert_eq!(patterns("patterns = \"paper\""), Some(Patterns::Paper));
    assert_eq!(patterns("patterns = \"optimal\""), Some(Patterns::Optimal));
    assert_eq!(patterns("patterns = \"papers\""), None);
    assert_eq!(reference().patterns, Patterns::Paper);
}

#[test]
fn orders_of_the_reference_machine() {
    let parameters = reference();
    let limits = [
        (859.4, 1235.0, true),
        (2000.0, 6000.0, true),
        (1000.0, 1500.0, true),
        (1500.0, 1800.0, true),
        (1800.0, 2070.0, false),
        (850.0, 1000.0, false),
        (233.345, 303.348_5, false),
        (6000.0, 6600.0, false),
    ];
    let margins = [
        (179_992.315_1, 248_864.0),
        (246_400.0, 783_733.119_3),
        (303.348_5, 933.38),
        (2070.0, 5400.0),
        (6600.0, 18_000.0),
        (23.334_5, 750.0),
        (12_350.0, 1_235_000.0),
        (12.35, 12_350.0),
        (5_409.0, 246_400.0),
        (1.017_519_888, 600.0),
    ];
    for (order, (low, high, may_be_equal)) in parameters.limits().iter().zip(limits) {
        near(order.low.1, low, 1e-9);
        near(order.high.1, high, 1e-9);
        assert_eq!(order.may_be_equal, may_be_equal, "{}", order.low.0);
    }
    for (order, (low, high)) in parameters.margins().iter().zip(margins) {
        near(order.low.1, low, 1e-7);
        near(order.high.1, high, 1e-7);
        assert!(order.may_be_equal, "{}", order.low.0);
    }
}

/// Equal values are accepted where they may be equal, and values just beyond are not; the other way round where they may not.
#[test]
fn orders_at_equality() {
    for (line, beyond) in [
        ("rated_torque_nm = 1235.0", "rated_torque_nm = 1235.1"),
        ("dc_link_min_v = 1500.0", "dc_link_min_v = 1500.1"),
        ("dc_link_max_v = 1500.0", "dc_link_max_v = 1499.9"),
        ("trip_dc_over_v = 5400.0", "trip_dc_over_v = 5400.1"),
        ("trip_speed_rpm = 18000.0", "trip_speed_rpm = 18000.1"),
        ("torque_slew_nm_per_s = 1235000.0", "torque_slew_nm_per_s = 1235000.1"),
        ("torque_slew_nm_per_s = 12.35", "torque_slew_nm_per_s = 12.34"),
        ("loss_rated_w = 246400.0", "loss_rated_w = 246401.0"),
        ("trip_current_a = 933.38", "trip_current_a = 933.381"),
        ("min_id_a = -233.345", "min_id_a = -233.346"),
        ("max_switching_hz = 400.0", "max_switching_hz = 399.999"),
        ("trip_dc_over_v = 1800.001", "trip_dc_over_v = 1800.0"),
        ("trip_dc_under_v = 999.999", "trip_dc_under_v = 1000.0"),
        ("trip_current_a = 233.346", "trip_current_a = 233.345"),
        ("trip_speed_rpm = 6000.001", "trip_speed_rpm = 6000.0"),
    ] {
        // With a rated torque that large the rated power exceeds the machine's.
        let good = with(&[line, "rated_speed_rpm = 1500.0"]);
        assert!(good.is_ok(), "{line}: {:?}", good.err().map(|error| error.to_string()));
        let wrong = with(&[beyond, "rated_speed_rpm = 1500.0"]);
        assert!(wrong.is_err(), "{beyond}");
    }
}

#[test]
fn ranges_hold_their_ends() {
    for (line, beyond) in [
        ("pole_pairs = 1", "pole_pairs = 0"),
        ("pole_pairs = 100", "pole_pairs = 101"),
        ("loss_quadratic_fraction = 0", "loss_quadratic_fraction = -0.001"),
        ("loss_quadratic_fraction = 1.0", "loss_quadratic_fraction = 1.001"),
        ("iron_loss_share = 0", "iron_loss_share = -0.001"),
        ("iron_loss_share = 1.0", "iron_loss_share = 1.001"),
        ("stator_resistance_ohm = 0", "stator_resistance_ohm = -1e-9"),
        ("max_switching_hz = 1e5", "max_switching_hz = 100_001"),
        ("rotor_inertia_kg_m2 = 1e-9", "rotor_inertia_kg_m2 = 0.9e-9"),
    ] {
        let good = with(&[line, "max_speed_rpm = 3000", "max_switching_hz = 1e5"]);
        let good = if line.starts_with("max_switching") { with(&[line]) } else { good };
        assert!(good.is_ok(), "{line}: {:?}", good.err().map(|error| error.to_string()));
        assert!(with(&[beyond]).is_err(), "{beyond}");
    }
    let said = |line: &str| with(&[line]).err().map(|error| error.to_string()).unwrap_or_default();
    assert!(said("rotor_inertia_kg_m2 = 0").contains("must be a number above 0, up to 10000000"));
    assert!(said("max_switching_hz = 7").contains("must be a number from 50 to 100000"));
}

#[test]
fn defaults_of_the_linear_machine() {
    let parameters = IPM.folder(&[]).parameters;
    for (value, expected) in [
        (parameters.min_id_a, -20.0),
        (parameters.trip_current_a, 26.0),
        (parameters.trip_dc_over_v, 402.5),
        (parameters.trip_dc_under_v, 212.5),
        (parameters.trip_speed_rpm, 3300.0),
        (parameters.torque_slew_nm_per_s, 220.0),
        (parameters.rotor_inertia_kg_m2, 0.070_028_174_96),
        (parameters.loss_rated_w, 0.0),
        (parameters.loss_quadratic_fraction, 0.6),
        (parameters.iron_loss_share, 0.0),
    ] {
        near(value, expected, 1e-9);
    }
    assert_eq!(parameters.least_id_a(), f64::NEG_INFINITY, "the largest current is no limit");
    assert_eq!(IPM.folder(&["min_id_a = -19.5"]).parameters.least_id_a(), -19.5);
}

#[test]
fn losses_over_speed() {
    let parameters = reference();
    for (rpm, watts) in [
        (0.0, 0.0),
        (1000.0, 5409.0 * (0.6 * 0.25 + 0.4 * 0.5)),
        (-1000.0, 5409.0 * 0.35),
        (2000.0, 5409.0),
        (6000.0, 5409.0 * (0.6 * 9.0 + 0.4 * 3.0)),
    ] {
        near(parameters.speed_loss_w(rpm), watts, 1e-12);
    }
}

#[test]
fn words_and_lines() {
    for (a, b, count) in [
        ("kitten", "sitting", 3),
        ("", "abc", 3),
        ("abc", "", 3),
        ("flaw", "lawn", 2),
        ("same", "same", 0),
        ("ab", "ba", 2),
        ("intention", "execution", 5),
    ] {
        assert_eq!(slips(a, b), count, "{a} {b}");
    }
    for (offset, line) in [(0, 1), (1, 1), (2, 2), (3, 3), (4, 3), (99, 4)] {
        assert_eq!(line_at("a\n\nb\n", offset), line, "{offset}");
    }
    assert!(unknown("pole_pears").ends_with("must probably be pole_pairs"));
    assert!(unknown("nime").ends_with("must probably be name"));
    assert!(unknown("trip_speed").ends_with("wrong unit: must be trip_speed_rpm"));
}
