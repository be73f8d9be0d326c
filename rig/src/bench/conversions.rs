//! The exchange between a bench and the control interrupt: samples that wait until they are asked for, and reports that appear once their commands
//! take effect.

use super::due::Due;
use super::{BenchError, Tick, Timeline};
use std::collections::VecDeque;
use tractive::time::Instant;

/// Samples in one direction, reports in the other.
#[derive(Clone, Debug)]
pub struct Conversions<S, R> {
    samples: VecDeque<(Tick, S)>,
    /// The time of the next sample.
    pub next: Tick,
    reports: Due<R>,
    /// The report whose command has taken effect.
    pub report: R,
}

impl<S, R: Default> Conversions<S, R> {
    /// Nothing sampled yet.
    pub fn new(time: &Timeline) -> Self {
        Self { samples: VecDeque::new(), next: time.control(), reports: Due::default(), report: R::default() }
    }

    /// A sample is taken now. The report of the period before last must have arrived, because its command takes effect now; unless control does not
    /// run.
    pub fn begin(&mut self, time: &Timeline, has_control: bool) -> Result<(), BenchError> {
        if self.samples.len() > 1 {
            if has_control {
                return Err(BenchError::ControlLate(time.now_s()));
            }
            self.samples.clear();
        }
        self.next = time.now + time.control();
        Ok(())
    }

    /// Stores the sample of this time.
    pub fn put(&mut self, now: Tick, sample: S) {
        self.samples.push_back((now, sample));
    }

    /// The sample of a step.
    pub fn ask(&mut self, asked: Tick) -> Result<S, BenchError> {
        while let Some((at, sample)) = self.samples.pop_front() {
            if at == asked {
                return Ok(sample);
            }
        }
        Err(BenchError::NoSample(asked))
    }

    /// The report of the period that began at `instant`.
    pub fn tell(&mut self, time: &Timeline, instant: Instant, report: R) {
        self.reports.push(time.widen(instant) + time.control(), report);
    }

    /// Takes over the reports whose commands have taken effect.
    pub fn show(&mut self, now: Tick) {
        while let Some(report) = self.reports.take(now) {
            self.report = report;
        }
    }
}
