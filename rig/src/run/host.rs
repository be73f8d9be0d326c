//! The drive on the host: the firmware's own tasks, called in the order in which their interrupts would come.

use super::Progress;
use crate::bench::{Bench, BenchError};
use crate::campaign::without::Without;
use crate::trace::Recording;
use tractive::board::{ControlPort, PwmPort, Sample};
use tractive::control::{Demand, LinkWindow, Measurements};
use tractive::drive::Report;
use tractive::drive::traction::{ControlTask, PwmTask, Settings, Shared};
use tractive::frames::{Abc, Angle};
use tractive::machine::Tables;
use tractive::modulation::CarrierPeriod;
use tractive::protection::{LegFaults, SafeState, Trip};
use tractive::time::Instant;

/// The bench behind a board's ports; the first error ends the run.
struct Port<'a> {
    bench: &'a mut Bench,
    without: Option<Without>,
    error: Option<BenchError>,
}

impl ControlPort for Port<'_> {
    fn sample(&mut self, now: Instant) -> Sample {
        self.bench.control_sample(now).unwrap_or_else(|error| {
            self.error = Some(error);
            let measured = Measurements { currents_a: Abc::default(), udc_v: 0.0, angle: Angle::ZERO };
            Sample {
                measured,
                demand: Demand::default(),
                enable: false,
                window: LinkWindow::OPEN,
                acknowledge: 0,
                hardware: None,
            }
        })
    }

    fn enter(&mut self, safe: SafeState, now: Instant) {
        self.bench.enter(now, safe);
    }

    fn overrun_ticks(&mut self, _now: Instant) -> u32 {
        self.bench.control_late_ticks()
    }

    fn report(&mut self, now: Instant, report: &Report) {
        self.bench.control_report(now, *report);
    }

    fn leg_faults(&mut self) -> LegFaults {
        let found = self.bench.leg_faults();
        self.without.map_or(found, |without| without.leg_faults(found))
    }
}

impl PwmPort for Port<'_> {
    fn sample(&mut self, now: Instant) -> Abc {
        self.bench.pwm_sample(now).unwrap_or_else(|error| {
            self.error = Some(error);
            Abc::default()
        })
    }

    fn play(&mut self, now: Instant, next: &CarrierPeriod) {
        self.bench.play(now, *next);
    }

    fn enter(&mut self, safe: SafeState, now: Instant) {
        self.bench.enter(now, safe);
    }

    fn leg_faults(&mut self) -> LegFaults {
        let found = self.bench.leg_faults();
        self.without.map_or(found, |without| without.leg_faults(found))
    }
}

/// Runs until the recording is complete.
pub fn run_on_host(
    name: &str,
    mut bench: Bench,
    tables: &'static Tables,
    settings: Settings,
    first_half_ticks: u32,
) -> Result<Recording, BenchError> {
    let mut progress = Progress::new(name);
    let mut tasks = Tasks::new(tables, settings, first_half_ticks);
    tasks.drive(&mut bench, |bench| {
        progress.show(bench.progress());
        true
    })?;
    Ok(super::record(bench))
}

/// Both tasks and the cells between them.
pub struct Tasks {
    control: ControlTask,
    pwm: PwmTask,
    shared: Shared,
    without: Option<Without>,
}

impl Tasks {
    /// Before their first interrupts.
    pub fn new(tables: &'static Tables, settings: Settings, first_half_ticks: u32) -> Self {
        let first_control = Instant(settings.clock.control_ticks);
        Self {
            control: ControlTask::new(tables, settings, first_control),
            pwm: PwmTask::new(tables, settings, Instant(first_half_ticks)).after_halves_of(first_half_ticks),
            shared: Shared::new(),
            without: None,
        }
    }

    /// The same with a protection off; its levels are the tables' business.
    pub fn without(self, without: Without) -> Self {
        let disarmed = without.disarmed();
        let (control, pwm) = (self.control.without(disarmed), self.pwm.without(disarmed));
        Self { control, pwm, without: Some(without), ..self }
    }

    /// The latched fault.
    pub fn trip(&self) -> Option<Trip> {
        self.control.trip().or(self.pwm.trip())
    }

    /// Until the bench's recording is complete, or nobody wants to see more of it.
    pub fn drive(
        &mut self,
        bench: &mut Bench,
        mut goes_on: impl FnMut(&Bench) -> bool,
    ) -> Result<(), BenchError> {
        while !bench.is_done() {
            let (control_at, pwm_at) = (self.control.next_call(), self.pwm.next_call());
            let has_control = bench.has_control(control_at);
            let mut port = Port { bench, without: self.without, error: None };
            // At equal instants the PWM interrupt comes first: it has the higher priority.
            if control_at.reached(pwm_at) || !has_control {
                self.pwm.run(&mut port, &self.shared);
            } else {
                if self.control.wants_revision() {
                    self.pwm.revise(&mut port, &self.shared);
                }
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
