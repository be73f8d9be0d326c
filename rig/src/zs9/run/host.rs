//! On the host: the firmware's own tasks, called in the order in which their interrupts would come.

use crate::campaign::without::Without;
use crate::run::Progress;
use crate::zs9::bench::{Bench, BenchError};
use crate::zs9::trace::Recording;
use tractive::board::{DualControlPort, DualPwmPort, DualSample, MotorDemand, PlayedPeriod, PowerSample};
use tractive::drive::dual::{ControlTask, DualReport, PwmTask, Settings, Shared};
use tractive::frames::Abc;
use tractive::machine::Tables;
use tractive::nine_switch::Scheme;
use tractive::protection::Trip;
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
        self.bench.control_late_ticks()
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
    let mut progress = Progress::new(name);
    Tasks::new(tables, settings).drive(&mut bench, |bench| {
        progress.show(bench.progress());
        true
    })?;
    let (rows, edges) = bench.into_recording();
    Ok(Recording { rows, edges })
}

/// Both tasks and the cells between them.
pub struct Tasks {
    control: ControlTask,
    pwm: PwmTask,
    shared: Shared,
}

impl Tasks {
    /// Before their first interrupts.
    pub fn new(tables: &'static Tables, settings: Settings) -> Self {
        Self::beginning_at(Instant(0), tables, settings)
    }

    /// The same for timers that start at another instant.
    pub fn beginning_at(origin: Instant, tables: &'static Tables, settings: Settings) -> Self {
        Self {
            control: ControlTask::new(tables, settings).beginning_at(origin),
            pwm: PwmTask::new(tables, settings).beginning_at(origin),
            shared: Shared::new(),
        }
    }

    /// The same with a protection off; its levels are the tables' and the settings' business.
    pub fn without(self, without: Without) -> Self {
        let disarmed = without.disarmed();
        Self { control: self.control.without(disarmed), pwm: self.pwm.without(disarmed), ..self }
    }

    /// The latched fault.
    pub fn trip(&self) -> Option<Trip> {
        self.control.trip().or(self.pwm.trip())
    }

    /// Until the bench's recording is complete, or nobody wants to see more of it.
    ///
    /// # Errors
    /// Where the bench cannot go on.
    pub fn drive(
        &mut self,
        bench: &mut Bench,
        mut goes_on: impl FnMut(&Bench) -> bool,
    ) -> Result<(), BenchError> {
        while !bench.is_done() {
            let (control_at, pwm_at) = (self.control.next_call(), self.pwm.next_call());
            let has_control = bench.has_control(control_at);
            let mut port = Port { bench, error: None };
            // They never meet: control comes at valleys, PWM at peaks.
            if control_at.reached(pwm_at) || !has_control {
                self.pwm.run(&mut port, &self.shared);
            } else {
                self.control.run(&mut port, &self.shared);
            }
            if let Some(error) = port.error {
                return Err(error);
            }
            if !goes_on(bench) {
                break;
            }
        }
        Ok(())
    }
}
