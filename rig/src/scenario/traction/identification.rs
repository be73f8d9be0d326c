//! The identification of a machine, driven: the firmware's own law on the bench, or its image in QEMU.

use super::{Options, Plan, STEP_S, bench, setup, tasks, truth};
use crate::bench::Bench;
use crate::machine::Machine;
use crate::options::On;
use crate::plant::SpeedSource;
use crate::run::traction::{Tasks, run_in_qemu};
use crate::run::{self, Interrupts};
use crate::trace::Recording;
use anyhow::Result;
use tractive::control::Demand;
use tractive::identification::Identification;
use tractive::recorder::Recorder;
use tractive::time::Instant;
use tractive::wire;

/// The longest experiment, in carrier halves; and in s.
const MOST_HALVES: f64 = 12_000.0;
const LEAST_S: f64 = 1.0;

/// Drives the experiment with a free rotor of this inertia, in kg·m², until it is over or a fault ends it.
///
/// # Errors
/// Options that make no sense, or an emulator that does not do its part.
pub fn drive(options: &Options, machine: &Machine, inertia_kg_m2: f64) -> Result<Recording> {
    let halves_s = 1.0 / (2.0 * machine.folder.parameters.max_switching_hz);
    let duration_s = LEAST_S + MOST_HALVES * halves_s;
    let wanted = |_: f64| (Demand::default(), true);
    let plan = Plan {
        speed: SpeedSource::Inertia { inertia_kg_m2, load_nm: 0.0 },
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
