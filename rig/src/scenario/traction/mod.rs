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
pub mod identification;
mod line;
pub(super) mod line_limits;
pub(super) mod link_steps;
mod live;
pub(super) mod load_steps;
pub(super) mod mode_borders;
pub(super) mod precharge;
mod prelude;
pub(super) mod restart;
pub(super) mod reversal;
mod script;
pub(super) mod start;
pub(super) mod steady;
pub(super) mod sweep;
pub mod switches;
pub(super) mod timing;
pub(super) mod wheel;

pub use ablated::Part;
pub use line::scaled as scaled_link;
pub use live::{Command, Live, Start, Turning, Wanted};
pub use sweep::Sweep;

use super::System;
use crate::analysis::{self, Figures};
use crate::bench::{self, Bench, Encoder, Flaws, Limits, LinePlan, Operator, Simulated, Supply, Wiring};
use crate::inject::Injection;
use crate::inject::traction::Kind;
use crate::law::LawName;
use crate::machine::Machine;
use crate::options::{On, finite, not_negative, usual_min_pulse_us, within};
use crate::plant::{DcLinkSettings, FilteredLink, LineFilter, Plant, Source, SpeedSource};
use crate::report::{self, Page};
use crate::run::traction::{OnBench, Tasks, Together, run_in_qemu};
use crate::run::{self, CLOCK, Progress, Supervisor};
use crate::trace::Recording;
use ablated::Ablated;
use anyhow::{Result, bail, ensure};
use clap::{Args, ValueEnum};
use flaws::{Beside, Filled, FlawOptions};
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};
use tractive::control::{ControlLaw, Controller, Demand, Gains, MtpaStart, PiLaw};
use tractive::drive::traction::Settings;
use tractive::modulation::{FREE_CARRIER_SHARE, Ladder, SwitchLimits};
use tractive::operator::{Line, LineTimes, TrainLimits};
use tractive::recorder::Recorder;
use tractive::time::{Clock, Instant};
use tractive::wire::{self, Setup};
use tractive_tablegen::Patterns;

/// The usual lead, in s.
const LEAD_S: f64 = 0.1;

/// Step of the trace unless a scenario needs a finer one, in s.
const STEP_S: f64 = 50e-6;

/// The PMaSynRM drive.
#[derive(Clone, Copy, Debug)]
pub struct Traction;

/// The point whose inductances the first pass of MTPA takes under `--law pi`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum StartName {
    /// That of the operating point before
    Previous,
    /// No current, as we read the paper
    Zero,
}

impl StartName {
    /// As the law takes it.
    const fn of(self) -> MtpaStart {
        match self {
            Self::Previous => MtpaStart::Previous,
            Self::Zero => MtpaStart::Zero,
        }
    }
}

/// The pulse patterns that the drive uses above the free carrier.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum PatternsName {
    /// The paper's modes
    Paper,
    /// Optimised patterns of 15 to 3 pulses
    Optimal,
}

impl TractionOptions {
    /// Age of the angle that the drive is told, in s.
    fn known_late_s(&self) -> f32 {
        let mean_us = self.angle_late_us - 0.5 * self.flaws.angle_jitter_us;
        if self.angle_late_known { (1e-6 * mean_us) as f32 } else { 0.0 }
    }

    /// Delay of the currents that the drive is told, in ticks: the sensors' time constant, and by how much all phases together are sampled early.
    fn known_filter_ticks(&self) -> u32 {
        if self.current_filter_known { ticks(self.current_filter_us + self.flaws.mean_skew_us()) } else { 0 }
    }

    /// Share of the iron loss that the drive is told, in thousandths.
    fn known_iron_permille(&self, machine: &Machine) -> u32 {
        let known = if self.iron_loss_known {
            self.flaws.iron_loss / 100.0
        } else {
            machine.folder.parameters.iron_loss_share
        };
        (1e3 * known).round() as u32
    }

    /// Mean threshold and slope of the devices that the drive is told, in mV and hundredths of a mΩ.
    fn known_drops(&self) -> (u32, u32) {
        let drops = self.flaws.drops();
        let steps = |igbt: f64, diode: f64, per: f64| (0.5 * per * (igbt + diode)).round() as u32;
        let known = (steps(drops.igbt_v, drops.diode_v, 1e3), steps(drops.igbt_ohm, drops.diode_ohm, 1e5));
        if self.flaws.device_drop_known { known } else { (0, 0) }
    }
}

impl From<Patterns> for PatternsName {
    fn from(patterns: Patterns) -> Self {
        match patterns {
            Patterns::Paper => Self::Paper,
            Patterns::Optimal => Self::Optimal,
        }
    }
}

impl PatternsName {
    /// The patterns of a run: those that its options name, else the machine's.
    pub fn of(options: &TractionOptions, machine: &Machine) -> Self {
        options.patterns.unwrap_or_else(|| machine.folder.parameters.patterns.into())
    }

    /// As the modulator's schedule takes them.
    pub(crate) const fn ladder(self) -> Ladder {
        match self {
            Self::Paper => Ladder::PAPER,
            Self::Optimal => Ladder::OPTIMAL,
        }
    }

    /// Highest frequency of the free carrier, as a share of the switches'.
    pub(crate) const fn free_carrier_share(self) -> f32 {
        match self {
            Self::Paper => 1.0,
            Self::Optimal => FREE_CARRIER_SHARE,
        }
    }

    /// As on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Paper => "paper",
            Self::Optimal => "optimal",
        }
    }
}

/// Options of all its scenarios.
#[derive(Clone, Debug, Args, Serialize)]
pub struct TractionOptions {
    /// With --law pi: the point whose inductances the first of the two passes of MTPA takes.
    #[arg(long, value_enum, default_value = "previous", value_name = "POINT")]
    pub mtpa_start: StartName,
    /// The pulse patterns above the free carrier; without it those that machine.toml names, else the paper's.
    #[arg(long, value_enum)]
    pub patterns: Option<PatternsName>,
    /// A part of the project's own law to take away, to see what it buys; on the host.
    #[arg(long, value_enum, value_name = "PART")]
    pub ablate: Option<Part>,
    /// Leave the dead time uncompensated: neither the pulses are corrected nor is the sixth harmonic of the voltage followed.
    #[arg(long)]
    pub uncompensated: bool,
    /// Rate of the control interrupt, in Hz; without it 10,000, or 20,000 for a machine whose devices switch faster than 10 kHz.
    #[arg(long, value_parser = clap::value_parser!(u32).range(1_000..=100_000))]
    pub control_hz: Option<u32>,
    /// Line filter between a stiff source and the link: choke, link capacitor and the resistance of both, written L_MH,C_MF,R_MOHM;
    /// without it the link itself is stiff.
    #[arg(long, value_name = "L_MH,C_MF,R_MOHM", allow_negative_numbers = true)]
    pub line: Option<LineFilter>,
    /// Drives behind that line filter: the same ones with the same demand, each further one's wheels larger by a percent, so that its speed is lower.
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=4), value_name = "NUMBER")]
    pub drives: u32,
    /// Error of the angle sensor that goes once with the electrical angle, amplitude in electrical degrees.
    #[arg(long, default_value_t = 0.0, value_parser = finite, allow_negative_numbers = true, value_name = "DEG")]
    pub angle_1f_deg: f64,
    /// The same that goes twice with it.
    #[arg(long, default_value_t = 0.0, value_parser = finite, allow_negative_numbers = true, value_name = "DEG")]
    pub angle_2f_deg: f64,
    /// Age of the angle when it is read, in µs.
    #[arg(long, default_value_t = 0.0, value_parser = not_negative, allow_negative_numbers = true, value_name = "US")]
    pub angle_late_us: f64,
    /// Lines of the position encoder in a turn of the shaft, four counts each; without it the angle has no steps.
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..), value_name = "LINES")]
    pub encoder_lines: Option<u32>,
    /// Time constant of the current sensors, in µs.
    #[arg(long, default_value_t = 0.0, value_parser = not_negative, allow_negative_numbers = true, value_name = "US")]
    pub current_filter_us: f64,
    /// The drive knows of --angle-late-us and of the mean of --angle-jitter-us, as by its power stage's key, and makes up for them.
    #[arg(long)]
    pub angle_late_known: bool,
    /// The drive knows of --current-filter-us and of the mean of --adc-skew-us, as by its power stage's key, and makes up for them.
    #[arg(long)]
    pub current_filter_known: bool,
    /// The drive knows of --iron-loss, as by its machine's key, and makes up for it, up to 100 %; --law pi does not.
    #[arg(long)]
    pub iron_loss_known: bool,
    /// The true machine, where it is not the one that control knows: a folder of tables/, or the path of any machine folder.
    #[arg(long, value_name = "DIR")]
    pub plant: Option<String>,
    /// By how much currents are read larger than they are, in percent.
    #[arg(long, default_value_t = 0.0, value_parser = finite, allow_negative_numbers = true, value_name = "PERCENT")]
    pub current_gain: f64,
    /// By how much the DC link is read larger than it is, in percent.
    #[arg(long, default_value_t = 0.0, value_parser = finite, allow_negative_numbers = true, value_name = "PERCENT")]
    pub udc_gain: f64,
    /// The phase that each of the three current sensors reads, with - where its leads are exchanged.
    #[arg(long, default_value_t, allow_hyphen_values = true, value_name = "U,V,W")]
    pub current_sensors: Wiring,
    /// The angle sensor counts the wrong way.
    #[arg(long)]
    pub angle_reversed: bool,
    /// Torque of friction of a free rotor against either direction, in N·m.
    #[arg(long, default_value_t = 0.0, value_parser = not_negative, allow_negative_numbers = true, value_name = "NM")]
    pub friction: f64,
    /// By how much the PWM timer starts later, in µs.
    #[arg(long, default_value_t = 0.0, value_parser = not_negative, allow_negative_numbers = true, hide = true)]
    pub pwm_delay_us: f64,
    /// Further flaws.
    #[serde(flatten)]
    #[command(flatten)]
    pub flaws: FlawOptions,
}

/// Options of a run.
pub type Options = crate::options::Options<TractionOptions>;

/// A scenario's inputs.
pub struct Plan {
    /// Time in which the drive settles before the recording begins, in s.
    pub lead_s: f64,
    /// Length of the recording, in s.
    pub duration_s: f64,
    /// Step of the rows that figures are taken from, in s, however densely the trace is written.
    pub judged_step_s: f64,
    /// The rotor's drive, from the run's beginning on.
    pub speed: SpeedSource,
    /// DC-link voltages: (time in s, V), each from its time on; the run's own before the first.
    pub link: Vec<(f64, f64)>,
    /// The operator.
    pub operator: Box<dyn Operator + Send>,
    /// The line side, where the scenario is about it; otherwise the link is stiff and the drive is commanded directly.
    pub line: Option<LinePlan>,
    /// The operator's limits of line and acceleration.
    pub train: TrainLimits,
    /// The fault, if there is one.
    pub injection: Option<Injection<Kind>>,
    /// From this time on control is told the same currents again and again, in s.
    pub freeze_at_s: Option<f64>,
    /// The incremental encoder that the rotor has in the place of an absolute one.
    pub encoder: Option<Encoder>,
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
            judged_step_s: STEP_S,
            speed: SpeedSource::profile(later),
            link: Vec::new(),
            operator: Box::new(operator),
            line: None,
            train: TrainLimits::NONE,
            injection: None,
            freeze_at_s: None,
            encoder: None,
        }
    }

    /// The same with a line filter in front of the link's contactors, where the scenario has them.
    fn behind(mut self, filter: Option<LineFilter>) -> Self {
        if let (Some(line), Some(filter)) = (&mut self.line, filter) {
            let LineFilter { inductance_h, resistance_ohm, capacitance_f } = filter;
            let source = Source { inductance_h, resistance_ohm, ..line.link.source };
            line.link = DcLinkSettings { capacitance_f, source, ..line.link };
        }
        self
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
        STEP_S
    }

    fn min_pulse_us(machine: &Machine) -> f64 {
        usual_min_pulse_us(machine.folder.parameters.max_switching_hz)
    }

    fn check(options: &Options, scenario: &Map<String, Value>, machine: &Machine) -> Result<()> {
        let parameters = &machine.folder.parameters;
        let (fastest_rpm, most_nm) = (3.0 * parameters.max_speed_rpm, 10.0 * parameters.max_torque_nm);
        let (udc_v, clock) = (udc_v(options, machine), clock(options, machine));
        let shortest_half_us = 0.5e6 / parameters.max_switching_hz;
        let fastest_rad_s =
            parameters.max_speed_rpm * std::f64::consts::PI / 30.0 * f64::from(parameters.pole_pairs);
        // A drive that knows the filter takes it for a delay.
        let most_known_us = shortest_half_us.min(0.3e6 / fastest_rad_s);
        let own = |name: &str| scenario.get(name).and_then(Value::as_f64).unwrap_or(0.0);
        let (switching_hz, control_hz) = (parameters.max_switching_hz, control_hz(options, machine));
        // A carrier lasts a control period at least.
        ensure!(
            (50.0..=f64::from(control_hz)).contains(&switching_hz),
            "max_switching_hz {switching_hz}: must be from 50 to {control_hz}, the rate of control: see --control-hz"
        );
        within(&[
            ("--dt", options.dt.unwrap_or(0.1), f64::from(clock.ticks_per_s).recip(), 0.1),
            ("--udc", udc_v, 0.0, 10.0 * parameters.dc_link_max_v),
            ("--torque-scale", own("torque_scale"), -10.0, 10.0),
            ("--speed", own("speed"), -fastest_rpm, fastest_rpm),
            ("--torque", own("torque"), -most_nm, most_nm),
            ("--to", own("to"), -fastest_rpm, fastest_rpm),
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
        options.check_flaws(machine, udc_v)
    }

    fn filled(options: &Options, machine: &Machine) -> Options {
        filled(options, machine)
    }

    fn run(
        name: &str,
        plan: Plan,
        options: &Options,
        machine: &Machine,
        supervisor: Option<&mut dyn Supervisor>,
    ) -> Result<Recording> {
        let mut plan = plan.behind(options.own.line);
        let setup = setup(&plan, options, machine, supervisor.is_some());
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

/// The options with everything that `--real` stands for.
fn filled(options: &Options, machine: &Machine) -> Options {
    let own = &options.own;
    if !own.flaws.real {
        return options.clone();
    }
    let TractionOptions { udc_gain, current_filter_us, angle_1f_deg, angle_2f_deg, .. } = *own;
    let beside = Beside { udc_gain, current_filter_us, angle_deg: [angle_1f_deg, angle_2f_deg] };
    let Filled { run, beside, flaws } = Filled::of(&options.run, beside, &own.flaws, machine);
    let Beside { udc_gain, current_filter_us, angle_deg: [angle_1f_deg, angle_2f_deg] } = beside;
    let own = TractionOptions {
        udc_gain,
        current_filter_us,
        current_filter_known: true,
        angle_late_known: true,
        iron_loss_known: true,
        angle_1f_deg,
        angle_2f_deg,
        flaws,
        ..own.clone()
    };
    Options { run, own }
}

/// A run on the host, but for the control law.
struct OnHost<'a> {
    name: &'a str,
    bench: Bench,
    beside: Vec<Bench>,
    setup: &'a Setup,
    options: &'a Options,
    machine: &'a Machine,
}

impl OnHost<'_> {
    /// The drive's own tasks with a law; with other drives on the same link each its own.
    fn run(self, law: impl ControlLaw + Copy, supervisor: Option<&mut dyn Supervisor>) -> Result<Recording> {
        let Self { setup, options, machine, .. } = self;
        let recorder = Recorder::new();
        let of_drive = || tasks(law, setup, options, machine);
        let tasks = of_drive()?.recorded_by(&recorder).commanded_by(supervisor);
        let record = |index| recorder.read(index);
        let Some(filter) = options.own.line.filter(|_| !self.beside.is_empty()) else {
            return run::on_host(self.name, self.bench, tasks, record);
        };
        let others = self.beside.into_iter().map(|bench| Ok(OnBench { bench, tasks: of_drive()? }));
        let mut together = Together {
            link: FilteredLink::new(filter, udc_v(options, machine)),
            first: OnBench { bench: self.bench, tasks },
            others: others.collect::<Result<_>>()?,
        };
        let mut progress = Progress::new(self.name);
        together.drive(|done| progress.show(done))?;
        let beside = together.others.into_iter().map(|drive| drive.bench.into_recording(Vec::new()));
        let recording = together.first.bench.into_recording((0..).map_while(record).collect());
        Ok(Recording { beside: beside.collect(), ..recording })
    }
}

/// The benches of the other drives on the same line: of the same plan, but for their wheels, their rotors' angles and their noise.
fn beside(
    plan: &mut Plan,
    setup: &Setup,
    options: &Options,
    machines: (&Machine, &Machine),
) -> Result<Vec<Bench>> {
    let count = options.own.drives;
    if count == 1 {
        return Ok(Vec::new());
    }
    if plan.line.is_some() {
        drives::alone(count)?;
    }
    let nobody = |_: f64| (Demand::default(), false);
    let shared = drives::Shared::new(std::mem::replace(&mut plan.operator, Box::new(nobody)));
    plan.operator = shared.operator();
    let benches = (1..count).map(|number| {
        let mut others = options.clone();
        others.run.seed = options.seed.wrapping_add(number.into());
        let plan = Plan {
            speed: drives::speed(&plan.speed, number),
            link: plan.link.clone(),
            operator: shared.operator(),
            ..Plan::driven(plan.lead_s, plan.duration_s, Vec::new(), nobody)
        };
        let mut bench = bench(plan, setup, &others, machines).without_edges();
        bench.plant_mut().motor.rotor_mut().turn_to(drives::turns(number));
        bench
    });
    Ok(benches.collect())
}

/// A speed of the machine that the scenarios were written for, in r/min, as the same share of this machine's largest one.
fn scaled_rpm(speed_rpm: f64, machine: &Machine) -> f64 {
    speed_rpm * (machine.folder.parameters.max_speed_rpm / 6000.0)
}

/// A torque of that machine, in N·m, as the same share of this machine's largest one.
fn scaled_nm(torque_nm: f64, machine: &Machine) -> f64 {
    torque_nm * (machine.folder.parameters.max_torque_nm / 1235.0)
}

/// A speed of a machine rated at 2,000 r/min, in r/min, as the same share of this machine's rated one.
fn of_rated_rpm(speed_rpm: f64, machine: &Machine) -> f64 {
    speed_rpm * (machine.folder.parameters.rated_speed_rpm / 2_000.0)
}

/// Voltage of the machine without current at a speed in r/min, peak between lines, in V.
pub(crate) fn emf_v(speed_rpm: f64, machine: &Machine) -> f64 {
    let turns_s = speed_rpm.abs() / 60.0 * f64::from(machine.folder.parameters.pole_pairs);
    3.0_f64.sqrt() * core::f64::consts::TAU * turns_s * f64::from(machine.tables.ratings.magnet_flux_wb)
}

/// Ratio of this machine's stator frequencies to those of the machine that the scenarios were written for, at least 1: a ramp over the
/// same share of the speed takes so much longer, or it would count as a lost angle.
fn ramp_scale(machine: &Machine) -> f64 {
    let parameters = &machine.folder.parameters;
    let speeds = (parameters.max_speed_rpm / 6000.0).max(parameters.rated_speed_rpm / 2000.0);
    (speeds * (f64::from(parameters.pole_pairs) / 4.0)).max(1.0)
}

/// A time in which torque changes, over that of the machine that the scenarios were written for: as the link drives flux linkage into the
/// machine, for which full power over full torque is the measure, or as carriers follow each other, whichever is slower.
fn time_scale(machine: &Machine) -> f64 {
    let parameters = &machine.folder.parameters;
    let omega = |power_w: f64, torque_nm: f64, pole_pairs: f64| power_w / torque_nm * pole_pairs;
    let own = omega(parameters.max_power_w, parameters.max_torque_nm, f64::from(parameters.pole_pairs));
    let flux = omega(246.4e3, 1235.0, 4.0) / own;
    flux.max(900.0 / parameters.max_switching_hz)
}

/// Step of the rows that a carrier's mean is taken from, in s: as many in a carrier as at 900 Hz, at least.
fn carrier_step_s(machine: &Machine) -> f64 {
    // Whole ticks each.
    const PARTS: [u32; 6] = [1, 2, 5, 10, 25, 50];
    let carriers = machine.folder.parameters.max_switching_hz / 900.0;
    let parts = PARTS.into_iter().find(|parts| f64::from(*parts) >= carriers).unwrap_or(125);
    STEP_S / f64::from(parts)
}

/// The link's voltage, in V.
fn udc_v(options: &Options, machine: &Machine) -> f64 {
    options.udc.unwrap_or(machine.folder.parameters.dc_link_nominal_v)
}

fn ticks(microseconds: f64) -> u32 {
    (microseconds * 1e-6 * f64::from(CLOCK.ticks_per_s)).round() as u32
}

/// The rate of control, in Hz.
fn control_hz(options: &Options, machine: &Machine) -> u32 {
    options.own.control_hz.unwrap_or(Clock::control_hz(machine.tables.ratings.max_switching_hz))
}

fn clock(options: &Options, machine: &Machine) -> Clock {
    run::clock(control_hz(options, machine))
}

fn setup(plan: &Plan, options: &Options, machine: &Machine, over_protocol: bool) -> Setup {
    let uncompensated = options.own.uncompensated;
    let (threshold_mv, slope_10uohm) = options.own.known_drops();
    Setup {
        control_ticks: clock(options, machine).control_ticks,
        min_pulse_ticks: ticks(options.min_pulse_us(machine.folder.parameters.max_switching_hz)),
        // What the firmware compensates.
        dead_time_ticks: if uncompensated { 0 } else { ticks(options.dead_time_us) },
        pwm_delay_ticks: ticks(options.own.pwm_delay_us),
        line: plan.line.as_ref().map(|plan| times(&plan.link)),
        over_protocol,
        uncompensated,
        behind_line_filter: options.own.line.is_some() || plan.line.as_ref().is_some_and(LinePlan::has_choke),
        angle_late_s: options.own.known_late_s(),
        angle_step_rad: angle_step_rad(options, machine),
        current_filter_ticks: options.own.known_filter_ticks(),
        threshold_mv,
        slope_10uohm,
        iron_permille: options.own.known_iron_permille(machine),
        train: plan.train,
    }
}

/// Step of the encoder's counts, electrical, in rad; 0 without an encoder.
fn angle_step_rad(options: &Options, machine: &Machine) -> f32 {
    let counts = options.own.encoder_lines.map(|lines| lines.saturating_mul(4));
    counts.map_or(0.0, |counts| Settings::step_rad(counts, machine.tables.ratings.pole_pairs))
}

fn devices(setup: &Setup, options: &Options, machine: &Machine) -> SwitchLimits {
    let Setup { control_ticks, min_pulse_ticks, dead_time_ticks, .. } = *setup;
    let clock = Clock { control_ticks, ..CLOCK };
    let carrier_hz = PatternsName::of(&options.own, machine).free_carrier_share()
        * machine.tables.ratings.max_switching_hz;
    SwitchLimits::new(min_pulse_ticks, dead_time_ticks, carrier_hz, &clock)
}

fn first_half_ticks(setup: &Setup, options: &Options, machine: &Machine) -> u32 {
    devices(setup, options, machine).shortest_half_ticks + setup.pwm_delay_ticks
}

/// The drive that an image with this law and this setup would be, and its operator.
fn tasks<'a, L: ControlLaw>(
    law: L,
    setup: &Setup,
    options: &Options,
    machine: &Machine,
) -> Result<Tasks<'a, L>> {
    let gains = Gains::of(setup.uncompensated, setup.behind_line_filter);
    let devices = devices(setup, options, machine);
    let settings = Settings {
        angle_late_s: setup.angle_late_s,
        angle_step_rad: setup.angle_step_rad,
        current_filter_ticks: setup.current_filter_ticks,
        drops: setup.drops(),
        iron_share: setup.iron_share(),
        gains,
        ..Settings::new(clock(options, machine), devices)
    };
    settings.check(machine.tables).map_err(run::refused)?;
    let ratings = &machine.tables.ratings;
    let line = setup.line.map(|times| Line::rated(ratings, times.precharge_s, times.discharge_s));
    let first = first_half_ticks(setup, options, machine);
    let tasks = Tasks::with_law(law, Instant(0), machine.tables, settings, first);
    Ok(tasks.on(PatternsName::of(&options.own, machine).ladder()).operated_on(line).limited_to(setup.train))
}

/// The true machine: the one that control knows, unless the options name another.
fn truth(options: &Options, machine: &Machine) -> Result<Machine> {
    options.own.plant.as_deref().map_or_else(|| Ok(machine.clone()), Machine::load)
}

/// The bench with the machine that control knows, and the true one.
fn bench(plan: Plan, setup: &Setup, options: &Options, (machine, truth): (&Machine, &Machine)) -> Bench {
    let flaws = options.flaws(machine.folder.parameters.trip_current_a);
    let pole_pairs = f64::from(machine.folder.parameters.pole_pairs);
    let own = &options.own.flaws;
    let settings = bench::Settings {
        clock: clock(options, machine),
        first_half_ticks: first_half_ticks(setup, options, machine),
        dead_time_ticks: ticks(options.dead_time_us),
        lead_s: plan.lead_s,
        duration_s: plan.duration_s,
        trace_step_s: plan.judged_step_s,
        udc_v: udc_v(options, machine),
        link_steps: plan.link,
        flaws: Flaws {
            current_offsets_a: own.offsets().map(|share| share * flaws.adc_full_scale_a),
            current_gains: own.gains(),
            angle_jitter_s: 1e-6 * own.angle_jitter_us,
            angle_harmonics_deg: [options.own.angle_1f_deg, options.own.angle_2f_deg],
            angle_phases_deg: [own.angle_1f_phase_deg, own.angle_2f_phase_deg],
            angle_late_s: 1e-6 * options.own.angle_late_us,
            angle_counts: options.own.encoder_lines.map(|lines| 4.0 * f64::from(lines) / pole_pairs),
            current_filter_s: 1e-6 * options.own.current_filter_us,
            adc_skew_s: own.skew_s(),
            freeze_at_s: plan.freeze_at_s,
            current_gain: options.own.current_gain / 100.0,
            udc_gain: options.own.udc_gain / 100.0,
            current_wiring: options.own.current_sensors,
            angle_reversed: options.own.angle_reversed,
            ..flaws
        },
        supply: match options.own.line {
            Some(_) if options.own.drives > 1 => Supply::Shared,
            Some(filter) => Supply::Line(filter),
            None => Supply::Stiff,
        },
        injection: plan.injection,
        limits: Limits::NONE,
    };
    let deviations = own.plant(options.plant(), truth.folder.parameters.rotor_inertia_kg_m2);
    let mut plant = Plant::new(&truth.folder, plan.speed, &deviations);
    plant.motor.rotor_mut().set_friction_nm(options.own.friction);
    if let Some(encoder) = plan.encoder {
        plant.motor.rotor_mut().turn_to(encoder.turns());
    }
    let bench = Bench::new(plant, plan.operator, &settings).with_line(plan.line).with_encoder(plan.encoder);
    match options.dt {
        Some(dt_s) if dt_s != plan.judged_step_s => bench.writing_every(dt_s),
        _ => bench,
    }
}

/// Time constants of a link, as the operator has to know them.
fn times(link: &DcLinkSettings) -> LineTimes {
    let seconds = |ohm: f64| (ohm * link.capacitance_f) as f32;
    LineTimes { precharge_s: seconds(link.precharge_ohm), discharge_s: seconds(link.discharge_ohm) }
}
