//! Every scenario of the two-level drive with a machine of 48 V and 20 kHz, judged by the rule of exit code 0: no fault, and no
//! bound that is missed.

mod nameplate;

use nameplate::made;
use rayon::prelude::*;
use std::collections::BTreeSet;
use std::process::Command;
use tractive_rig::analysis::Figures;
use tractive_rig::machine::Machine;
use tractive_rig::scenario::catalogue;
use tractive_rig::trace::{Recorded, Recording};
use tractive_rig::verdict::FALLS_SHORT;

const MACHINE: &str = "pmsm-48v-1kw";

/// Each scenario, and the verdicts that it has to give at least.
const SCENARIOS: [(&str, usize); 14] = [
    ("mode-borders --speed 3000", 2),
    ("load-steps", 4),
    ("restart", 3),
    ("characteristic", 7),
    ("sweep", 2),
    ("chopper", 12),
    ("precharge", 8),
    ("acknowledge", 8),
    ("link-steps", 1),
    ("steady", 3),
    ("full-step", 4),
    ("reversal", 2),
    ("borders-timing", 0),
    ("timing", 0),
];

#[test]
fn every_scenario_keeps_its_bounds_with_48_volts_and_20_kilohertz() {
    let complaints: Vec<_> =
        SCENARIOS.par_iter().flat_map(|(line, least)| complaints(line, MACHINE, *least)).collect();
    assert!(complaints.is_empty(), "{complaints:#?}");
}

/// Copper loss takes a quarter of a hub motor's braking power: that the link does not get it is no failure of the drive.
#[test]
fn a_hub_motor_brakes_into_its_link_as_far_as_its_copper_leaves_it() {
    keeps_its_bounds(
        "--pole-pairs 15 --rs 0.08 --ld 2e-4 --lq 2e-4 --psi-f 0.011 --max-current 40 --udc 48 --max-speed-rpm 700 --max-switching-hz 16000",
        &[("chopper", 12), ("line-limits", 10)],
    );
}

/// No power comes back to the line where copper takes more than the shaft gives: the use of its limit is not seen. It was a pass of −4.8 times the limit.
#[test]
fn a_hub_motor_whose_copper_takes_everything_shows_no_limit_of_power() {
    let machine = made(
        "--pole-pairs 15 --rs 0.2 --ld 1.8e-4 --lq 2e-4 --psi-f 0.0105 --max-current 35 --udc 24 --max-speed-rpm 400 --max-switching-hz 16000",
    );
    let chosen =
        catalogue::of_traction(&format!("line-limits --machine {}", machine.path().display())).unwrap();
    let machine = chosen.machine().unwrap();
    let figures = chosen.figures(&chosen.drive(&machine).unwrap(), &machine);
    let verdicts = figures.get("verdicts").and_then(|verdicts| verdicts.as_array()).unwrap();
    let used: Vec<_> =
        verdicts.iter().filter(|verdict| verdict["what"] == "that limit over what is used of it").collect();
    assert!(used.len() == 2 && used[1]["verdict"] == "not seen", "{used:?}");
}

/// At a third of its speed a hub motor's copper takes more than full braking gives: without a line it brakes by as much as its link can use. It used to
/// empty the link.
#[test]
fn a_hub_motor_holds_its_link_while_the_line_is_away() {
    keeps_its_bounds(
        "--pole-pairs 15 --rs 0.1 --ld 2e-4 --lq 2.4e-4 --psi-f 0.012 --max-current 30 --udc 36 --max-speed-rpm 500 --max-switching-hz 16000",
        &[("gaps", 11)],
    );
}

/// A gearless motor whose EMF at its largest speed is a fiftieth of what the link gives: it never needs field weakening, and is a machine like any other.
#[test]
fn a_machine_that_never_weakens_keeps_its_bounds() {
    keeps_its_bounds(
        "--pole-pairs 4 --rs 0.5 --ld 4e-3 --lq 5e-3 --psi-f 0.1 --max-current 20 --udc 560 --max-speed-rpm 100 --max-switching-hz 8000",
        &[("load-steps", 4), ("sweep", 2), ("start", 8), ("restart", 3), ("full-step", 4), ("chopper", 12)],
    );
}

/// A machine of reluctance alone has no flux linkage without a current, and reveals nothing about its map there: what had been learnt of it made
/// torque 18 % larger than wanted after a catch. Without torque it has no ripple, and no ripple is not in excess of no ripple.
#[test]
fn a_machine_of_reluctance_alone_keeps_its_torque() {
    keeps_its_bounds(
        "--pole-pairs 4 --rs 0.00138 --ld 165e-6 --lq 825e-6 --psi-f 0 --max-current 300 --udc 24 --max-speed-rpm 300 --max-switching-hz 800",
        &[("load-steps", 4), ("restart", 3), ("full-step", 4), ("steady --torque 0", 3)],
    );
}

/// A machine of much reluctance whose line is lost just after a switch to three pulses: its torque is gone within some milliseconds. When the pulses
/// waited for 30 ms to pass, their ripple at so little voltage was beyond the trip level.
#[test]
fn a_pattern_that_has_just_begun_gives_way_where_torque_goes() {
    keeps_its_bounds(
        "--pole-pairs 3 --rs 0.08 --ld 1.2e-3 --lq 9e-3 --psi-f 0.2 --saturation 0.6 --max-current 240 --udc 750 --max-speed-rpm 5000 --max-switching-hz 1000",
        &[("gaps", 11)],
    );
}

/// A machine that needs its largest current for its largest torque leaves square wave at that current. When three pulses needed a little less than
/// their voltage, the operating point stood for 3 ms where the circles of that voltage and of the current cross: torque moved by 29 N·m, and the
/// current by 3.4 % more than it has.
#[test]
fn a_machine_at_its_largest_current_leaves_square_wave_without_a_jump() {
    keeps_its_bounds(
        "--pole-pairs 4 --rs 0.05 --ld 1.3e-3 --lq 3e-3 --psi-f 0.35 --saturation 0.75 --max-current 260 --udc 750 --max-speed-rpm 4000 --max-switching-hz 2000",
        &[("sweep --to 2200 --down", 5)],
    );
}

/// A machine that is in field weakening where its free carrier ends: on the way down, patterns have the carrier's voltage before it takes over. It
/// used to take over from square wave, with 93 of 739 N·m missing for 5 ms; with optimised patterns, torque was 34 N·m too large.
#[test]
fn a_free_carrier_takes_over_where_patterns_have_its_voltage() {
    const VALUES: &str = "--pole-pairs 4 --rs 0.03 --ld 0.9e-3 --lq 1.9e-3 --psi-f 0.28 --saturation 0.8 --max-current 350 --udc 600 --max-speed-rpm 4500 --max-switching-hz 3000";
    let figures = swept(VALUES, "--to 2300 --down").1;
    let switches = figures.get("mode_switches").and_then(|switches| switches.as_array()).unwrap();
    let to_carrier: Vec<_> = switches.iter().filter(|switch| switch["to"] == "async").collect();
    let of = |name: &str| to_carrier[0][name].as_f64().unwrap();
    let (torque_nm, excess) = (of("torque_excursion_nm"), of("excess_percent"));
    assert!(to_carrier.len() == 1 && torque_nm < 10.0 && excess < 1.5, "{torque_nm} N·m, {excess} %");
    keeps_its_bounds(VALUES, &[("sweep --to 2300 --down --patterns optimal", 4)]);
}

/// A machine whose patterns have halves as short as 0.36 of a control period goes through all five modes to 2 kHz of stator frequency: the modulator
/// alone knows which half leads the flux to a pattern. When control led the flux, it tripped where the first pattern began; when its command counted
/// for the next half, it tripped in square wave.
#[test]
fn patterns_faster_than_control_keep_their_current() {
    const VALUES: &str = "--pole-pairs 10 --rs 0.00274 --ld 19.6e-6 --lq 58.8e-6 --psi-f 0.00918 --saturation 0.7 --max-current 780 --udc 370 --max-speed-rpm 12000 --max-switching-hz 8000";
    keeps_its_bounds(VALUES, &[("sweep", 5), ("reversal", 2)]);
    // Optimised patterns: their edges were once moved by twice the error.
    swept(VALUES, "--patterns optimal");
}

/// A command acts for two halves if a machine's locked carriers have halves of half a control period. Computed for one, it removed twice its error,
/// and the machine tripped at 5,332 r/min. Trimmed by so few samples of its torque, it was 1.9 % off after a catch.
#[test]
fn a_locked_carrier_as_fast_as_control_keeps_its_current() {
    keeps_its_bounds(
        "--pole-pairs 5 --rs 0.0125 --ld 180e-6 --lq 180e-6 --psi-f 0.0834 --max-current 258 --udc 560 --max-speed-rpm 6000 --max-switching-hz 10000",
        &[
            ("sweep", 4),
            ("load-steps", 4),
            ("full-step", 4),
            ("reversal", 2),
            ("link-steps", 1),
            ("restart", 3),
        ],
    );
}

/// Machines whose carrier half is no whole part of a control period: a command makes one half or two, and is computed for as many. Computed for a
/// control period in either case, it removed up to 1.25 of its error, and steps of torque overshot by 21, 6.5, 19 and 19 %.
#[test]
fn a_command_is_made_for_the_halves_that_use_it() {
    [
        "--pole-pairs 4 --rs 0.06 --ld 0.36e-3 --lq 0.55e-3 --psi-f 0.0125 --saturation 0.8 --max-current 30 --udc 48 --max-speed-rpm 6000 --max-switching-hz 6000",
        "--pole-pairs 4 --rs 0.06 --ld 0.36e-3 --lq 0.55e-3 --psi-f 0.0125 --saturation 0.8 --max-current 30 --udc 48 --max-speed-rpm 6000 --max-switching-hz 11000",
        "--pole-pairs 2 --rs 0.02 --ld 0.05e-3 --lq 0.07e-3 --psi-f 0.004 --max-current 60 --udc 36 --max-speed-rpm 40000 --max-switching-hz 12000",
        "--pole-pairs 21 --rs 0.05 --ld 0.1e-3 --lq 0.12e-3 --psi-f 0.004 --max-current 40 --udc 24 --max-speed-rpm 2500 --max-switching-hz 12000",
    ]
    .par_iter()
    .for_each(|values| keeps_its_bounds(values, &[("load-steps", 4), ("full-step", 4)]));
}

/// Machines whose field weakening begins below the end of their free carrier, a car's first: a locked carrier leads their flux linkage to where a
/// pattern begins, and the pattern begins with the carrier's voltage. Without the former, the car's machine tripped; without the latter, it took 12 %
/// more current than either mode has; then the second and the third tripped.
#[test]
fn a_weakened_machine_leaves_its_free_carrier_by_a_locked_one() {
    [
        ("--pole-pairs 4 --rs 0.01 --ld 0.1e-3 --lq 0.3e-3 --psi-f 0.06 --max-current 600 --udc 800 --max-speed-rpm 18000 --max-switching-hz 12000", 2.0),
        ("--pole-pairs 3 --rs 0.0168 --ld 0.082e-3 --lq 0.397e-3 --psi-f 0 --saturation 0.6 --max-current 136 --udc 96 --max-speed-rpm 10148 --max-switching-hz 8000", 5.0),
        ("--pole-pairs 3 --rs 0.231 --ld 1.16e-3 --lq 4.29e-3 --psi-f 0.203 --saturation 0.4 --max-current 244 --udc 1500 --max-speed-rpm 8408 --max-switching-hz 8000", 2.0),
    ]
    .par_iter()
    .for_each(|(values, most_percent)| {
        let (recording, figures) = swept(values, "");
        let mut modes: Vec<_> = recording.rows.iter().map(|row| row.mode.name()).collect();
        modes.dedup();
        assert_eq!(modes, ["async", "sync15", "mid7", "mid3", "square"], "{values}");
        let switches = figures.get("mode_switches").and_then(|switches| switches.as_array()).unwrap();
        let into_patterns = switches.iter().filter(|switch| switch["to"] == "mid7" || switch["to"] == "mid3");
        let excess: Vec<_> = into_patterns.map(|switch| switch["excess_percent"].as_f64().unwrap()).collect();
        assert!(excess.len() == 2 && excess.iter().all(|excess| excess < most_percent), "{values}: {excess:?} %");
    });
}

/// Devices that are faster than the usual control, in runs with a rate of their own: the bound's pulses and those on the page are made at that rate. At
/// the usual one, bounds were not seen, and once its run was over the page of `characteristic` was refused.
#[test]
fn a_run_at_its_own_rate_of_control_is_judged_and_drawn_at_it() {
    let machine = made(
        "--pole-pairs 7 --rs 0.02 --max-current 60 --udc 50 --max-speed-rpm 40000 --max-switching-hz 48000 --ld 8e-6 --lq 8e-6 --psi-f 6e-4",
    );
    let machine = machine.path().to_str().unwrap();
    ["steady --speed 20000", "characteristic"].par_iter().for_each(|line| {
        let out = tempfile::tempdir().unwrap();
        let words = ["--control-hz", "48000", "--machine", machine, "--json", "--out"];
        let output = Command::new(env!("CARGO_BIN_EXE_tractive-rig"))
            .arg("run")
            .args(line.split(' '))
            .args(words)
            .arg(out.path())
            .output()
            .unwrap();
        let said = String::from_utf8_lossy(&output.stdout);
        assert_ne!(output.status.code(), Some(2), "{line}: {}", String::from_utf8_lossy(&output.stderr));
        assert!(said.contains("over its bound") && !said.contains("not seen"), "{line}: {said}");
        assert!(out.path().join("report.html").exists(), "{line}");
    });
}

/// Patterns of fast devices follow each other faster, and so they remove a flux error faster. With the same 350 rad/s for all devices, the flux
/// linkage, which changes where a machine leaves field weakening, lagged behind: the motor of 8 kHz took 6.3 % more current than either mode, and
/// that of 2 kHz was 35 N·m off where its square wave ends.
#[test]
fn a_pattern_follows_its_flux_as_fast_as_the_devices_are() {
    [
        ("--pole-pairs 5 --rs 0.2255 --ld 0.00346 --lq 0.00431 --psi-f 0.1513 --max-current 30 --udc 560 --max-speed-rpm 6000 --max-switching-hz 8000 --saturation 0.6", "mid7", 3.2, 0.8),
        ("--pole-pairs 4 --rs 0.012 --ld 0.55e-3 --lq 1.4e-3 --psi-f 0.62 --saturation 0.6 --max-current 800 --udc 1500 --max-speed-rpm 4500 --max-switching-hz 2000", "mid3", 1.3, 10.0),
    ]
    .par_iter()
    .for_each(|(values, into, most_percent, most_nm)| {
        let figures = swept(values, "--down --control-hz 20000").1;
        let switches = figures.get("mode_switches").and_then(|switches| switches.as_array()).unwrap();
        let from = if *into == "mid3" { "square" } else { "sync15" };
        let of = |switch: &serde_json::Value, name: &str| switch[name].as_f64().unwrap();
        let switch = switches.iter().find(|switch| switch["from"] == from && switch["to"] == *into).unwrap();
        let found = [of(switch, "excess_percent"), of(switch, "torque_excursion_nm")];
        assert!(found[0] < *most_percent && found[1] < *most_nm, "{values}: {found:?}");
    });
}

/// The trip level of a machine whose pulses make the current half as large again as its largest one is chosen above that. At 1.3 of the largest
/// current, the level without such pulses, it tripped where its free carrier ends.
#[test]
fn the_trip_leaves_the_ripple_its_room() {
    const VALUES: &str = "--pole-pairs 10 --rs 0.0199 --ld 2.02e-3 --lq 8.36e-3 --psi-f 0 --saturation 0.4 --max-current 306 --udc 1500 --udc-min 1500 --udc-max 1500 --max-speed-rpm 1214 --max-switching-hz 900";
    let folder = made(VALUES);
    let machine = Machine::load(folder.path().to_str().unwrap()).unwrap();
    let told_a = machine.folder.parameters.trip_current_a / 1.15;
    let rows = swept(VALUES, "").0.rows;
    let highest_a =
        rows.iter().flat_map(|row| [row.ia_a, row.ib_a, row.ic_a]).map(f64::abs).fold(0.0, f64::max);
    assert!(
        told_a > 1.5 * 306.0 && (0.95..1.05).contains(&(highest_a / told_a)),
        "{highest_a} A, {told_a} A told"
    );
    let usual = made(
        "--pole-pairs 4 --rs 0.06 --ld 0.36e-3 --lq 0.55e-3 --psi-f 0.0125 --max-current 30 --udc 48 --max-speed-rpm 6000 --max-switching-hz 20000",
    );
    assert_eq!(Machine::load(usual.path().to_str().unwrap()).unwrap().folder.parameters.trip_current_a, 39.0);
}

/// The ripple of few pulses on a map that saturates to a half and less makes a torque of its own, and a resistive drop that the mean current does not
/// have. With neither foreseen, torque was 1.3, 2.0, 3.8 and 19 % off.
#[test]
fn a_large_ripple_on_a_saturated_map_keeps_the_mean_torque() {
    [
        ("--pole-pairs 2 --rs 0.186 --ld 0.71e-3 --lq 2.95e-3 --psi-f 0.141 --saturation 0.5 --max-current 182 --udc 750 --max-speed-rpm 6315 --max-switching-hz 4000", "reversal"),
        ("--pole-pairs 7 --rs 0.0867 --ld 0.177e-3 --lq 0.865e-3 --psi-f 0.0059 --saturation 0.4 --max-current 23.2 --udc 96 --max-speed-rpm 5442 --max-switching-hz 16000", "reversal"),
        ("--pole-pairs 2 --rs 0.0136 --ld 0.156e-3 --lq 0.689e-3 --psi-f 0.03 --saturation 0.4 --max-current 200 --udc 96 --max-speed-rpm 5621 --max-switching-hz 900", "restart"),
        ("--pole-pairs 2 --rs 0.0286 --ld 0.115e-3 --lq 0.197e-3 --psi-f 0.00752 --saturation 0.4 --max-current 61.7 --udc 48 --max-speed-rpm 24524 --max-switching-hz 4000", "reversal"),
    ]
    .par_iter()
    .for_each(|(values, scenario)| keeps_its_bounds(values, &[(scenario, 2)]));
}

/// A machine of reluctance alone has its torque reversed and removed in field weakening with no more than its own current: where the voltage has no
/// room, its flux linkage goes straight and does not lag behind the rotor. It used to take 1.33 and 1.30 of its largest steady current.
#[test]
fn a_machine_of_reluctance_alone_lets_go_of_its_torque_without_more_current() {
    [
        "--pole-pairs 7 --rs 0.6 --ld 6.31e-3 --lq 42.1e-3 --psi-f 0 --max-current 6.24 --udc 96 --max-speed-rpm 754 --max-switching-hz 16000",
        "--pole-pairs 4 --rs 0.0122 --ld 0.293e-3 --lq 1.98e-3 --psi-f 0 --max-current 234 --udc 560 --max-speed-rpm 5052 --max-switching-hz 20000",
    ]
    .par_iter()
    .for_each(|values| keeps_its_bounds(values, &[("reversal", 2)]));
}

/// Sweep of a machine made from a nameplate's values, which does not trip.
fn swept(values: &str, options: &str) -> (Recording, Figures) {
    let folder = made(values);
    let line = format!("sweep {options} --machine {}", folder.path().display());
    let chosen = catalogue::of_traction(&line).unwrap();
    let machine = chosen.machine().unwrap();
    let recording = chosen.drive(&machine).unwrap();
    assert!(recording.trip().is_none(), "{values}: {:?}", recording.trip().map(|trip| trip.fault.name()));
    let figures = chosen.figures(&recording, &machine);
    (recording, figures)
}

fn keeps_its_bounds(values: &str, scenarios: &[(&str, usize)]) {
    let folder = made(values);
    let machine = folder.path().display().to_string();
    let complaints: Vec<_> =
        scenarios.par_iter().flat_map(|(line, least)| complaints(line, &machine, *least)).collect();
    assert!(complaints.is_empty(), "{complaints:#?}");
}

fn complaints(line: &str, machine: &str, least: usize) -> Vec<String> {
    let chosen = catalogue::of_traction(&format!("{line} --machine {machine}")).unwrap();
    let machine = chosen.machine().unwrap();
    assert!(chosen.title(&machine).starts_with("no figure: "), "{}", chosen.title(&machine));
    let recording = chosen.drive(&machine).unwrap();
    let figures = chosen.figures(&recording, &machine);
    let mut complaints = Vec::new();
    if let Some(trip) = chosen.trip(&recording) {
        complaints.push(format!("{line}: {}", trip.fault.name()));
    }
    let verdicts =
        figures.get("verdicts").and_then(|verdicts| verdicts.as_array().cloned()).unwrap_or_default();
    let kept = verdicts.iter().filter(|verdict| verdict["verdict"] == "pass").count();
    if kept < least {
        complaints.push(format!("{line}: {kept} bounds kept, of {least}"));
    }
    let short = verdicts.iter().filter(|verdict| verdict["verdict"] == FALLS_SHORT);
    complaints.extend(short.map(|verdict| format!("{line}: {verdict}")));
    complaints
}

/// The paper's machine has the paper's figures, and nobody else's has them.
#[test]
fn only_the_papers_machine_answers_its_figures() {
    for (machine, title) in
        [("pmasynrm-180kw", "figure 8: load steps at 200 r/min"), (MACHINE, "no figure: load steps")]
    {
        let chosen = catalogue::of_traction(&format!("load-steps --machine {machine}")).unwrap();
        assert_eq!(chosen.title(&chosen.machine().unwrap()), title);
    }
}

/// The numbers of the scenarios follow the machine's ratings: what is asked of a small machine is what it has.
#[test]
fn a_scenario_asks_what_the_machine_has() {
    let chosen = catalogue::of_traction(&format!("load-steps --machine {MACHINE}")).unwrap();
    let machine = chosen.machine().unwrap();
    let parameters = &machine.folder.parameters;
    let recording = chosen.drive(&machine).unwrap();
    let most_nm = recording.rows.iter().map(|row| row.te_ref_nm).fold(0.0, f64::max);
    assert!((most_nm / parameters.max_torque_nm - 1.0).abs() < 1e-5, "{most_nm} N·m");
    let speed_rpm = recording.rows[0].speed_rpm;
    assert!((speed_rpm / parameters.rated_speed_rpm - 0.1).abs() < 1e-6, "{speed_rpm} r/min");
}

/// A bound that another machine does not keep gives exit code 1, as for the paper's machine; its page names no figure of the paper.
#[test]
fn a_bound_that_is_not_kept_is_exit_code_1_for_every_machine() {
    let folder = tempfile::tempdir().unwrap();
    let run = |line: &str| {
        let mut rig = Command::new(env!("CARGO_BIN_EXE_tractive-rig"));
        let output =
            rig.arg("run").args(line.split_whitespace()).arg("--out").arg(folder.path()).output().unwrap();
        let page = std::fs::read_to_string(folder.path().join("report.html")).unwrap();
        (output.status.code(), String::from_utf8_lossy(&output.stdout).into_owned(), page)
    };
    // Pulses as short as a carrier of 20 kHz needs, and pulses of an IGBT.
    let own = format!("reversal --machine {MACHINE}");
    let (code, said, page) = run(&own);
    assert!(code == Some(0) && said.starts_with("PASS: 2 of 2 bounds kept"), "{said}");
    assert!(!page.contains("The paper's") && page.contains("class=\"plot\""), "{page}");
    let (code, said, _) = run(&format!("{own} --min-pulse-us 12"));
    assert!(code == Some(1) && said.starts_with("FALLS SHORT: 1 of 2 bounds"), "{code:?}: {said}");
}

/// A heading names a figure of the paper only if the plot shows the same: that machine, and nothing that the paper does not show.
#[test]
fn a_plot_names_the_papers_figure_only_where_it_shows_the_same() {
    let headings = |line: &str| {
        let folder = tempfile::tempdir().unwrap();
        let mut rig = Command::new(env!("CARGO_BIN_EXE_tractive-rig"));
        rig.arg("run").args(line.split_whitespace()).arg("--out").arg(folder.path());
        assert!(rig.output().unwrap().status.success(), "{line}");
        let page = std::fs::read_to_string(folder.path().join("report.html")).unwrap();
        let named = page.split("The paper's ").skip(1).filter_map(|rest| rest.split(" · ").next());
        named.map(str::to_owned).collect::<BTreeSet<_>>()
    };
    for (line, figures) in [
        ("load-steps", &["figure 8"][..]),
        ("full-step", &[]),
        ("sweep", &["figure 9a", "figure 9b", "figure 9c", "figure 9d"]),
        ("sweep --brake --to 2300", &[]),
        ("mode-borders", &[]),
        ("characteristic", &["figure 1", "figure 10", "figure 3", "figure 4", "figure 6", "figure 7"]),
    ] {
        let wanted: BTreeSet<_> = figures.iter().map(|figure| (*figure).to_owned()).collect();
        assert_eq!(headings(line), wanted, "{line}");
        assert!(headings(&format!("{line} --machine {MACHINE}")).is_empty(), "{line}");
    }
}
