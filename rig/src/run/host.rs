//! The drive on the host: the firmware's own tasks, called in the order in which their interrupts would come.

use super::Progress;
use crate::bench::{Bench, BenchError};
use crate::trace::Recording;
use tractive::board::{ControlPort, PwmPort, Sample};
use tractive::control::{Demand, LinkWindow, Measurements};
use tractive::drive::Report;
use tractive::drive::traction::{ControlTask, PwmTask, Settings, Shared};
use tractive::frames::{Abc, Angle};
use tractive::machine::{Ratings, Tables};
use tractive::modulation::CarrierPeriod;
use tractive::operator::{self, Desk, Feedback, Line, OperatorPort, Request, Slot, Status, slot_s};
use tractive::protection::SafeState;
use tractive::time::Instant;

/// The bench behind a board's ports; the first error ends the run.
struct Port<'a> {
    bench: &'a mut Bench,
    desk: &'a Desk,
    ratings: &'a Ratings,
    error: Option<BenchError>,
}

impl ControlPort for Port<'_> {
    fn sample(&mut self, now: Instant) -> Sample {
        let sample = self.bench.control_sample(now);
        let sample = if self.bench.is_operated() {
            sample.map(|sample| self.desk.permit(now).applied_to(sample))
        } else {
            sample
        };
        sample.unwrap_or_else(|error| {
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
        0
    }

    fn report(&mut self, now: Instant, report: &Report) {
        self.desk.tell(now, report);
        self.bench.control_report(now, *report);
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

    fn leave(&mut self, now: Instant) -> bool {
        self.bench.leave(now);
        true
    }
}

impl OperatorPort for Port<'_> {
    fn ask(&mut self, at: Instant) -> (Request, Feedback) {
        self.bench.ask(at).unwrap_or_else(|error| {
            self.error = Some(error);
            (Request::idle(self.ratings), Feedback::default())
        })
    }

    fn tell(&mut self, from: Instant, status: &Status) {
        if let Err(error) = self.bench.told(from, *status) {
            self.error = Some(error);
        }
    }
}

/// Runs until the recording is complete.
pub fn run_on_host(
    name: &str,
    mut bench: Bench,
    tables: &'static Tables,
    settings: Settings,
    first_half_ticks: u32,
    line: Option<Line>,
) -> Result<Recording, BenchError> {
    let shared = Shared::new();
    let mut control_at = Instant(settings.clock.control_ticks);
    let mut pwm_at = Instant(first_half_ticks);
    let mut control = ControlTask::new(tables, settings, control_at);
    let mut pwm = PwmTask::new(tables, settings, pwm_at).after_halves_of(first_half_ticks);
    let desk = Desk::new();
    let mut slot = Slot::new();
    let operator = operator::Settings::rated(&tables.ratings, slot_s(&settings.clock), line);
    let mut progress = Progress::new(name);
    while !bench.is_done() {
        let operated = bench.is_operated();
        let mut port = Port { bench: &mut bench, desk: &desk, ratings: &tables.ratings, error: None };
        // At equal instants the PWM interrupt comes first: it has the higher priority.
        if control_at.reached(pwm_at) {
            pwm.run(&mut port, &shared);
            pwm_at = pwm.next_call();
        } else {
            control.run(&mut port, &shared);
            control_at = control.next_call();
            // The idle loop goes on where the interrupt ends.
            if operated {
                slot.run(&desk, &mut port, &operator, &settings.clock);
            }
        }
        if let Some(error) = port.error {
            return Err(error);
        }
        progress.show(bench.progress());
    }
    Ok(bench.into_recording())
}
