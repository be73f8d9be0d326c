//! Machines of other kinds driven on the host.

mod linear;

use linear::{Linear, MACHINES};
use rayon::prelude::*;
use std::path::Path;
use tractive_rig::scenario::catalogue;
use tractive_rig::trace::Recorded;

const LOW_VOLTAGE: Linear = Linear {
    name: "600 W from 48 V",
    pole_pairs: 4,
    resistance_ohm: 0.012,
    ld_h: 0.15e-3,
    lq_h: 0.35e-3,
    magnet_wb: 0.0075,
    current_a: 60.0,
    torque_nm: 2.6,
    power_w: 600.0,
    speed_rpm: 3500.0,
    link_v: 48.0,
    switching_hz: 20e3,
};

/// The same where the lowest link gives more voltage than the machine takes at its highest speed.
const VOLTAGE_IN_RESERVE: Linear =
    Linear { name: "500 W, voltage in reserve", power_w: 500.0, speed_rpm: 2000.0, ..LOW_VOLTAGE };

#[test]
fn any_machine_folder_drives() {
    MACHINES.par_iter().chain([&LOW_VOLTAGE, &VOLTAGE_IN_RESERVE]).for_each(|linear| {
        let folder = tempfile::tempdir().unwrap();
        linear.write(folder.path());
        let path = folder.path().display().to_string();
        let run = |line: &str| {
            let chosen = catalogue::of_traction(&format!("{line} --machine {path}")).unwrap();
            let machine = chosen.machine().unwrap();
            let recording = chosen.drive(&machine).unwrap();
            assert!(recording.trip().is_none(), "{}: {line}: {:?}", linear.name, recording.trip());
            chosen.figures(&recording, &machine)
        };
        for (speed_share, torque_share) in [(0.1, 1.0), (0.1, -0.5), (0.35, 0.9), (1.0, 0.3), (-0.6, 0.5)] {
            let (speed, torque) = (speed_share * linear.speed_rpm, torque_share * linear.torque_nm);
            let figures = run(&format!("steady --speed {speed} --torque {torque}"));
            let point = &figures.get("point").unwrap()[0];
            println!("{}: {point}", linear.name);
            let error = point["torque_error_percent"].as_f64().unwrap();
            assert!(error.abs() < 0.5, "{}: {error} % at {speed} r/min, {torque} N·m", linear.name);
        }
        run(&format!("sweep --down --to {}", linear.speed_rpm));
        for line in ["load-steps", "restart", "link-steps"] {
            let verdicts = run(line).get("verdicts").unwrap().clone();
            for verdict in verdicts.as_array().unwrap() {
                let kept = verdict["verdict"] == "pass" || verdict["verdict"] == "reported";
                assert!(kept, "{}: {line}: {verdict}", linear.name);
            }
        }
        // At speeds and torques that this machine has.
        run("reversal");
        run("characteristic");
    });
}

/// Carriers that are a whole number of control periods long, within a few ticks: samples alias with them, beats of some hertz
/// included. And a rotor that speeds up.
#[test]
fn a_carrier_that_stands_still_against_the_samples_leaves_torque_alone() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tables/pmasynrm-180kw");
    let [toml, map] =
        ["machine.toml", "flux_map.csv"].map(|file| std::fs::read_to_string(folder.join(file)).unwrap());
    ["1000.0", "1250.0", "1666.0", "2000.0", "2500.0", "5000.0"].par_iter().for_each(|switching_hz| {
        let own = tempfile::tempdir().unwrap();
        let faster = toml.replace("max_switching_hz = 900.0", &format!("max_switching_hz = {switching_hz}"));
        assert_ne!(faster, toml);
        std::fs::write(own.path().join("machine.toml"), faster).unwrap();
        std::fs::write(own.path().join("flux_map.csv"), &map).unwrap();
        for line in ["load-steps", "steady --speed 300 --torque 1000", "start"] {
            let chosen =
                catalogue::of_traction(&format!("{line} --machine {}", own.path().display())).unwrap();
            let machine = chosen.machine().unwrap();
            let verdicts =
                chosen.figures(&chosen.drive(&machine).unwrap(), &machine).get("verdicts").unwrap().clone();
            for verdict in verdicts.as_array().unwrap() {
                assert!(verdict["verdict"] == "pass", "{switching_hz} Hz: {line}: {verdict}");
            }
        }
    });
}

#[test]
fn a_sweep_ends_at_the_machines_rated_speed() {
    let linear = &MACHINES[0];
    let folder = tempfile::tempdir().unwrap();
    linear.write(folder.path());
    let chosen = catalogue::of_traction(&format!("sweep --machine {}", folder.path().display())).unwrap();
    let machine = chosen.machine().unwrap();
    let recording = chosen.drive(&machine).unwrap();
    let last_rpm = recording.rows.last().unwrap().speed_rpm;
    assert!((last_rpm - machine.folder.parameters.rated_speed_rpm).abs() < 1e-3, "{last_rpm} r/min");
}
