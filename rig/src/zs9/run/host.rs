//! On the host: the firmware's own tasks, called in the order in which their interrupts would come.

use crate::run::Progress;
use crate::zs9::bench::{Bench, BenchError};
use crate::zs9::trace::Recording;
use tractive::board::{DualControlPort, DualPwmPort, DualSample, MotorDemand, PlayedPeriod, PowerSample};
use tractive::drive::dual::{ControlTask, DualReport, PwmTask, Settings, Shared};
use tractive::frames::Abc;
use tractive::machine::Tables;
use tractive::nine_switch::Scheme;
use tractive::time::Instant;

/// The bench behind a board's ports; the first error ends the run.
struct Port<'a> {
    bench: &'a mut Bench,
    error: Option<BenchError>,
}

/// What is sampled when there is nothing left to sample.
const NOTHING: DualSample = DualSample {
    currents_a: [Abc { a: 0.0, b: 0.0, c: 0.0 }; 2],
    angles: [None; 2],
    capacitor_v: 0.0,
    inductor_a: 0.0,
    source_v: 0.0,
    demands: [MotorDemand::Speed(0.0); 2],
    link_ref_v: 0.0,
    scheme: Scheme::S,
    enable: false,
};

impl DualControlPort for Port<'_> {
    fn sample(&mut self, now: Instant) -> DualSample {
        self.bench.control_sample(now).unwrap_or_else(|error| {
            self.error = Some(error);
            NOTHING
        })
    }

    fn gates_off(&mut self, now: Instant) {
        self.bench.gates_off(now);
    }

    fn overrun_ticks(&mut self, _now: Instant, _deadline_ticks: u32) -> u32 {
        0
    }

    fn report(&mut self, now: Instant, report: &DualReport) {
        self.bench.control_report(now, *report);
    }
}

impl DualPwmPort for Port<'_> {
    fn sample(&mut self, now: Instant) -> PowerSample {
        self.bench.power_sample(now).unwrap_or_else(|error| {
            self.error = Some(error);
            PowerSample::default()
        })
    }

    fn play(&mut self, _now: Instant, next: &PlayedPeriod) {
        self.bench.play(*next);
    }

    fn gates_off(&mut self, now: Instant) {
        self.bench.gates_off(now);
    }
}

/// Runs until the recording is complete.
///
/// # Errors
/// Where the bench cannot go on.
pub fn run_on_host(
    name: &str,
    mut bench: Bench,
    tables: &'static Tables,
    settings: Settings,
) -> Result<Recording, BenchError> {
    let shared = Shared::new();
    let mut control = ControlTask::new(tables, settings);
    let mut pwm = PwmTask::new(tables, settings);
    let mut progress = Progress::new(name);
    while !bench.is_done() {
        let mut port = Port { bench: &mut bench, error: None };
        // They never meet: control comes at valleys, PWM at peaks.
        if control.next_call().reached(pwm.next_call()) {
            pwm.run(&mut port, &shared);
        } else {
            control.run(&mut port, &shared);
        }
        if let Some(error) = port.error {
            return Err(error);
        }
        progress.show(bench.progress());
    }
    let (rows, edges) = bench.into_recording();
    Ok(Recording { rows, edges })
}
