//! A rotor by itself, which full torque takes to its largest speed in some hundredths of a second.

mod nameplate;
mod stiff;

use nameplate::made;
use std::process::Command;
use tractive::control::Demand;
use tractive::time::Instant;
use tractive_rig::machine::Machine;
use tractive_rig::plant::{Plant, PlantSettings, SpeedSource};
use tractive_rig::run::Interrupts;

const SERVO: &str = "--pole-pairs 4 --rs 1.1 --ld 0.0055 --lq 0.0065 --psi-f 0.155 --max-current 35 --udc 560 --max-speed-rpm 6000 --max-switching-hz 8000";

/// A servo motor of 33 N·m and 8 kg·cm² at 10 kHz: 166,000 rad/s², electrical. Its demand is reversed before it is at its largest speed. With the loop of heavy
/// rotors its angle was lost.
#[test]
fn a_servo_motor_by_itself_is_followed_at_full_torque() {
    let folder = made(&format!("{SERVO} --inertia 0.0008"));
    let machine = Machine::load(folder.path().to_str().unwrap()).unwrap();
    let parameters = &machine.folder.parameters;
    let largest_nm = parameters.max_torque_nm as f32;
    let operator = move |t_s: f64| {
        let torque_nm = if t_s < 0.06 {
            0.0
        } else if (t_s / 0.012) as u32 % 2 == 1 {
            largest_nm
        } else {
            -largest_nm
        };
        (Demand { torque_nm, slew_limited: false }, t_s > 0.05)
    };
    let free = SpeedSource::Inertia { inertia_kg_m2: parameters.rotor_inertia_kg_m2, load_nm: 0.0 };
    let plant = Plant::new(&machine.folder, free, &PlantSettings::default());
    let run =
        stiff::Run { lead_s: 0.0, duration_s: 0.2, trace_step_s: 50e-6, udc_v: parameters.dc_link_nominal_v };
    let mut bench = stiff::bench(&machine, plant, operator, run).without_edges();
    let mut tasks = stiff::tasks(&machine, Instant(0));
    tasks.drive(&mut bench, |_| true).unwrap();
    let trip = bench.rows().iter().find_map(|row| row.trip);
    let fastest_rpm = bench.rows().iter().map(|row| row.speed_rpm.abs()).fold(0.0, f64::max);
    assert!(trip.is_none() && fastest_rpm > 0.5 * parameters.max_speed_rpm, "{trip:?} {fastest_rpm}");
}

/// A rotor that control cannot follow at its usual rate is refused with the reason, and runs at the rate that is named.
#[test]
fn a_rotor_that_is_too_light_is_refused_by_name() {
    let folder = made(&format!("{SERVO} --inertia 0.0003"));
    let place = tempfile::tempdir().unwrap();
    let run = |more: &[&str]| {
        let mut rig = Command::new(env!("CARGO_BIN_EXE_tractive-rig"));
        rig.args(["run", "steady", "--speed", "1000", "--torque", "5", "--machine"]).arg(folder.path());
        rig.arg("--out").arg(place.path().join("out")).args(more).output().unwrap()
    };
    let refused = run(&[]);
    let said = String::from_utf8_lossy(&refused.stderr);
    assert_eq!(refused.status.code(), Some(2), "{said}");
    for word in ["max_acceleration_rad_s2", "rotor_inertia_kg_m2", "--control-hz"] {
        assert!(said.contains(word), "{said}");
    }
    assert_eq!(run(&["--control-hz", "20000"]).status.code(), Some(0));
}
