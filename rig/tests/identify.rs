//! Machines identified by their own drive, and how far what comes out is from the truth.

use clap::{Args, Command, FromArgMatches};
use std::path::Path;
use tractive_rig::identify::{Identify, Outcome, contents, identified};
use tractive_rig::machine::Machine;

/// The outcome of the words behind `identify`, on a machine's folder.
fn outcome(machine: &Machine, words: &str) -> Outcome {
    let command = Identify::augment_args(Command::new("identify"));
    let matches = command.get_matches_from(std::iter::once("identify").chain(words.split_whitespace()));
    let identify = Identify::from_arg_matches(&matches).unwrap();
    let outcome = identified(&identify, machine).unwrap();
    let outcome = outcome.unwrap_or_else(|trip| panic!("{words}: {trip:?}"));
    let values = outcome.figures();
    println!("{words}: {}", serde_json::to_string(values.values()).unwrap());
    outcome
}

/// The limits that every experiment keeps.
fn keeps_its_place(outcome: &Outcome) {
    assert!(outcome.pulses_s < 2.0, "{} s", outcome.pulses_s);
    assert!(outcome.turned_deg < 5.0, "{}°", outcome.turned_deg);
    assert!(outcome.peak_share < 1.1, "{} of the bound", outcome.peak_share);
}

const FLAWS: &str = "--noise-a 0.5 --dead-time-us 5 --uncompensated --rs-error 10 --inertia 3";

#[test]
fn the_reference_machine_with_noise_dead_time_and_a_wrong_resistance() {
    let machine = Machine::load("pmasynrm-180kw").unwrap();
    let found = outcome(&machine, FLAWS);
    keeps_its_place(&found);
    assert!(found.flux_rms < 0.005, "{}", found.flux_rms);
    assert!(found.flux_worst < 0.012, "{}", found.flux_worst);
    assert!(found.torque_worst < 0.01, "{}", found.torque_worst);
    assert!(found.magnet_error.abs() < 0.005, "{}", found.magnet_error);
    assert!(found.resistance_error.abs() < 0.01, "{}", found.resistance_error);
    assert!((found.fit.dead_time_s - 5e-6).abs() < 0.2e-6, "{}", found.fit.dead_time_s);
    assert!((found.inertia_kg_m2 / 3.0 - 1.0).abs() < 0.01, "{}", found.inertia_kg_m2);
}

#[test]
fn a_wrong_gain_of_link_or_currents_is_the_torques_error_and_no_more() {
    let machine = Machine::load("pmasynrm-180kw").unwrap();
    for gain in ["--udc-gain 1", "--udc-gain -1", "--current-gain 1", "--current-gain -1"] {
        let found = outcome(&machine, &format!("{FLAWS} {gain}"));
        keeps_its_place(&found);
        assert!(found.torque_worst < 0.015, "{gain}: {}", found.torque_worst);
    }
}

#[test]
fn the_machine_is_found_not_the_folder_that_the_drive_was_built_with() {
    let machine = Machine::load("pmasynrm-180kw").unwrap();
    let found = outcome(&machine, &format!("{FLAWS} --map-error -15"));
    keeps_its_place(&found);
    assert!(found.flux_rms < 0.005 && found.flux_worst < 0.012, "{} {}", found.flux_rms, found.flux_worst);
    let share = found.fit.flux(0.0, 0.0).0 / f64::from(machine.tables.ratings.magnet_flux_wb);
    assert!((share - 0.85).abs() < 0.005, "{share}");
}

#[test]
fn the_other_machines_at_their_own_carriers() {
    // Noise and dead time as the same shares of current and carrier.
    for (name, flaws) in [
        ("pmsm-48v-1kw", "--noise-a 0.064 --dead-time-us 0.24 --uncompensated --rs-error 10"),
        ("ipm-zs9", "--noise-a 0.18 --dead-time-us 0.48 --uncompensated --rs-error 10"),
    ] {
        let machine = Machine::load(name).unwrap();
        let found = outcome(&machine, flaws);
        keeps_its_place(&found);
        assert!(found.flux_rms < 0.005, "{name}: {}", found.flux_rms);
        assert!(found.flux_worst < 0.012, "{name}: {}", found.flux_worst);
        assert!(found.torque_worst < 0.015, "{name}: {}", found.torque_worst);
    }
}

#[test]
fn the_generator_takes_the_folder_and_the_drive_runs_on_the_true_machine() {
    let machine = Machine::load("pmasynrm-180kw").unwrap();
    let found = outcome(&machine, FLAWS);
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("found");
    tractive_rig::folder::write_folder(&out, &contents(&found, &machine)).unwrap();
    let made = Machine::load(out.to_str().unwrap()).unwrap();
    let most = machine.folder.parameters.max_torque_nm;
    assert!(made.folder.parameters.max_torque_nm > 0.985 * most);
    sweep(&out, most);
}

/// A sweep with the found tables on the true machine.
fn sweep(found: &Path, most_nm: f64) {
    use tractive_rig::scenario::catalogue::{self, Chosen};
    let words = ["sweep", "--machine", found.to_str().unwrap(), "--plant", "pmasynrm-180kw"];
    let Ok(Chosen::Traction(choice)) = catalogue::choose(words.map(std::ffi::OsString::from).to_vec()) else {
        panic!("a scenario of the other system")
    };
    let machine = choice.machine().unwrap();
    let recording = choice.drive(&machine).unwrap();
    assert!(recording.rows.iter().all(|row| row.trip.is_none()));
    // Means of a tenth of a second, from the second on: in the first the demand is on its way.
    let means = recording.rows.chunks_exact(2_000).skip(1);
    let worst = means.map(|rows| {
        let mean = |value: fn(&tractive_rig::trace::Row) -> f64| {
            rows.iter().map(value).sum::<f64>() / rows.len() as f64
        };
        (mean(|row| row.te_nm) - mean(|row| row.te_ref_nm)).abs()
    });
    let worst = worst.fold(0.0, f64::max);
    println!("sweep: torque within {worst} N·m of {most_nm}");
    assert!(worst < 0.015 * most_nm, "{worst} N·m");
}
