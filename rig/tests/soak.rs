//! Long driving and the instants' wrap-around, every 172 s: nothing drifts, nothing jumps.
//!
//! `TRACTIVE_SOAK_S=3600 cargo test --release -p tractive-rig --test soak` drives for an hour.

use tractive::control::{Demand, Gains};
use tractive::drive::traction::Settings;
use tractive::modulation::Devices;
use tractive::time::Instant;
use tractive_rig::bench::{self, Bench, Flaws, Limits, Supply, Tick};
use tractive_rig::machine::Machine;
use tractive_rig::plant::{Plant, PlantSettings, SpeedSource};
use tractive_rig::run::{CLOCK, Tasks};
use tractive_rig::trace::Row;

const LEAD_S: f64 = 0.1;
/// Where instants wrap, and where their differences from 0 would change sign.
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
    let settings = PlantSettings { flux_scale: 1.0, resistance_scale: 1.0 };
    let plant = Plant::new(&machine.folder, SpeedSource::profile(speed(duration_s)), &settings);
    let devices = Devices::new(250, 0, machine.tables.ratings.max_switching_hz, &CLOCK);
    let first_half_ticks = devices.shortest_half_ticks;
    let settings = bench::Settings {
        clock: CLOCK,
        first_half_ticks,
        dead_time_ticks: 0,
        lead_s: LEAD_S,
        duration_s,
        trace_step_s,
        udc_v: machine.folder.parameters.dc_link_nominal_v,
        link_steps: Vec::new(),
        flaws: Flaws::default(),
        supply: Supply::Stiff,
        limits: Limits::NONE,
        injection: None,
    };
    let mut bench = Bench::new(plant, Box::new(demand), &settings).beginning_at(origin).without_edges();
    let settings = Settings { clock: CLOCK, devices, gains: Gains::DEFAULT };
    let mut tasks = Tasks::beginning_at(Instant(origin as u32), machine.tables, settings, first_half_ticks);
    tasks.drive(&mut bench, goes_on).unwrap();
    bench
}

/// Where the counters stand makes no difference, to the last bit: not at their wrap-around, not at the half of their range.
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

/// What a period of the drive comes to.
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

#[test]
fn nothing_drifts_however_long_it_drives() {
    let asked = std::env::var("TRACTIVE_SOAK_S").ok().and_then(|seconds| seconds.parse().ok());
    let periods = (asked.unwrap_or(20.0_f64) / PERIOD_S).ceil().max(3.0);
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
