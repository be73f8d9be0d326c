//! Every way `machine.toml` can be wrong is refused, in one line that names file, line, key, value and what is allowed.
#![allow(missing_docs)]

mod common;

use common::{Folder, good_map, good_toml, toml_with};
use tractive_tablegen::Patterns;

/// The error of reading a folder with this `machine.toml`, without the folder's path.
#[track_caller]
fn refusal(machine: &str) -> String {
    let folder = Folder::new(machine, &good_map());
    let text = folder.refusal();
    assert_eq!(text.lines().count(), 1, "{text}");
    println!("{text}");
    let prefix = format!("{}/machine.toml", folder.path().display());
    text.strip_prefix(&prefix).expect("names the file").to_owned()
}

/// The line, from 1, on which a key stands.
fn line_of(machine: &str, key: &str) -> usize {
    1 + machine.lines().position(|line| line.starts_with(key)).expect("the key is there")
}

/// With one key's line replaced, the refusal names the new line's place, and says this.
#[track_caller]
fn says(key: &str, line: &str, what: &str) {
    let machine = toml_with(key, line);
    let text = refusal(&machine);
    let place = format!(":{}: ", line_of(&machine, line));
    assert!(text.starts_with(&place), "{text}\nmust begin with {place}");
    assert!(text.contains(what), "{text}\nmust contain {what}");
}

const REQUIRED: [&str; 13] = [
    "name",
    "pole_pairs",
    "stator_resistance_ohm",
    "max_torque_nm",
    "max_power_w",
    "max_current_a",
    "max_speed_rpm",
    "rated_torque_nm",
    "rated_speed_rpm",
    "dc_link_min_v",
    "dc_link_nominal_v",
    "dc_link_max_v",
    "max_switching_hz",
];

#[test]
fn a_missing_key() {
    Folder::new(&good_toml(), &good_map()).read().unwrap();
    for key in REQUIRED {
        assert_eq!(refusal(&toml_with(key, "")), format!(": {key}: missing: must be given"));
    }
}

#[test]
fn a_key_in_another_unit_names_the_one_that_was_meant() {
    for (key, wrong) in [
        ("max_speed_rpm", "max_speed_rad_s"),
        ("max_speed_rpm", "max_speed"),
        ("max_current_a", "max_current_ka"),
        ("max_current_a", "max_current_a_rms"),
        ("max_power_w", "max_power_kw"),
        ("max_torque_nm", "max_torque_knm"),
        ("rated_speed_rpm", "rated_speed_hz"),
        ("stator_resistance_ohm", "stator_resistance_mohm"),
        ("dc_link_min_v", "dc_link_min_kv"),
        ("dc_link_max_v", "dc_link_max_kv"),
        ("max_switching_hz", "max_switching_khz"),
        ("loss_rated_w", "loss_rated_kw"),
        ("torque_slew_nm_per_s", "torque_slew_nm_s"),
    ] {
        says(key, &format!("{wrong} = 1.0"), &format!("{wrong}: wrong unit: must be {key}"));
    }
}

#[test]
fn an_unknown_key() {
    says("pole_pairs", "poles_pair = 4", "poles_pair: unknown key: must probably be pole_pairs");
    let machine = good_toml() + "\ncolour = \"red\"\n";
    let text = refusal(&machine);
    let begin =
        format!(":{}: colour: unknown key: must be one of name, pole_pairs", line_of(&machine, "colour"));
    assert!(text.starts_with(&begin), "{text}");
    let machine = good_toml() + "\n[limits]\nmax_torque_nm = 3.0\n";
    assert!(refusal(&machine).contains("limits: unknown key"));
}

#[test]
fn patterns_that_there_are_not() {
    let with = |patterns: &str| good_toml() + &format!("\npatterns = {patterns}\n");
    for wrong in ["\"best\"", "7", "true"] {
        let text = refusal(&with(wrong));
        assert!(text.ends_with(&format!("patterns: {wrong}: must be \"paper\" or \"optimal\"")), "{text}");
    }
    let read = |toml: &str| Folder::new(toml, &good_map()).read().unwrap().parameters.patterns;
    assert_eq!(read(&good_toml()), Patterns::Paper);
    assert_eq!(read(&with("\"optimal\"")), Patterns::Optimal);
}

#[test]
fn a_wrong_type() {
    says("max_torque_nm", "max_torque_nm = \"1235\"", "max_torque_nm: \"1235\": must be a number ");
    says("max_torque_nm", "max_torque_nm = true", "max_torque_nm: true: must be a number ");
    says("max_torque_nm", "max_torque_nm = [1235.0]", "max_torque_nm: [1235.0]: must be a number ");
    says("max_torque_nm", "max_torque_nm = 0x10", "max_torque_nm: 0x10: must be a number ");
    says("name", "name = 7", "name: 7: must be a text in quotes");
    says("name", "name = \"  \"", "must be a text in quotes that is not empty");
    says("pole_pairs", "pole_pairs = 4.5", "pole_pairs: 4.5: must be a whole number from 1 to 100");
}

#[test]
fn a_number_that_is_none() {
    for key in REQUIRED.into_iter().skip(1) {
        for value in ["nan", "inf", "-inf", "1e999"] {
            says(key, &format!("{key} = {value}"), &format!("{key}: {value}: must be a number "));
        }
    }
}

#[test]
fn a_number_out_of_range() {
    for key in REQUIRED.into_iter().skip(1) {
        says(key, &format!("{key} = -1.0"), &format!("{key}: -1.0: must be a number "));
        says(key, &format!("{key} = 1e12"), &format!("{key}: 1e12: must be a number "));
        if key != "stator_resistance_ohm" {
            says(key, &format!("{key} = 0"), &format!("{key}: 0: must be a number "));
        }
    }
    says(
        "loss_quadratic_fraction",
        "loss_quadratic_fraction = 1.1",
        "loss_quadratic_fraction: 1.1: must be a number from 0 to 1",
    );
}

#[test]
fn integers_with_underscores_are_numbers() {
    let machine = toml_with("max_speed_rpm", "max_speed_rpm = 6_000");
    let folder = Folder::new(&machine, &good_map());
    assert_eq!(folder.read().unwrap().parameters.max_speed_rpm, 6000.0);
}

#[test]
fn devices_that_switch_too_seldom() {
    says("max_switching_hz", "max_switching_hz = 60.0", "max_switching_hz: 60: must be at least 400");
    says("max_switching_hz", "max_switching_hz = 399.0", "the stator frequency at max_speed_rpm 6000");
    let folder = Folder::new(&toml_with("max_switching_hz", "max_switching_hz = 400.0"), &good_map());
    assert!(folder.read().is_ok());
}

/// Neither a device without end nor a pipe without a writer is waited for.
#[test]
fn what_is_no_file() {
    for name in ["machine.toml", "flux_map.csv"] {
        for device in ["/dev/zero", "/dev/tty", "/"] {
            let folder = Folder::new(&good_toml(), &good_map());
            let path = folder.path().join(name);
            std::fs::remove_file(&path).unwrap();
            std::os::unix::fs::symlink(device, &path).unwrap();
            let text = folder.refusal();
            assert!(text.ends_with(&format!("{name}: cannot be read: must be a regular file")), "{text}");
        }
        let folder = Folder::new(&good_toml(), &good_map());
        std::fs::File::create(folder.path().join(name)).unwrap().set_len((16 << 20) + 1).unwrap();
        let text = folder.refusal();
        assert!(
            text.ends_with(&format!("{name}: cannot be read: must be at most 16777216 bytes long")),
            "{text}"
        );
    }
}

#[test]
fn limits_that_contradict_each_other() {
    says("rated_torque_nm", "rated_torque_nm = 1300.0", "must be at most max_torque_nm, 1235");
    says("rated_speed_rpm", "rated_speed_rpm = 7000.0", "must be at most max_speed_rpm, 6000");
    says("dc_link_min_v", "dc_link_min_v = 1600.0", "must be at most dc_link_nominal_v, 1500");
    says("dc_link_nominal_v", "dc_link_nominal_v = 1900.0", "must be at most dc_link_max_v, 1800");
    says("max_power_w", "max_power_w = 2e6", "must be at most power of max_torque_nm at max_speed_rpm");
    // Another key's line, as the product of two has none.
    let text = refusal(&toml_with("max_power_w", "max_power_w = 100e3"));
    assert!(text.contains("power of rated_torque_nm at rated_speed_rpm: 179"), "{text}");
    for (line, what) in [
        ("trip_current_a = 233.345", "max_current_a: 233.345: must be below trip_current_a, 233.345"),
        ("trip_dc_over_v = 1800.0", "dc_link_max_v: 1800: must be below trip_dc_over_v, 1800"),
        ("trip_dc_under_v = 1000.0", "trip_dc_under_v: 1000: must be below dc_link_min_v, 1000"),
        ("trip_speed_rpm = 5000.0", "max_speed_rpm: 6000: must be below trip_speed_rpm, 5000"),
    ] {
        let key = line.split(' ').next().unwrap();
        let rest = good_toml().lines().filter(|old| !old.starts_with(key)).collect::<Vec<_>>().join("\n");
        let text = refusal(&format!("{rest}\n{line}\n"));
        assert!(text.contains(what), "{text}");
    }
}

/// A demagnetisation limit that takes away what the largest current alone would give, or that limits nothing.
#[test]
fn a_demagnetisation_limit_that_leaves_too_little() {
    let with = |line: &str| good_toml() + "\n" + line + "\n";
    for (line, what) in [
        ("min_id_a = -240.0", "min_id_a: -240: must be from -233.345, −max_current_a, to 0"),
        ("min_id_a = 5.0", "min_id_a: 5.0: must be a number from -100000 to 0"),
        ("min_id = -100.0", "min_id: wrong unit: must be min_id_a"),
        ("min_id_a = -152.0", "min_id_a: -152: must be at or below -152.1, which max_torque_nm takes"),
    ] {
        let text = refusal(&with(line));
        assert!(text.contains(what), "{text}");
    }
    // A machine of less torque weakens less for it than for the highest speed, and than for the rated point on a low link.
    let weak = toml_with("max_torque_nm", "max_torque_nm = 870.0") + "\nmin_id_a = -120.0\n";
    let text = refusal(&weak);
    assert!(
        text.contains("-120: must be at or below -14")
            && text.ends_with("which no torque at max_speed_rpm on dc_link_min_v takes"),
        "{text}"
    );
    let slow = weak.replace("max_speed_rpm = 6000.0", "max_speed_rpm = 2800.0");
    assert!(Folder::new(&slow, &good_map()).read().is_ok());
    let fast = slow.replace("rated_speed_rpm = 2000.0", "rated_speed_rpm = 2690.0");
    let text = refusal(&fast);
    assert!(text.ends_with("which rated_torque_nm at rated_speed_rpm on dc_link_nominal_v takes"), "{text}");
    // Where the largest current does not weaken as far as the speed asks for, the limit takes nothing away.
    let mut fast = slow;
    for (from, to) in [
        ("max_speed_rpm = 2800.0", "max_speed_rpm = 60000.0"),
        ("max_switching_hz = 900.0", "max_switching_hz = 5000.0"),
        ("max_torque_nm = 870.0", "max_torque_nm = 500.0"),
        ("rated_torque_nm = 859.4", "rated_torque_nm = 400.0"),
        ("max_current_a = 233.345", "max_current_a = 180.0"),
    ] {
        assert!(fast.contains(from), "{from}");
        fast = fast.replace(from, to);
    }
    Folder::new(&fast, &good_map()).read().unwrap();
}

/// A thousand times what is good is nonsense for every key, and told by the key's name.
#[test]
fn a_number_a_thousand_times_too_large() {
    let optional = [
        ("trip_current_a", 303.0),
        ("trip_dc_over_v", 2_070.0),
        ("trip_dc_under_v", 850.0),
        ("trip_speed_rpm", 6_600.0),
        ("torque_slew_nm_per_s", 12_350.0),
        ("rotor_inertia_kg_m2", 2.0),
        ("loss_rated_w", 5_409.0),
        ("loss_quadratic_fraction", 0.6),
    ];
    let good = good_toml();
    let value = |key: &str| -> f64 {
        let line = good.lines().find(|line| line.starts_with(&format!("{key} ="))).unwrap();
        line.split(['=', '#']).nth(1).unwrap().trim().parse().unwrap()
    };
    let required = REQUIRED.into_iter().skip(1).map(|key| (key, value(key)));
    for (key, value) in required.chain(optional) {
        let rest = good.lines().filter(|old| !old.starts_with(key)).collect::<Vec<_>>().join("\n");
        Folder::new(&format!("{rest}\n{key} = {value:.4}\n"), &good_map()).read().unwrap();
        let text = refusal(&format!("{rest}\n{key} = {}\n", value * 1e3));
        assert!(text.contains(key), "{key}: {text}");
    }
}

#[test]
fn a_torque_or_a_current_beyond_the_map() {
    let text = refusal(&toml_with("max_current_a", "max_current_a = 150.0"));
    assert!(text.contains("max_torque_nm: 1235: must be at most"), "{text}");
    says("max_torque_nm", "max_torque_nm = 1250.0", "max_torque_nm: 1250: must be at most 1243");
    let folder = Folder::new(&toml_with("max_current_a", "max_current_a = 260.0"), &good_map());
    let text = folder.refusal();
    assert!(text.contains("must begin at or below −max_current_a, -260"), "{text}");
}

#[test]
fn what_is_not_toml() {
    says("max_torque_nm", "max_torque_nm = 12 35", "not TOML");
    says("max_torque_nm", "max_torque_nm = ", "not TOML");
    let machine = good_toml() + "\npole_pairs = 4\n";
    assert!(refusal(&machine).contains("not TOML: duplicate key"));
    let folder = Folder::new("", &good_map());
    std::fs::remove_file(folder.path().join("machine.toml")).unwrap();
    let text = folder.refusal();
    assert!(text.contains("machine.toml: cannot be read: "), "{text}");
}

#[test]
fn defaults_derive_from_what_is_required() {
    let required = |line: &&str| REQUIRED.iter().any(|key| line.starts_with(&format!("{key} =")));
    let good = good_toml();
    let machine = good.lines().filter(required).collect::<Vec<_>>().join("\n");
    let parameters = Folder::new(&machine, &good_map()).read().unwrap().parameters;
    let near =
        |value: f64, expected: f64| assert!((value / expected - 1.0).abs() < 1e-12, "{value} {expected}");
    near(parameters.trip_current_a, 1.3 * 233.345);
    near(parameters.trip_dc_over_v, 1.15 * 1800.0);
    near(parameters.trip_dc_under_v, 0.85 * 1000.0);
    near(parameters.trip_speed_rpm, 1.1 * 6000.0);
    near(parameters.torque_slew_nm_per_s, 12350.0);
    assert_eq!(parameters.loss_rated_w, 0.0);
    assert_eq!(parameters.speed_loss_w(2000.0), 0.0);
}
