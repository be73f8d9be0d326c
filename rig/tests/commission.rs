//! A commissioning on the rig, without anybody who answers.

mod nameplate;

use std::path::Path;
use std::process::Command;

/// The exit code, what was said, and the record.
fn commissioned(words: &str, place: &Path) -> (i32, String, toml::Table) {
    free("3", &format!("--noise-a 0.5 {words}"), place)
}

/// The same of a free rotor of this inertia, in kg·m², without noise.
fn free(inertia: &str, words: &str, place: &Path) -> (i32, String, toml::Table) {
    let mut rig = Command::new(env!("CARGO_BIN_EXE_tractive-rig"));
    rig.args(["commission", "--yes", "--inertia", inertia]).args(words.split_whitespace());
    rig.arg("--out").arg(place.join("found")).arg("--page").arg(place.join("found.html"));
    let output = rig.output().unwrap();
    let record = std::fs::read_to_string(place.join("found-commissioning.toml")).unwrap();
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    (output.status.code().unwrap(), said, record.parse().unwrap())
}

fn steps(record: &toml::Table) -> Vec<(String, bool)> {
    let of =
        |step: &toml::Value| (step["name"].as_str().unwrap().to_owned(), step["passed"].as_bool().unwrap());
    record["step"].as_array().unwrap().iter().map(of).collect()
}

fn found(record: &toml::Table, step: usize, name: &str) -> f64 {
    record["step"][step]["found"][name].as_float().unwrap()
}

#[test]
fn from_the_wiring_to_the_first_torque() {
    let place = tempfile::tempdir().unwrap();
    let (code, said, record) =
        commissioned("--dead-time-us 5 --rs-error 10 --device-drop 2,5,2,5", place.path());
    assert_eq!(code, 0, "{said}");
    let advice = record["step"][1]["advice"][0].as_str().unwrap();
    assert!(advice.contains("device_threshold_v: add about "), "{advice}");
    // From seed to seed it scatters by 0.4 V.
    assert!((found(&record, 1, "threshold_v") - 2.0).abs() < 0.5);
    let names = ["wiring", "identification", "tables", "first torque"];
    assert_eq!(steps(&record), names.map(|name| (name.to_owned(), true)));
    assert!(record["finished"].as_bool().unwrap() && record["on"].as_str() == Some("host"));
    assert!((found(&record, 0, "link_charged_v") - 1_500.0).abs() < 20.0);
    assert!(found(&record, 1, "angle_zero_deg").abs() < 1.0);
    assert!((found(&record, 1, "rotor_inertia_kg_m2") / 3.0 - 1.0).abs() < 0.01);
    let asked_nm = found(&record, 3, "torque_asked_nm");
    assert!((asked_nm - 0.05 * 1_235.0).abs() < 1.0, "{asked_nm}");
    // 62 N·m for 0.2 s and two ramps of 0.1 s, over 3 kg·m².
    let speed_rpm = found(&record, 3, "speed_reached_rpm");
    assert!((speed_rpm - 0.3 * asked_nm / 3.0 * 9.549).abs() < 0.05 * speed_rpm, "{speed_rpm}");
    assert!(place.path().join("found/flux_map.csv").is_file());
}

/// All flaws of a usual inverter, whose current sensors are off by up to a twenty-fifth of the largest current: the drive takes that off.
#[test]
fn a_real_inverter_is_commissioned() {
    for (machine, inertia, largest_a) in [("pmasynrm-180kw", "3", 233.345), ("pmsm-48v-1kw", "3e-4", 30.0)] {
        let place = tempfile::tempdir().unwrap();
        let (code, said, record) = free(inertia, &format!("--real --machine {machine}"), place.path());
        assert_eq!(code, 0, "{machine}: {said}");
        assert!(found(&record, 0, "current_at_rest_a") > 0.02 * largest_a, "{said}");
    }
}

/// Sensors that the drive refuses, at its own bound of a twentieth, 11.67 A, are refused with what to do, and those that it takes pass.
#[test]
fn an_offset_is_judged_as_the_drive_judges_it() {
    let of = |share: f64| {
        let place = tempfile::tempdir().unwrap();
        // Percent of the converters' range.
        let percent = 100.0 * share * 233.345 / 455.0;
        commissioned(&format!("--current-offset={percent},-{percent},0 --until identification"), place.path())
    };
    let (code, said, _) = of(0.048);
    assert_eq!(code, 0, "{said}");
    let (code, said, record) = of(0.055);
    assert_eq!((code, steps(&record)), (1, vec![("wiring".to_owned(), false)]), "{said}");
    assert!(said.contains("must be from 0 to 11.667"), "{said}");
    assert!(record["step"][0]["advice"][0].as_str().unwrap().contains("takes off by itself"), "{said}");
}

/// Noise that the experiment cannot take is told as noise, and nothing is said about wires.
#[test]
fn noise_is_told_as_noise() {
    let place = tempfile::tempdir().unwrap();
    let (code, said, record) = free("3", "--noise-a 2.1", place.path());
    assert_eq!(code, 1, "{said}");
    let last = record["step"].as_array().unwrap().last().unwrap();
    assert!(last["advice"][0].as_str().unwrap().contains("scatter too much"), "{said}");
    assert!(said.contains("current_noise") && !said.contains("exchange"), "{said}");
    assert!(!place.path().join("found").exists());
}

/// A direct drive without its load, which a twentieth of its largest torque would take beyond its largest speed: it used to end in `overspeed`.
#[test]
fn the_first_torque_takes_a_direct_drive_to_half_of_its_largest_speed() {
    let machine = nameplate::made(
        "--pole-pairs 20 --rs 0.5 --ld 4e-3 --lq 5e-3 --psi-f 0.3 --max-current 20 --udc 560 --max-speed-rpm 150 --max-switching-hz 8000",
    );
    let place = tempfile::tempdir().unwrap();
    let (code, said, record) = free("0.1", &format!("--machine {}", machine.path().display()), place.path());
    assert_eq!(code, 0, "{said}");
    let speed_rpm = found(&record, 3, "speed_reached_rpm");
    assert!((speed_rpm - 75.0).abs() < 4.0, "{speed_rpm}");
}

/// A zero that is some degrees off: the tables are made for the right zero, the key to change and the number to add are told, and the first
/// torque uses the right zero.
#[test]
fn a_zero_that_is_off_is_told_and_the_tables_are_made() {
    for error_deg in [8.0, -10.0] {
        let place = tempfile::tempdir().unwrap();
        let (code, said, record) = commissioned(&format!("--angle-error {error_deg}"), place.path());
        assert_eq!(code, 0, "{said}");
        assert!((found(&record, 1, "angle_zero_deg") + error_deg).abs() < 0.3, "{said}");
        let text = record["step"][1]["advice"][0].as_str().unwrap();
        let number = text.strip_prefix("power stage, encoder_zeros_deg: add about ").expect(text);
        let number = number.split(',').next().unwrap().parse::<f64>().expect(text);
        assert!((number + error_deg).abs() < 0.3, "{text}");
        assert!((found(&record, 3, "encoder_zero_added_deg") + error_deg).abs() < 0.3);
        let [speed_rpm, expected_rpm] =
            ["speed_reached_rpm", "speed_expected_rpm"].map(|name| found(&record, 3, name));
        assert!((speed_rpm / expected_rpm - 1.0).abs() < 0.05, "{speed_rpm} r/min, not {expected_rpm}");
    }
}

/// The rotor turns away under currents that are far from the d axis: the experiment ends before it has gone far.
#[test]
fn an_angle_whose_zero_is_far_off_is_told_and_nothing_turns_with_it() {
    for words in ["--angle-error 60", "--angle-error -60"] {
        let place = tempfile::tempdir().unwrap();
        let (code, said, record) = commissioned(words, place.path());
        assert_eq!(code, 1, "{words}: {said}");
        assert_eq!(steps(&record), [("wiring".to_owned(), true), ("identification".to_owned(), false)]);
        assert!(!record["finished"].as_bool().unwrap());
        let complaint = record["step"][1]["complaints"][0].as_str().unwrap();
        assert!(complaint.starts_with("fault rotor_turned"), "{words}: {complaint}");
        let advice = record["step"][1]["advice"][0].as_str().unwrap();
        assert!(advice.contains("encoder_zeros_deg"), "{advice}");
        assert!(!place.path().join("found").exists(), "no tables of a machine that was not found");
    }
}

/// Current sensors whose wires are exchanged: which, and nothing turns.
#[test]
fn the_wires_of_the_current_sensors_are_told() {
    for wiring in ["-u,-v,-w", "v,u,w", "v,w,u", "-u,v,w"] {
        let place = tempfile::tempdir().unwrap();
        let (code, said, record) = commissioned(&format!("--current-sensors={wiring}"), place.path());
        assert_eq!(code, 1, "{said}");
        assert_eq!(steps(&record), [("wiring".to_owned(), true), ("identification".to_owned(), false)]);
        let advice = record["step"][1]["advice"][0].as_str().unwrap();
        let told = if wiring == "-u,v,w" {
            "current sensors: one or two have".to_owned()
        } else {
            format!("current sensors: those of u,v,w read {wiring}:")
        };
        assert!(advice.starts_with(&told), "{advice}");
        assert!(!place.path().join("found").exists());
    }
}

/// As far as the tables, then on: what has passed is not done again.
#[test]
fn a_commissioning_goes_on_where_it_has_ended() {
    let place = tempfile::tempdir().unwrap();
    let (code, said, record) = commissioned("--until tables", place.path());
    assert_eq!((code, steps(&record).len(), record["finished"].as_bool()), (0, 3, Some(false)), "{said}");
    let (code, said, resumed) = commissioned("--resume", place.path());
    assert_eq!((code, steps(&resumed).len(), resumed["finished"].as_bool()), (0, 4, Some(true)), "{said}");
    assert!(!said.contains("identification"), "{said}");
    assert_eq!(resumed["step"].as_array().unwrap()[..3], record["step"].as_array().unwrap()[..]);
    let (code, said, _) = commissioned("--resume --machine pmsm-48v-1kw", place.path());
    assert!(code != 0, "a record of another machine: {said}");
}

#[test]
fn a_fault_ends_it_and_stands_in_the_record() {
    let place = tempfile::tempdir().unwrap();
    let (code, said, record) = commissioned("--fault-at 3", place.path());
    assert_eq!(code, 1, "{said}");
    assert_eq!(steps(&record).last(), Some(&("identification".to_owned(), false)));
    let complaints = record["step"][1]["complaints"].as_array().unwrap();
    assert!(complaints[0].as_str().unwrap().starts_with("fault "), "{complaints:?}");
    assert!(!place.path().join("found").exists());
}

/// Nobody there to answer: nothing is done.
#[test]
fn without_an_answer_nothing_is_done() {
    let place = tempfile::tempdir().unwrap();
    let mut rig = Command::new(env!("CARGO_BIN_EXE_tractive-rig"));
    rig.arg("commission").arg("--out").arg(place.path().join("found")).stdin(std::process::Stdio::null());
    let output = rig.output().unwrap();
    let said = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.code() == Some(1) && said.contains("stopped before: wiring"), "{said}");
    assert!(!place.path().join("found").exists());
}
