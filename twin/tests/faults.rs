//! The hardware's faults on the very images. Those are what `TRACTIVE_NUCLEO_IMAGE` and `TRACTIVE_NUCLEO_ZS9_IMAGE` name.

use std::path::PathBuf;
use tractive_rig::talk::System;
use tractive_twin::faults::{Cause, Seen, When, look, starting};
use tractive_twin::time::{MICROSECOND, Time};

fn image(system: System) -> PathBuf {
    let name = match system {
        System::Pmasynrm => "TRACTIVE_NUCLEO_IMAGE",
        System::Zs9 => "TRACTIVE_NUCLEO_ZS9_IMAGE",
    };
    std::env::var_os(name).expect(name).into()
}

/// The time within which every gate is off; `None` where the drive goes on.
fn within(cause: Cause) -> Option<Time> {
    match cause {
        // Without clock and software.
        Cause::Drivers | Cause::Overcurrent | Cause::Crystal | Cause::BrownOut | Cause::Debugger => Some(0),
        // The handler.
        Cause::HardFault => Some(10 * MICROSECOND),
        // 161 counts of the watchdog's clock.
        Cause::Hang => Some(20_200 * MICROSECOND),
        Cause::Encoder => Some(20_000 * MICROSECOND),
        Cause::BusOff | Cause::Babble => None,
    }
}

/// The time within which contactors, discharge resistor and chopper are off; `None` if they wait for the operator's word, or nothing
/// happens to them.
fn lines_within(cause: Cause, when: When) -> Option<Time> {
    match cause {
        _ if matches!(when, When::Starting(_)) => Some(0),
        Cause::HardFault => Some(10 * MICROSECOND),
        Cause::Hang | Cause::Debugger => Some(20_200 * MICROSECOND),
        // The reset, a millisecond later.
        Cause::BrownOut => Some(1_100 * MICROSECOND),
        _ => None,
    }
}

/// The words at the end.
fn told(system: System, cause: Cause, when: When, seen: &Seen) -> bool {
    let told = seen.told.as_str();
    match cause {
        // The watchdog is the start's last step: before it nothing is told, except after a reset.
        Cause::BrownOut if matches!(when, When::Starting(_)) => {
            ["self_test", "ready"].contains(&told) && seen.resets == 1
        }
        _ if matches!(when, When::Starting(_)) => true,
        Cause::Drivers => told == "fault gate_driver",
        // Software that samples within the same period may be first with the name.
        Cause::Overcurrent => ["fault hardware_overcurrent", "fault overcurrent"].contains(&told),
        Cause::Hang | Cause::Debugger | Cause::HardFault => told == "fault start_refused" && seen.resets == 1,
        // The diodes still carry the turning motors' current when the start looks for the sensors' zeros: reason 10.
        // Without torque it may have died away by then: that depends on 0.2 ms of the idle loop.
        Cause::BrownOut if system == System::Zs9 && seen.pulsed => {
            let is_found = matches!(when, When::Enabled) && told == "ready";
            (is_found || told == "fault start_refused") && seen.resets == 1
        }
        // The contactors that open within 20 ms are found closed by the start, where they were.
        Cause::BrownOut => ["ready", "fault contactor"].contains(&told) && seen.resets == 1,
        // There is no bus without the crystal, and no fault where no angle is needed.
        Cause::Crystal | Cause::Encoder => true,
        Cause::BusOff => seen.heard > 0 && seen.listening == "fresh" && seen.resets == 0,
        Cause::Babble => {
            told == "running" && seen.listening == "fresh" && seen.lost == 0 && in_time(system, seen)
        }
    }
}

/// Control and PWM interrupts end before their deadlines, in cycles with every wait state: the ZS9's before the next valley or peak.
fn in_time(system: System, seen: &Seen) -> bool {
    let (control, deadlines) = match system {
        System::Pmasynrm => (45, [17_000, 94_000]),
        System::Zs9 => (44, [8_500; 2]),
    };
    let longest = [control, 41].map(|exception| seen.longest[&exception].waited);
    println!("control and PWM interrupt: {longest:?} cycles at most, {} frames lost", seen.lost);
    longest.iter().zip(deadlines).all(|(longest, deadline)| (500..deadline).contains(longest))
}

fn campaign(system: System, cases: impl IntoIterator<Item = (Cause, When)>) {
    let image = image(system);
    let mut wrong = Vec::new();
    // One alone, by its name.
    let only = std::env::var("TRACTIVE_FAULT").unwrap_or_default();
    for (cause, when) in cases.into_iter().filter(|case| format!("{case:?}").contains(&only)) {
        let seen = look(&image, system, cause, when).unwrap();
        let us = seen.off_after.map(|off| off as f64 / MICROSECOND as f64);
        let (name, words) = (system.name(), &seen.told);
        let (resets, heard) = (seen.resets, seen.heard);
        let lines = seen.lines_off_after.map(|off| off as f64 / MICROSECOND as f64);
        println!(
            "| {name} | {cause:?} | {when:?} | {us:.3?} µs | {lines:.3?} µs | {words} | {resets} resets | {heard} frames |"
        );
        let is_within = |limit: Option<Time>, off: Option<Time>| {
            limit.is_none_or(|limit| off.is_some_and(|off| off <= limit))
        };
        let off = is_within(within(cause), seen.off_after)
            && is_within(lines_within(cause, when), seen.lines_off_after);
        let pulsed = seen.pulsed == matches!(when, When::Enabled | When::Running)
            && (matches!(when, When::Starting(_)) || seen.state == format!("{when:?}").to_lowercase());
        let is_early = matches!(when, When::Starting(_)) && !seen.clocked;
        let early = |text: &String| is_early && text.ends_with("its clock is off");
        let quiet = seen.findings.iter().all(early);
        if !(off && pulsed && quiet && told(system, cause, when, &seen)) {
            wrong.push((cause, when, seen));
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
#[ignore = "needs the image; `cargo xtask test --only twin` builds it"]
fn a_fault_of_the_hardware_turns_the_gates_off() {
    campaign(System::Pmasynrm, Cause::ALL.map(|cause| (cause, When::Running)));
}

#[test]
#[ignore = "needs the image; `cargo xtask test --only twin` builds it"]
fn a_fault_of_the_hardware_turns_the_gates_of_the_zs9_off() {
    campaign(System::Zs9, Cause::ALL.map(|cause| (cause, When::Running)));
}

/// The faults that stop the program, in every state but the one above, and through the start.
fn elsewhere(system: System) {
    let causes = [Cause::HardFault, Cause::Hang, Cause::Debugger, Cause::BrownOut];
    let states = [When::Ready, When::Charged, When::Enabled];
    campaign(system, causes.into_iter().flat_map(|cause| states.map(|when| (cause, when))));
    let starting: Vec<_> =
        starting(&image(system), system).unwrap().into_iter().map(When::Starting).collect();
    assert!(starting.len() > 20, "{starting:?}");
    let middle = starting[starting.len() / 2];
    campaign(system, causes[1..].iter().map(|cause| (*cause, middle)));
    campaign(system, starting.into_iter().map(|when| (Cause::HardFault, when)));
}

#[test]
#[ignore = "needs the image; `cargo xtask test --only twin` builds it"]
fn in_every_state_nothing_turns_a_gate_on() {
    elsewhere(System::Pmasynrm);
}

#[test]
#[ignore = "needs the image; `cargo xtask test --only twin` builds it"]
fn in_every_state_nothing_turns_a_gate_of_the_zs9_on() {
    elsewhere(System::Zs9);
}
