//! Machines identified by their own drive, and the error of the result against the truth.

mod linear;
mod nameplate;

use clap::{Args, FromArgMatches};
use linear::MACHINES;
use rayon::prelude::*;
use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::process::Command;
use tractive::identification::Stage;
use tractive::modulation::Mode;
use tractive_rig::bench::Wiring;
use tractive_rig::identify::{Identify, Outcome, contents, identified};
use tractive_rig::machine::Machine;
use tractive_rig::scenario::catalogue::{self, Chosen};
use tractive_rig::scenario::traction::identification;
use tractive_rig::trace::{Recording, Row};
use tractive_tablegen::SmoothMap;

/// The words behind `identify`.
fn parsed(words: &str) -> Identify {
    let command = Identify::augment_args(clap::Command::new("identify"));
    let matches = command.get_matches_from(std::iter::once("identify").chain(words.split_whitespace()));
    Identify::from_arg_matches(&matches).unwrap()
}

/// The outcome of the words behind `identify`, on a machine's folder.
fn outcome(machine: &Machine, words: &str) -> Outcome {
    let outcome = identified(&parsed(words), machine).unwrap();
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

/// Four seeds. With an earlier law of the pulses, seeds 50 and 83 left the corner of +d and large i_q so poorly known that the map decreased there,
/// and seed 15 missed the bound of flux linkage by its edges of uncertain sign.
#[test]
fn the_reference_machine_with_noise_dead_time_and_a_wrong_resistance() {
    let machine = Machine::load("pmasynrm-180kw").unwrap();
    [1, 15, 50, 83].par_iter().for_each(|seed| {
        let found = outcome(&machine, &format!("{FLAWS} --seed {seed}"));
        keeps_its_place(&found);
        assert!(found.flux_rms < 0.005, "{seed}: {}", found.flux_rms);
        assert!(found.flux_worst < 0.012, "{seed}: {}", found.flux_worst);
        assert!(found.torque_worst < 0.01, "{seed}: {}", found.torque_worst);
        assert!(found.magnet_error.abs() < 0.005, "{seed}: {}", found.magnet_error);
        assert!(found.resistance_error.abs() < 0.01, "{seed}: {}", found.resistance_error);
        // Dead time and threshold together: 5 µs of 1,500 V in each half, and no threshold.
        assert!((found.lacking_v.0 / 6.75 - 1.0).abs() < 0.03, "{seed}: {:?}", found.lacking_v);
        assert!(
            (found.rotor.inertia_kg_m2 / 3.0 - 1.0).abs() < 0.01,
            "{seed}: {}",
            found.rotor.inertia_kg_m2
        );
        let map = found.fit.map(machine.folder.parameters.max_current_a);
        let columns = map.iq_a.len();
        let rises =
            |of: &[f64], step: usize| of.iter().zip(&of[step..]).map(|(a, b)| b - a).fold(f64::MAX, f64::min);
        let along_q = map.psi_q_wb.chunks(columns).map(|row| rises(row, 1)).fold(f64::MAX, f64::min);
        let along_d = rises(&map.psi_d_wb, columns);
        assert!(along_d > 0.0 && along_q > 0.0, "{seed}: {along_d}, {along_q}");
    });
}

/// Devices that conduct, in proportion to a link's voltage and a machine's current: what the reference machine's have.
fn device_drop(link_v: f64, current_a: f64) -> String {
    let volts = link_v / 1_500.0;
    let ohms = volts / (current_a / 233.333);
    format!(" --device-drop {:.6},{:.6},{:.6},{:.6}", 2.0 * volts, 5.0 * ohms, 1.5 * volts, 3.0 * ohms)
}

/// Devices' thresholds beside the dead time: the bounds hold, and the mean of eight seeds tells the two apart; the slope counts as resistance.
#[test]
fn the_devices_thresholds_are_told_from_the_dead_time() {
    let reference = "pmasynrm-180kw";
    let cases: Vec<_> = (1..=8).map(|seed| (reference, FLAWS, seed)).collect();
    let others = EVERY.into_iter().skip(1).map(|(name, flaws)| (name, flaws, 1));
    let cases: Vec<_> = cases.into_iter().chain(others).collect();
    let off_v: Vec<_> = cases.par_iter().map(|case| (case.0, thresholds_off_v(*case))).collect();
    // If control sees whole carriers, the pulses tell only the sum.
    let own: Vec<_> = off_v.iter().filter(|(name, _)| *name == reference).map(|(_, off_v)| off_v).collect();
    for case in 0..2 {
        let mean_v = own.iter().map(|off_v| off_v[case]).sum::<f64>() / own.len() as f64;
        println!("{mean_v}");
        assert!(mean_v.abs() < 0.9, "{own:?}");
    }
}

/// Drops of devices that the drive has found itself and is then told: the first step settles in 2.6 ms, where it takes 14 to 20 if it knows nothing of them.
#[test]
fn steps_settle_with_the_threshold_that_was_found() {
    let machine = Machine::load("pmasynrm-180kw").unwrap();
    for drop in ["2,5,1.5,3", "2,5,2,5"] {
        let found = outcome(&machine, &format!("{FLAWS} --seed 2 --device-drop {drop}"));
        let advice = found.threshold_advice().unwrap();
        let threshold_v = advice.rsplit(' ').next().unwrap();
        let told = format!("load-steps --device-drop {drop} --device-drop-told {threshold_v},0");
        let chosen = catalogue::of_traction(&told).unwrap();
        let recording = chosen.drive(&machine).unwrap();
        let figures = chosen.figures(&recording, &machine);
        for step in figures.values()["steps"].as_array().unwrap() {
            let settles_ms = step["settling_2_percent_ms"].as_f64().unwrap();
            assert!(settles_ms < 5.0, "{told}: {settles_ms} ms");
        }
    }
    assert!(outcome(&machine, &format!("{FLAWS} --seed 2")).threshold_advice().is_none());
}

/// Excess of the found threshold over the true one, in V: without devices' drops, and with them.
fn thresholds_off_v((name, flaws, seed): (&str, &str, u32)) -> [f64; 2] {
    let machine = Machine::load(name).unwrap();
    let parameters = &machine.folder.parameters;
    let (link_v, half_s) = (parameters.dc_link_nominal_v, 0.5 / parameters.max_switching_hz);
    let drop = device_drop(link_v, parameters.max_current_a);
    let words = format!("{flaws} --seed {seed}");
    let [without, found] = [words.clone(), words + &drop].map(|words| outcome(&machine, &words));
    let case = format!("{name}, seed {seed}");
    keeps_its_place(&found);
    assert!(
        found.flux_rms < 0.005 && found.flux_worst < 0.012,
        "{case}: {} {}",
        found.flux_rms,
        found.flux_worst
    );
    assert!(found.torque_worst < 0.01, "{case}: {}", found.torque_worst);
    assert!(found.magnet_error.abs() < 0.005, "{case}: {}", found.magnet_error);
    assert!(found.resistance_error.abs() < 0.01, "{case}: {}", found.resistance_error);
    // An IGBT conducts half of the time, a diode the other half.
    let threshold_v = 1.75 * link_v / 1_500.0;
    let dead_time_s = flaws.split(' ').nth(3).unwrap().parse::<f64>().unwrap() * 1e-6;
    let lacking_v = 0.5 * link_v * dead_time_s / half_s;
    [(&without, 0.0), (&found, threshold_v)].map(|(found, threshold_v)| {
        let lacks = found.lacking_v.0 / (lacking_v + threshold_v);
        assert!((lacks - 1.0).abs() < 0.03, "{case}: {:?}", found.lacking_v);
        found.fit.threshold_v - threshold_v
    })
}

/// The turning rotor's own flux linkages, from its voltage less the drops of resistance and inverter, agree with the pulses' map; with a map that is
/// 2 % off they do not.
#[test]
fn the_turn_checks_the_map_of_the_pulses() {
    let machine = Machine::load("pmasynrm-180kw").unwrap();
    let found = outcome(&machine, &format!("{FLAWS} --device-drop 2,5,1.5,3"));
    assert_eq!(found.fit.turning.len(), 2, "{:?}", found.fit.turning);
    assert!(found.turning_flux_off < 0.01, "{}", found.turning_flux_off);
    assert!(found.turning_torque_off < 0.005, "{}", found.turning_torque_off);
    let largest_wb = found.fit.flux(0.0, machine.folder.parameters.max_current_a).1;
    let mut other = found.fit.turning[0];
    other.map = (other.map.0, 1.05 * other.map.1);
    assert!(other.off_wb() > 0.01 * largest_wb, "{other:?}");
}

/// Charged, enabled, stopped and told by frames, which have fewer bits than the rig's own words.
#[test]
fn commanded_over_the_protocol_as_a_board_is() {
    let machine = Machine::load("pmasynrm-180kw").unwrap();
    let found = outcome(&machine, &format!("{FLAWS} --over-protocol"));
    keeps_its_place(&found);
    assert!(found.flux_rms < 0.005 && found.flux_worst < 0.012, "{} {}", found.flux_rms, found.flux_worst);
    assert!(found.torque_worst < 0.01, "{}", found.torque_worst);
    assert!(found.magnet_error.abs() < 0.005, "{}", found.magnet_error);
    let ended = identified(&parsed(&format!("{FLAWS} --over-protocol --fault-at 1.5")), &machine);
    let ended = ended.unwrap().err().unwrap();
    assert!(!ended.fault.is_empty() && !ended.value.is_empty(), "{ended:?}");
}

#[test]
fn a_wrong_gain_of_link_or_currents_is_the_torques_error_and_no_more() {
    let machine = Machine::load("pmasynrm-180kw").unwrap();
    // A voltage error is a flux linkage error that no observation reveals; a current error is none where no current flows.
    for (gain, webers) in [
        ("--udc-gain 1", 0.01),
        ("--udc-gain -1", -0.01),
        ("--current-gain 1", 0.0),
        ("--current-gain -1", 0.0),
    ] {
        let found = outcome(&machine, &format!("{FLAWS} {gain}"));
        keeps_its_place(&found);
        assert!(found.torque_worst < 0.015, "{gain}: {}", found.torque_worst);
        assert!((found.magnet_error - webers).abs() < 0.005, "{gain}: {}", found.magnet_error);
    }
}

/// All flaws of `--real`, including a link that is read 1 % wrong and magnets that are 1 % weaker than the folder's.
#[test]
fn a_machine_behind_a_real_inverter_is_found() {
    for name in ["pmasynrm-180kw", "pmsm-48v-1kw", "ipm-zs9"] {
        let machine = Machine::load(name).unwrap();
        let found = outcome(&machine, "--real");
        keeps_its_place(&found);
        assert!(found.torque_worst < 0.015, "{name}: {}", found.torque_worst);
        let webers = found.magnet_error;
        assert!(webers > 0.003 && webers < 0.015, "{name}: {webers}, of which 0.01 are the link sensor's");
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

/// The machines with the flaws of their experiments: noise and dead time as the same shares of current and carrier.
const EVERY: [(&str, &str); 3] = [
    ("pmasynrm-180kw", FLAWS),
    ("pmsm-48v-1kw", "--noise-a 0.064 --dead-time-us 0.24 --uncompensated --rs-error 10"),
    ("ipm-zs9", "--noise-a 0.18 --dead-time-us 0.48 --uncompensated --rs-error 10"),
];

/// The rotor is free, and the currents along the supposed d axis are not along d.
#[test]
fn a_zero_that_is_off_is_found_with_the_machine() {
    let cases: Vec<_> = EVERY
        .into_iter()
        .flat_map(|(name, flaws)| [-10.0, -3.0, 3.0, 10.0].map(|error_deg| (name, flaws, error_deg)))
        .flat_map(|(name, flaws, error_deg)| [1.0, 2.0].map(|times| (name, flaws, error_deg, times)))
        .collect();
    cases.par_iter().for_each(|(name, flaws, error_deg, times)| {
        let machine = Machine::load(name).unwrap();
        let case = format!("{name}, {error_deg}°, {times} times the inertia");
        let mut identify = parsed(&format!("{flaws} --angle-error {error_deg}"));
        let inertia_kg_m2 = identify.inertia.unwrap_or(machine.folder.parameters.rotor_inertia_kg_m2);
        identify.inertia = Some(times * inertia_kg_m2);
        let found =
            identified(&identify, &machine).unwrap().unwrap_or_else(|ended| panic!("{case}: {ended:?}"));
        println!("{case}: turned {:.2}°, |i| up to {:.3}", found.turned_deg, found.peak_share);
        keeps_its_place(&found);
        assert!((found.signs.zero_deg + error_deg).abs() < 0.3, "{case}: {}", found.signs.zero_deg);
        assert!(found.flux_rms < 0.005, "{case}: {}", found.flux_rms);
        assert!(found.flux_worst < 0.012, "{case}: {}", found.flux_worst);
        assert!(found.torque_worst < 0.01, "{case}: {}", found.torque_worst);
        assert!(found.magnet_error.abs() < 0.005, "{case}: {}", found.magnet_error);
    });
}

/// Offsets that the drive removes by its own zeros before the first pulse: little is left, and the map is as good.
#[test]
fn offsets_of_the_current_sensors_cost_nothing() {
    for ((name, flaws), offset_a) in EVERY.into_iter().zip([3.0_f64, 0.4, 1.1]) {
        let machine = Machine::load(name).unwrap();
        let percent = 100.0 * offset_a / machine.folder.parameters.trip_current_a;
        let other = -0.5 * percent;
        let found = outcome(&machine, &format!("{flaws} --current-offset {percent},{other},{other}"));
        keeps_its_place(&found);
        assert!(found.offset_a < 0.1 * offset_a, "{name}: {}", found.offset_a);
        assert!(found.flux_rms < 0.005, "{name}: {}", found.flux_rms);
        assert!(found.flux_worst < 0.012, "{name}: {}", found.flux_worst);
        assert!(found.torque_worst < 0.01, "{name}: {}", found.torque_worst);
        assert!(found.magnet_error.abs() < 0.005, "{name}: {}", found.magnet_error);
    }
}

/// A fiftieth of the largest torque: a dry bearing and more.
#[test]
fn friction_is_found_beside_the_inertia() {
    for (name, flaws) in EVERY {
        let machine = Machine::load(name).unwrap();
        let parameters = &machine.folder.parameters;
        let friction_nm = 0.02 * parameters.max_torque_nm;
        let found = outcome(&machine, &format!("{flaws} --friction {friction_nm}"));
        keeps_its_place(&found);
        let share = found.rotor.friction_nm / friction_nm;
        assert!((share - 1.0).abs() < 0.05, "{name}: {share}");
        let without = outcome(&machine, flaws).rotor;
        assert!(without.friction_nm.abs() < 0.05 * friction_nm, "{name}: {}", without.friction_nm);
        let inertia = found.rotor.inertia_kg_m2 / without.inertia_kg_m2;
        assert!((inertia - 1.0).abs() < 0.01, "{name}: {inertia}");
    }
}

/// Sensors of the wrong sign or in another order: their wires are named, and nothing else is done. If some have the wrong sign, the phases' sum is
/// not zero, which is a fault.
#[test]
fn wires_of_the_current_sensors_are_told() {
    let one_sign =
        Wiring::of_one_sign().into_iter().skip(1).map(|wiring| (wiring.to_string(), "current_sensors"));
    let some = ["-u,v,w", "u,-v,w", "-u,-v,w", "v,u,-w"].map(|wiring| (wiring.to_owned(), "phase_sum"));
    let wirings: Vec<_> = one_sign.chain(some).collect();
    let cases: Vec<_> =
        EVERY.iter().flat_map(|machine| wirings.iter().map(move |wiring| (machine, wiring))).collect();
    cases.par_iter().for_each(|((name, flaws), (wiring, fault))| {
        let machine = Machine::load(name).unwrap();
        let ended =
            identified(&parsed(&format!("{flaws} --current-sensors={wiring}")), &machine).unwrap().err();
        let ended = ended.unwrap_or_else(|| panic!("{name}: {wiring}"));
        assert_eq!(ended.fault, *fault, "{name}: {wiring}: {ended:?}");
        assert_eq!(
            ended.wiring.map(|told| told.to_string()),
            (*fault == "current_sensors").then(|| wiring.clone()),
            "{name}"
        );
    });
    // A board's bus reports progress ten times a second: at 20 kHz, a first part is over before that.
    let machine = Machine::load("pmsm-48v-1kw").unwrap();
    let ended = identified(&parsed("--over-protocol --current-sensors=v,u,w"), &machine).unwrap().err();
    assert_eq!(ended.and_then(|ended| ended.wiring).unwrap().to_string(), "v,u,w");
}

/// Half a percent of the largest current as noise: the machines are found, and exchanged wires are told as such. With a whole percent nothing is done, and it
/// is told as noise, whatever the wires. Before thresholds came from the noise, 0.5 % ended in `overcurrent`, `rotor_turned` or wires that were right.
#[test]
fn noise_is_taken_to_half_a_percent_and_told_beyond() {
    let cases: Vec<_> = EVERY.iter().flat_map(|(name, _)| [1, 2, 3].map(|seed| (*name, seed))).collect();
    cases.par_iter().for_each(|(name, seed)| {
        let machine = Machine::load(name).unwrap();
        let inertia = if *name == "pmasynrm-180kw" { "--inertia 3" } else { "" };
        let words = |share: f64, more: &str| {
            let noise_a = share * machine.folder.parameters.max_current_a;
            format!("--noise-a {noise_a:.4} --seed {seed} {inertia} {more}")
        };
        let found = outcome(&machine, &words(0.005, ""));
        keeps_its_place(&found);
        assert!(found.flux_rms < 0.005, "{name}: {}", found.flux_rms);
        assert!(found.flux_worst < 0.012, "{name}: {}", found.flux_worst);
        assert!(found.torque_worst < 0.01, "{name}: {}", found.torque_worst);
        let share = found.noise_a / machine.folder.parameters.max_current_a;
        assert!((share / 0.005 - 1.0).abs() < 0.2, "{name}: {share}");
        let ended = |words: &str| identified(&parsed(words), &machine).unwrap().err().unwrap();
        for wiring in ["-u,-v,-w", "v,u,w", "v,w,u"] {
            let ended = ended(&words(0.005, &format!("--current-sensors={wiring}")));
            assert_eq!(
                ended.wiring.map(|told| told.to_string()).as_deref(),
                Some(wiring),
                "{name}: {ended:?}"
            );
        }
        for more in ["", "--current-sensors=v,u,w"] {
            let ended = ended(&words(0.01, more));
            assert_eq!((ended.fault.as_str(), ended.wiring), ("current_noise", None), "{name}: {ended:?}");
        }
    });
}

#[test]
fn the_other_machines_at_their_own_carriers() {
    for (name, flaws) in EVERY.into_iter().skip(1) {
        let machine = Machine::load(name).unwrap();
        let found = outcome(&machine, flaws);
        keeps_its_place(&found);
        assert!(found.flux_rms < 0.005, "{name}: {}", found.flux_rms);
        assert!(found.flux_worst < 0.012, "{name}: {}", found.flux_worst);
        assert!(found.torque_worst < 0.015, "{name}: {}", found.torque_worst);
    }
}

/// The flaws of the reference machine's experiment: noise as the same share of current, dead time of a carrier in whole ticks.
fn flaws_of(machine: &Machine) -> Vec<String> {
    let parameters = &machine.folder.parameters;
    let noise_a = 0.5 * parameters.max_current_a / 233.333;
    let dead_time_us = (5.0 * 900.0 / parameters.max_switching_hz / 0.04).round() * 0.04;
    let drop = device_drop(parameters.dc_link_nominal_v, parameters.max_current_a);
    let words = format!(
        "--noise-a {noise_a:.4} --dead-time-us {dead_time_us:.2} --uncompensated --rs-error 10{drop}"
    );
    words.split(' ').map(str::to_owned).collect()
}

/// The words of the rig's own program, with exit code 0.
fn rig(words: &[&OsStr]) -> String {
    let output = Command::new(env!("CARGO_BIN_EXE_tractive-rig")).args(words).output().unwrap();
    assert!(output.status.success(), "{words:?}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

/// The chain of a machine folder: identified, its operating points and a sweep with what was found on the true machine.
fn is_found_and_driven(folder: &Path) {
    let machine = Machine::load(folder.to_str().unwrap()).unwrap();
    let place = tempfile::tempdir().unwrap();
    let (out, page) = (place.path().join("found"), place.path().join("found.html"));
    let flaws = flaws_of(&machine);
    let fixed = ["identify", "--machine"].map(OsStr::new).into_iter();
    let rest = [folder.as_os_str(), "--out".as_ref(), out.as_os_str(), "--page".as_ref(), page.as_os_str()];
    let flaws = flaws.iter().map(OsStr::new).chain(["--json".as_ref()]);
    let told = rig(&fixed.chain(rest).chain(flaws).collect::<Vec<_>>());
    let told: serde_json::Value = serde_json::from_str(&told).unwrap();
    let [turned_deg, peak] =
        ["rotor_turned_deg", "peak_current_percent_of_bound"].map(|name| told[name].as_f64().unwrap());
    assert!(turned_deg < 5.0 && peak < 110.0, "{}: {turned_deg}°, {peak} % of the bound", folder.display());
    let peak_a = told["peak_current_a"].as_f64().unwrap();
    assert!((100.0 * peak_a / machine.folder.parameters.max_current_a - peak).abs() < 1e-6);
    assert!(
        told["seconds"].as_f64().unwrap() > 0.1
            && told.as_object().unwrap().values().all(|value| value.is_number())
    );
    let points = worst_point_nm(&machine, &warm(folder, place.path()), &out, place.path());
    let swept = worst_swept_nm(&machine, folder, &out);
    let most_nm = machine.folder.parameters.max_torque_nm;
    let name = folder.file_name().unwrap_or_default().to_string_lossy();
    let percent = |torque_nm: f64| 100.0 * torque_nm / most_nm;
    println!("{name}: points within {:.3} %, sweep within {:.3} %", percent(points), percent(swept));
    assert!(points < 0.015 * most_nm, "{name}: {points} N·m of {most_nm}");
    assert!(swept < 0.015 * most_nm, "{name}: {swept} N·m of {most_nm}");
}

/// The folder of the machine that was really there: with the resistance of [`flaws_of`].
fn warm(folder: &Path, place: &Path) -> PathBuf {
    let warm = place.join("warm");
    std::fs::create_dir(&warm).unwrap();
    std::fs::copy(folder.join("flux_map.csv"), warm.join("flux_map.csv")).unwrap();
    let text = std::fs::read_to_string(folder.join("machine.toml")).unwrap();
    let mut keys: toml::Table = text.parse().unwrap();
    let ohm = keys["stator_resistance_ohm"].as_float().unwrap();
    keys.insert("stator_resistance_ohm".to_owned(), (1.1 * ohm).into());
    std::fs::write(warm.join("machine.toml"), keys.to_string()).unwrap();
    warm
}

/// Worst torque of the found tables' operating points on the true machine, as an error against the true machine's own points.
fn worst_point_nm(machine: &Machine, folder: &Path, found: &Path, place: &Path) -> f64 {
    let parameters = &machine.folder.parameters;
    let [input, own, of_found] = ["in.csv", "own.csv", "found.csv"].map(|name| place.join(name));
    let mut wanted = String::from("torque_nm,speed_rpm,udc_v\n");
    for (torque, speed) in (-8..=8).flat_map(|k| (0..=8).map(move |n| (k, n))) {
        let torque_nm = parameters.max_torque_nm * f64::from(torque) / 8.0;
        let speed_rpm = parameters.max_speed_rpm * f64::from(speed) / 8.0;
        wanted += &format!("{torque_nm},{speed_rpm},{}\n", parameters.dc_link_nominal_v);
    }
    std::fs::write(&input, wanted).unwrap();
    let map = SmoothMap::new(&machine.folder.map);
    let torques = [(folder, &own), (found, &of_found)].map(|(of, output)| {
        rig(&[
            "points".as_ref(),
            input.as_os_str(),
            output.as_os_str(),
            "--machine".as_ref(),
            of.as_os_str(),
        ]);
        let text = std::fs::read_to_string(output).unwrap();
        let torque_nm = |line: &str| {
            let cells: Vec<_> = line.split(',').collect();
            let (id, iq): (f64, f64) = (cells[3].parse().unwrap(), cells[4].parse().unwrap());
            let at = map.at(id, iq);
            1.5 * f64::from(parameters.pole_pairs) * (at.psi_d_wb * iq - at.psi_q_wb * id)
        };
        text.lines().skip(1).map(torque_nm).collect::<Vec<_>>()
    });
    let [own, of_found] = torques;
    assert_eq!((own.len(), of_found.len()), (153, 153));
    own.iter().zip(&of_found).map(|(own, found)| (own - found).abs()).fold(0.0, f64::max)
}

/// Worst torque error of a sweep with the found tables on the true machine, against the demand, as means of a tenth of a second; no fault. The
/// machine's resistance is the one that was identified, and the step is no simple fraction of a carrier, so that the ripple has no mean.
fn worst_swept_nm(machine: &Machine, plant: &Path, found: &Path) -> f64 {
    let step_s = (0.37 / machine.folder.parameters.max_switching_hz).min(50e-6);
    let flaws = format!("sweep --rs-error 10 --dt {step_s}");
    let folders: [&OsStr; 4] =
        ["--machine".as_ref(), found.as_os_str(), "--plant".as_ref(), plant.as_os_str()];
    let words: Vec<_> = flaws.split(' ').map(OsStr::new).chain(folders).map(OsStr::to_owned).collect();
    let Ok(Chosen::Traction(choice)) = catalogue::choose(words) else {
        panic!("a scenario of the other system")
    };
    let recording = choice.drive(&choice.machine().unwrap()).unwrap();
    let trip = recording.rows.iter().find_map(|row| row.trip);
    assert!(trip.is_none(), "{}: {trip:?}", plant.display());
    // From the second tenth on: in the first the demand is on its way.
    let means = recording.rows.chunks_exact((0.1 / step_s) as usize).skip(1);
    let worst = means.map(|rows| {
        let mean = |value: fn(&Row) -> f64| rows.iter().map(value).sum::<f64>() / rows.len() as f64;
        (mean(|row| row.te_nm) - mean(|row| row.te_ref_nm)).abs()
    });
    worst.fold(0.0, f64::max)
}

#[test]
fn every_folder_of_tables_is_found_and_driven_with_what_was_found() {
    let tables = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tables");
    let mut folders: Vec<_> = std::fs::read_dir(&tables)
        .unwrap()
        .map(|entry| entry.unwrap().path().canonicalize().unwrap())
        .collect();
    folders.retain(|folder| folder.join("machine.toml").is_file());
    assert!(folders.len() >= 3, "{folders:?}");
    folders.par_iter().for_each(|folder| is_found_and_driven(folder));
}

#[test]
fn machines_of_other_kinds_are_found_and_driven_with_what_was_found() {
    MACHINES.par_iter().for_each(|linear| {
        let place = tempfile::tempdir().unwrap();
        let folder = place.path().join(linear.name);
        std::fs::create_dir(&folder).unwrap();
        linear.write(&folder);
        is_found_and_driven(&folder);
    });
}

/// A tram's machine, whose ripple goes a tenth beyond the largest current.
const TRAM: &str = "--pole-pairs 3 --rs 0.06 --ld 1.2e-3 --lq 2.6e-3 --psi-f 0.45 --saturation 0.6 --max-current 350 --udc 750 --max-speed-rpm 4000 \
     --max-switching-hz 2000";

/// Machines as a nameplate tells them: a tram's, much reluctance, 200 W at 24 V, a car's, whose current is fast and whose
/// iron saturates; 30 W, one pole pair, twelve, reluctance alone at 48 V, and a rotor of a hundred times the usual inertia.
const NAMEPLATES: [(&str, &str); 9] = [
    (
        "tiny",
        "--pole-pairs 4 --rs 1.2 --ld 1e-3 --lq 1e-3 --psi-f 0.008 --max-current 3 --udc 24 --max-speed-rpm 5000 --max-switching-hz 20000",
    ),
    (
        "one pole pair",
        "--pole-pairs 1 --rs 0.4 --ld 0.4e-3 --lq 0.45e-3 --psi-f 0.012 --max-current 8 --udc 36 --max-speed-rpm 12000 --max-switching-hz 20000",
    ),
    (
        "hub",
        "--pole-pairs 12 --rs 0.15 --ld 0.3e-3 --lq 0.3e-3 --psi-f 0.02 --max-current 40 --udc 60 --max-speed-rpm 1000 --max-switching-hz 16000",
    ),
    (
        "reluctance alone at 48 V",
        "--pole-pairs 2 --rs 0.1 --ld 0.5e-3 --lq 3e-3 --psi-f 0 --saturation 0.5 --max-current 30 --udc 48 --max-speed-rpm 3000 --max-switching-hz 16000",
    ),
    (
        "heavy rotor",
        "--pole-pairs 5 --rs 0.9 --ld 6e-3 --lq 11e-3 --psi-f 0.18 --saturation 0.7 --max-current 20 --udc 560 --max-speed-rpm 4500 \
         --max-switching-hz 8000 --inertia 3",
    ),
    ("tram", TRAM),
    (
        "reluctance",
        "--pole-pairs 2 --rs 0.25 --ld 6e-3 --lq 55e-3 --psi-f 0.22 --saturation 0.45 --max-current 60 --udc 560 --max-speed-rpm 4500 \
         --max-switching-hz 8000",
    ),
    (
        "small",
        "--pole-pairs 5 --rs 0.08 --ld 0.12e-3 --lq 0.13e-3 --psi-f 0.006 --max-current 15 --udc 24 --max-speed-rpm 3500 --max-switching-hz 20000",
    ),
    (
        "car",
        "--pole-pairs 4 --rs 0.01 --ld 0.13e-3 --lq 0.35e-3 --psi-f 0.075 --saturation 0.55 --max-current 550 --udc 370 --max-speed-rpm 12000 \
         --max-switching-hz 10000",
    ),
];

#[test]
fn machines_of_a_nameplate_are_found_and_driven_with_what_was_found() {
    NAMEPLATES.par_iter().for_each(|(name, values)| {
        let place = tempfile::tempdir().unwrap();
        is_found_and_driven(&new(values, place.path(), name));
    });
}

/// The folder of a nameplate's values.
fn new(values: &str, place: &Path, name: &str) -> PathBuf {
    let folder = place.join(name);
    let words: Vec<_> =
        ["machine", "new"].into_iter().chain(values.split_whitespace()).map(OsStr::new).collect();
    rig(&[words, vec!["--out".as_ref(), folder.as_os_str()]].concat());
    folder
}

/// Runs the experiment on a nameplate's machine with each of so many seeds; each is judged by its recording and the bound of current in A.
fn driven(values: &str, seeds: u32, judge: impl Fn(u32, &Recording, f64) + Sync) {
    let place = tempfile::tempdir().unwrap();
    let machine = Machine::load(new(values, place.path(), "saturates").to_str().unwrap()).unwrap();
    let parameters = &machine.folder.parameters;
    let flaws = flaws_of(&machine).join(" ");
    let stand = identification::Stand { inertia_kg_m2: parameters.rotor_inertia_kg_m2, fault_at_s: None };
    (1..=seeds).into_par_iter().for_each(|seed| {
        let options = parsed(&format!("{flaws} --seed {seed}")).options;
        let recording = identification::drive(&options, &machine, &stand).unwrap();
        let trip = recording.rows.iter().find_map(|row| row.trip);
        assert!(trip.is_none(), "seed {seed}: {trip:?}");
        judge(seed, &recording, parameters.max_current_a);
    });
}

/// Reach of the pulses along q, as a share of the circle that boundaries keep to: the least of all bands along d, each a tenth of the bound wide.
fn reach(recording: &Recording, bound_a: f64) -> f64 {
    let shares = recording.observations.iter().map(|o| (f64::from(o.current.d), f64::from(o.current.q)));
    let shares: Vec<_> = shares.map(|(d, q)| (d / bound_a, q.abs() / bound_a)).collect();
    let of_band = |band: i32| {
        let middle = 0.1 * f64::from(band);
        let own = shares.iter().filter(|(d, _)| (d - middle).abs() < 0.06);
        own.map(|(_, q)| *q).fold(0.0, f64::max) / (0.94f64 * 0.94 - middle * middle).sqrt()
    };
    (-9..=1).map(of_band).fold(1.0, f64::min)
}

/// Iron whose L_q falls to 0.4 of itself, in seven machines, most of which saturate along d too: the pulses along q keep the bound and still come
/// near it beside every current along d. With laws that kept the bound by making no pulses, they reached 0.02 of the circle.
#[test]
fn much_saturation_keeps_the_bound_of_current() {
    let tram = TRAM.replace(" --saturation 0.6", "");

    // Reluctance alone, a car, a servo, much reluctance behind few volt-seconds, little of anything, 300 kW.
    for (values, least_reach) in [
        (
            "--pole-pairs 2 --rs 0.1 --ld 0.5e-3 --lq 3e-3 --psi-f 0 --max-current 30 --udc 48 --max-speed-rpm 3000 --max-switching-hz 16000",
            0.6,
        ),
        (
            "--pole-pairs 4 --rs 0.01 --ld 0.13e-3 --lq 0.35e-3 --psi-f 0.075 --max-current 550 --udc 370 --max-speed-rpm 12000 --max-switching-hz 10000",
            0.6,
        ),
        (
            "--pole-pairs 5 --rs 0.9 --ld 6e-3 --lq 11e-3 --psi-f 0.18 --max-current 20 --udc 560 --max-speed-rpm 4500 --max-switching-hz 8000",
            0.6,
        ),
        (
            "--pole-pairs 2 --rs 0.25 --ld 6e-3 --lq 55e-3 --psi-f 0.22 --max-current 60 --udc 560 --max-speed-rpm 4500 --max-switching-hz 8000",
            0.5,
        ),
        (
            "--pole-pairs 4 --rs 0.06 --ld 0.36e-3 --lq 0.55e-3 --psi-f 0.0125 --max-current 30 --udc 48 --max-speed-rpm 6000 --max-switching-hz 20000",
            0.6,
        ),
        (
            "--pole-pairs 4 --rs 0.012 --ld 0.55e-3 --lq 1.4e-3 --psi-f 0.62 --max-current 800 --udc 1500 --max-speed-rpm 4500 --max-switching-hz 2000",
            0.6,
        ),
        (&tram, 0.6),
    ] {
        driven(&format!("{values} --saturation 0.4"), 8, |seed, recording, bound_a| {
            let peak_a = recording.rows.iter().map(|row| row.id_a.hypot(row.iq_a)).fold(0.0, f64::max);
            let (peak_share, reach) = (peak_a / bound_a, reach(recording, bound_a));
            println!("{bound_a} A, seed {seed}: {peak_share:.3} of the bound, reach {reach:.3}");
            assert!(peak_share < 1.1, "{bound_a} A, seed {seed}: {peak_share} of the bound");
            assert!(reach > least_reach, "{bound_a} A, seed {seed}: {reach}");
        });
    }
}

/// Changes of a constant current are noise: the law learns nothing from them, and the turning rotor's current stays at its reference, 0.32 of the
/// bound. With iron whose L_q falls to 0.35 of itself, a law that had learnt from noise let the current rise to 1.87 of the bound, which is a fault.
#[test]
fn the_turning_rotors_current_stays_where_it_is_wanted() {
    const VALUES: &str = "--pole-pairs 5 --rs 0.9 --ld 6e-3 --lq 11e-3 --psi-f 0.18 --saturation 0.35 --max-current 20 --udc 560 \
         --max-speed-rpm 4500 --max-switching-hz 8000";
    driven(VALUES, 8, |seed, recording, bound_a| {
        let turning = recording.observations.iter().filter(|o| o.stage == Stage::Turn);
        let (peak_a, count) =
            turning.fold((0.0_f32, 0), |(most, n), o| (most.max(o.current.length()), n + 1));
        let peak_share = f64::from(peak_a) / bound_a;
        println!("seed {seed}: {peak_share:.3} of the bound, {count} observations");
        assert!(count > 100 && peak_share < 0.5, "seed {seed}: {peak_share} of the bound");
    });
}

/// Iron goes on saturating beyond the pulses, and so does the map: at the peaks of ripple it is as good as the flux linkage's mean error has to be
/// within the bound.
#[test]
fn the_map_goes_on_with_its_bend_where_ripple_is() {
    let place = tempfile::tempdir().unwrap();
    let machine = Machine::load(new(TRAM, place.path(), "tram").to_str().unwrap()).unwrap();
    let found = outcome(&machine, &flaws_of(&machine).join(" "));
    let bound_a = machine.folder.parameters.max_current_a;
    let map = SmoothMap::new(&machine.folder.map);
    let at = |share: f64, angle_deg: f64| {
        let (q, d) = angle_deg.to_radians().sin_cos();
        let (id, iq) = (share * bound_a * d, share * bound_a * q);
        let (is, found) = (map.at(id, iq), found.fit.flux(id, iq));
        (is.psi_d_wb.hypot(is.psi_q_wb), (found.0 - is.psi_d_wb).hypot(found.1 - is.psi_q_wb))
    };
    let angles = || (0..=20).map(|k| 90.0 + 4.5 * f64::from(k));
    let largest_wb = angles().map(|angle| at(1.0, angle).0).fold(0.0, f64::max);
    let worst_wb = angles().map(|angle| at(1.1, angle).1).fold(0.0, f64::max);
    println!("tram, at 1.1 of the bound: {:.2} %", 100.0 * worst_wb / largest_wb);
    assert!(worst_wb < 0.005 * largest_wb, "{worst_wb} of {largest_wb} Wb");
}

/// A demagnetisation limit is kept by the stairs, the pulses and the turn, and it and the patterns are keys of the folder that comes of them. Without it
/// the pulses go to 0.96 of the largest current against the magnets' flux.
#[test]
fn a_demagnetisation_limit_is_kept_and_handed_on() {
    [("pmasynrm-180kw", -160.5), ("pmsm-48v-1kw", -15.5)].par_iter().for_each(|(name, least_a)| {
        let place = tempfile::tempdir().unwrap();
        let machine = limited(name, *least_a, place.path());
        let words = flaws_of(&machine).join(" ");
        let stand = identification::Stand {
            inertia_kg_m2: machine.folder.parameters.rotor_inertia_kg_m2,
            fault_at_s: None,
        };
        let recording = identification::drive(&parsed(&words).options, &machine, &stand).unwrap();
        let boundaries = recording.observations.iter().map(|observation| observation.current.d);
        let lowest_share = f64::from(boundaries.fold(0.0, f32::min)) / least_a;
        assert!((0.9..1.02).contains(&lowest_share), "{name}: {lowest_share} of the limit");
        let found: toml::Table = contents(&outcome(&machine, &words), &machine).toml.parse().unwrap();
        assert_eq!(
            (found["min_id_a"].as_float(), found["patterns"].as_str()),
            (Some(*least_a), Some("optimal"))
        );
        is_found_and_driven(&place.path().join("limited"));
    });
}

/// A limit that leaves the pulses no current against the magnets' flux is refused, and its key is named.
#[test]
fn a_limit_without_pulses_along_d_is_refused() {
    let place = tempfile::tempdir().unwrap();
    let values = "--pole-pairs 4 --rs 0.06 --ld 0.36e-3 --lq 0.36e-3 --psi-f 0.0125 --max-current 30 --udc 48 --max-speed-rpm 4000 --max-switching-hz 20000";
    let folder = new(values, place.path(), "surface");
    let file = folder.join("machine.toml");
    std::fs::write(&file, std::fs::read_to_string(&file).unwrap() + "min_id_a = -2.9\n").unwrap();
    let machine = Machine::load(folder.to_str().unwrap()).unwrap();
    let refused = identified(&parsed(""), &machine).err().unwrap().to_string();
    assert_eq!(
        refused,
        "min_id_a -2.9: must be at or below -3: the experiment's pulses along d take 0.1 of max_current_a"
    );
}

/// A machine of `tables/` with a demagnetisation limit and optimised patterns.
fn limited(name: &str, least_a: f64, place: &Path) -> Machine {
    let (from, folder) =
        (Path::new(env!("CARGO_MANIFEST_DIR")).join("../tables").join(name), place.join("limited"));
    std::fs::create_dir(&folder).unwrap();
    std::fs::copy(from.join("flux_map.csv"), folder.join("flux_map.csv")).unwrap();
    let text = std::fs::read_to_string(from.join("machine.toml")).unwrap();
    std::fs::write(
        folder.join("machine.toml"),
        format!("{text}\nmin_id_a = {least_a}\npatterns = \"optimal\"\n"),
    )
    .unwrap();
    Machine::load(folder.to_str().unwrap()).unwrap()
}

#[test]
fn a_light_rotor_that_turns_away_is_told_what_it_needs() {
    let folder = nameplate::made(
        "--pole-pairs 4 --rs 1.1 --ld 0.0055 --lq 0.0065 --psi-f 0.155 --max-current 35 --udc 560 --max-speed-rpm 6000 --max-switching-hz 8000 --inertia 0.0008",
    );
    let place = tempfile::tempdir().unwrap();
    let run = |more: &[&str]| {
        let mut rig = Command::new(env!("CARGO_BIN_EXE_tractive-rig"));
        rig.args(["identify", "--machine"]).arg(folder.path()).arg("--out").arg(place.path().join("found"));
        rig.arg("--page").arg(place.path().join("found.html")).args(more).output().unwrap()
    };
    let alone = run(&[]);
    let said = String::from_utf8_lossy(&alone.stderr);
    assert!(alone.status.code() == Some(1) && said.starts_with("fault rotor_turned"), "{said}");
    assert!(
        said.contains("couple it") && said.contains("--inertia") && said.trim().lines().count() == 1,
        "{said}"
    );
    assert_eq!(run(&["--inertia", "0.003"]).status.code(), Some(0));
}

/// A fault in the midst of the experiment: gates off, exit code 1, nothing written beside or in the place of the folder.
#[test]
fn a_fault_ends_the_experiment_with_gates_off_and_nothing_half_written() {
    let machine = Machine::load("pmasynrm-180kw").unwrap();
    for at_s in ["0.0004", "0.3", "2.1"] {
        let place = tempfile::tempdir().unwrap();
        let run = |out: &Path| {
            let mut rig = Command::new(env!("CARGO_BIN_EXE_tractive-rig"));
            rig.args("identify --inertia 3 --fault-at".split(' ')).arg(at_s).arg("--out").arg(out);
            let output = rig.arg("--page").arg(place.path().join("found.html")).output().unwrap();
            (output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned())
        };
        let (code, said) = run(&place.path().join("found"));
        assert!(code == Some(1) && said.contains("nothing is written"), "{code:?}: {said}");
        let left: Vec<_> = std::fs::read_dir(place.path()).unwrap().collect();
        assert!(left.is_empty(), "{at_s} s: {left:?}");
        let recording = identification::drive(
            &parsed("--inertia 3").options,
            &machine,
            &identification::Stand { inertia_kg_m2: 3.0, fault_at_s: at_s.parse().ok() },
        );
        let recording = recording.unwrap();
        let trip_s = recording.rows.iter().find(|row| row.trip.is_some()).unwrap().t_s;
        assert!(trip_s < at_s.parse::<f64>().unwrap() + 0.01, "{trip_s} s");
        // The devices that are on at the end, and the last that was turned on.
        let on = recording.edges.iter().fold([false; 6], |mut on, edge| {
            on[usize::from(edge.gate)] = edge.on;
            on
        });
        let last = recording.edges.iter().rev().find(|edge| edge.on).map_or(0, |edge| edge.tick);
        let last_s = last as f64 / 25e6;
        assert!(on == [false; 6] && last_s < trip_s + 1e-4, "{at_s} s: {on:?}, {last_s} s, {trip_s} s");
        assert_eq!(recording.rows.last().unwrap().mode, Mode::Off);
    }
}

/// A folder that already exists stays as it was.
#[test]
fn a_fault_leaves_the_folder_that_was_there() {
    let place = tempfile::tempdir().unwrap();
    let out = place.path().join("found");
    std::fs::create_dir(&out).unwrap();
    std::fs::write(out.join("machine.toml"), "kept").unwrap();
    let mut rig = Command::new(env!("CARGO_BIN_EXE_tractive-rig"));
    rig.args("identify --fault-at 0.3 --out".split(' ')).arg(&out);
    assert_eq!(rig.output().unwrap().status.code(), Some(1));
    assert_eq!(std::fs::read_to_string(out.join("machine.toml")).unwrap(), "kept");
    assert_eq!(std::fs::read_dir(&out).unwrap().count(), 1);
}

/// The dead time is never compensated, whatever the options say, and anything the experiment is not made for is refused by name.
#[test]
fn nothing_wrong_can_be_run() {
    let machine = Machine::load("pmasynrm-180kw").unwrap();
    let stand = identification::Stand { inertia_kg_m2: 3.0, fault_at_s: None };
    let drive = |words: &str| identification::drive(&parsed(words).options, &machine, &stand);
    let [with, without] = ["--dead-time-us 5 --uncompensated", "--dead-time-us 5"]
        .map(|words| drive(words).unwrap().observations);
    assert!(with.len() > 3_000 && with == without);
    for words in ["--law pi", "--patterns optimal", "--line 3,4,30", "--ablate prediction"] {
        let error = drive(words).err().map(|error| error.to_string()).unwrap_or_default();
        assert!(error.starts_with(words.split(' ').next().unwrap()), "{words}: {error}");
    }
}
