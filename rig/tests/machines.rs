//! Machines of other kinds driven on the host.

mod linear;

use linear::MACHINES;
use rayon::prelude::*;
use tractive_rig::scenario::catalogue;

#[test]
fn any_machine_folder_drives() {
    MACHINES.par_iter().for_each(|linear| {
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
    });
}
