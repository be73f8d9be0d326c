//! Several drives on one line filter: what the others than the first are.

use super::{Options, Plan, bench};
use crate::bench::{Bench, Operator};
use crate::machine::Machine;
use crate::options::RunOptions;
use crate::plant::SpeedSource;
use anyhow::{Result, ensure};
use std::sync::{Arc, Mutex, PoisonError};
use tractive::control::Demand;
use tractive::wire::Setup;

/// By how much the wheels of each further drive on a line are larger, as a share.
const LARGER_WHEELS: f64 = 0.01;
/// The electrical angle at which each further drive's rotor begins, in turns.
const FURTHER_TURNS: f64 = 0.37;

/// The check that a drive is by itself, for whatever has no place for others.
pub(super) fn alone(options: &Options) -> Result<()> {
    let drives = options.own.drives;
    ensure!(
        drives == 1,
        "--drives {drives}: only a scenario that is commanded directly has others beside its drive"
    );
    Ok(())
}

/// A plan that several drives follow.
struct Shared {
    operator: Arc<Mutex<Box<dyn Operator + Send>>>,
    speed: SpeedSource,
    link: Vec<(f64, f64)>,
    lead_s: f64,
    duration_s: f64,
}

impl Shared {
    /// Shares a plan's operator.
    fn of(plan: &mut Plan) -> Self {
        let nobody = |_: f64| (Demand::default(), false);
        let operator = std::mem::replace(&mut plan.operator, Box::new(nobody));
        let operator = Arc::new(Mutex::new(operator));
        plan.operator = Self::operator(&operator);
        let (speed, link) = (plan.speed.clone(), plan.link.clone());
        Self { operator, speed, link, lead_s: plan.lead_s, duration_s: plan.duration_s }
    }

    fn operator(operator: &Arc<Mutex<Box<dyn Operator + Send>>>) -> Box<dyn Operator + Send> {
        let operator = Arc::clone(operator);
        Box::new(move |t_s: f64| operator.lock().unwrap_or_else(PoisonError::into_inner).demand(t_s))
    }

    /// The plan of a drive at other speeds, where they are prescribed.
    fn with_speeds(&self, share: f64) -> Plan {
        let speed = match &self.speed {
            SpeedSource::Profile(points) => {
                SpeedSource::profile(points.iter().map(|(t_s, rpm)| (*t_s, rpm * share)).collect())
            }
            free => free.clone(),
        };
        let plan =
            Plan::driven(self.lead_s, self.duration_s, Vec::new(), |_: f64| (Demand::default(), false));
        Plan { speed, link: self.link.clone(), operator: Self::operator(&self.operator), ..plan }
    }
}

/// The benches of the other drives on the same line: of the same plan, but for their wheels, their rotors' angles and their noise.
pub(super) fn beside(
    plan: &mut Plan,
    setup: &Setup,
    options: &Options,
    machines: (&Machine, &Machine),
) -> Result<Vec<Bench>> {
    let drives = options.own.drives;
    if drives == 1 {
        return Ok(Vec::new());
    }
    if plan.line.is_some() {
        alone(options)?;
    }
    let all = Shared::of(plan);
    let benches = (1..drives).map(|index| {
        let (number, seed) = (f64::from(index), options.seed.wrapping_add(index.into()));
        let run = RunOptions { seed, ..options.run.clone() };
        let options = Options { run, own: options.own.clone() };
        let plan = all.with_speeds(1.0 / (1.0 + number * LARGER_WHEELS));
        let mut bench = bench(plan, setup, &options, machines).without_edges();
        bench.plant_mut().motor.rotor_mut().turn_to(number * FURTHER_TURNS);
        bench
    });
    Ok(benches.collect())
}
