//! The ZS9's scenarios.

pub(super) mod cycle;
mod live;
pub(super) mod load_step;
mod patterns;
mod prelude;
pub(super) mod reverse;
mod scaled;
pub(super) mod steady;
pub(super) mod timing;

pub use live::Live;
pub use load_step::INERTIA_KG_M2;
pub use steady::SPEEDS_RPM as STEADY_SPEEDS_RPM;

use super::System;
use super::traction::flaws::{Drops, RealInverter};
use crate::analysis::{Figures, MOST_LINK_SWING};
use crate::bench::Limits;
use crate::inject::Injection;
use crate::inject::zs9::Kind;
use crate::law::LawName;
use crate::machine::Machine;
use crate::options::{On, needs, positive};
use crate::plant::zs9::{NetworkState, ZNetwork, Zs9Plant, Zs9Settings};
use crate::plant::{LineFilter, SpeedSource};
use crate::report::Page;
use crate::run::{CLOCK, Supervisor, on_host};
use crate::verdict::{Verdict, bound};
use crate::zs9::bench::{Bench, BenchSettings};
use crate::zs9::line::LineTimes;
use crate::zs9::run::{Tasks, run_in_qemu};
use crate::zs9::trace::Recording;
use crate::zs9::{Operator, figures, settings};
use anyhow::{Result, bail, ensure};
use clap::{Args, Command};
use core::f64::consts::TAU;
use serde::Serialize;
use serde_json::{Map, Value};
use tractive::control::{ControlLaw, Controller, PiLaw};
use tractive::drive::dual::{Settings, TRACKING_RAD_S};
use tractive::machine::Ratings;
use tractive::nine_switch::Scheme;
use tractive::operator::Line;
use tractive::recorder::DualRecorder;
use tractive::time::Instant;
use tractive::wire::DualSetup;

/// Largest source and link voltage that is simulated, as a multiple of the source's nominal one: the drive trips long before.
const LARGEST: f64 = 3.0;

/// Time that an injected fault is left to show before the run ends, in s.
const LEFT_S: f64 = 0.02;

/// Two motors on a Z-source nine-switch inverter.
#[derive(Clone, Copy, Debug)]
pub struct Zs9;

/// Options of all the ZS9's scenarios.
#[derive(Clone, Debug, Args, Serialize)]
pub struct Zs9Options {
    /// Carrier frequency, in Hz, 10000 or 20000.
    #[arg(long, default_value_t = 10_000, value_parser = carrier_hz, allow_negative_numbers = true)]
    pub carrier_hz: u32,
    /// Link voltage outside shoot-through, in V; default the machine's (the paper's: 667, which means a shoot-through duty of 0.2).
    #[arg(long, value_parser = positive, allow_negative_numbers = true)]
    pub uin: Option<f64>,
    /// Place of the zero vectors: s, rs, rthd, zvo, rthd-central or rthd-slide.
    #[serde(serialize_with = "scheme_name")]
    #[arg(long, default_value = "rthd", value_parser = scheme)]
    pub scheme: Scheme,
    /// Fault to inject, NAME@SECONDS: source-short, source-low, source-high, sensor-lost-1, sensor-lost-2,
    /// sensor-frozen-1, sensor-frozen-2, sensor-jump-2, overcurrent, not-finite, leg-stuck-on, leg-stuck-off,
    /// gate-driver.
    #[arg(long)]
    pub inject: Option<Injection<Kind>>,
    /// Leave the dead time uncompensated: the pulses are not corrected.
    #[arg(long)]
    pub uncompensated: bool,
    /// Threshold and slope of an IGBT, and of a diode, for the nine devices and the source's switch.
    #[arg(long, value_name = "V,MOHM,V,MOHM", allow_negative_numbers = true)]
    pub device_drop: Option<Drops>,
    /// Line filter between the source and its contactor: choke, capacitor and the resistance of both, written L_MH,C_MF,R_MOHM; without it the source is
    /// stiff.
    #[arg(long, value_name = "L_MH,C_MF,R_MOHM", allow_negative_numbers = true)]
    pub line: Option<LineFilter>,
    /// Drops, dead time, steps and noise of the current converters, ripple of the source and a warm winding at once; an option that is also
    /// given keeps its own value.
    #[arg(long)]
    pub real: bool,
}

/// Options of a run.
pub type Options = crate::options::Options<Zs9Options>;

/// A scenario's inputs.
pub struct Plan {
    /// Time before the recording, in s, in which the drive starts and settles.
    pub lead_s: f64,
    /// Length of the recording, in s.
    pub duration_s: f64,
    /// Step of the rows that figures are taken from, in s, however densely the trace is written; `None`: a carrier period.
    pub judged_step_s: Option<f64>,
    /// The rotors' drive.
    pub speeds: [SpeedSource; 2],
    /// Speeds of free rotors at the beginning, in r/min.
    pub from_rpm: [f64; 2],
    /// Operator and loads.
    pub operator: Box<dyn Operator + Send>,
    /// Edges are kept.
    pub edges: bool,
    /// The line side, if there is one; the network is then empty at first.
    pub line: Option<LineTimes>,
}

impl Plan {
    /// A plan for motors that are commanded directly; lead and length in s, speeds of free rotors at the beginning in r/min.
    pub fn driven(
        (lead_s, duration_s): (f64, f64),
        speeds: [SpeedSource; 2],
        from_rpm: [f64; 2],
        operator: impl Operator + Send + 'static,
    ) -> Self {
        Self {
            lead_s,
            duration_s,
            judged_step_s: None,
            speeds,
            from_rpm,
            operator: Box::new(operator),
            edges: true,
            line: None,
        }
    }
}

impl System for Zs9 {
    const NAME: &'static str = "zs9";
    const MACHINE: &'static str = scaled::MACHINE;
    type Own = Zs9Options;
    type Plan = Plan;
    type Recording = Recording;

    fn source_v(machine: &Machine) -> f64 {
        machine.folder.parameters.zs9_source_v
    }

    fn trace_step_s(own: &Zs9Options) -> f64 {
        f64::from(own.carrier_hz).recip()
    }

    fn tailored(command: Command) -> Command {
        let udc = "Voltage of the DC source, in V; default the machine's, the paper's 400";
        command.mut_arg("udc", |arg| arg.help(udc)).mut_arg("min_pulse_us", |arg| arg.hide(true))
    }

    fn check(options: &Options, scenario: &Map<String, Value>, machine: &Machine) -> Result<()> {
        if options.min_pulse_us.is_some() {
            bail!("--min-pulse-us: the ZS9's scenarios do not have this option");
        }
        if let Some(step_nm) = scenario.get("step").and_then(Value::as_f64) {
            scaled::check_step(step_nm, machine)?;
        }
        let (source_v, link_ref_v) = (source_v(options, machine), link_v(options, machine));
        let largest_v = LARGEST * Self::source_v(machine);
        if source_v > largest_v {
            bail!("--udc {source_v}: must be at most {largest_v} V");
        }
        check_link(link_ref_v, source_v, options, machine)?;
        let link_v = capacitor_v(options, machine);
        options.own.device_drop.unwrap_or_default().check(link_v, machine)?;
        let has_dead_time = options.own.real || options.dead_time_us > 0.0;
        needs(&[("--uncompensated", options.own.uncompensated, "--dead-time-us", has_dead_time)])?;
        options.check_flaws(machine, source_v)
    }

    fn filled(options: &Options, machine: &Machine) -> Options {
        let own = Zs9Options { uin: Some(link_v(options, machine)), ..options.own.clone() };
        if !own.real {
            return Options { run: options.run.clone(), own };
        }
        let inverter = RealInverter { link_v: capacitor_v(options, machine), ..RealInverter::of(machine) };
        let inverter = RealInverter { switching_hz: options.own.carrier_hz.into(), ..inverter };
        let device_drop = options.own.device_drop.or(Some(inverter.drops(machine)));
        let own = Zs9Options { device_drop, ..own };
        Options { run: inverter.run(&options.run, machine), own }
    }

    fn run(
        name: &str,
        plan: Plan,
        options: &Options,
        machine: &Machine,
        supervisor: Option<&mut dyn Supervisor>,
    ) -> Result<Recording> {
        let line = plan.line;
        let bench = bench(plan, options, machine)?;
        let settings = settings::drive(CLOCK, options.own.carrier_hz, machine.tables);
        let told_us = if options.own.uncompensated { 0.0 } else { options.dead_time_us };
        let behind_line_filter = options.own.line.is_some_and(|filter| {
            let power_w = 2.0 * machine.folder.parameters.max_power_w;
            filter.needs_damping(power_w, source_v(options, machine))
        });
        let settings = settings::with_dead_time(settings, told_us * 1e-6)
            .behind_line_filter(behind_line_filter, machine.tables);
        settings::check(&settings, machine, machine_name(options))?;
        let (on, law) = options.choice()?;
        match on {
            On::Host => {
                let ratings = Settings::operator_ratings(&machine.tables.ratings);
                let line = line.map(|times| {
                    Line::rated(&ratings, times.precharge_s, times.discharge_s).without_chopper()
                });
                let run = OnHost { name, bench, settings, ratings, line, machine };
                match law {
                    LawName::Tractive => run.run(Controller::with_tracking(TRACKING_RAD_S), supervisor),
                    LawName::Pi => run.run(PiLaw::with_tracking(TRACKING_RAD_S), supervisor),
                }
            }
            On::Qemu => {
                let setup = DualSetup {
                    behind_line_filter,
                    carrier_ticks: settings.carrier_ticks,
                    dead_time_ticks: settings.dead_time_ticks,
                    line,
                };
                let patient = supervisor.as_ref().is_some_and(|supervisor| supervisor.is_typed());
                run_in_qemu(name, bench, setup, &options.emulator(patient)?, supervisor)
            }
        }
    }

    fn figures(recording: &Recording) -> Figures {
        figures::common(recording)
    }

    fn draw_common(recording: &Recording, page: &mut Page) {
        figures::line(page, recording);
        figures::recorder(page, recording);
        let tripped = recording.rows.iter().find_map(|row| Some((row.t_s, row.trip?)));
        if let Some((t_s, trip)) = tripped {
            page.mark(t_s, trip.fault.name(), true);
        }
    }
}

/// A run on the host, except for the control law.
struct OnHost<'a> {
    name: &'a str,
    bench: Bench,
    settings: Settings,
    ratings: Ratings,
    line: Option<Line>,
    machine: &'a Machine,
}

impl OnHost<'_> {
    /// The drive's own tasks with a law for each motor.
    fn run(self, law: impl ControlLaw + Copy, supervisor: Option<&mut dyn Supervisor>) -> Result<Recording> {
        let Self { settings, ratings, line, machine, .. } = self;
        let recorder = DualRecorder::new();
        let tasks = Tasks::with_law(law, Instant(0), machine.tables, settings).recorded_by(&recorder);
        let tasks = tasks.commanded_by(supervisor, ratings, line);
        on_host(self.name, self.bench, tasks, |index| recorder.read(index))
    }
}

fn bench(plan: Plan, options: &Options, machine: &Machine) -> Result<Bench> {
    let Plan { lead_s, duration_s, .. } = plan;
    let Zs9Options { carrier_hz, scheme, inject, .. } = options.own;
    if let Some(Injection { at_s, .. }) = inject
        && !(0.0..=duration_s - LEFT_S).contains(&at_s)
    {
        let latest_s = duration_s - LEFT_S;
        bail!("--inject at {at_s} s: must be from 0 to {latest_s:.2} s: the run ends at {duration_s} s");
    }
    let judged_step_s = plan.judged_step_s.unwrap_or(Zs9::trace_step_s(&options.own));
    let written_step_s = options.dt.unwrap_or(judged_step_s);
    let (shortest_s, longest_s) = (CLOCK.tick_s, duration_s);
    if written_step_s < f64::from(shortest_s) || written_step_s > longest_s {
        bail!("--dt {written_step_s}: must be a number from {shortest_s} to {longest_s}");
    }
    let (source_v, link_ref_v) = (source_v(options, machine), link_v(options, machine));
    let network = ZNetwork::of(&machine.folder.parameters);
    let drops = options.own.device_drop.unwrap_or_default().devices();
    let motors = [options.plant(); 2];
    let plant_settings = Zs9Settings { network, source_v, motors, drops, ..Zs9Settings::default() };
    let mut plant = Zs9Plant::new([&machine.folder; 2], plan.speeds, &plant_settings);
    // A network above its source swings until the pulses begin, and a line filter would swing with it.
    let capacitor_v = if options.own.line.is_some() { source_v } else { 0.5 * (link_ref_v + source_v) };
    plant.network = NetworkState::even(0.0, capacitor_v);
    for (motor, rpm) in plant.motors.iter_mut().zip(plan.from_rpm) {
        motor.set_speed_rpm(rpm);
    }
    let settings = BenchSettings {
        drive: settings::drive(CLOCK, carrier_hz, machine.tables),
        lead_s,
        duration_s,
        trace_step_s: judged_step_s,
        link_ref_v,
        scheme,
        flaws: options.flaws(machine.folder.parameters.trip_current_a),
        injection: inject,
        limits: Limits::NONE,
        edges: plan.edges,
        dead_time_s: options.dead_time_us * 1e-6,
    };
    let bench = Bench::new(plant, plan.operator, settings).with_line(plan.line).behind(options.own.line);
    Ok(if written_step_s == judged_step_s { bench } else { bench.writing_every(written_step_s) })
}

/// The check that shoot-through can make this link voltage, in V, of the source's, in V. The error names the option, or the machine's file and key.
fn check_link(link_ref_v: f64, source_v: f64, options: &Options, machine: &Machine) -> Result<()> {
    let duty = settings::drive(CLOCK, options.own.carrier_hz, machine.tables).link.duty_max;
    let most_v = (source_v / (1.0 - 2.0 * f64::from(duty))).min(LARGEST * Zs9::source_v(machine));
    let place = || settings::place(machine, machine_name(options), "zs9_link_v");
    let name = if options.own.uin.is_some() { "--uin".to_owned() } else { place() + "zs9_link_v" };
    ensure!(
        (source_v..=most_v).contains(&link_ref_v),
        "{name} {link_ref_v}: must be from the source's {source_v} V to {most_v:.0} V, which a shoot-through duty of {duty} makes of it"
    );
    Ok(())
}

/// The machine's name, or its folder.
fn machine_name(options: &Options) -> &str {
    options.machine.as_deref().unwrap_or(Zs9::MACHINE)
}

/// Voltage of the source, in V.
fn source_v(options: &Options, machine: &Machine) -> f64 {
    options.udc.unwrap_or(Zs9::source_v(machine))
}

/// Link voltage that is wanted outside shoot-through, in V.
pub fn link_v(options: &Options, machine: &Machine) -> f64 {
    options.own.uin.unwrap_or(machine.folder.parameters.zs9_link_v)
}

/// Capacitor voltage that is wanted, in V: the link's pulses are made of it.
fn capacitor_v(options: &Options, machine: &Machine) -> f64 {
    0.5 * (link_v(options, machine) + source_v(options, machine))
}

/// Free rotors, with the loads that the operator gives.
pub fn free(inertia_kg_m2: f64) -> [SpeedSource; 2] {
    [(); 2].map(|()| SpeedSource::Inertia { inertia_kg_m2, load_nm: 0.0 })
}

/// Figures of the link, whose voltage moves by design while the capacitors damp a line filter.
const OF_THE_LINK: [&str; 2] = ["link_deviation_percent", "capacitor_overshoot_percent"];
/// Frequency of the line's ripple, in Hz, from which on it does not make a filter swing: the six pulses of a rectifier on 50 Hz.
const RECTIFIER_HZ: f64 = 300.0;

/// Verdicts on figures: the quantity with its unit, the figure's name, the bound. The paper shows curves without numbers. With flaws, or with a
/// link below the machine's own, figures are only reported, because the link's are farther off there; behind a line filter, those of the link; but a
/// filter must not swing for ever. If nothing was injected, a figure that never came falls short of any bound; a fault that was injected must be
/// latched.
pub fn judge(
    figures: &Figures,
    options: &Options,
    machine: &Machine,
    bounds: &[(&str, &str, f64)],
) -> Vec<Verdict> {
    let has_link = link_v(options, machine) >= machine.folder.parameters.zs9_link_v;
    let judged = has_link && options.own.device_drop.is_none();
    let verdict = |(what, name, at_most): &(&str, &str, f64)| {
        let judged = judged && (options.own.line.is_none() || !OF_THE_LINK.contains(name));
        let at_most = if judged { bound(options, *at_most, f64::INFINITY) } else { f64::INFINITY };
        let verdict = Verdict::at_most(what, figures.number(name), at_most);
        if options.own.inject.is_some() { verdict } else { verdict.wanted() }
    };
    // A fault's effect and the ripple of a single-phase line make it swing.
    let swings = options.own.inject.is_some()
        || options.udc_ripple.is_some_and(|ripple| ripple.frequency_hz < RECTIFIER_HZ);
    let swing = figures.number(figures::SOURCE_SWING).map(|percent| {
        let at_most = if swings { f64::INFINITY } else { 100.0 * MOST_LINK_SWING };
        Verdict::at_most("swing of the source that is left in %", percent, at_most)
    });
    let unfelt = figures.get("fault_value").is_none();
    let injected = options.own.inject.map(|_| Verdict::never("the injected fault had no effect", unfelt));
    injected.into_iter().chain(bounds.iter().map(verdict)).chain(swing).collect()
}

/// A speed in rad/s.
pub fn rad_s(rpm: f64) -> f64 {
    rpm * TAU / 60.0
}

/// 0 before `from`, 1 after `to`, and a straight line between them.
pub fn ramp(t_s: f64, from_s: f64, to_s: f64) -> f64 {
    ((t_s - from_s) / (to_s - from_s)).clamp(0.0, 1.0)
}

fn scheme(text: &str) -> Result<Scheme, String> {
    let found = Scheme::ALL.into_iter().find(|scheme| scheme.name() == text);
    found.ok_or_else(|| format!("must be one of {}", Scheme::ALL.map(Scheme::name).join(", ")))
}

fn scheme_name<S: serde::Serializer>(scheme: &Scheme, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(scheme.name())
}

fn carrier_hz(text: &str) -> Result<u32, String> {
    match text.parse() {
        Ok(hz @ (10_000 | 20_000)) => Ok(hz),
        _ => Err("must be 10000 or 20000".to_owned()),
    }
}
