//! What is driven, and what is to be seen.

mod cycle;
mod load_step;
mod reverse;
mod steady;
mod timing;

pub use load_step::INERTIA_KG_M2;

use super::bench::{Bench, BenchSettings};
use super::operator::{Operator, Orders, SeenMotors};
use super::trace::Recording;
use super::{line, run, settings};
use crate::analysis::Figures;
use crate::bench::Limits;
use crate::machine::Machine;
use crate::options::{On, RunOptions};
use crate::plant::zs9::{NetworkState, Zs9Plant, Zs9Settings};
use crate::plant::{PlantSettings, SpeedSource};
use crate::report::Page;
use crate::run::{CLOCK, Emulator, Supervisor, refused};
use anyhow::{Result, bail};
use core::f64::consts::TAU;
use tractive::operator::Line;
use tractive::ports::MotorDemand;
use tractive::wire::DualSetup;

pub use steady::SPEEDS_RPM as STEADY_SPEEDS_RPM;

/// Source voltage, in V.
pub const SOURCE_V: f64 = 400.0;

/// Largest source and link voltage that is simulated, in V: the drive trips long before.
const LARGEST_V: f64 = 1200.0;

/// A scenario's inputs.
pub struct Plan {
    /// Before the recording, in s: the drive starts and settles.
    pub lead_s: f64,
    /// Length of the recording, in s.
    pub duration_s: f64,
    /// What turns the rotors.
    pub speeds: [SpeedSource; 2],
    /// Speeds of free rotors at the beginning, in r/min.
    pub from_rpm: [f64; 2],
    /// Operator and loads.
    pub operator: Box<dyn Operator + Send>,
}

/// A scenario of the ZS9.
pub trait Scenario {
    /// Its name on the command line.
    fn name(&self) -> &'static str;
    /// The paper's figures that it answers, and what it is.
    fn title(&self) -> &'static str;
    /// Which of [`crate::options::OWN`] it knows besides those of the ZS9.
    fn own_options(&self) -> &'static [&'static str] {
        &[]
    }
    /// Step of the trace unless another is asked for, in s.
    fn trace_step_s(&self, options: &RunOptions) -> f64 {
        f64::from(options.zs9.carrier_hz).recip()
    }
    /// Whether edges are kept.
    fn edges(&self, _options: &RunOptions) -> bool {
        true
    }
    /// What is driven.
    fn plan(&self, options: &RunOptions) -> Plan;
    /// The figures to report.
    fn figures(&self, recording: &Recording, options: &RunOptions) -> Figures;
    /// The plots to draw.
    fn plots(&self, recording: &Recording, page: &mut Page);
}

/// Every scenario of the ZS9.
pub fn all() -> [Box<dyn Scenario>; 5] {
    [
        Box::new(load_step::LoadStep),
        Box::new(reverse::Reverse),
        Box::new(cycle::Cycle),
        Box::new(steady::Steady),
        Box::new(timing::Timing),
    ]
}

/// The scenario of that name.
pub fn find(name: &str) -> Option<Box<dyn Scenario>> {
    all().into_iter().find(|scenario| scenario.name() == name)
}

/// Drives a scenario.
pub fn drive(scenario: &dyn Scenario, options: &RunOptions, machine: &Machine) -> Result<Recording> {
    let bench = bench(scenario, options, machine)?;
    let settings = settings::drive(CLOCK, options.zs9.carrier_hz);
    match options.on {
        On::Host => {
            settings.check(machine.tables).map_err(refused)?;
            run::run_on_host(scenario.name(), bench, machine.tables, settings)
        }
        On::Qemu => {
            let setup = DualSetup { carrier_ticks: settings.carrier_ticks, line: None };
            run::run_in_qemu(scenario.name(), bench, setup, &options.emulator()?, None)
        }
    }
}

/// Drives free rotors from an empty network over the protocol, without an end until the supervisor says so.
pub(crate) fn drive_supervised(
    supervisor: &mut dyn Supervisor,
    inertia_kg_m2: f64,
    options: &RunOptions,
    machine: &Machine,
) -> Result<Recording> {
    let bench = bench(&Supervised(inertia_kg_m2), options, machine)?.with_line(line::TIMES);
    let settings = settings::drive(CLOCK, options.zs9.carrier_hz);
    match options.on {
        On::Host => {
            settings.check(machine.tables).map_err(refused)?;
            let ratings = settings.operator_ratings(&machine.tables.ratings);
            let line =
                Line::rated(&ratings, line::TIMES.precharge_s, line::TIMES.discharge_s).without_chopper();
            run::run_supervised_on_host("talk", bench, machine.tables, settings, line, supervisor)
        }
        On::Qemu => {
            let setup = DualSetup { carrier_ticks: settings.carrier_ticks, line: Some(line::TIMES) };
            let emulator = Emulator { patient: supervisor.is_typed(), ..options.emulator()? };
            run::run_in_qemu("talk", bench, setup, &emulator, Some(supervisor))
        }
    }
}

/// Free rotors of this inertia, in kg·m²; what is driven the supervisor says.
struct Supervised(f64);

/// Longest talk, in s.
const LONGEST_S: f64 = 86_400.0;

impl Scenario for Supervised {
    fn name(&self) -> &'static str {
        "talk"
    }

    fn title(&self) -> &'static str {
        "commanded over the protocol"
    }

    fn trace_step_s(&self, _options: &RunOptions) -> f64 {
        1e-3
    }

    fn edges(&self, _options: &RunOptions) -> bool {
        false
    }

    fn plan(&self, _options: &RunOptions) -> Plan {
        // What the operator permits takes the place of the demands.
        let operator = |_: f64, _: SeenMotors| Orders {
            demands: [MotorDemand::Speed(0.0); 2],
            loads_nm: [0.0; 2],
            enable: true,
        };
        let speeds = [free(self.0), free(self.0)];
        Plan { lead_s: 0.0, duration_s: LONGEST_S, speeds, from_rpm: [0.0; 2], operator: Box::new(operator) }
    }

    fn figures(&self, _recording: &Recording, _options: &RunOptions) -> Figures {
        Figures::default()
    }

    fn plots(&self, _recording: &Recording, _page: &mut Page) {}
}

fn bench(scenario: &dyn Scenario, options: &RunOptions, machine: &Machine) -> Result<Bench> {
    let plan = scenario.plan(options);
    let parameters = &machine.folder.parameters;
    let motor = PlantSettings {
        flux_scale: 1.0 + options.map_error / 100.0,
        resistance_scale: 1.0 + options.rs_error / 100.0,
    };
    let source_v = options.udc.unwrap_or(SOURCE_V);
    let link_ref_v = options.zs9.uin;
    if source_v > LARGEST_V {
        bail!("--udc {source_v}: must be at most {LARGEST_V} V");
    }
    if !(source_v..=LARGEST_V).contains(&link_ref_v) {
        bail!("--uin {link_ref_v}: must be from the source's {source_v} V to {LARGEST_V} V");
    }
    options.check_flaws(machine, source_v)?;
    if let Some(injection) = options.zs9.inject
        && injection.at_s > plan.duration_s
    {
        bail!(
            "--inject at {} s: must be within the run, which ends at {} s",
            injection.at_s,
            plan.duration_s
        );
    }
    let plant_settings = Zs9Settings { source_v, motors: [motor; 2], ..Zs9Settings::default() };
    let folders = [&machine.folder; 2];
    let mut plant = Zs9Plant::new(folders, plan.speeds, &plant_settings);
    plant.set_network(NetworkState::even(0.0, 0.5 * (link_ref_v + source_v)));
    for (motor, rpm) in plant.motors_mut().iter_mut().zip(plan.from_rpm) {
        motor.set_speed_rpm(rpm);
    }
    let trace_step_s = options.dt.unwrap_or_else(|| scenario.trace_step_s(options));
    let settings = BenchSettings {
        clock: CLOCK,
        carrier_ticks: settings::carrier_ticks(&CLOCK, options.zs9.carrier_hz),
        lead_s: plan.lead_s,
        duration_s: plan.duration_s,
        trace_step_s,
        link_ref_v,
        scheme: options.zs9.scheme,
        flaws: options.flaws(parameters.trip_current_a),
        injection: options.zs9.inject,
        limits: Limits::NONE,
        edges: scenario.edges(options),
        dead_time_s: options.dead_time_us * 1e-6,
    };
    let (shortest_s, longest_s) = (CLOCK.tick_s, plan.duration_s);
    if trace_step_s < f64::from(shortest_s) || trace_step_s > longest_s {
        bail!("--dt {trace_step_s}: must be a number from {shortest_s} to {longest_s}");
    }
    Ok(Bench::new(plant, plan.operator, settings))
}

/// A free rotor, loaded by what the operator says.
fn free(inertia_kg_m2: f64) -> SpeedSource {
    SpeedSource::Inertia { inertia_kg_m2, load_nm: 0.0 }
}

/// A speed in rad/s.
fn rad_s(rpm: f64) -> f64 {
    rpm * TAU / 60.0
}

/// 0 before `from`, 1 after `to`, a straight line between.
fn ramp(t_s: f64, from_s: f64, to_s: f64) -> f64 {
    ((t_s - from_s) / (to_s - from_s)).clamp(0.0, 1.0)
}
