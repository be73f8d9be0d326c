//! Mistakes of wiring and of tables on the first run: each is a named fault, none is driven with.

use rayon::prelude::*;
use tractive::protection::Fault;
use tractive_rig::scenario::catalogue;
use tractive_rig::trace::Recorded;

const MACHINES: [&str; 3] = ["pmasynrm-180kw", "ipm-zs9", "pmsm-48v-1kw"];

/// The fault of a sweep from standstill.
fn fault_of(machine: &str, mistake: &str) -> Option<Fault> {
    let chosen = catalogue::of_traction(&format!("sweep --machine {machine} {mistake}")).unwrap();
    let recording = chosen.drive(&chosen.machine().unwrap()).unwrap();
    recording.trip().map(|trip| trip.fault)
}

/// Before the voltage was checked, five of these 24 sweeps went to the highest speed, among them the 48 V machine's with a zero that is 120° off.
#[test]
fn a_wrong_zero_a_wrong_direction_and_phases_that_are_exchanged_are_named() {
    const MISTAKES: [&str; 8] = [
        "--angle-error 30",
        "--angle-error -60",
        "--angle-error 120",
        "--angle-error 180",
        "--angle-reversed",
        "--current-sensors v,u,w",
        "--current-sensors v,w,u",
        "--current-sensors=-u,-v,-w",
    ];
    const NAMES: [Fault; 2] = [Fault::VoltageUnexplained, Fault::Overcurrent];
    let runs: Vec<_> =
        MACHINES.into_iter().flat_map(|machine| MISTAKES.map(|mistake| (machine, mistake))).collect();
    let found: Vec<_> =
        runs.par_iter().map(|(machine, mistake)| (machine, mistake, fault_of(machine, mistake))).collect();
    for (machine, mistake, fault) in found {
        assert!(fault.is_some_and(|fault| NAMES.contains(&fault)), "{machine} {mistake}: {fault:?}");
        println!("{machine} {mistake}: {fault:?}");
    }
}

/// Without the check 14 of these 20 runs ended without a fault.
#[test]
fn a_wrong_zero_of_the_nine_switch_inverters_motors_is_named() {
    const ZEROS_DEG: [u32; 5] = [30, 60, 90, 120, 180];
    let scenarios = ["zs9-load-step", "zs9-reverse", "zs9-cycle", "zs9-steady"];
    let runs: Vec<_> =
        scenarios.into_iter().flat_map(|run| ZEROS_DEG.map(|zero_deg| (run, zero_deg))).collect();
    runs.par_iter().for_each(|(run, zero_deg)| {
        let line = format!("{run} --angle-error {zero_deg}");
        let chosen = catalogue::of_zs9(&line).unwrap();
        let recording = chosen.drive(&chosen.machine().unwrap()).unwrap();
        let fault = recording.trip().map(|trip| trip.fault);
        assert_eq!(fault, Some(Fault::VoltageUnexplained), "{line}");
    });
}
