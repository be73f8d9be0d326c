//! Long driving and the instants' wrap-around, every 172 s: nothing drifts, nothing jumps.
//!
//! `TRACTIVE_SOAK_S=3600 cargo test --release -p tractive-rig --test soak` drives for an hour.

mod stiff;

use tractive::control::Demand;
use tractive::nine_switch::Scheme;
use tractive::time::Instant;
use tractive_rig::bench::{Bench, Flaws, Tick};
use tractive_rig::campaign::dual::{self, CycleResult, DriveCycle, Script};
use tractive_rig::machine::Machine;
use tractive_rig::plant::{Plant, PlantSettings, SpeedSource};
use tractive_rig::run::{CLOCK, Interrupts};
use tractive_rig::trace::Row;
use tractive_rig::zs9;
use tractive_rig::zs9::bench::Course;

const LEAD_S: f64 = 0.1;
/// The instant at which instants wrap, and at which their differences from 0 would change sign.
const WRAP: Tick = 1 << 32;
const HALF_WRAP: Tick = 1 << 31;

/// Speed up and down once in a period, through every mode; the torque changes its sign twice as often.
const PERIOD_S: f64 = 5.0;
const TOP_RPM: f64 = 3_000.0;

fn speed(duration_s: f64) -> Vec<(f64, f64)> {
    let turns = (duration_s / PERIOD_S).ceil() as usize + 1;
    let corners = (0..=2 * turns).map(|k| (LEAD_S + 0.5 * PERIOD_S * k as f64, TOP_RPM * (k % 2) as f64));
    corners.collect()
}

fn demand(t_s: f64) -> (Demand, bool) {
    let phase = (t_s / PERIOD_S).rem_euclid(1.0);
    let torque_nm = if ((phase * 4.0) as u32).is_multiple_of(2) { 400.0 } else { -400.0 };
    (Demand { torque_nm, slew_limited: true }, true)
}

/// Drives for so long, the timers started at a tick.
fn drive(origin: Tick, duration_s: f64, trace_step_s: f64, goes_on: impl FnMut(&Bench) -> bool) -> Bench {
    let machine = Machine::load("pmasynrm-180kw").unwrap();
    let settings = PlantSettings::default();
    let plant = Plant::new(&machine.folder, SpeedSource::profile(speed(duration_s)), &settings);
    let udc_v = machine.folder.parameters.dc_link_nominal_v;
    let run = stiff::Run { lead_s: LEAD_S, duration_s, trace_step_s, udc_v };
    let mut bench = stiff::bench(&machine, plant, demand, run).beginning_at(origin).without_edges();
    let mut tasks = stiff::tasks(&machine, Instant(origin as u32));
    tasks.drive(&mut bench, goes_on).unwrap();
    bench
}

/// The counters' values make no difference, to the last bit: not at their wrap-around, not at the half of their range.
#[test]
fn the_wrap_around_changes_nothing() {
    let duration_s = 4.0;
    let trace = |origin| format!("{:?}", drive(origin, duration_s, 1e-3, |_| true).rows());
    let plain = trace(0);
    assert!(plain.contains("Square") && plain.contains("Async") && !plain.contains("Some(Trip"));
    let before = (1.7 * f64::from(CLOCK.ticks_per_s)) as Tick;
    for origin in [WRAP - before, HALF_WRAP - before, WRAP - 1, WRAP - Tick::from(CLOCK.control_ticks)] {
        assert!(trace(origin) == plain, "begun at tick {origin}");
    }
}

/// The figures of a period of the drive.
#[derive(Debug)]
struct Figures {
    torque_error_nm: f64,
    current_a: f64,
    largest_a: f64,
}

fn figures(rows: &[Row]) -> Figures {
    let mean = |value: fn(&Row) -> f64| rows.iter().map(value).sum::<f64>() / rows.len() as f64;
    Figures {
        torque_error_nm: mean(|row| (row.te_nm - row.te_ref_nm).abs()),
        current_a: mean(|row| row.id_a.hypot(row.iq_a)),
        largest_a: rows.iter().map(|row| row.id_a.hypot(row.iq_a)).fold(0.0, f64::max),
    }
}

/// Periods to drive: what is asked for, or four.
fn periods() -> f64 {
    let asked = std::env::var("TRACTIVE_SOAK_S").ok().and_then(|seconds| seconds.parse().ok());
    (asked.unwrap_or(20.0_f64) / PERIOD_S).ceil().max(3.0)
}

#[test]
fn nothing_drifts_however_long_it_drives() {
    let periods = periods();
    let step_s = 1e-3;
    let before = (7.3 * f64::from(CLOCK.ticks_per_s)) as Tick;
    let bench = drive(WRAP - before, periods * PERIOD_S, step_s, |_| true);
    let rows = bench.rows();
    assert!(rows.iter().all(|row| row.trip.is_none()), "{:?}", rows.iter().find_map(|row| row.trip));
    let per_period = (PERIOD_S / step_s).round() as usize;
    let of = |number: usize| figures(&rows[number * per_period..(number + 1) * per_period]);
    // The first one begins with a drive that has just been switched on.
    let reference = of(1);
    println!("{reference:?}");
    for number in 2..periods as usize {
        let now = of(number);
        for (name, is, was) in [
            ("torque error", now.torque_error_nm, reference.torque_error_nm),
            ("current", now.current_a, reference.current_a),
            ("largest current", now.largest_a, reference.largest_a),
        ] {
            // Carriers meet the cycle in another phase each time.
            assert!((is / was - 1.0).abs() < 0.05, "{name} in period {number}: {is}, at first {was}");
        }
    }
}

/// The ZS9's cycle, once in a period: the one motor is led up and down and back in torque control, the other one wants a speed that
/// reverses, with a load that changes its sign; source and scheme change.
fn dual_cycle(periods: f64) -> DriveCycle {
    let (mut speed_rpm, mut torque_nm, mut wanted_rpm, mut load_nm) =
        (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    let mut course = Course::default();
    for period in 0..=periods.ceil() as u32 {
        let begins_s = f64::from(period) * PERIOD_S;
        let at = |share: f64| begins_s + share * PERIOD_S;
        speed_rpm.extend([(at(0.0), 0.0), (at(0.25), 1_300.0), (at(0.5), 0.0), (at(0.75), -1_300.0)]);
        torque_nm.extend([(at(0.0), (100.0, true)), (at(0.2), (-100.0, false)), (at(0.6), (100.0, false))]);
        wanted_rpm.extend([(at(0.0), 0.0), (at(0.1), 1_000.0), (at(0.4), 1_000.0), (at(0.8), -1_000.0)]);
        load_nm.extend([(at(0.15), 40.0), (at(0.55), -40.0)]);
        course.source_v.extend([(at(0.1), 370.0), (at(0.7), 430.0)]);
        for (share, scheme) in [0.05, 0.3, 0.55, 0.8].into_iter().zip(SCHEMES) {
            course.schemes.push((at(share), scheme));
        }
    }
    let motors = [Script::Torque { speed_rpm, torque_nm }, Script::Speed { wanted_rpm, load_nm }];
    DriveCycle { motors, course, duration_s: periods * PERIOD_S }
}

const SCHEMES: [Scheme; 4] = [Scheme::S, Scheme::Rs, Scheme::Rthd, Scheme::Zvo];
const DUAL_STEP_S: f64 = 5e-3;

fn dual_drive(cycle: DriveCycle, origin: Tick) -> CycleResult {
    let driven = dual::Drive::new(None).unwrap().cycle(cycle, Flaws::default(), DUAL_STEP_S, origin).unwrap();
    assert!(driven.trip.is_none(), "{:?} at {} s", driven.trip, driven.ended_s);
    driven
}

#[test]
fn the_wrap_around_changes_nothing_for_the_zs9() {
    let trace = |origin| {
        let cycle = DriveCycle { duration_s: 1.4, ..dual_cycle(1.0) };
        format!("{:?}", dual_drive(cycle, origin).rows)
    };
    let plain = trace(0);
    let before = (0.9 * f64::from(CLOCK.ticks_per_s)) as Tick;
    for origin in [WRAP - before, HALF_WRAP - before, WRAP - 1, WRAP - Tick::from(CLOCK.control_ticks)] {
        assert!(trace(origin) == plain, "begun at tick {origin}");
    }
}

/// The same figures of both motors of the ZS9, and its link.
fn dual_figures(rows: &[zs9::trace::Row]) -> Vec<(&'static str, f64)> {
    let mean =
        |value: &dyn Fn(&zs9::trace::Row) -> f64| rows.iter().map(value).sum::<f64>() / rows.len() as f64;
    let motor = |k: usize| {
        let error = mean(&|row| (row.motors[k].torque_nm - row.motors[k].torque_ref_nm).abs());
        (error, mean(&|row| row.motors[k].id_a.hypot(row.motors[k].iq_a)))
    };
    let ((error_1, current_1), (error_2, current_2)) = (motor(0), motor(1));
    let capacitor_v = mean(&|row| row.capacitor_v);
    let ripple_v = mean(&|row| (row.capacitor_v - capacitor_v).powi(2)).sqrt();
    vec![
        ("torque error 1", error_1),
        ("current 1", current_1),
        ("torque error 2", error_2),
        ("current 2", current_2),
        ("capacitor voltage", capacitor_v),
        ("its ripple", ripple_v),
        ("duty", mean(&|row| row.duty)),
        ("speed", mean(&|row| row.motors[1].speed_rpm.abs())),
    ]
}

#[test]
fn nothing_drifts_however_long_the_zs9_drives() {
    let periods = periods();
    let before = (7.3 * f64::from(CLOCK.ticks_per_s)) as Tick;
    let rows = dual_drive(dual_cycle(periods), WRAP - before).rows;
    let per_period = (PERIOD_S / DUAL_STEP_S).round() as usize;
    let of = |number: usize| dual_figures(&rows[number * per_period..(number + 1) * per_period]);
    let reference = of(1);
    println!("{reference:?}");
    for number in 2..periods as usize {
        for ((name, is), (_, was)) in of(number).into_iter().zip(&reference) {
            assert!((is / was - 1.0).abs() < 0.02, "{name} in period {number}: {is}, at first {was}");
        }
    }
}
