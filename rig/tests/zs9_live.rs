//! The ZS9's bench that is driven by hand.

use clap::{Args, FromArgMatches};
use tractive::nine_switch::Scheme;
use tractive::operator::State;
use tractive::protection::Fault;
use tractive_rig::campaign::dual::{Cause, faults};
use tractive_rig::machine::Machine;
use tractive_rig::scenario::System;
use tractive_rig::scenario::live::{Command, Start, Turning, Wanted};
use tractive_rig::scenario::zs9::{Live, Options, Zs9};
use tractive_rig::zs9::trace::Row;

fn live(words: &[&str], speed_rpm: f64) -> Live {
    let command = Options::augment_args(clap::Command::new("live").no_binary_name(true));
    let options = Options::from_arg_matches(&command.get_matches_from(words)).unwrap();
    let machine = Machine::load(Zs9::MACHINE).unwrap();
    let mut live = Live::new(&options, &machine, Start { speed_rpm, step_s: 1e-4 }).unwrap();
    live.wanted = Wanted { on: true, ..Wanted::default() };
    live
}

fn mean(rows: &[Row], of: fn(&Row) -> f64) -> f64 {
    rows.iter().map(of).sum::<f64>() / rows.len() as f64
}

/// Runs so long, in s; the rows of that time.
fn run(live: &mut Live, seconds: f64) -> Vec<Row> {
    live.take();
    live.run(seconds).unwrap();
    live.take().0
}

fn state(live: &Live) -> State {
    live.status().unwrap().state
}

#[test]
fn motors_follow_their_own_commands_and_a_row_comes_each_step() {
    let mut live = live(&[], 600.0);
    live.command(0, Command::Torque(40.0));
    live.command(1, Command::Torque(-30.0));
    run(&mut live, 1.5);
    assert_eq!(state(&live), State::Running);
    let rows = run(&mut live, 0.1);
    assert_eq!(rows.len(), 1000);
    assert!(rows.windows(2).all(|two| (two[1].t_s - two[0].t_s - 1e-4).abs() < 1e-9));
    assert!((mean(&rows, |row| row.motors[0].torque_nm) - 40.0).abs() < 1.0);
    assert!((mean(&rows, |row| row.motors[1].torque_nm) + 30.0).abs() < 1.0);
    assert!((mean(&rows, |row| row.link_v) - 667.0).abs() < 5.0);
    live.set_link(600.0, Scheme::ALL[0]);
    run(&mut live, 0.5);
    let rows = run(&mut live, 0.1);
    assert!((mean(&rows, |row| row.link_v) - 600.0).abs() < 5.0);
    assert_eq!(rows[0].scheme, Scheme::ALL[0]);
    live.wanted = Wanted::default();
    run(&mut live, 0.5);
    assert_eq!(state(&live), State::Charged);
}

#[test]
fn free_rotors_go_to_their_own_speeds_under_load() {
    let mut live = live(&[], 0.0);
    for (motor, rpm) in [(0, 300.0), (1, -200.0)] {
        live.turn_as(motor, Turning::Free(0.1, 10.0));
        live.command(motor, Command::Speed(rpm));
    }
    run(&mut live, 4.0);
    let [one, two] = live.speeds_rpm();
    assert!((one - 300.0).abs() < 2.0 && (two + 200.0).abs() < 2.0, "{one} {two}");
    live.turn_as(1, Turning::Held(100.0));
    run(&mut live, 0.5);
    assert!((live.speeds_rpm()[1] - 100.0).abs() < 1e-6);
}

/// Something goes wrong while it runs; the drive, and the name of its fault.
fn wrong(cause: Cause) -> (Live, Option<Fault>) {
    let mut live = live(&[], 600.0);
    for motor in [0, 1] {
        live.command(motor, Command::Torque(50.0));
    }
    run(&mut live, 1.0);
    assert_eq!((state(&live), live.trip()), (State::Running, None));
    match cause {
        Cause::Bench(kind) => live.inject(kind),
        Cause::Runaway(motor) => live.run_away(motor),
        Cause::Flux(flux_scale) => live.set_flux_scale(flux_scale),
    }
    run(&mut live, if matches!(cause, Cause::Runaway(_)) { 0.6 } else { 0.05 });
    let named = live.trip().map(|trip| trip.fault);
    (live, named)
}

#[test]
fn every_fault_is_named_as_in_the_campaign() {
    let mut named = 0;
    for fault in faults().into_iter().skip(1).filter(|fault| fault.fast) {
        if let (_, Some(name)) = wrong(fault.cause) {
            assert!(fault.rule.names.contains(&name), "{}: {}", fault.name, name.name());
            named += 1;
        }
    }
    assert!(named >= 15, "{named}");
}

#[test]
fn a_fault_is_mended_and_acknowledged_and_the_drive_runs_again() {
    for name in ["current-u1-railed", "angle-2-lost", "source-low", "vm-stuck-on"] {
        let fault = faults().into_iter().find(|fault| fault.name == name).unwrap();
        let (mut live, named) = wrong(fault.cause);
        assert!(named.is_some(), "{name}");
        live.mend();
        run(&mut live, 0.3);
        assert_eq!(state(&live), State::Fault, "{name}");
        live.acknowledge();
        run(&mut live, 1.5);
        assert_eq!((state(&live), live.trip()), (State::Running, None), "{name}");
    }
}
