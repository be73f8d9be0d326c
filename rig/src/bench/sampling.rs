//! The samples for the drive's interrupts, and the reports of control.

use super::{Bench, BenchError, Simulated};
use crate::inject::traction::Kind;
use crate::trace::Found;
use tractive::frames::{Abc, Angle};
use tractive::identification::{Observation, Stage};
use tractive::ports::{DriveCommand, Report, Sample};
use tractive::protection::LegFaults;
use tractive::time::Instant;

/// Largest error of a current reading that does not count as a difference, over the machine's largest current: the tolerance of the phases' sum. Added to it are a multiple of the sum's own noise, and the converters' steps, in which the error does not show.
const MUCH: f64 = 0.1;
const HIDDEN_NOISES: f64 = 3.0;

/// A control sample with its additional data.
#[derive(Clone, Copy, Debug)]
pub struct Sampled {
    /// The sample.
    pub sample: Sample,
    /// The bench's command.
    pub command: DriveCommand,
    /// The electrical turn that a position sensor has counted while it has no angle.
    pub counted: Option<Angle>,
}

impl Bench {
    /// The conversions that the control timer triggered at `instant`, and the bench's command.
    pub fn control_sample(&mut self, instant: Instant) -> Result<Sampled, BenchError> {
        let tick = self.time.widen(instant);
        self.advance(tick)?;
        self.control.ask(tick)
    }

    /// The control interrupt's report; it appears in the trace when the command takes effect.
    pub fn control_report(&mut self, instant: Instant, report: Report) {
        self.control.tell(&self.time, instant, report);
    }

    /// The observation reported by an identification's control interrupt that began at `instant`; after the last one the recording ends a period later.
    pub fn identified(&mut self, instant: Instant, observation: Observation) {
        if observation.stage == Stage::Done {
            self.end_at(instant.after(self.clock.control_ticks));
        }
        self.observations.push(observation);
    }

    /// Tells the position sensor the electrical angle at which it began to count.
    pub fn align(&mut self, zero: Angle) {
        let t_s = self.time.now_s();
        self.found = self.sensors.align(zero).map(|error_deg| Found { t_s, error_deg });
    }

    /// Delay of the control interrupt, in ticks.
    pub fn control_late_ticks(&self) -> u32 {
        self.spoiler.injected.late_ticks(self.time.now_s())
    }

    /// Phase currents at the carrier boundary `instant`.
    pub fn pwm_sample(&mut self, instant: Instant) -> Result<Abc, BenchError> {
        self.advance(self.time.widen(instant))?;
        let [_, at_boundary] = self.holds;
        let currents_a = self.sensors.converted(at_boundary.read(self.sensors.behind(&self.plant.motor)));
        Ok(self.read_currents(currents_a))
    }

    /// The findings of the legs' drivers and monitors.
    pub fn leg_faults(&self) -> LegFaults {
        let mut found = self.inverter.leg_faults();
        if let Some(Kind::Feedback(leg)) = self.spoiler.injected.kind(self.time.now_s()) {
            found.low |= 1 << leg;
        }
        found
    }

    /// The converters' reading of the phase currents.
    fn read_currents(&mut self, true_a: Abc) -> Abc {
        let read_a = self.spoiler.currents(self.time.now_s(), true_a);
        let off = [read_a.a - true_a.a, read_a.b - true_a.b, read_a.c - true_a.c];
        let much_a = (MUCH * self.plant.motor.largest_a) as f32 + self.sensors.hidden_a(HIDDEN_NOISES);
        // A value that is not a number counts as off, too.
        if off.iter().any(|off| off.is_nan() || off.abs() > much_a) {
            self.observed.makes_a_difference(self.time.now);
        }
        read_a
    }

    pub(super) fn take_sample(&mut self) -> Result<(), BenchError> {
        let (now, t_s) = (self.time.now, self.time.now_s());
        let has_control = self.spoiler.injected.has_control(t_s);
        self.control.begin(&self.time, has_control)?;
        let period_s = f64::from(self.clock.control_s());
        if let Some(line) = self.dc.operated_mut() {
            line.warm(&mut self.plant, period_s);
        }
        let (demand, enable) = self.operator.demand(t_s);
        let [for_control, _] = self.holds;
        let held_a = for_control.read(self.sensors.behind(&self.plant.motor));
        let (true_a, position) = self.sensors.measure(held_a, &self.plant.motor, t_s);
        let hardware = self.dc.operated().and_then(|line| line.hardware(t_s));
        // Without control nobody responds to the operator.
        let known = position.angle.is_some();
        if known && self.found.is_none() && self.sensors.has_encoder() {
            // The index came first.
            self.found = Some(Found { t_s, error_deg: 0.0 });
        }
        if self.dc.operated_mut().is_some_and(|line| line.sampled(now, t_s, known)) && has_control {
            return Err(BenchError::OperatorLate(t_s));
        }
        let mut sample = Sample {
            currents_a: self.read_currents(true_a),
            udc_v: self.sensors.link_v(self.udc_v(t_s)) as f32,
            angle: position.angle,
            may_pulse: true,
            hardware,
        };
        let mut command = DriveCommand { enable, demand, ..DriveCommand::NONE };
        self.spoiler.control(t_s, &mut sample, &mut command);
        self.control.put(now, Sampled { sample, command, counted: position.counted });
        Ok(())
    }
}
