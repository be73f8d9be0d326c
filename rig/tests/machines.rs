//! Machines of other kinds driven on the host.

mod linear;

use linear::{Linear, MACHINES};
use rayon::prelude::*;
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
