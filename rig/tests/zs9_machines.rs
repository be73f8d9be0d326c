//! Other machines than the paper's in the ZS9's scenarios, from nameplates: what is asked of them, and what is no pass.

mod zs9_runs;

use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use tractive_rig::scenario::catalogue;
use tractive_rig::trace::Recorded;
use zs9_runs::{Outcome, figure, run};

fn rig(line: &str) -> Output {
    Command::new(env!("CARGO_BIN_EXE_tractive-rig")).args(line.split_whitespace()).output().unwrap()
}

/// The ZS9's link with a duty of 0, 0.2 and 0.25, and one that it does not reach.
const LINK: &str = "--udc-min 181.3 --udc 241.8 --udc-max 272.1";
const HIGH_LINK: &str = "--udc-min 600 --udc 750 --udc-max 900";

/// A machine in a folder below this one.
fn machine(place: &Path, name: &str, nameplate: &str) -> PathBuf {
    let folder = place.join(name);
    let link = if nameplate == STRONG { HIGH_LINK } else { LINK };
    let line = format!("machine new {link} --max-switching-hz 10000 {nameplate} --out {}", folder.display());
    let output = rig(&line);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    folder
}

/// Of 162 N·m and three pole pairs.
const THREE: &str = "--pole-pairs 3 --rs 0.2 --max-current 70 --max-speed-rpm 1500 --inertia 0.1 --ld 0.004 --lq 0.008 --psi-f 0.45";
/// Of 14 N·m.
const SMALL: &str = "--pole-pairs 4 --rs 0.5 --max-current 15 --max-speed-rpm 3000 --inertia 0.1 --ld 0.005 --lq 0.008 --psi-f 0.15";
/// Whose magnets make twice the voltage that the ZS9 has.
const STRONG: &str = "--pole-pairs 4 --rs 0.1 --max-current 200 --max-speed-rpm 2000 --inertia 0.5 --ld 0.0025 --lq 0.005 --psi-f 0.6";

fn on(line: &str, machine: &Path) -> Outcome {
    run(&format!("{line} --machine {}", machine.display()))
}

fn verdicts(outcome: &Outcome) -> &[Value] {
    outcome.figures.get("verdicts").and_then(Value::as_array).unwrap()
}

/// Every scenario asks shares of the machine's own ratings, and judges them.
#[test]
fn every_machine_is_asked_its_own_shares() {
    let place = tempfile::tempdir().unwrap();
    for (name, nameplate) in [("three", THREE), ("small", SMALL)] {
        let folder = machine(place.path(), name, nameplate);
        for line in ["zs9-steady", "zs9-load-step", "zs9-reverse", "zs9-cycle --cruise 2"] {
            let outcome = on(line, &folder);
            assert!(outcome.recording.trip().is_none(), "{name}, {line}");
            let verdicts = verdicts(&outcome);
            let of = |word: &str| verdicts.iter().filter(|verdict| verdict["verdict"] == word).count();
            let (passed, reported) = (of("pass"), of("reported"));
            assert!(passed >= 2 && passed + reported == verdicts.len(), "{name}, {line}: {verdicts:#?}");
        }
    }
}

/// Distortion is taken over whole periods of both motors' currents, whatever their number of pole pairs.
#[test]
fn distortion_is_that_of_the_machines_own_pole_pairs() {
    let place = tempfile::tempdir().unwrap();
    let outcome = on("zs9-steady", &machine(place.path(), "three", THREE));
    for name in ["thd1_percent", "thd2_percent"] {
        assert!((0.3..1.0).contains(&figure(&outcome, name)), "{name}: {}", figure(&outcome, name));
    }
}

/// Titles and words name the paper's figures and speeds for the paper's machine alone.
#[test]
fn another_machine_answers_no_figure() {
    let place = tempfile::tempdir().unwrap();
    let small = machine(place.path(), "small", SMALL);
    let chosen = catalogue::of_zs9(&format!("zs9-cycle --cruise 2 --machine {}", small.display())).unwrap();
    let title = chosen.title(&chosen.machine().unwrap());
    assert!(title.starts_with("no figure") && !title.contains("1,300"), "{title}");
}

/// Figures that never come are no pass, with flaws or without: the drive did not do it.
#[test]
fn a_figure_that_never_came_is_no_pass() {
    let place = tempfile::tempdir().unwrap();
    let strong = machine(place.path(), "strong", STRONG);
    for (line, never) in [
        ("zs9-cycle --cruise 2 --noise-a 0.1", "accelerated_s"),
        ("zs9-load-step --noise-a 0.1", "motor2_back_within_0p2_percent_ms"),
    ] {
        let out = place.path().join("out");
        let output = rig(&format!("run {line} --machine {} --out {}", strong.display(), out.display()));
        let said = String::from_utf8_lossy(&output.stdout);
        assert!(output.status.code() == Some(1) && said.starts_with("FALLS SHORT"), "{line}: {said}");
        let summary: Value =
            serde_json::from_str(&std::fs::read_to_string(out.join("summary.json")).unwrap()).unwrap();
        assert!(summary["figures"][never].is_null(), "{line}: {}", summary["figures"][never]);
    }
    let steady = on("zs9-steady", &strong);
    let short = verdicts(&steady).iter().filter(|verdict| verdict["verdict"] == "falls short");
    assert!(short.count() == 2, "the mean torque is not there: {:#?}", verdicts(&steady));
}

/// Exit code 2, and one line with these words.
fn refused(line: &str, words: &[&str]) {
    let output = rig(line);
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.code() == Some(2) && said.trim().lines().count() == 1, "{line}: {said}");
    assert!(words.iter().all(|word| said.contains(word)), "{line}: no {words:?} in {said}");
}

/// A load that the machine cannot carry, and machines that the drive cannot have, are refused by what their user has.
#[test]
fn what_the_zs9_cannot_have_is_refused_by_the_users_own_key() {
    refused("run zs9-load-step --step 100", &["--step 100", "-180 to 60"]);
    refused("run zs9-steady --machine pmsm-48v-1kw", &["max_torque_nm 2.382", "at least 5.60", "ZS9"]);
    let place = tempfile::tempdir().unwrap();
    let light = machine(place.path(), "light", &THREE.replace("--inertia 0.1", "--inertia 0.02"));
    let line = format!("run zs9-steady --machine {}", light.display());
    refused(&line, &["rotor_inertia_kg_m2 0.02", "at least 0.0", "8000 rad/s²"]);
    let output = rig(&line);
    assert!(!String::from_utf8_lossy(&output.stderr).contains("--control-hz"), "the ZS9 has none");
}

/// Drops and dead time of `--real` are those of the link that is there and of the carrier that is asked for.
#[test]
fn real_flaws_are_those_of_the_zs9s_own_link_and_carrier() {
    let filled = |line: &str| {
        let chosen = catalogue::of_zs9(line).unwrap();
        chosen.filled(&chosen.machine().unwrap())
    };
    let slow = filled("zs9-steady --real");
    assert!((slow.own.device_drop.unwrap().0[0] / 2.0 - 533.5 / 1500.0).abs() < 1e-9);
    assert!((slow.dead_time_us - 0.45).abs() < 1e-9);
    let fast = filled("zs9-steady --real --carrier-hz 20000 --uin 800");
    assert!((fast.own.device_drop.unwrap().0[0] - 0.8).abs() < 1e-9);
    assert!((fast.dead_time_us - 0.225).abs() < 1e-9);
    // A tenth of the capacitors' voltage.
    refused("run zs9-steady --device-drop 60,5,1,3", &["--device-drop 60", "53.3"]);
    assert!(catalogue::of_zs9("zs9-steady --device-drop 50,5,1,3").is_ok_and(|chosen| {
        let machine = chosen.machine().unwrap();
        chosen.options.own.device_drop.unwrap().check(533.5, &machine).is_ok()
    }));
}
