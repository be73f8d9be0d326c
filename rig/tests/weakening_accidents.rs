//! Field weakening's classic accidents, each with the link on its capacitor and the line behind its choke.

use tractive::modulation::Mode;
use tractive::protection::{Fault, SafeState};
use tractive_rig::bench::Flaws;
use tractive_rig::campaign::traction::{CycleResult, Drive, DriveCycle};
use tractive_rig::inject::Injection;
use tractive_rig::inject::sensor::{AngleFault, CurrentFault};
use tractive_rig::inject::traction::{Kind, SupplyFault};
use tractive_rig::trace::Row;

const TRIP_A: f64 = 303.35;
const FULL_NM: f64 = 1235.0;
/// √3 · 0.448 Wb · 2,513 rad/s: what the diodes rectify at 6,000 r/min.
const EMF_V: f64 = 1955.0;

fn drive(cycle: DriveCycle) -> CycleResult {
    Drive::new(None).unwrap().cycle(cycle, Flaws::default()).unwrap()
}

fn steady(speed_rpm: f64, torque: &[(f64, f64)], duration_s: f64) -> DriveCycle {
    DriveCycle {
        speed: vec![(0.0, speed_rpm)],
        torque: torque.iter().map(|(t_s, torque_nm)| (*t_s, (*torque_nm, false))).collect(),
        duration_s,
        ..DriveCycle::default()
    }
}

fn mean_nm(rows: &[Row], from_s: f64, to_s: f64) -> f64 {
    let window: Vec<_> = rows.iter().filter(|row| (from_s..to_s).contains(&row.t_s)).collect();
    window.iter().map(|row| row.te_nm).sum::<f64>() / window.len() as f64
}

fn injected(kind: Kind) -> Option<Injection<Kind>> {
    Some(Injection { kind, at_s: 0.2037 })
}

#[test]
fn demand_released_in_deep_weakening() {
    let driven = drive(steady(6000.0, &[(-0.05, FULL_NM), (0.2, 0.0), (0.4, -FULL_NM), (0.6, 0.0)], 0.8));
    assert!(driven.trip.is_none(), "{:?}", driven.trip);
    let peaks = driven.observed.until;
    println!("{:.0} A, {:.0} V", peaks.current_a, peaks.udc_v);
    assert!(peaks.current_a < TRIP_A && peaks.udc_v < 1800.0, "{peaks:?}");
    assert!(mean_nm(&driven.rows, 0.1, 0.2) > 350.0 && mean_nm(&driven.rows, 0.5, 0.6) < -350.0);
    for end_s in [0.4, 0.8] {
        let left_nm = mean_nm(&driven.rows, end_s - 0.05, end_s);
        assert!(left_nm.abs() < 15.0, "{left_nm} N·m");
    }
}

/// Braking is released in square wave, and then the line rises until the voltage forces more flux upon the machine than its
/// magnets have: the machine stays on its side of the flux circle.
#[test]
fn line_rises_in_square_wave_without_torque() {
    for torque_nm in [FULL_NM, -FULL_NM] {
        let line = vec![(0.0, 1500.0), (0.5, 1660.0)];
        let driven = drive(DriveCycle { line, ..steady(4370.0, &[(-0.05, torque_nm), (0.2, 0.0)], 0.7) });
        let before = driven.rows.iter().find(|row| row.t_s > 0.49).map(|row| row.mode);
        let current_a = driven.observed.until.current_a;
        println!("{before:?}, {current_a:.0} A");
        assert_eq!(before, Some(Mode::Square));
        assert!(driven.trip.is_none() && current_a < 0.8 * TRIP_A, "{:?}", driven.trip);
    }
}

#[test]
fn sensor_lost_in_weakening() {
    for (kind, names) in [
        (Kind::Angle(AngleFault::Frozen), [Fault::AngleLost, Fault::Frozen]),
        (Kind::Angle(AngleFault::Jump(120.0)), [Fault::AngleLost, Fault::Frozen]),
        (Kind::Current(1, CurrentFault::Open), [Fault::PhaseSum, Fault::Overcurrent]),
    ] {
        for torque_nm in [FULL_NM, -FULL_NM] {
            let cycle =
                DriveCycle { injection: injected(kind), ..steady(6000.0, &[(-0.05, torque_nm)], 0.4) };
            let driven = drive(cycle);
            let trip = driven.trip.unwrap();
            assert!(names.contains(&trip.fault), "{trip:?}");
            assert_eq!(trip.safe, SafeState::ShortCircuit);
            let (until, after) = (driven.observed.until, driven.observed.after);
            println!(
                "{kind:?}: {:.0} A, then {:.0} A and {:.0} V",
                until.current_a, after.current_a, after.udc_v
            );
            assert!(until.current_a.max(after.current_a) < 1.5 * TRIP_A);
            let safe_s = driven.rows.last().unwrap().t_s;
            let left_nm = mean_nm(&driven.rows, safe_s - 0.02, safe_s);
            assert!(left_nm.abs() < 30.0, "the short circuit hardly brakes: {left_nm} N·m");
        }
    }
}

#[test]
fn dc_link_collapsing_in_weakening() {
    let kind = Kind::Supply(SupplyFault::Lost);
    let cycle = DriveCycle { injection: injected(kind), ..steady(6000.0, &[(-0.05, FULL_NM)], 0.5) };
    let driven = drive(cycle);
    let trip = driven.trip.unwrap();
    assert_eq!((trip.fault, trip.safe), (Fault::DcUndervoltage, SafeState::ShortCircuit));
    let (until, after) = (driven.observed.until, driven.observed.after);
    println!("{:.0} A, then {:.0} A and {:.0} V", until.current_a, after.current_a, after.udc_v);
    assert!(until.current_a.max(after.current_a) < 1.5 * TRIP_A);
    // The EMF would charge the link to 1,950 V; short-circuited the machine leaves it where it is.
    assert!(after.udc_v < 900.0, "{} V", after.udc_v);
}

#[test]
fn gates_blocked_at_6000_and_enabled_again() {
    let cycle = DriveCycle {
        enable: vec![(0.2, false), (0.35, true)],
        ..steady(6000.0, &[(-0.05, FULL_NM), (0.2, 0.0), (0.45, FULL_NM)], 0.7)
    };
    let driven = drive(cycle);
    assert!(driven.trip.is_none(), "{:?}", driven.trip);
    let peaks = driven.observed.until;
    println!("{:.0} A, {:.0} V", peaks.current_a, peaks.udc_v);
    assert!(peaks.current_a < TRIP_A, "{} A", peaks.current_a);
    assert!(peaks.udc_v < 1.01 * EMF_V, "{} V", peaks.udc_v);
    let blocked = driven.rows.iter().filter(|row| (0.21..0.345).contains(&row.t_s));
    assert!(blocked.clone().count() > 1000 && blocked.clone().all(|row| row.mode == Mode::Off));
    assert!(mean_nm(&driven.rows, 0.6, 0.7) > 350.0, "torque is back");
}

#[test]
fn mode_boundary_crossed_during_a_reversal() {
    // Each border, upward and downward, with torque turned over while it is crossed.
    for (low_rpm, high_rpm) in [(500.0, 700.0), (800.0, 1000.0), (1030.0, 1250.0), (1750.0, 2050.0)] {
        for (from_rpm, to_rpm) in [(low_rpm, high_rpm), (high_rpm, low_rpm), (-low_rpm, -high_rpm)] {
            for sign in [1.0, -1.0] {
                let torque = [(-0.05, sign * FULL_NM), (0.25, -sign * FULL_NM), (0.45, sign * FULL_NM)];
                let cycle = DriveCycle {
                    speed: vec![(0.1, from_rpm), (0.6, to_rpm)],
                    torque: torque.map(|(t_s, torque_nm)| (t_s, (torque_nm, true))).to_vec(),
                    ..steady(0.0, &[], 0.8)
                };
                let driven = drive(cycle);
                let modes: std::collections::BTreeSet<_> =
                    driven.rows.iter().map(|row| row.mode.name()).collect();
                println!(
                    "{from_rpm} to {to_rpm}, {sign}: {modes:?} {:.0} A",
                    driven.observed.until.current_a
                );
                assert!(driven.trip.is_none(), "{from_rpm} to {to_rpm}, {sign}: {:?}", driven.trip);
                assert!(modes.len() > 1, "{modes:?}");
                assert!(driven.observed.until.current_a < TRIP_A);
            }
        }
    }
}
