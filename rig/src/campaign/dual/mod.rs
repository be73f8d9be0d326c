//! Cases of the ZS9.

mod allowed;
mod cases;
mod drive_cycle;
mod faults;

pub use cases::{Case, cases};
pub use drive_cycle::{CycleResult, DriveCycle, Script};
pub use faults::{Cause, faults};

use super::Outcome;
use super::action::{LEAD_S, Stages};
use super::outcome::{Seen, Setting};
use crate::ablation::Ablation;
use crate::bench::{Flaws, Limits, Simulated};
use crate::inject::Injection;
use crate::inject::zs9::Kind;
use crate::machine::Machine;
use crate::plant::zs9::{NetworkState, ZNetwork, Zs9Plant, Zs9Settings};
use crate::plant::{PlantSettings, SpeedSource};
use crate::run::{CLOCK, Interrupts};
use crate::scenario::System;
use crate::scenario::zs9::Zs9;
use crate::zs9::bench::{Bench, BenchSettings};
use crate::zs9::run::Tasks;
use crate::zs9::trace::Row;
use crate::zs9::{Orders, SeenMotors, settings};
use anyhow::Result;
use tractive::control::Demand;
use tractive::drive::dual::Settings;
use tractive::machine::Tables;
use tractive::ports::MotorDemand;
use tractive::time::Instant;

const CARRIER_HZ: u32 = 10_000;
/// Share of the torque envelope that is demanded.
const SHARE: f64 = 0.6;
/// The aftermath covers twelve periods of the network's oscillation.
const STAGES: Stages = Stages { torque_s: -0.08, turn_s: 0.07, end_s: 0.16, aftermath_s: 0.04 };
/// Time over which the torque is averaged, in s.
const MEAN_S: f64 = 0.03;
/// The acceleration of a rotor that runs away, in r/min per s.
const RUNAWAY_RPM_S: f64 = 6_000.0;

/// The drive, with one protection off or none.
pub struct Drive {
    /// The machine that it drives.
    pub machine: Machine,
    tables: &'static Tables,
    settings: Settings,
    without: Option<Ablation>,
}

impl Drive {
    /// For two of the ZS9's machines.
    pub fn new(without: Option<Ablation>) -> Result<Self> {
        let machine = Machine::load(Zs9::MACHINE)?;
        let mut settings = settings::drive(CLOCK, CARRIER_HZ, machine.tables);
        let mut tables = machine.tables;
        if let Some(without) = without {
            settings.limits = without.link_limits(settings.limits);
            tables = without.tables(tables);
        }
        Ok(Self { machine, tables, settings, without })
    }

    /// Runs one case.
    pub fn run(&self, case: &Case) -> Result<Outcome> {
        let mut bench = self.bench(case);
        let mut tasks = self.tasks(Instant(0));
        let tick_s = bench.step_s();
        tasks.drive(&mut bench, |bench| {
            let safe_s = bench.observed.safe.map(|(at, _)| at as f64 * tick_s - LEAD_S);
            safe_s.is_none_or(|safe_s| bench.time_s() < safe_s + STAGES.aftermath_s)
        })?;
        let rows = bench.rows();
        let seen = Seen {
            observed: bench.observed,
            trip: tasks.trip(),
            torque_error_nm: torque_error_nm(rows, STAGES.turn_s).max(torque_error_nm(rows, STAGES.end_s)),
            tick_s,
            carrier_s: f64::from(CARRIER_HZ).recip(),
        };
        let setting = Setting {
            system: "zs9",
            mode: case.scheme.name(),
            speed_rpm: case.point.speeds_rpm[0],
            action: case.action,
        };
        let allowed = self.allowed(case, &seen);
        Ok(Outcome::new(&setting, &case.fault, &seen, allowed))
    }

    fn tasks(&self, origin: Instant) -> Tasks<'static> {
        Tasks::beginning_at(origin, self.tables, self.settings).without(self.without)
    }

    fn bench(&self, case: &Case) -> Bench {
        let parameters = &self.machine.folder.parameters;
        let Case { point, action, at_s, scheme, .. } = *case;
        let full_nm = point
            .speeds_rpm
            .map(|speed_rpm| (SHARE * self.machine.envelope_nm(speed_rpm)).copysign(speed_rpm));
        let operator = move |t_s: f64, _: SeenMotors| {
            let share = action.share(&STAGES, t_s);
            let demand = |full_nm: f64| Demand { torque_nm: (share * full_nm) as f32, slew_limited: true };
            Orders {
                demands: full_nm.map(|full_nm| MotorDemand::Torque(demand(full_nm))),
                loads_nm: [0.0; 2],
                enable: true,
            }
        };
        let (kind, flux_scale) = match case.fault.cause {
            Cause::Bench(kind) => (kind, 1.0),
            Cause::Flux(flux_scale) => (Kind::Elsewhere, flux_scale),
            Cause::Runaway(_) => (Kind::Elsewhere, 1.0),
        };
        let speeds = [0, 1].map(|motor| {
            let from_rpm = point.speeds_rpm[motor];
            let faster = (case.fault.cause == Cause::Runaway(motor))
                .then_some((LEAD_S + STAGES.end_s, from_rpm + RUNAWAY_RPM_S * (STAGES.end_s - at_s)));
            SpeedSource::profile([(LEAD_S + at_s, from_rpm)].into_iter().chain(faster).collect())
        });
        let motor = PlantSettings { flux_scale, ..PlantSettings::default() };
        let limits = settings::drive(CLOCK, CARRIER_HZ, self.machine.tables).limits;
        let bench = BenchSettings {
            scheme,
            injection: Some(Injection { kind, at_s }),
            limits: Limits {
                current_a: parameters.trip_current_a,
                uc_v: f64::from(limits.capacitor_max_v),
                source_v: f64::from(limits.source_min_v),
                speed_rpm: parameters.trip_speed_rpm,
                ..Limits::NONE
            },
            ..self.bench_settings(STAGES.end_s, Flaws::default())
        };
        Bench::new(self.plant(speeds, motor), Box::new(operator), bench)
    }

    /// Both motors on a network that is charged.
    fn plant(&self, speeds: [SpeedSource; 2], motor: PlantSettings) -> Zs9Plant {
        let parameters = &self.machine.folder.parameters;
        let (source_v, network) = (parameters.zs9_source_v, ZNetwork::of(parameters));
        let settings = Zs9Settings { network, source_v, motors: [motor; 2], ..Zs9Settings::default() };
        let mut plant = Zs9Plant::new([&self.machine.folder; 2], speeds, &settings);
        plant.network = NetworkState::even(0.0, 0.5 * (parameters.zs9_link_v + source_v));
        plant
    }

    /// A sound bench.
    fn bench_settings(&self, duration_s: f64, flaws: Flaws) -> BenchSettings {
        BenchSettings {
            drive: settings::drive(CLOCK, CARRIER_HZ, self.machine.tables),
            lead_s: LEAD_S,
            duration_s,
            trace_step_s: f64::from(CARRIER_HZ).recip(),
            link_ref_v: self.machine.folder.parameters.zs9_link_v,
            scheme: cases::SCHEMES[0],
            flaws,
            injection: Some(Injection { kind: Kind::Elsewhere, at_s: -LEAD_S }),
            limits: Limits::NONE,
            edges: false,
            dead_time_s: 0.0,
        }
    }
}

/// Mean torque less demand before an instant, in N·m, of the worse motor.
fn torque_error_nm(rows: &[Row], before_s: f64) -> f64 {
    let window: Vec<_> =
        rows.iter().filter(|row| row.t_s < before_s && row.t_s > before_s - MEAN_S).collect();
    let error = |motor: usize| {
        let off = |row: &&Row| row.motors[motor].torque_nm - row.motors[motor].torque_ref_nm;
        (window.iter().map(off).sum::<f64>() / window.len().max(1) as f64).abs()
    };
    error(0).max(error(1))
}
