//! What is driven, and what is to be seen.

mod acknowledge;
mod borders_timing;
pub mod characteristic;
mod chopper;
mod full_step;
mod line;
mod link_steps;
mod load_steps;
mod mode_borders;
mod precharge;
mod restart;
mod reversal;
mod script;
mod steady;
mod sweep;
mod switches;
mod timing;

use crate::analysis::{self, Figures};
use crate::bench::{self, Bench, Limits, LinePlan, Operator, Supply};
use crate::inject::Injection;
use crate::inject::sensor::CurrentFault;
use crate::inject::traction::Kind;
use crate::machine::Machine;
use crate::options::{On, RunOptions};
use crate::plant::{DcLinkSettings, Plant, PlantSettings, SpeedSource};
use crate::report::Page;
use crate::run::{self, CLOCK, Emulator, Supervisor};
use crate::trace::Recording;
use anyhow::{Context, Result};
use tractive::control::{Demand, Gains};
use tractive::drive::traction::Settings;
use tractive::link::{LineTimes, Setup};
use tractive::modulation::Devices;
use tractive::operator::{Line, Request};

/// The usual lead, in s.
const LEAD_S: f64 = 0.1;
/// What `--offset-at` adds to a phase current, as a share of the largest: more than the sum of the phases may be.
const OFFSET: f64 = 0.2;

/// Longest run of a supervisor's, in s.
const LONGEST_S: f64 = 1e5;

/// A scenario's inputs.
pub struct Plan {
    /// Time in which the drive settles before the recording begins, in s.
    pub lead_s: f64,
    /// Length of the recording, in s.
    pub duration_s: f64,
    /// Prescribed speed: (time in s, r/min), straight lines between; before the first the first.
    pub speed: Vec<(f64, f64)>,
    /// DC-link voltages: (time in s, V), each from its time on; the run's own before the first.
    pub link: Vec<(f64, f64)>,
    /// The operator.
    pub operator: Box<dyn Operator + Send>,
}

impl Plan {
    /// For a drive with a line side, whose operator permits what is driven.
    fn operated(duration_s: f64, speed: Vec<(f64, f64)>) -> Self {
        // What the operator permits takes the place of this.
        let operator = Box::new(|_: f64| (Demand::default(), true));
        Self { lead_s: 0.0, duration_s, speed, link: Vec::new(), operator }
    }
}

/// A scenario.
pub trait Scenario {
    /// Its name on the command line.
    fn name(&self) -> &'static str;
    /// The paper's figure that it answers.
    fn figure(&self) -> &'static str;
    /// Which of [`crate::options::OWN`] it knows.
    fn own_options(&self) -> &'static [&'static str] {
        &[]
    }
    /// What is driven.
    fn plan(&self, options: &RunOptions, machine: &Machine) -> Plan;
    /// The line side, where the scenario is about it; otherwise the link is stiff and the drive is commanded directly.
    fn line(&self, _options: &RunOptions, _machine: &Machine) -> Option<LinePlan> {
        None
    }
    /// The figures to report; those that all have, and the modes, unless the scenario is about something.
    fn figures(&self, recording: &Recording, _options: &RunOptions, _machine: &Machine) -> Figures {
        let mut figures = analysis::common(recording);
        figures.set("modes", analysis::modes(recording));
        figures
    }
    /// Step of the trace unless the options say another, in s.
    fn trace_step_s(&self) -> f64 {
        50e-6
    }
    /// The steady states whose spectrum is to be drawn beside its bound: a title, and from when to when, in s.
    fn spectra(&self, _recording: &Recording) -> Vec<(String, (f64, f64))> {
        Vec::new()
    }
    /// The plots to draw; the whole run unless the scenario is about something.
    fn plots(&self, recording: &Recording, page: &mut Page) {
        page.overview(recording);
    }
}

/// Every scenario.
pub fn all() -> Vec<Box<dyn Scenario>> {
    vec![
        Box::new(load_steps::LoadSteps),
        Box::new(sweep::Sweep),
        Box::new(characteristic::Characteristic),
        Box::new(full_step::FullStep),
        Box::new(steady::Steady),
        Box::new(mode_borders::ModeBorders),
        Box::new(reversal::Reversal),
        Box::new(restart::Restart),
        Box::new(link_steps::LinkSteps),
        Box::new(precharge::Precharge),
        Box::new(chopper::Chopper),
        Box::new(acknowledge::Acknowledge),
        Box::new(timing::Timing),
        Box::new(borders_timing::BordersTiming),
    ]
}

/// The scenario of that name.
pub fn find(name: &str) -> Result<Box<dyn Scenario>> {
    let own = all();
    let zs9 = crate::zs9::scenario::all();
    let names = own.iter().map(|scenario| scenario.name()).chain(zs9.iter().map(|scenario| scenario.name()));
    let names: Vec<_> = names.collect();
    all()
        .into_iter()
        .find(|scenario| scenario.name() == name)
        .with_context(|| format!("scenario {name}: must be one of {}", names.join(", ")))
}

/// The options with the step of the trace that the scenario takes where none was given.
pub fn with_step(scenario: &dyn Scenario, options: &RunOptions) -> RunOptions {
    RunOptions { dt: Some(options.dt.unwrap_or_else(|| scenario.trace_step_s())), ..options.clone() }
}

/// Drives a scenario.
pub fn drive(scenario: &dyn Scenario, options: &RunOptions, machine: &Machine) -> Result<Recording> {
    let options = &with_step(scenario, options);
    options.check(machine)?;
    let plan = scenario.plan(options, machine);
    let line = scenario.line(options, machine);
    let speed = plan.speed.iter().map(|(t_s, rpm)| (t_s + plan.lead_s, *rpm)).collect();
    run_plan(scenario.name(), plan, SpeedSource::profile(speed), line, None, options, machine)
}

/// Drives a rotor on a link over the protocol, without an end until the supervisor says so.
pub(crate) fn drive_supervised(
    name: &str,
    supervisor: &mut dyn Supervisor,
    inertia_kg_m2: f64,
    options: &RunOptions,
    machine: &Machine,
) -> Result<Recording> {
    let plan = Plan::operated(LONGEST_S, Vec::new());
    let idle = Request::idle(&machine.tables.ratings);
    // The frames ask, not this.
    let line_plan = LinePlan::new(line::scaled(machine), Box::new(move |_| idle));
    let rotor = SpeedSource::Inertia { inertia_kg_m2, load_nm: 0.0 };
    run_plan(name, plan, rotor, Some(line_plan), Some(supervisor), options, machine)
}

fn run_plan(
    name: &str,
    plan: Plan,
    speed: SpeedSource,
    line_plan: Option<LinePlan>,
    supervisor: Option<&mut dyn Supervisor>,
    options: &RunOptions,
    machine: &Machine,
) -> Result<Recording> {
    let ticks = |microseconds: f64| (microseconds * 1e-6 * f64::from(CLOCK.ticks_per_s)).round() as u32;
    let setup = Setup {
        min_pulse_ticks: ticks(options.min_pulse_us),
        // What the firmware compensates.
        dead_time_ticks: if options.uncompensated { 0 } else { ticks(options.dead_time_us) },
        pwm_delay_ticks: ticks(options.pwm_delay_us),
        line: line_plan.as_ref().map(|plan| times(&plan.link)),
        over_protocol: supervisor.is_some(),
        uncompensated: options.uncompensated,
    };
    let devices = Devices::new(
        setup.min_pulse_ticks,
        setup.dead_time_ticks,
        machine.tables.ratings.max_switching_hz,
        &CLOCK,
    );
    let parameters = &machine.folder.parameters;
    let plant = plant(speed, options, machine);
    let first_half_ticks = devices.shortest_half_ticks + setup.pwm_delay_ticks;
    let bench = Bench::new(
        plant,
        plan.operator,
        &bench::Settings {
            clock: CLOCK,
            first_half_ticks,
            dead_time_ticks: ticks(options.dead_time_us),
            lead_s: plan.lead_s,
            duration_s: plan.duration_s,
            trace_step_s: options.dt_s(),
            udc_v: options.udc.unwrap_or(parameters.dc_link_nominal_v),
            link_steps: plan.link,
            flaws: options.flaws(parameters.trip_current_a),
            supply: Supply::Stiff,
            injection: options.offset_at.map(|at_s| {
                let fault = CurrentFault::Offset(OFFSET * parameters.max_current_a);
                Injection { kind: Kind::Current(0, fault), at_s }
            }),
            limits: Limits::NONE,
        },
    );
    let line =
        setup.line.map(|times| Line::rated(&machine.tables.ratings, times.precharge_s, times.discharge_s));
    let bench = match line_plan {
        Some(plan) => bench.with_line(plan),
        None => bench,
    };
    match options.on {
        On::Host => {
            let gains = if options.uncompensated { Gains::WITHOUT_SIXTH } else { Gains::DEFAULT };
            let settings = Settings { clock: CLOCK, devices, gains };
            settings.check(machine.tables).map_err(run::refused)?;
            run::run_on_host(name, bench, machine.tables, settings, first_half_ticks, line, supervisor)
        }
        On::Qemu => {
            let patient = supervisor.as_ref().is_some_and(|supervisor| supervisor.is_typed());
            let emulator = Emulator { patient, ..options.emulator()? };
            run::run_in_qemu(name, bench, setup, &emulator, supervisor)
        }
    }
}

fn plant(speed: SpeedSource, options: &RunOptions, machine: &Machine) -> Plant {
    Plant::new(
        &machine.folder,
        speed,
        &PlantSettings {
            flux_scale: 1.0 + options.map_error / 100.0,
            resistance_scale: 1.0 + options.rs_error / 100.0,
        },
    )
}

/// What the operator has to know of a link.
fn times(link: &DcLinkSettings) -> LineTimes {
    let seconds = |ohm: f64| (ohm * link.capacitance_f) as f32;
    LineTimes { precharge_s: seconds(link.precharge_ohm), discharge_s: seconds(link.discharge_ohm) }
}
