//! The images in QEMU against the same code on the host, byte for byte. Needs TRACTIVE_IMAGE, TRACTIVE_PI_IMAGE, TRACTIVE_OPTIMAL_IMAGE,
//! TRACTIVE_ZS9_IMAGE, TRACTIVE_ZS9_PI_IMAGE, TRACTIVE_IDENTIFY_IMAGE (and TRACTIVE_QEMU);
//! `cargo xtask test` sets them, so these tests are ignored otherwise.

use std::path::{Path, PathBuf};
use std::process::Command;

fn run(scenario: &str, on: &str, out: &Path) -> (i32, String) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_tractive-rig"));
    let image = match (scenario.starts_with("zs9-"), scenario.ends_with("--law pi")) {
        (false, _) if scenario.ends_with("--patterns optimal") => "TRACTIVE_OPTIMAL_IMAGE",
        (false, false) => "TRACTIVE_IMAGE",
        (false, true) => "TRACTIVE_PI_IMAGE",
        (true, false) => "TRACTIVE_ZS9_IMAGE",
        (true, true) => "TRACTIVE_ZS9_PI_IMAGE",
    };
    if let Some(image) = std::env::var_os(image) {
        command.env("TRACTIVE_IMAGE", image);
    }
    command.arg("run").args(scenario.split(' ')).args(["--on", on, "--out"]).arg(out);
    let output = command.output().unwrap();
    (output.status.code().unwrap_or(-1), String::from_utf8_lossy(&output.stderr).into_owned())
}

/// Both runs end alike and leave the same files.
fn same(scenario: &str, code: i32) {
    assert!(std::env::var_os("TRACTIVE_IMAGE").is_some(), "TRACTIVE_IMAGE must name the image");
    let folder = tempfile::tempdir().unwrap();
    let outs: Vec<PathBuf> = ["host", "qemu"].iter().map(|on| folder.path().join(on)).collect();
    for (on, out) in ["host", "qemu"].iter().zip(&outs) {
        let (got, errors) = run(scenario, on, out);
        assert_eq!(got, code, "{scenario} on {on}: {errors}");
    }
    let mut files = vec!["trace.csv"];
    if !scenario.starts_with("zs9-cycle") {
        files.push("edges.csv");
    }
    if code == 1 && !scenario.starts_with("zs9-") {
        files.push("recorder.csv");
    }
    if ["precharge", "chopper", "acknowledge", "wheel"].contains(&scenario) {
        files.push("operator.csv");
    }
    for file in files {
        let [host, qemu] = [&outs[0], &outs[1]].map(|out| std::fs::read(out.join(file)).unwrap());
        assert!(host.starts_with(b"t_s,"), "{scenario}: {file} has no header");
        assert!(host == qemu, "{scenario}: {file} differs");
    }
}

#[test]
#[ignore = "needs the image and QEMU"]
fn load_steps_are_the_same() {
    same("load-steps", 0);
}

#[test]
#[ignore = "needs the image and QEMU"]
fn the_sweep_and_its_way_back_are_the_same() {
    same("sweep --down", 0);
}

#[test]
#[ignore = "needs the image and QEMU"]
fn braking_is_the_same() {
    same("sweep --brake --to 2300", 0);
}

#[test]
#[ignore = "needs the image and QEMU"]
fn the_characteristic_is_the_same() {
    same("characteristic", 0);
}

/// Every mode, with the papers' ordinary law in place of ours; its bounds are not kept.
#[test]
#[ignore = "needs the image and QEMU"]
fn the_ordinary_law_is_the_same() {
    same("timing --to 6000 --law pi", 0);
}

#[test]
#[ignore = "needs the image and QEMU"]
fn optimised_patterns_are_the_same() {
    same("sweep --patterns optimal", 0);
}

#[test]
#[ignore = "needs the image and QEMU"]
fn flaws_are_the_same() {
    same(
        "sweep --dead-time-us 5 --adc-bits 12 --noise-a 0.5 --udc-ripple 30@300 --rs-error 50 --angle-error 1",
        0,
    );
}

/// Steps of the line behind its filter, whose wide swings are damped; and a start that finds the rotor's angle.
#[test]
#[ignore = "needs the image and QEMU"]
fn a_line_filter_and_a_start_are_the_same() {
    same("link-steps --line 1,4,30", 0);
    same("start", 0);
}

#[test]
#[ignore = "needs the image and QEMU"]
fn a_trip_is_the_same() {
    same("sweep --udc 2200", 1);
    same("timing --to 6650", 1);
    // In full operation: what led to the fault is in the recorder.
    same("timing --to 2000 --fault-at 0.05", 1);
}

#[test]
#[ignore = "needs the image and QEMU"]
fn both_motors_load_step_is_the_same() {
    same("zs9-load-step", 0);
    same("zs9-load-step --carrier-hz 20000 --uin 800 --scheme s", 0);
    // Behind a line filter that the capacitors damp.
    same("zs9-timing --line 3,4,30", 0);
}

#[test]
#[ignore = "needs the image and QEMU"]
fn both_motors_reversal_is_the_same() {
    same("zs9-reverse --scheme zvo --adc-bits 12 --noise-a 0.3 --dead-time-us 5", 0);
}

#[test]
#[ignore = "needs the image and QEMU"]
fn both_motors_cycle_is_the_same() {
    same("zs9-cycle --cruise 2", 0);
}

/// Motoring, weakening and braking, then a fault, with the papers' ordinary law in place of ours.
#[test]
#[ignore = "needs the image and QEMU"]
fn both_motors_under_the_ordinary_law_are_the_same() {
    same("zs9-timing --carrier-hz 20000 --uin 800 --law pi", 0);
    same("zs9-reverse --scheme zvo --adc-bits 12 --noise-a 0.3 --law pi", 0);
    same("zs9-load-step --inject leg-stuck-on@0.1 --law pi", 1);
}

#[test]
#[ignore = "needs the image and QEMU"]
fn both_motors_trips_are_the_same() {
    same("zs9-load-step --inject leg-stuck-on@0.1", 1);
    same("zs9-load-step --inject sensor-frozen-2@0.1", 1);
    same("zs9-load-step --inject overcurrent@0.1", 1);
    same("zs9-load-step --carrier-hz 20000 --inject source-short@0.1", 1);
}

/// An image that is told nonsense does not start: it names what is wrong, no interrupt comes, nothing is written.
#[test]
#[ignore = "needs the image and QEMU"]
fn nonsense_is_refused_by_name_before_anything_starts() {
    for (scenario, name) in [
        ("load-steps --min-pulse-us 300", "devices.min_pulse_ticks"),
        ("load-steps --dead-time-us 140", "devices.dead_time_ticks"),
    ] {
        for on in ["host", "qemu"] {
            let folder = tempfile::tempdir().unwrap();
            let out = folder.path().join("out");
            let (code, errors) = run(scenario, on, &out);
            assert_eq!(code, 2, "{scenario} on {on}: {errors}");
            assert!(
                errors.contains(&format!("configuration refused: {name}")),
                "{scenario} on {on}: {errors}"
            );
            assert!(!out.join("trace.csv").exists());
        }
    }
}

#[test]
#[ignore = "needs the image and QEMU"]
fn from_power_up_to_an_empty_link_is_the_same() {
    same("precharge", 0);
}

#[test]
#[ignore = "needs the image and QEMU"]
fn limits_of_line_and_rail_are_the_same() {
    same("line-limits --udc 1200", 0);
    same("wheel", 0);
}

#[test]
#[ignore = "needs the image and QEMU"]
fn braking_into_a_link_that_cannot_take_it_is_the_same() {
    same("chopper", 0);
}

#[test]
#[ignore = "needs the image and QEMU"]
fn an_acknowledged_fault_is_the_same() {
    same("acknowledge", 0);
}

/// The same scripts over the protocol: the same frames, telemetry and pulses.
fn same_talk(system: &str, name: &str, flaws: &[&str]) {
    let zs9 = std::env::var_os("TRACTIVE_ZS9_IMAGE").filter(|_| system == "zs9");
    let folder = tempfile::tempdir().unwrap();
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("scripts").join(name);
    for on in ["host", "qemu"] {
        let mut command = Command::new(env!("CARGO_BIN_EXE_tractive-rig"));
        command.envs(zs9.iter().map(|image| ("TRACTIVE_IMAGE", image)));
        command.args(["talk", "--system", system]).arg(&script).args(flaws);
        command.args(["--on", on, "--out"]).arg(folder.path().join(on));
        let output = command.output().unwrap();
        assert!(output.status.success(), "{name} on {on}: {}", String::from_utf8_lossy(&output.stderr));
    }
    for file in ["telemetry.csv", "frames.log", "trace.csv"] {
        let [host, qemu] =
            ["host", "qemu"].map(|on| std::fs::read(folder.path().join(on).join(file)).unwrap());
        assert!(host.len() > 10_000 && host == qemu, "{name}: {file} differs");
    }
}

#[test]
#[ignore = "needs the image and QEMU"]
fn a_round_trip_over_the_protocol_is_the_same() {
    same_talk("pmasynrm", "round-trip.talk", &[]);
}

#[test]
#[ignore = "needs the image and QEMU"]
fn hostile_frames_are_treated_the_same() {
    same_talk("pmasynrm", "hostile.talk", &[]);
}

#[test]
#[ignore = "needs the image and QEMU"]
fn both_motors_over_the_protocol_are_the_same() {
    same_talk("zs9", "zs9.talk", &[]);
}

#[test]
#[ignore = "needs the image and QEMU"]
fn a_zero_is_calibrated_the_same() {
    same_talk("pmasynrm", "calibrate.talk", &["--angle-error", "8"]);
    same_talk("zs9", "zs9-calibrate.talk", &["--angle-error", "8"]);
}

/// The same experiment: the same machine folder, and over the protocol the same frames.
fn same_machine(words: &str, files: &[&str]) {
    let image = std::env::var_os("TRACTIVE_IDENTIFY_IMAGE").unwrap();
    let folder = tempfile::tempdir().unwrap();
    for on in ["host", "qemu"] {
        let out = folder.path().join(on);
        std::fs::create_dir(&out).unwrap();
        let mut command = Command::new(env!("CARGO_BIN_EXE_tractive-rig"));
        command.env("TRACTIVE_IMAGE", &image).arg("identify").args(words.split(' ')).args(["--on", on]);
        command.arg("--out").arg(out.join("found")).arg("--page").arg(out.join("found.html"));
        if words.contains("--over-protocol") {
            command.arg("--frames").arg(out.join("frames.log"));
        }
        let output = command.output().unwrap();
        assert!(output.status.success(), "{words} on {on}: {}", String::from_utf8_lossy(&output.stderr));
    }
    for file in files {
        let [host, qemu] =
            ["host", "qemu"].map(|on| std::fs::read(folder.path().join(on).join(file)).unwrap());
        assert!(host.len() > 500 && host == qemu, "{words}: {file} differs");
    }
}

#[test]
#[ignore = "needs the image and QEMU"]
fn an_identification_is_the_same() {
    let flaws = "--inertia 3 --noise-a 0.5 --dead-time-us 5 --rs-error 10";
    let files = ["found/machine.toml", "found/flux_map.csv"];
    same_machine(flaws, &files);
    same_machine(&format!("{flaws} --over-protocol"), &[&files[..], &["frames.log"]].concat());
}
