//! The PMaSynRM drive's scenarios.

mod ablated;
pub(super) mod acknowledge;
pub(super) mod borders_timing;
pub mod characteristic;
pub(super) mod chopper;
mod drives;
pub mod flaws;
pub(super) mod full_step;
pub(super) mod gaps;
mod host;
pub mod identification;
mod line;
pub(super) mod line_limits;
pub(super) mod link_steps;
mod live;
pub(super) mod load_steps;
pub(super) mod mode_borders;
mod options;
mod plan;
pub(super) mod precharge;
mod prelude;
pub(super) mod restart;
pub(super) mod reversal;
mod scaled;
mod script;
mod setup;
pub(super) mod start;
pub(super) mod steady;
pub(super) mod sweep;
pub mod switches;
pub(super) mod timing;
pub(super) mod wheel;

pub use ablated::Part;
pub use line::{fed as fed_link, scaled as scaled_link};
pub use live::{Command, Live, Start, Turning, Wanted};
pub use options::{Options, PatternsName, StartName, TractionOptions};
pub use plan::Plan;
pub(crate) use scaled::emf_v;
pub use sweep::Sweep;

use super::System;
use crate::analysis::{self, Figures};
use crate::law::LawName;
use crate::machine::Machine;
use crate::options::{On, needs, usual_min_pulse_us, within};
use crate::plant::SpeedSource;
use crate::report::{self, Page};
use crate::run::Supervisor;
use crate::run::traction::run_in_qemu;
use crate::trace::Recording;
use ablated::Ablated;
use anyhow::{Result, bail, ensure};
use host::{OnHost, bench, beside, truth};
use plan::STEP_S;
use serde_json::{Map, Value};
use setup::{clock, control_hz, setup, udc_v};
use tractive::control::{Controller, PiLaw};
use tractive::wire;

/// The line filter that damping is for.
const DAMPED: &str = "--line, or a scenario's own line, whose filter needs damping";

/// The check that the true machine has the iron loss of which `--iron-loss` is a share; `--real` asks for all flaws that a machine can have.
fn check_iron(options: &Options, machine: &Machine) -> Result<()> {
    let flaws = &options.own.flaws;
    if flaws.real || flaws.iron_loss == 0.0 {
        return Ok(());
    }
    let loss_w = truth(options, machine)?.folder.parameters.loss_rated_w;
    needs(&[("--iron-loss", true, "loss_rated_w in the machine.toml of the true machine", loss_w > 0.0)])
}

/// The PMaSynRM drive.
#[derive(Clone, Copy, Debug)]
pub struct Traction;

impl System for Traction {
    const NAME: &'static str = "pmasynrm";
    const MACHINE: &'static str = "pmasynrm-180kw";
    type Own = TractionOptions;
    type Plan = Plan;
    type Recording = Recording;

    fn trace_step_s(_own: &TractionOptions) -> f64 {
        STEP_S
    }

    fn min_pulse_us(machine: &Machine) -> Option<f64> {
        Some(usual_min_pulse_us(machine.folder.parameters.max_switching_hz))
    }

    fn check(options: &Options, scenario: &Map<String, Value>, machine: &Machine) -> Result<()> {
        let parameters = &machine.folder.parameters;
        let (fastest_rpm, most_nm) = (3.0 * parameters.max_speed_rpm, 10.0 * parameters.max_torque_nm);
        let (udc_v, clock) = (udc_v(options, machine), clock(options, machine));
        let shortest_half_us = 0.5e6 / parameters.max_switching_hz;
        let fastest_rad_s =
            parameters.max_speed_rpm * std::f64::consts::PI / 30.0 * f64::from(parameters.pole_pairs);
        // A drive that knows the filter treats it as a delay.
        let most_known_us = shortest_half_us.min(0.3e6 / fastest_rad_s);
        let own_or = |name: &str, or: f64| scenario.get(name).and_then(Value::as_f64).unwrap_or(or);
        let own = |name: &str| own_or(name, 0.0);
        let sweep_rpm_s = scaled::sweep_rpm_s(machine);
        let (switching_hz, control_hz) = (parameters.max_switching_hz, control_hz(options, machine));
        // A carrier lasts at least a control period.
        ensure!(
            (50.0..=f64::from(control_hz)).contains(&switching_hz),
            "max_switching_hz {switching_hz}: must be from 50 to {control_hz}, the rate of control: --control-hz {:.0} goes with it",
            switching_hz.ceil()
        );
        within(&[
            ("--dt", options.dt.unwrap_or(0.1), f64::from(clock.ticks_per_s).recip(), 0.1),
            ("--udc", udc_v, 0.0, 10.0 * parameters.dc_link_max_v),
            ("--torque-scale", own("torque_scale"), -10.0, 10.0),
            ("--speed", own("speed"), -fastest_rpm, fastest_rpm),
            ("--torque", own("torque"), -most_nm, most_nm),
            ("--to", own("to"), -fastest_rpm, fastest_rpm),
            ("--slope", own_or("slope", sweep_rpm_s), sweep_rpm_s / 20.0, 100.0 * sweep_rpm_s),
            ("--current-gain", options.own.current_gain, -50.0, 100.0),
            ("--udc-gain", options.own.udc_gain, -50.0, 100.0),
            ("--angle-1f-deg", options.own.angle_1f_deg, -90.0, 90.0),
            ("--angle-2f-deg", options.own.angle_2f_deg, -90.0, 90.0),
            (
                "--angle-late-us",
                options.own.angle_late_us,
                0.0,
                if options.own.angle_late_known { 500.0 } else { 1e4 },
            ),
            (
                "--current-filter-us",
                options.own.current_filter_us,
                0.0,
                if options.own.current_filter_known {
                    most_known_us - options.own.flaws.mean_skew_us()
                } else {
                    1e4
                },
            ),
        ])?;
        if (options.law, PatternsName::of(&options.own, machine), options.on)
            == (LawName::Pi, PatternsName::Optimal, On::Qemu)
        {
            bail!("--patterns optimal: no image with --law pi has them; --on host has");
        }
        if options.own.ablate.is_some() && (options.law == LawName::Pi || options.on == On::Qemu) {
            bail!("--ablate: a part is taken away from the project's own law, and on the host alone");
        }
        if options.own.drives > 1 && (options.own.line.is_none() || options.on == On::Qemu) {
            bail!("--drives {}: needs --line, and runs on the host alone", options.own.drives);
        }
        options.own.flaws.check(machine)?;
        options.own.check_needs(options.law)?;
        check_iron(options, machine)?;
        options.check_flaws(machine, udc_v)
    }

    fn filled(options: &Options, machine: &Machine) -> Options {
        options::filled(options, machine)
    }

    fn run(
        name: &str,
        plan: Plan,
        options: &Options,
        machine: &Machine,
        supervisor: Option<&mut dyn Supervisor>,
    ) -> Result<Recording> {
        let free = matches!(plan.speed, SpeedSource::Inertia { .. });
        needs(&[("--friction", options.own.friction != 0.0, "a free rotor, as of start", free)])?;
        let mut plan = plan.behind(options.own.line);
        let setup = setup(&plan, options, machine, supervisor.is_some());
        let undamped = options.own.ablate == Some(Part::Damping);
        needs(&[("--ablate damping", undamped, DAMPED, setup.behind_line_filter)])?;
        let machines = (machine, &truth(options, machine)?);
        let beside = beside(&mut plan, &setup, options, machines)?;
        let bench = bench(plan, &setup, options, machines);
        let (on, law) = options.choice()?;
        match on {
            On::Host => {
                let run = OnHost { name, bench, beside, setup: &setup, options, machine };
                match (law, options.own.ablate.filter(|_| !cfg!(target_family = "wasm"))) {
                    (LawName::Tractive, Some(part)) => run.run(Ablated::new(part), supervisor),
                    (LawName::Tractive, None) => run.run(Controller::new(), supervisor),
                    (LawName::Pi, _) => run.run(PiLaw::starting(options.own.mtpa_start.of()), supervisor),
                }
            }
            On::Qemu => {
                let patient = supervisor.as_ref().is_some_and(|supervisor| supervisor.is_typed());
                let hello = wire::setup_with_start(setup, options.own.mtpa_start.of());
                run_in_qemu(name, bench, hello, &options.emulator(patient)?, supervisor)
            }
        }
    }

    fn figures(recording: &Recording) -> Figures {
        let mut figures = analysis::common(recording);
        figures.set("modes", analysis::modes(recording));
        figures
    }

    fn draw_common(recording: &Recording, page: &mut Page) {
        page.line(recording);
        page.recorder(recording);
        page.events(recording);
    }

    fn overview(recording: &Recording) -> Result<Option<String>> {
        report::overview(recording).map(Some)
    }
}
