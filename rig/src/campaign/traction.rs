//! Cases of the PMaSynRM drive.

use super::Action;
use crate::bench::inject::{Injection, Kind, SupplyFault};
use crate::bench::{self, Bench, Flaws, LineFilter, Observed, Supply};
use crate::machine::Machine;
use crate::plant::{Plant, PlantSettings, SpeedSource};
use crate::run::{CLOCK, Tasks};
use crate::sensor_faults::{AngleFault, CurrentFault};
use core::f64::consts::TAU;
use tractive::control::{Demand, Gains};
use tractive::drive::traction::Settings;
use tractive::modulation::{Devices, Mode};
use tractive::protection::Trip;

/// Speed in r/min, and the share of the torque envelope that is asked for.
pub const POINTS: [(f64, f64); 17] = [
    (0.0, 0.8),
    (100.0, 0.8),
    (300.0, 0.8),
    (550.0, 0.8),
    (640.0, 0.8),
    (850.0, 0.8),
    (930.0, 0.5),
    (1080.0, 0.5),
    (1200.0, 0.5),
    (1700.0, 0.5),
    (1950.0, 0.4),
    (2800.0, 0.4),
    (2000.0, 1.0),
    (3000.0, 0.8),
    (4500.0, 0.8),
    (5500.0, 0.8),
    (6000.0, 0.8),
];

/// When the fault comes, in s.
const FAULT_S: f64 = 0.005_037;
/// When another torque is wanted, in s: a fault that has not shown must not hide for ever.
const TURN_S: f64 = 0.125;
/// End, in s.
const END_S: f64 = 0.25;
const LEAD_S: f64 = 0.12;
/// After the gates are safe, in s.
const AFTERMATH_S: f64 = 0.06;

/// What a fault is made of.
#[derive(Clone, Copy, Debug)]
pub enum Cause {
    Injected(Kind),
    Flux(f64),
    Runaway,
}

/// What was seen.
#[derive(Clone, Copy, Debug)]
pub struct Seen {
    pub mode: Mode,
    pub trip: Option<Trip>,
    pub observed: Observed,
    pub torque_error_nm: f64,
    pub tick_s: f64,
}

pub fn faults() -> Vec<(String, Cause)> {
    vec![
        ("current-u-offset".to_owned(), Cause::Injected(Kind::Current(0, CurrentFault::Offset(60.0)))),
        ("angle-jump".to_owned(), Cause::Injected(Kind::Angle(AngleFault::Jump(90.0)))),
        ("angle-frozen".to_owned(), Cause::Injected(Kind::Angle(AngleFault::Frozen))),
        ("angle-reversed".to_owned(), Cause::Injected(Kind::Angle(AngleFault::Reversed))),
        ("uh-stuck-on".to_owned(), Cause::Injected(Kind::Gate(0, true))),
        ("uh-stuck-off".to_owned(), Cause::Injected(Kind::Gate(0, false))),
        ("ul-stuck-on".to_owned(), Cause::Injected(Kind::Gate(1, true))),
        ("uh-device".to_owned(), Cause::Injected(Kind::Device(0))),
        ("link-lost".to_owned(), Cause::Injected(Kind::Supply(SupplyFault::Lost))),
        ("link-over".to_owned(), Cause::Injected(Kind::Supply(SupplyFault::To(2300.0)))),
        ("link-swings".to_owned(), Cause::Injected(Kind::Supply(SupplyFault::Swinging(300.0, 30.0)))),
        ("flux-120".to_owned(), Cause::Flux(1.2)),
        ("flux-80".to_owned(), Cause::Flux(0.8)),
        ("runaway".to_owned(), Cause::Runaway),
    ]
}

pub fn run(
    machine: &Machine,
    speed_rpm: f64,
    share: f64,
    action: Action,
    cause: Cause,
) -> anyhow::Result<Seen> {
    let parameters = &machine.folder.parameters;
    let omega = speed_rpm * TAU / 60.0;
    let envelope_nm = (parameters.max_power_w / omega.max(1.0)).min(parameters.max_torque_nm);
    let wanted_nm = share * envelope_nm * action.sign();
    let turned_nm = if action == Action::Coasting { 0.5 } else { -0.5 * action.sign() } * share * envelope_nm;
    let operator = move |t_s: f64| {
        let torque_nm = if t_s < -0.09 {
            0.0
        } else if t_s < TURN_S {
            wanted_nm
        } else {
            turned_nm
        };
        (Demand { torque_nm: torque_nm as f32, slew_limited: false }, true)
    };
    let at_s = FAULT_S;
    let injection = match cause {
        Cause::Injected(kind) => Some(Injection { kind, at_s, seed: 1 }),
        _ => None,
    };
    let speed = match cause {
        Cause::Runaway => vec![(LEAD_S + at_s, speed_rpm), (LEAD_S + END_S, speed_rpm + 2000.0)],
        _ => vec![(0.0, speed_rpm)],
    };
    let flux_scale = if let Cause::Flux(scale) = cause { scale } else { 1.0 };
    let plant = Plant::new(
        &machine.folder,
        SpeedSource::profile(speed),
        &PlantSettings { flux_scale, resistance_scale: 1.0 },
    );
    let devices = Devices::new(250, 0, machine.tables.ratings.max_switching_hz, &CLOCK);
    let first_half_ticks = devices.shortest_half_ticks;
    let mut bench = Bench::new(
        plant,
        Box::new(operator),
        &bench::Settings {
            clock: CLOCK,
            first_half_ticks,
            dead_time_ticks: 0,
            lead_s: LEAD_S,
            duration_s: END_S,
            trace_step_s: 50e-6,
            udc_v: parameters.dc_link_nominal_v,
            link_steps: Vec::new(),
            flaws: Flaws::default(),
            supply: Supply::Line(LineFilter::TRACTION),
            injection,
        },
    );
    let settings = Settings { clock: CLOCK, devices, gains: Gains::DEFAULT };
    let tasks = Tasks::new(machine.tables, settings, first_half_ticks);
    let tick_s = f64::from(CLOCK.tick_s);
    tasks.drive(&mut bench, |bench| {
        let safe_s = bench.observed().safe.map(|(at, _)| at as f64 * tick_s - LEAD_S);
        safe_s.is_none_or(|safe_s| bench.time_s() < safe_s + AFTERMATH_S)
    })?;
    let rows = bench.rows();
    let mode = rows.iter().rev().find(|row| row.t_s < at_s).map_or(Mode::Off, |row| row.mode);
    let last = &rows[rows.len().saturating_sub(800)..];
    let mean =
        |value: fn(&crate::trace::Row) -> f64| last.iter().map(value).sum::<f64>() / last.len().max(1) as f64;
    Ok(Seen {
        mode,
        trip: rows.last().and_then(|row| row.trip),
        observed: *bench.observed(),
        torque_error_nm: mean(|row| row.te_nm - row.te_ref_nm),
        tick_s,
    })
}

#[test]
fn first_look() {
    use rayon::prelude::*;
    let machine = Machine::load("pmasynrm-180kw").unwrap();
    let list: Vec<_> = faults()
        .into_iter()
        .flat_map(|fault| {
            POINTS.into_iter().flat_map(move |point| {
                let fault = fault.clone();
                Action::ALL.into_iter().map(move |action| (fault.clone(), point, action))
            })
        })
        .collect();
    let lines: Vec<_> = list.par_iter().map(|((name, cause), (speed, share), action)| {
        let seen = run(&machine, *speed, *share, *action, *cause).unwrap();
        let o = seen.observed;
        let from = o.effect.unwrap_or(o.from);
        let ms = o.safe.map_or(f64::NAN, |(at, _)| (at as f64 - from as f64) * seen.tick_s * 1e3);
        let period = o.carrier_ticks as f64 * seen.tick_s * 1e3;
        format!("{name:18} {speed:6} {:8} {:8} {:18} {:?} ms {ms:.2} periods {:.2} eff {} I {:.0}/{:.0} U {:.0}/{:.0} Te {:.0}",
            action.name(), seen.mode.name(), seen.trip.map_or("-", |t| t.fault.name()), o.safe.map(|s| s.1), ms / period, o.effect.is_some(),
            o.until.current_a, o.after.current_a, o.until.udc_v, o.after.udc_v, seen.torque_error_nm)
    }).collect();
    for line in lines {
        println!("{line}");
    }
}
