//! A run on the host: benches and the drives on them.

use super::setup::{clock, first_half_ticks, tasks, udc_v};
use super::{Options, Plan, drives};
use crate::bench::{self, Bench, Flaws, Limits, Simulated, Supply};
use crate::machine::Machine;
use crate::plant::{FilteredLink, Plant, PlantSettings};
use crate::run::traction::{OnBench, Together};
use crate::run::{self, Progress, Supervisor, ticks};
use crate::trace::Recording;
use anyhow::Result;
use tractive::control::{ControlLaw, Demand};
use tractive::recorder::Recorder;
use tractive::wire::Setup;

/// A run on the host, except for the control law.
pub(super) struct OnHost<'a> {
    pub name: &'a str,
    pub bench: Bench,
    pub beside: Vec<Bench>,
    pub setup: &'a Setup,
    pub options: &'a Options,
    pub machine: &'a Machine,
}

impl OnHost<'_> {
    /// The drive's own tasks with a law; other drives on the same link each have their own.
    pub fn run(
        self,
        law: impl ControlLaw + Copy,
        supervisor: Option<&mut dyn Supervisor>,
    ) -> Result<Recording> {
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

/// The benches of the other drives on the same line: of the same plan, except for their wheels, their rotors' angles and their noise.
pub(super) fn beside(
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

/// The true machine: the one that control knows, unless the options name another.
pub(super) fn truth(options: &Options, machine: &Machine) -> Result<Machine> {
    options.own.plant.as_deref().map_or_else(|| Ok(machine.clone()), Machine::load)
}

/// The folder of the true machine, with the deviations that the options name, under the tables that control knows. If the folder is gone since the run, it
/// is that of the machine that control knows.
pub(super) fn true_machine(options: &Options, machine: &Machine) -> Machine {
    let truth = truth(options, machine).unwrap_or_else(|_| machine.clone());
    let folder = deviations(options, &truth).folder(&truth.folder);
    Machine { folder, tables: machine.tables }
}

/// The deviations of the true machine from its folder.
fn deviations(options: &Options, truth: &Machine) -> PlantSettings {
    options.own.flaws.plant(options.plant(), truth.folder.parameters.rotor_inertia_kg_m2)
}

/// The bench with the machine that control knows, and the true one.
pub(super) fn bench(
    plan: Plan,
    setup: &Setup,
    options: &Options,
    (machine, truth): (&Machine, &Machine),
) -> Bench {
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
    let mut plant = Plant::new(&truth.folder, plan.speed, &deviations(options, truth));
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
