//! An angle that is read late, whose age the drive is told, one that is read in steps, and one with a resolver's error in a sweep.

use tractive_rig::scenario::catalogue;
use tractive_rig::trace::Recorded;

/// Errors of torque at the end of each catch of `restart`, in N·m, and the demands.
fn catches(flaw: &str) -> Vec<[f64; 2]> {
    let line = format!("restart {flaw}");
    let chosen = catalogue::of_traction(line.trim_end()).unwrap();
    let machine = chosen.machine().unwrap();
    let recording = chosen.drive(&machine).unwrap();
    assert!(recording.trip().is_none(), "{line}");
    let figures = chosen.figures(&recording, &machine);
    let number = |catch: &serde_json::Value, key: &str| catch[key].as_f64().unwrap();
    let catches = figures.values()["catches"].as_array().unwrap();
    catches.iter().map(|catch| ["final_error_nm", "demand_nm"].map(|key| number(catch, key))).collect()
}

/// Largest error, as a share of the demand.
fn worst(catches: &[[f64; 2]]) -> f64 {
    catches.iter().map(|[error_nm, demand_nm]| (error_nm / demand_nm).abs()).fold(0.0, f64::max)
}

#[test]
fn a_late_angle_whose_age_is_known_costs_no_torque() {
    let [unknown, known] = ["", " --angle-late-known"].map(|known| {
        let worst = worst(&catches(&format!("--angle-late-us 50{known}")));
        println!("50 µs late{known}: {:.2} % of the demand at worst", 100.0 * worst);
        worst
    });
    assert!(unknown > 0.1, "an angle that is late must be noticed: {unknown}");
    assert!(known < 0.01, "{known}");
}

/// 4,096 counts a turn of the shaft; half of one is 0.18°, electrical.
#[test]
fn an_encoder_tells_the_middle_of_its_counts() {
    let worst = worst(&catches("--encoder-lines 1024"));
    println!("1,024 lines: {:.2} % of the demand at worst", 100.0 * worst);
    assert!(worst < 0.01, "{worst}");
}

/// 1,024 counts a turn of the shaft are 1.4°, electrical, each: the speed tracker's angle is closer. With the sensor's own angle, 4.7 % were left.
#[test]
fn between_coarse_counts_the_angle_follows_the_speed() {
    for lines in [256, 512] {
        let worst = worst(&catches(&format!("--encoder-lines {lines}")));
        println!("{lines} lines: {:.2} % of the demand at worst", 100.0 * worst);
        assert!(worst < 0.01, "{lines} lines: {worst}");
    }
}

/// 3° of once the angle are learnt on the way, before a border between two modes comes.
#[test]
fn a_resolvers_error_makes_no_mode_hunt() {
    for line in
        ["sweep --angle-1f-deg 3", "sweep --angle-1f-deg 3 --slope 500", "sweep --angle-1f-deg 3 --down"]
    {
        let chosen = catalogue::of_traction(line).unwrap();
        let machine = chosen.machine().unwrap();
        let recording = chosen.drive(&machine).unwrap();
        let figures = chosen.figures(&recording, &machine);
        assert!(!figures.fall_short() && recording.trip().is_none(), "{line}: {:?}", figures.get("verdicts"));
    }
}
