//! The PMaSynRM drive's scenarios.

mod acknowledge;
mod borders_timing;
mod characteristic;
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
pub mod switches;
mod timing;

pub use acknowledge::Acknowledge;
pub use borders_timing::BordersTiming;
pub use characteristic::Characteristic;
pub use chopper::Chopper;
pub use full_step::FullStep;
pub use line::scaled as scaled_link;
pub use link_steps::LinkSteps;
pub use load_steps::LoadSteps;
pub use mode_borders::ModeBorders;
pub use precharge::Precharge;
pub use restart::Restart;
pub use reversal::Reversal;
pub use steady::Steady;
pub use sweep::Sweep;
pub use timing::Timing;

use super::System;
use crate::analysis::{self, Figures};
use crate::bench::{self, Bench, Flaws, Limits, LinePlan, Operator, Supply};
use crate::inject::Injection;
use crate::inject::traction::Kind;
use crate::machine::Machine;
use crate::options::{On, not_negative, within};
use crate::plant::{DcLinkSettings, Plant, SpeedSource};
use crate::report::{self, Page};
use crate::run::{self, CLOCK, Supervisor};
use crate::trace::Recording;
use anyhow::Result;
use clap::Args;
use serde::Serialize;
use serde_json::{Map, Value};
use tractive::control::{Demand, Gains};
use tractive::drive::traction::Settings;
use tractive::modulation::Devices;
use tractive::operator::Line;
use tractive::operator::LineTimes;
use tractive::wire::Setup;

/// The usual lead, in s.
const LEAD_S: f64 = 0.1;

/// The PMaSynRM drive.
#[derive(Clone, Copy, Debug)]
pub struct Traction;

/// What all of its scenarios know.
#[derive(Clone, Debug, Args, Serialize)]
pub struct TractionOptions {
    /// Leave the dead time uncompensated: neither the pulses are corrected nor is the sixth harmonic of the voltage followed.
    #[arg(long)]
    pub uncompensated: bool,
    /// By how much the PWM timer starts later, in µs.
    #[arg(long, default_value_t = 0.0, value_parser = not_negative, allow_negative_numbers = true, hide = true)]
    pub pwm_delay_us: f64,
}

/// Options of a run.
pub type Options = crate::options::Options<TractionOptions>;

/// A scenario's inputs.
pub struct Plan {
    /// Time in which the drive settles before the recording begins, in s.
    pub lead_s: f64,
    /// Length of the recording, in s.
    pub duration_s: f64,
    /// What turns the rotor, from the run's beginning on.
    pub speed: SpeedSource,
    /// DC-link voltages: (time in s, V), each from its time on; the run's own before the first.
    pub link: Vec<(f64, f64)>,
    /// The operator.
    pub operator: Box<dyn Operator + Send>,
    /// The line side, where the scenario is about it; otherwise the link is stiff and the drive is commanded directly.
    pub line: Option<LinePlan>,
    /// What goes wrong.
    pub injection: Option<Injection<Kind>>,
    /// From this time on control is told the same currents again and again, in s.
    pub freeze_at_s: Option<f64>,
}

impl Plan {
    /// For a drive that is commanded directly at a prescribed speed: (time in s, r/min), straight lines between; before the first the
    /// first.
    pub fn driven(
        lead_s: f64,
        duration_s: f64,
        speed: Vec<(f64, f64)>,
        operator: impl Operator + Send + 'static,
    ) -> Self {
        let later = speed.into_iter().map(|(t_s, rpm)| (t_s + lead_s, rpm)).collect();
        Self {
            lead_s,
            duration_s,
            speed: SpeedSource::profile(later),
            link: Vec::new(),
            operator: Box::new(operator),
            line: None,
            injection: None,
            freeze_at_s: None,
        }
    }

    /// For a drive with a line side, whose operator permits what is driven.
    pub fn operated(duration_s: f64, speed: Vec<(f64, f64)>, line: LinePlan) -> Self {
        // What the operator permits takes the place of this.
        let nothing = |_: f64| (Demand::default(), true);
        Self { line: Some(line), ..Self::driven(0.0, duration_s, speed, nothing) }
    }
}

impl System for Traction {
    const NAME: &'static str = "pmasynrm";
    const MACHINE: &'static str = "pmasynrm-180kw";
    type Own = TractionOptions;
    type Plan = Plan;
    type Recording = Recording;

    fn trace_step_s(_own: &TractionOptions) -> f64 {
        50e-6
    }

    fn check(options: &Options, scenario: &Map<String, Value>, machine: &Machine) -> Result<()> {
        let parameters = &machine.folder.parameters;
        let (fastest_rpm, most_nm) = (3.0 * parameters.max_speed_rpm, 10.0 * parameters.max_torque_nm);
        let udc_v = udc_v(options, machine);
        let own = |name: &str| scenario.get(name).and_then(Value::as_f64).unwrap_or(0.0);
        within(&[
            ("--dt", options.dt.unwrap_or(0.1), f64::from(CLOCK.ticks_per_s).recip(), 0.1),
            ("--udc", udc_v, 0.0, 10.0 * parameters.dc_link_max_v),
            ("--torque-scale", own("torque_scale"), -10.0, 10.0),
            ("--speed", own("speed"), -fastest_rpm, fastest_rpm),
            ("--torque", own("torque"), -most_nm, most_nm),
            ("--to", own("to"), -fastest_rpm, fastest_rpm),
        ])?;
        options.check_flaws(machine, udc_v)
    }

    fn run(
        name: &str,
        plan: Plan,
        options: &Options,
        machine: &Machine,
        supervisor: Option<&mut dyn Supervisor>,
    ) -> Result<Recording> {
        let setup = setup(&plan, options, supervisor.is_some());
        let bench = bench(plan, &setup, options, machine);
        match options.on {
            On::Host => {
                let gains = if options.own.uncompensated { Gains::WITHOUT_SIXTH } else { Gains::DEFAULT };
                let settings = Settings { clock: CLOCK, devices: devices(&setup, machine), gains };
                settings.check(machine.tables).map_err(run::refused)?;
                let ratings = &machine.tables.ratings;
                let line = setup.line.map(|times| Line::rated(ratings, times.precharge_s, times.discharge_s));
                let first = first_half_ticks(&setup, machine);
                run::traction::run_on_host(name, bench, machine.tables, settings, first, line, supervisor)
            }
            On::Qemu => {
                let patient = supervisor.as_ref().is_some_and(|supervisor| supervisor.is_typed());
                run::traction::run_in_qemu(name, bench, setup, &options.emulator(patient)?, supervisor)
            }
        }
    }

    fn figures(recording: &Recording) -> Figures {
        let mut figures = analysis::common(recording);
        figures.set("modes", analysis::modes(recording));
        figures
    }

    fn draw_recorder(recording: &Recording, page: &mut Page) {
        page.recorder(recording);
    }

    fn overview(recording: &Recording) -> Result<Option<String>> {
        report::overview(recording).map(Some)
    }
}

/// The link's voltage, in V.
fn udc_v(options: &Options, machine: &Machine) -> f64 {
    options.udc.unwrap_or(machine.folder.parameters.dc_link_nominal_v)
}

fn ticks(microseconds: f64) -> u32 {
    (microseconds * 1e-6 * f64::from(CLOCK.ticks_per_s)).round() as u32
}

fn setup(plan: &Plan, options: &Options, over_protocol: bool) -> Setup {
    let uncompensated = options.own.uncompensated;
    Setup {
        min_pulse_ticks: ticks(options.min_pulse_us),
        // What the firmware compensates.
        dead_time_ticks: if uncompensated { 0 } else { ticks(options.dead_time_us) },
        pwm_delay_ticks: ticks(options.own.pwm_delay_us),
        line: plan.line.as_ref().map(|plan| times(&plan.link)),
        over_protocol,
        uncompensated,
    }
}

fn devices(setup: &Setup, machine: &Machine) -> Devices {
    let Setup { min_pulse_ticks, dead_time_ticks, .. } = *setup;
    Devices::new(min_pulse_ticks, dead_time_ticks, machine.tables.ratings.max_switching_hz, &CLOCK)
}

fn first_half_ticks(setup: &Setup, machine: &Machine) -> u32 {
    devices(setup, machine).shortest_half_ticks + setup.pwm_delay_ticks
}

fn bench(plan: Plan, setup: &Setup, options: &Options, machine: &Machine) -> Bench {
    let flaws = options.flaws(machine.folder.parameters.trip_current_a);
    let settings = bench::Settings {
        clock: CLOCK,
        first_half_ticks: first_half_ticks(setup, machine),
        dead_time_ticks: ticks(options.dead_time_us),
        lead_s: plan.lead_s,
        duration_s: plan.duration_s,
        trace_step_s: options.dt.unwrap_or(Traction::trace_step_s(&options.own)),
        udc_v: udc_v(options, machine),
        link_steps: plan.link,
        flaws: Flaws { freeze_at_s: plan.freeze_at_s, ..flaws },
        supply: Supply::Stiff,
        injection: plan.injection,
        limits: Limits::NONE,
    };
    let plant = Plant::new(&machine.folder, plan.speed, &options.plant());
    let bench = Bench::new(plant, plan.operator, &settings);
    match plan.line {
        Some(line) => bench.with_line(line),
        None => bench,
    }
}

/// What the operator has to know of a link.
fn times(link: &DcLinkSettings) -> LineTimes {
    let seconds = |ohm: f64| (ohm * link.capacitance_f) as f32;
    LineTimes { precharge_s: seconds(link.precharge_ohm), discharge_s: seconds(link.discharge_ohm) }
}
