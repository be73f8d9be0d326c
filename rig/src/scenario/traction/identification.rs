//! The identification of a machine, driven: the firmware's own law on the bench, or its image in QEMU.

use super::host::{bench, truth};
use super::plan::STEP_S;
use super::setup::{setup, tasks};
use super::{Options, PatternsName, Plan, drives, fed_link};
use crate::bench::{Bench, LinePlan};
use crate::inject::Injection;
use crate::inject::sensor::CurrentFault;
use crate::inject::traction::Kind;
use crate::law::LawName;
use crate::machine::Machine;
use crate::options::On;
use crate::plant::SpeedSource;
use crate::run::traction::{Tasks, run_in_qemu};
use crate::run::{self, Interrupts, Supervisor};
use crate::trace::Recording;
use anyhow::{Result, bail};
use tractive::control::Demand;
use tractive::experiment::Memory;
use tractive::identification::{Identification, Units};
use tractive::operator;
use tractive::recorder::Recorder;
use tractive::time::Instant;
use tractive::wire;

/// The longest experiment: so many carrier halves, and a time in s besides.
const MOST_HALVES: f64 = 28_000.0;
const LEAST_S: f64 = 1.0;
/// The longest experiment over the protocol, with all its frames, in s; and the step of its trace.
const COMMANDED_S: f64 = 600.0;
const COMMANDED_STEP_S: f64 = 1e-3;
/// Time from a fault that is injected until the recording ends, in s.
const AFTER_FAULT_S: f64 = 0.1;

/// The bench of the experiment.
#[derive(Clone, Copy, Debug)]
pub struct Stand {
    /// Inertia of the free rotor, in kg·m².
    pub inertia_kg_m2: f64,
    /// Time from which a current sensor reads too much by three tenths of the largest current, in s.
    pub fault_at_s: Option<f64>,
}

impl Stand {
    fn rotor(&self) -> SpeedSource {
        SpeedSource::Inertia { inertia_kg_m2: self.inertia_kg_m2, load_nm: 0.0 }
    }

    fn injection(&self, machine: &Machine) -> Option<Injection<Kind>> {
        let fault = CurrentFault::Offset(OFFSET * machine.folder.parameters.max_current_a);
        self.fault_at_s.map(|at_s| Injection { kind: Kind::Current(0, fault), at_s })
    }
}

/// Error of the sensor that fails, as a share of the machine's largest current.
const OFFSET: f64 = 0.3;

/// The check that no option asks for something that the experiment does not have: another law, other patterns or another kind of supply.
///
/// # Errors
/// The first option that does.
fn check(options: &Options) -> Result<()> {
    let own = &options.own;
    let others = [
        (options.law != LawName::Tractive, "--law"),
        (own.patterns == Some(PatternsName::Optimal), "--patterns"),
        (own.ablate.is_some(), "--ablate"),
        (own.line.is_some(), "--line"),
    ];
    match others.into_iter().find(|(asked, _)| *asked) {
        Some((_, name)) => {
            bail!("{name}: not for an identification, which has a law of its own and a stiff link")
        }
        None => Ok(()),
    }
}

/// Drives the experiment until it is over or a fault ends it. The dead time is not compensated, whatever the options say: the fit uses
/// the pulses as they are commanded.
///
/// # Errors
/// Options that make no sense, or an emulator that does not do its part.
pub fn drive(options: &Options, machine: &Machine, stand: &Stand) -> Result<Recording> {
    let options = &held(options)?;
    let halves_s = 1.0 / (2.0 * machine.folder.parameters.max_switching_hz);
    let longest_s = LEAST_S + MOST_HALVES * halves_s;
    let duration_s = stand.fault_at_s.map_or(longest_s, |at_s| longest_s.min(at_s + AFTER_FAULT_S));
    let wanted = |_: f64| (Demand::default(), true);
    let plan = Plan {
        speed: stand.rotor(),
        injection: stand.injection(machine),
        judged_step_s: STEP_S.min(halves_s),
        ..Plan::driven(0.0, duration_s, Vec::new(), wanted)
    };
    let setup = setup(&plan, options, machine, false);
    let bench = bench(plan, &setup, options, (machine, &truth(options, machine)?));
    match options.on {
        On::Host => {
            let recorder = Recorder::new();
            let tasks = tasks(Identification::new(), &setup, options, machine)?.recorded_by(&recorder);
            run::on_host("identify", bench, Identifying(tasks), |index| recorder.read(index))
        }
        On::Qemu => {
            run_in_qemu("identify", bench, wire::setup_to_block(setup), &options.emulator(false)?, None)
        }
    }
}

/// Drives the experiment like a board: from an empty link, commanded over the protocol, whose frames carry away the observations.
///
/// # Errors
/// As [`drive`], and those of the supervisor.
pub fn drive_commanded(
    options: &Options,
    machine: &Machine,
    stand: &Stand,
    supervisor: &mut dyn Supervisor,
) -> Result<Recording> {
    let options = &held(options)?;
    let idle = operator::Request::idle(&machine.tables.ratings);
    // The requests come in frames, not from here.
    let line = LinePlan::new(fed_link(options, machine), Box::new(move |_| idle));
    let plan = Plan {
        speed: stand.rotor(),
        injection: stand.injection(machine),
        judged_step_s: options.dt.unwrap_or(COMMANDED_STEP_S),
        ..Plan::operated(COMMANDED_S, Vec::new(), line)
    };
    let setup = setup(&plan, options, machine, true);
    let bench = bench(plan, &setup, options, (machine, &truth(options, machine)?));
    match options.on {
        On::Host => {
            let (recorder, memory) = (Recorder::new(), Box::new(Memory::new()));
            let tasks = tasks(Identification::new(), &setup, options, machine)?.recorded_by(&recorder);
            let units = Units::of(&machine.tables.ratings);
            let keep = |law: &mut Identification, _: Instant, begins_slot: bool| {
                memory.take(law.take().as_ref(), &units, begins_slot);
            };
            let tasks = tasks.doing(keep).commanded_by(Some(supervisor)).telling(&memory);
            run::on_host("identify", bench, tasks, |index| recorder.read(index))
        }
        On::Qemu => {
            let emulator = options.emulator(false)?;
            run_in_qemu("identify", bench, wire::setup_to_block(setup), &emulator, Some(supervisor))
        }
    }
}

/// The options that apply: the dead time is not compensated, and the carrier is free.
fn held(options: &Options) -> Result<Options> {
    drives::alone(options.own.drives)?;
    check(options)?;
    let mut options = options.clone();
    options.own.uncompensated = true;
    // Whatever machine.toml names: the images that identify have the paper's free carrier.
    options.own.patterns = Some(PatternsName::Paper);
    Ok(options)
}

/// The drive's tasks, whose law tells the bench what it observes.
struct Identifying<'a>(Tasks<'a, Identification>);

impl Interrupts for Identifying<'_> {
    type Bench = Bench;

    fn next_calls(&self) -> [Instant; 2] {
        self.0.next_calls()
    }

    fn pwm(&mut self, bench: &mut Bench) -> Result<()> {
        self.0.pwm(bench)
    }

    fn control(&mut self, bench: &mut Bench) -> Result<()> {
        let [now, _] = self.0.next_calls();
        self.0.control(bench)?;
        if let Some(observation) = self.0.law_mut().take() {
            bench.identified(now, observation);
        }
        Ok(())
    }
}
