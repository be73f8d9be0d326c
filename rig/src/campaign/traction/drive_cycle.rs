//! Drive cycles written as lists of timed events, instead of cases.

use super::{Drive, STAGES};
use crate::bench::{self, Bench, Flaws, Observed, Simulated};
use crate::campaign::action::LEAD_S;
use crate::inject::Injection;
use crate::inject::traction::Kind;
use crate::plant::{Plant, PlantSettings, SpeedSource};
use crate::run::Interrupts;
use crate::steps::held;
use crate::trace::Row;
use anyhow::Result;
use tractive::control::Demand;
use tractive::protection::Trip;

/// A drive cycle written as timed events; times in s from the recording's beginning.
#[derive(Clone, Debug, Default)]
pub struct DriveCycle {
    /// Speeds in r/min, linear in between.
    pub speed: Vec<(f64, f64)>,
    /// Torques in N·m, each from its time on, and whether the demand's rate is limited.
    pub torque: Vec<(f64, (f64, bool))>,
    /// The permissions of the drive, each from its time on.
    pub enable: Vec<(f64, bool)>,
    /// Voltages of the line, each from its time on.
    pub line: Vec<(f64, f64)>,
    /// The fault that is injected.
    pub injection: Option<Injection<Kind>>,
    /// Length, in s.
    pub duration_s: f64,
}

/// The results of a cycle.
pub struct CycleResult {
    /// The trace.
    pub rows: Vec<Row>,
    /// The effects of a fault.
    pub observed: Observed,
    /// The latched fault.
    pub trip: Option<Trip>,
}

/// Step of a cycle's trace, in s.
const TRACE_STEP_S: f64 = 100e-6;

impl Drive {
    /// Drives a script instead of a case.
    pub fn cycle(&self, cycle: DriveCycle, flaws: Flaws) -> Result<CycleResult> {
        let DriveCycle { speed, torque, enable, line, injection, duration_s } = cycle;
        let operator = move |t_s: f64| {
            let (torque_nm, slew_limited) = held(&torque, t_s).unwrap_or((0.0, true));
            let demand = Demand { torque_nm: torque_nm as f32, slew_limited };
            (demand, held(&enable, t_s).unwrap_or(true))
        };
        let speed = speed.into_iter().map(|(t_s, rpm)| (t_s + LEAD_S, rpm)).collect();
        let sound = self.bench_settings(duration_s, TRACE_STEP_S);
        let injection = injection.or(sound.injection);
        let settings = bench::Settings { link_steps: line, flaws, injection, ..sound };
        let plant = Plant::new(&self.machine.folder, SpeedSource::profile(speed), &PlantSettings::default());
        let mut bench = Bench::new(plant, Box::new(operator), &settings);
        let mut tasks = self.tasks(self.devices(0));
        let mut tripped_s = None;
        tasks.drive(&mut bench, |bench| {
            // After the drive has stopped there is little to see.
            if bench.observed.safe.is_some() {
                tripped_s.get_or_insert(bench.time_s());
            }
            tripped_s.is_none_or(|tripped_s| bench.time_s() < tripped_s + STAGES.aftermath_s)
        })?;
        Ok(CycleResult { rows: bench.rows().to_vec(), observed: bench.observed, trip: tasks.trip() })
    }
}
