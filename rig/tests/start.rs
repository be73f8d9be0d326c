//! Starts without an angle: wherever the rotor stands, the drive finds out before it turns it.

use rand::rngs::StdRng;
use rand::{Rng, SeedableRng};
use tractive_rig::scenario::catalogue;
use tractive_rig::trace::{Recorded, Recording};

/// Starts of each machine with its flaws, and without any.
const STARTS: usize = 100;
const IDEAL_STARTS: usize = 20;
const MACHINES: [&str; 3] = ["pmasynrm-180kw", "ipm-zs9", "pmsm-48v-1kw"];

/// A run as on the command line, and the verdicts that it did not keep.
fn run(line: &str) -> (Recording, Vec<String>) {
    let chosen = catalogue::of_traction(line).unwrap();
    let machine = chosen.machine().unwrap();
    let recording = chosen.drive(&machine).unwrap();
    let figures = chosen.figures(&recording, &machine);
    let verdicts = figures.values()["verdicts"].as_array().unwrap();
    let broken = verdicts.iter().filter(|verdict| verdict["verdict"] != "pass");
    let broken = broken.map(ToString::to_string).collect();
    (recording, broken)
}

/// Starts from random angles: all with flaws, some without; prints and returns the largest error of an angle, in electrical degrees.
fn starts(machine: &str, flaws: &str, seed: u64) -> f64 {
    let mut random = StdRng::seed_from_u64(seed);
    let mut worst_deg = 0.0_f64;
    for start in 0..if flaws.is_empty() { IDEAL_STARTS } else { STARTS } {
        let from_deg: f64 = random.random_range(0.0..360.0);
        let line = format!("start --machine {machine} --from-deg {from_deg} --seed {start} {flaws}");
        let (recording, broken) = run(&line);
        assert!(broken.is_empty(), "{line}: {broken:?}");
        worst_deg = worst_deg.max(recording.found.unwrap().error_deg.abs());
    }
    println!("{machine} {flaws}: {worst_deg:.2}° at most");
    worst_deg
}

#[test]
fn the_traction_machine_starts_from_any_angle() {
    assert!(starts(MACHINES[0], "", 1) < 5.0);
    assert!(starts(MACHINES[0], "--noise-a 0.5 --dead-time-us 5", 2) < 5.0);
}

#[test]
fn a_machine_that_does_not_saturate_starts_from_any_angle() {
    assert!(starts(MACHINES[1], "", 1) < 5.0);
    assert!(starts(MACHINES[1], "--noise-a 0.5 --dead-time-us 5", 2) < 5.0);
}

/// Noise of as large a share of the current as half an ampere is of the traction machine's: half an ampere is a fault by itself, as the
/// phases' sum. And the dead time of a stage of 20 kHz: 5 µs are a fifth of its carrier halves, and one start of some twenty then takes the wrong pole.
#[test]
fn a_small_machine_starts_from_any_angle() {
    assert!(starts(MACHINES[2], "", 1) < 5.0);
    assert!(starts(MACHINES[2], "--noise-a 0.065 --dead-time-us 0.5", 2) < 5.0);
}

#[test]
fn a_rotor_that_is_braked_shows_its_polarity_by_saturation_or_not_at_all() {
    let (recording, broken) = run("start --braked --from-deg 123");
    assert!(broken.is_empty() && recording.trip().is_none(), "{broken:?}");
    let (recording, _) = run("start --braked --from-deg 123 --machine ipm-zs9");
    let trip = recording.trip().unwrap();
    assert_eq!(trip.fault.name(), "position_sensor");
    assert!(recording.found.is_none());
}
