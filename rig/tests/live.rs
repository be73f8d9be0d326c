//! The bench that is driven by hand.

use clap::{Args, FromArgMatches};
use tractive::operator::State;
use tractive::protection::Fault;
use tractive_rig::campaign::traction::{Cause, Scale, faults};
use tractive_rig::machine::Machine;
use tractive_rig::scenario::System;
use tractive_rig::scenario::traction::{Command, Live, Options, Start, Traction, Turning, Wanted};
use tractive_rig::trace::Row;

fn live(words: &[&str], speed_rpm: f64) -> Live {
    let command = Options::augment_args(clap::Command::new("live").no_binary_name(true));
    let options = Options::from_arg_matches(&command.get_matches_from(words)).unwrap();
    let machine = Machine::load(Traction::MACHINE).unwrap();
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
fn it_starts_follows_its_commands_and_leaves_a_row_a_step() {
    let mut live = live(&[], 1_000.0);
    live.command(Command::Torque(500.0));
    run(&mut live, 0.7);
    assert_eq!(state(&live), State::Running);
    let rows = run(&mut live, 0.1);
    assert_eq!(rows.len(), 1000);
    assert!((mean(&rows, |row| row.te_nm) - 500.0).abs() < 5.0);
    live.command(Command::Torque(-300.0));
    live.set_source_v(1_700.0);
    run(&mut live, 0.5);
    let rows = run(&mut live, 0.1);
    assert!((mean(&rows, |row| row.te_nm) + 300.0).abs() < 5.0);
    assert!((mean(&rows, |row| row.udc_v) - 1_700.0).abs() < 10.0);
    live.wanted.coast = true;
    run(&mut live, 0.5);
    assert_eq!(state(&live), State::Coasting);
    live.wanted = Wanted::default();
    run(&mut live, 0.5);
    assert_eq!(state(&live), State::Charged);
}

#[test]
fn a_rotor_that_is_let_go_of_is_brought_to_its_speed_and_held_there() {
    let mut live = live(&[], 0.0);
    live.turn_as(Turning::Free(2.0, 100.0));
    live.command(Command::Speed(600.0));
    run(&mut live, 4.0);
    assert!((live.speed_rpm() - 600.0).abs() < 2.0, "{}", live.speed_rpm());
    live.turn_as(Turning::Held(300.0));
    run(&mut live, 0.5);
    assert!((live.speed_rpm() - 300.0).abs() < 1e-6);
}

#[test]
fn a_wrong_map_is_noticed() {
    let mut live = live(&[], 1_000.0);
    live.command(Command::Torque(800.0));
    live.set_flux_scale(1.1);
    run(&mut live, 3.0);
    let told = run(&mut live, 0.1).last().unwrap().map_error;
    assert!((told - 0.1).abs() < 0.02, "{told}");
}

#[test]
fn a_resistance_that_doubles_takes_more_voltage_until_it_is_mended() {
    let mut live = live(&[], 200.0);
    live.command(Command::Torque(1_000.0));
    let mut voltage_v = |scale: Option<f64>| {
        match scale {
            Some(scale) => live.set_resistance_scale(scale),
            None => live.mend(),
        }
        run(&mut live, 0.8);
        mean(&run(&mut live, 0.2), |row| row.u_v)
    };
    let [rated, doubled, mended] = [Some(1.0), Some(2.0), None].map(&mut voltage_v);
    assert!(doubled > rated + 5.0 && (mended - rated).abs() < 1.0, "{rated} {doubled} {mended}");
}

#[test]
fn short_turns_are_the_same_as_long_ones() {
    let run = |pieces: u32| {
        let mut live = live(&[], 600.0);
        live.turn_as(Turning::Free(5.0, 0.0));
        live.command(Command::Speed(700.0));
        for _ in 0..pieces {
            live.run(0.6 / f64::from(pieces)).unwrap();
        }
        let (rows, edges) = live.take();
        (rows[5_000].ia_a, rows[5_000].te_nm, edges[800])
    };
    assert_eq!(run(1), run(4_321));
}

/// Something goes wrong while it runs; the drive, and the name of its fault.
fn wrong(cause: Cause) -> (Live, Option<Fault>) {
    let mut live = live(&[], 1_200.0);
    live.command(Command::Torque(600.0));
    run(&mut live, 0.4);
    assert_eq!((state(&live), live.trip()), (State::Running, None));
    match cause {
        Cause::Bench(kind) => live.inject(kind),
        Cause::Runaway => live.run_away(),
        Cause::Machine(flux_scale, resistance_scale) => {
            live.set_flux_scale(flux_scale);
            live.set_resistance_scale(resistance_scale);
        }
        Cause::Sensor(..) => unreachable!("no temperature sensors here"),
    }
    run(&mut live, if cause == Cause::Runaway { 0.6 } else { 0.05 });
    let named = live.trip().map(|trip| trip.fault);
    (live, named)
}

#[test]
fn every_fault_is_named_as_in_the_campaign() {
    let mut named = 0;
    for fault in faults(&Scale::ONE).into_iter().skip(1).filter(|fault| fault.fast) {
        if matches!(fault.cause, Cause::Sensor(..)) {
            continue;
        }
        if let (_, Some(name)) = wrong(fault.cause) {
            assert!(fault.rule.names.contains(&name), "{}: {}", fault.name, name.name());
            named += 1;
        }
    }
    assert!(named >= 15, "{named}");
}

#[test]
fn a_fault_is_mended_and_acknowledged_and_the_drive_runs_again() {
    for name in ["current-u-railed", "angle-jump", "control-late", "uh-stuck-on"] {
        let fault = faults(&Scale::ONE).into_iter().find(|fault| fault.name == name).unwrap();
        let (mut live, named) = wrong(fault.cause);
        assert!(named.is_some(), "{name}");
        live.mend();
        run(&mut live, 0.3);
        assert_eq!(state(&live), State::Fault, "{name}");
        live.acknowledge();
        run(&mut live, 1.0);
        assert_eq!((state(&live), live.trip()), (State::Running, None), "{name}");
    }
}
