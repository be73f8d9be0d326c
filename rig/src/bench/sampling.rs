//! What the drive's interrupts are told, and what control reports.

use super::{Bench, BenchError};
use crate::inject::traction::Kind;
use tractive::control::{LinkWindow, Measurements};
use tractive::frames::Abc;
use tractive::ports::Report;
use tractive::ports::Sample;
use tractive::protection::LegFaults;
use tractive::time::Instant;

/// How far a current's reading may be off without making a difference that counts, in A: a tenth of the machine's largest current,
/// which is what the sum of the phases may be.
const MUCH_A: f32 = 23.3;

impl Bench {
    /// The conversions that the control timer triggered at `instant`.
    pub fn control_sample(&mut self, instant: Instant) -> Result<Sample, BenchError> {
        let tick = self.time.widen(instant);
        self.advance(tick)?;
        self.control.ask(tick)
    }

    /// The control interrupt's report; it shows in the trace when the command takes effect.
    pub fn control_report(&mut self, instant: Instant, report: Report) {
        self.control.tell(&self.time, instant, report);
    }

    /// By how much the control interrupt is late, in ticks.
    pub fn control_late_ticks(&self) -> u32 {
        self.spoiler.injected.late_ticks(self.time.now_s())
    }

    /// Phase currents at the carrier boundary `instant`.
    pub fn pwm_sample(&mut self, instant: Instant) -> Result<Abc, BenchError> {
        self.advance(self.time.widen(instant))?;
        let currents_a = self.sensors.currents(&self.plant);
        Ok(self.read_currents(currents_a))
    }

    /// What drivers and monitors of the legs have found.
    pub fn leg_faults(&self) -> LegFaults {
        let mut found = self.inverter.leg_faults();
        if let Some(Kind::Feedback(leg)) = self.spoiler.injected.kind(self.time.now_s()) {
            found.low |= 1 << leg;
        }
        found
    }

    /// What the converters make of the phase currents.
    fn read_currents(&mut self, true_a: Abc) -> Abc {
        let read_a = self.spoiler.currents(self.time.now_s(), true_a);
        let off = [read_a.a - true_a.a, read_a.b - true_a.b, read_a.c - true_a.c];
        // What is not a number is off as well.
        if off.iter().any(|off| off.is_nan() || off.abs() > MUCH_A) {
            self.observed.makes_a_difference(self.time.now);
        }
        read_a
    }

    pub(super) fn take_sample(&mut self) -> Result<(), BenchError> {
        let (now, t_s) = (self.time.now, self.time.now_s());
        self.control.begin(&self.time, self.spoiler.injected.has_control(t_s))?;
        let (demand, enable) = self.operator.demand(t_s);
        let udc_v = self.udc_v(t_s);
        let Measurements { currents_a, udc_v, angle } = self.sensors.measure(&self.plant, udc_v, t_s);
        let (currents_a, angle, window) = (self.read_currents(currents_a), Some(angle), LinkWindow::OPEN);
        let hardware = self.dc.operated().and_then(|line| line.hardware(t_s));
        if self.dc.operated_mut().is_some_and(|line| line.sampled(now, t_s)) {
            return Err(BenchError::OperatorLate(t_s));
        }
        let mut sample =
            Sample { currents_a, udc_v, angle, demand, enable, window, acknowledge: 0, hardware };
        self.spoiler.control(t_s, &mut sample);
        self.control.put(now, sample);
        Ok(())
    }
}
