//! The PMaSynRM drive on a stiff link, with ideal sensors and nothing that goes wrong.

use tractive::drive::traction::Settings;
use tractive::modulation::SwitchLimits;
use tractive::time::Instant;
use tractive_rig::bench::{self, Bench, Flaws, Limits, Operator, Supply};
use tractive_rig::machine::Machine;
use tractive_rig::plant::Plant;
use tractive_rig::run::CLOCK;
use tractive_rig::run::traction::Tasks;

fn devices(machine: &Machine) -> SwitchLimits {
    SwitchLimits::new(250, 0, machine.tables.ratings.max_switching_hz, &CLOCK)
}

/// A run: time before the recording, length, step of the trace, in s; voltage of the link, in V.
pub struct Run {
    pub lead_s: f64,
    pub duration_s: f64,
    pub trace_step_s: f64,
    pub udc_v: f64,
}

/// The bench.
pub fn bench(
    machine: &Machine,
    plant: Plant,
    operator: impl Operator + Send + 'static,
    Run { lead_s, duration_s, trace_step_s, udc_v }: Run,
) -> Bench {
    let settings = bench::Settings {
        clock: CLOCK,
        first_half_ticks: devices(machine).shortest_half_ticks,
        dead_time_ticks: 0,
        lead_s,
        duration_s,
        trace_step_s,
        udc_v,
        link_steps: Vec::new(),
        flaws: Flaws::default(),
        supply: Supply::Stiff,
        limits: Limits::NONE,
        injection: None,
    };
    Bench::new(plant, Box::new(operator), &settings)
}

/// The tasks, their timers started at an instant.
pub fn tasks(machine: &Machine, origin: Instant) -> Tasks<'static> {
    let devices = devices(machine);
    let settings = Settings::new(CLOCK, devices);
    Tasks::beginning_at(origin, machine.tables, settings, devices.shortest_half_ticks)
}
