//! `machine new`: what it refuses, and what it leaves behind.

use std::path::Path;
use std::process::{Command, Output};
use tractive_rig::machine::Machine;

const GOOD: &str = "--pole-pairs 4 --rs 0.05 --ld 0.3e-3 --lq 0.45e-3 --psi-f 0.0135 --max-current 32 --udc 48 \
    --max-speed-rpm 6000 --max-switching-hz 20000";

fn new(values: &str, out: &Path) -> Output {
    let rig = env!("CARGO_BIN_EXE_tractive-rig");
    Command::new(rig)
        .args(["machine", "new"])
        .args(values.split_whitespace())
        .arg("--out")
        .arg(out)
        .output()
        .unwrap()
}

/// The good values with one replaced.
fn with(option: &str, value: &str) -> String {
    let mut words: Vec<_> = GOOD.split_whitespace().collect();
    match words.iter().position(|word| *word == option) {
        Some(at) => words[at + 1] = value,
        None => words.extend([option, value]),
    }
    words.join(" ")
}

#[test]
fn nonsense_is_refused_by_its_option_and_leaves_nothing() {
    let folder = tempfile::tempdir().unwrap();
    for (option, value, allowed) in [
        ("--rs", "-0.1", "from 0 "),
        ("--rs", "0.8", "at most 0.75"),
        ("--ld", "0", "above 0"),
        ("--ld", "0.5e-3", "at most --lq"),
        ("--lq", "450", "up to 10 H"),
        ("--psi-f", "-0.01", "from 0 "),
        ("--max-current", "0", "above 0"),
        ("--udc", "-48", "above 0"),
        ("--udc-min", "50", "up to 48"),
        ("--udc-max", "40", "from 48"),
        ("--max-speed-rpm", "0", "above 0"),
        ("--max-speed-rpm", "40000", "must be at most 18"),
        ("--max-switching-hz", "100", "at least 400"),
        ("--inertia", "100", "ten minutes"),
        ("--saturation", "0", "from 0.2"),
        ("--saturation", "1.5", "up to 1"),
        ("--name", "", "must not be empty"),
    ] {
        let mut words: Vec<String> = with(option, "VALUE").split(' ').map(str::to_owned).collect();
        words.iter_mut().filter(|word| *word == "VALUE").for_each(|word| value.clone_into(word));
        let out = folder.path().join("made");
        let mut rig = Command::new(env!("CARGO_BIN_EXE_tractive-rig"));
        let output = rig.args(["machine", "new"]).args(&words).arg("--out").arg(&out).output().unwrap();
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{option} {value}: {said}");
        assert!(said.starts_with(option) && said.contains(allowed), "{option} {value}: {said}");
        assert_eq!(said.trim().lines().count(), 1, "{said}");
    }
    let no_torque = "--psi-f 0 --pole-pairs 4 --rs 0.05 --ld 0.3e-3 --lq 0.3e-3 --max-current 32 --udc 48 \
        --max-speed-rpm 6000 --max-switching-hz 20000";
    let said = new(no_torque, &folder.path().join("made"));
    assert!(String::from_utf8_lossy(&said.stderr).starts_with("--psi-f 0: must be above 0"), "{said:?}");
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0, "nothing is left behind");
}

/// Without saliency the largest torque is as round a number as the values are.
#[test]
fn a_machine_of_round_numbers_is_taken() {
    let folder = tempfile::tempdir().unwrap();
    for (values, torque_nm) in [
        (
            "--pole-pairs 4 --rs 0.3 --ld 2.5e-3 --lq 2.5e-3 --psi-f 0.15 --max-current 30 --udc 325 --max-speed-rpm 4500",
            27.0,
        ),
        (
            "--pole-pairs 1 --rs 0.05 --ld 3e-4 --lq 3e-4 --psi-f 0.035 --max-current 80 --udc 300 --max-speed-rpm 40000",
            4.2,
        ),
    ] {
        let out = folder.path().join("made");
        let output = new(&format!("{values} --max-switching-hz 20000"), &out);
        assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
        let machine = Machine::load(&out.display().to_string()).unwrap();
        let share = machine.folder.parameters.max_torque_nm / torque_nm;
        assert!((0.999..=1.0).contains(&share), "{values}: {share}");
    }
}

/// A link with more than a thousand times the voltage that the largest speed needs: no drive takes such tables, so no folder is made.
#[test]
fn what_the_drive_would_refuse_is_not_written() {
    let folder = tempfile::tempdir().unwrap();
    let output = new(&with("--max-speed-rpm", "0.5"), &folder.path().join("made"));
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{said}");
    assert!(said.contains("the drive refuses the tables of these values: weakening.flux_knee_wb"), "{said}");
    assert_eq!((said.trim().lines().count(), std::fs::read_dir(folder.path()).unwrap().count()), (1, 0));
}

/// Six pulses a turn into a fifth of the inductance: the current is four times the largest one, at least.
#[test]
fn a_ripple_that_leaves_no_trip_its_room_is_told_as_one() {
    let folder = tempfile::tempdir().unwrap();
    let values = with("--ld", "0.06e-3").replace("20000", "420");
    let output = new(&values, &folder.path().join("made"));
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{said}");
    assert!(
        said.starts_with("--max-switching-hz 420: with the ripple")
            && said.contains("4 × --max-current, 128 A"),
        "{said}"
    );
    assert_eq!((said.trim().lines().count(), std::fs::read_dir(folder.path()).unwrap().count()), (1, 0));
}

/// A hundred thousand carriers in a turn: what their ticks round is no ripple. Nor are speeds of more than 1 kHz without pulses.
#[test]
fn a_fast_machine_trips_near_its_largest_current() {
    let folder = tempfile::tempdir().unwrap();
    let car = "--pole-pairs 4 --rs 0.009 --ld 0.12e-3 --lq 0.30e-3 --psi-f 0.068 --max-current 500 --udc 800 --max-speed-rpm 16000";
    for (hz, saturation, trip_a) in [
        (10_000, "1", 600.0..=700.0),
        (20_000, "1", 600.0..=700.0),
        (10_000, "0.5", 800.0..=850.0),
        (20_000, "0.5", 700.0..=750.0),
    ] {
        let values = format!("{car} --max-switching-hz {hz} --saturation {saturation}");
        let made = folder.path().join(format!("made-{hz}-{saturation}"));
        let output = new(&values, &made);
        assert!(output.status.success(), "{values}: {output:?}");
        let machine = Machine::load(made.to_str().unwrap()).unwrap();
        let set_a = machine.folder.parameters.trip_current_a;
        assert!(trip_a.contains(&set_a), "{values}: trip at {set_a} A");
        let mut show = Command::new(env!("CARGO_BIN_EXE_tractive-rig"));
        let page = folder.path().join("page.html");
        let shown =
            show.args(["machine", "show", "--json"]).arg(&made).arg("--out").arg(page).output().unwrap();
        let figures: serde_json::Value = serde_json::from_slice(&shown.stdout).unwrap();
        let rows = figures["figures"]["limits"].as_array().unwrap();
        assert!(rows.iter().all(|row| row["peak_current_a"].is_f64()), "pulses at up to 1,067 Hz: {rows:?}");
    }
}

#[test]
fn a_folder_is_made_whole_replaced_whole_and_others_are_left_alone() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("deep/made");
    for (values, torque_nm) in [(GOOD.to_owned(), 2.736), (with("--saturation", "0.8"), 2.688)] {
        let output = new(&values, &out);
        assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
        let machine = Machine::load(&out.display().to_string()).unwrap();
        let parameters = &machine.folder.parameters;
        assert_eq!((parameters.max_torque_nm, parameters.name.as_str()), (torque_nm, "made"));
        assert_eq!((parameters.pole_pairs, parameters.max_switching_hz), (4, 20e3));
        let entries = std::fs::read_dir(folder.path().join("deep")).unwrap().count();
        assert_eq!(entries, 1, "nothing beside it");
    }
    let before = std::fs::read(out.join("machine.toml")).unwrap();
    assert_eq!(new(&with("--ld", "0"), &out).status.code(), Some(2));
    assert_eq!(std::fs::read(out.join("machine.toml")).unwrap(), before, "a refusal changes nothing");
    std::fs::write(out.join("notes.txt"), "mine").unwrap();
    let refused = new(GOOD, &out);
    assert_eq!(refused.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&refused.stderr).contains("holds notes.txt"), "{refused:?}");
    assert!(out.join("notes.txt").exists());
}

/// Inductances in other units make a machine whose full torque ends at a hundredth of its speed: that is told, or the drive refuses it.
#[test]
fn values_in_other_units_are_asked_about() {
    let folder = tempfile::tempdir().unwrap();
    for (lq_h, code, asked) in [("0.45e-3", 0, false), ("0.03", 0, true), ("0.45", 2, true)] {
        let output = new(&with("--lq", lq_h), &folder.path().join("made"));
        let said = [output.stdout, output.stderr].concat();
        let said = String::from_utf8_lossy(&said);
        assert_eq!(output.status.code(), Some(code), "{lq_h}: {said}");
        assert_eq!(said.contains("are inductances in H, flux linkages in Wb"), asked, "{lq_h}: {said}");
    }
    // Both in mH: the current that weakens the magnets lies between two steps of the map, and the speed is not what is wrong.
    let output = new(&with("--lq", "0.45").replace("--ld 0.3e-3", "--ld 0.3"), &folder.path().join("made"));
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(said.contains("are inductances in H, flux linkages in Wb"), "{said}");
}

/// Carriers that need more control than is usual: the option that gives it is named where the machine is made, and where it is missing.
#[test]
fn the_rate_of_control_that_fast_devices_need_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("made");
    let told = new(&with("--max-switching-hz", "40000"), &out);
    let said = String::from_utf8_lossy(&told.stdout);
    assert!(said.contains("run and identify with --control-hz 40000"), "{said}");
    let usual = new(&with("--max-switching-hz", "20000"), &folder.path().join("usual"));
    assert!(!String::from_utf8_lossy(&usual.stdout).contains("--control-hz"), "{usual:?}");
    for (command, words) in [
        ("run load-steps", "must be from 50 to 20000, the rate of control: --control-hz 40000 goes with it"),
        (
            "campaign --fast",
            "must be at most 20000, the rate of control of this command; run and identify take --control-hz 40000",
        ),
        (
            "pattern --u 10 --udc 48 --f1 50 --mode async",
            "must be at most 20000, the rate of control of this command",
        ),
    ] {
        let mut rig = Command::new(env!("CARGO_BIN_EXE_tractive-rig"));
        rig.args(command.split_whitespace())
            .arg("--machine")
            .arg(&out)
            .arg("--out")
            .arg(folder.path().join("x"));
        let output = rig.output().unwrap();
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{command}: {said}");
        assert!(said.contains(&format!("max_switching_hz 40000: {words}")), "{command}: {said}");
    }
}

/// A machine that its link never makes weaken is rated at its largest speed, and the folder says so.
#[test]
fn the_origin_of_the_rated_speed_is_told() {
    let folder = tempfile::tempdir().unwrap();
    for (most_rpm, rated_rpm, origin) in [
        ("3000", 3000.0, "chosen: max_speed_rpm, up to which nothing is weakened"),
        ("6000", 4207.0, "chosen: a little above the speed where weakening begins"),
        ("4100", 4100.0, "chosen: max_speed_rpm, a little above the speed where weakening begins"),
    ] {
        let out = folder.path().join(most_rpm);
        let told = new(&with("--max-speed-rpm", most_rpm), &out);
        assert_eq!(told.status.code(), Some(0), "{}", String::from_utf8_lossy(&told.stderr));
        let toml = std::fs::read_to_string(out.join("machine.toml")).unwrap();
        let line = toml.lines().find(|line| line.starts_with("rated_speed_rpm")).unwrap();
        assert!(line.ends_with(&format!("# {origin}")), "{line}");
        let found = Machine::load(out.to_str().unwrap()).unwrap().folder.parameters.rated_speed_rpm;
        assert!((found / rated_rpm - 1.0).abs() < 1e-3, "{found} r/min");
    }
}

/// Devices that are faster than the usual control make ripple, too, and its room is chosen at the rate that they want: it used to be left out.
#[test]
fn the_ripple_of_devices_faster_than_control_has_its_room() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("made");
    let values = "--pole-pairs 7 --rs 0.02 --max-current 60 --udc 50 --max-speed-rpm 40000 --ld 2e-6 --lq 2e-6 --psi-f 6e-4 --max-switching-hz 48000";
    let told = new(values, &out);
    let said = String::from_utf8_lossy(&told.stdout);
    assert_eq!(told.status.code(), Some(0), "{}", String::from_utf8_lossy(&told.stderr));
    assert!(said.contains("with the ripple of 48000 Hz the current is up to"), "{said}");
    let parameters = Machine::load(out.to_str().unwrap()).unwrap().folder.parameters;
    assert!(parameters.trip_current_a > 1.4 * 60.0, "{} A", parameters.trip_current_a);
}
