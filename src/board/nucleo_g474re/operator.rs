//! Between the idle loop, where the operator runs, and the interrupts.

use crate::board::Sample;
use crate::cell::Uplink;
use crate::drive::Report;
use crate::operator::Desk;
use crate::time::Instant;
use core::sync::atomic::{AtomicBool, Ordering};

/// Permit in, observation and report out.
pub struct Operator {
    /// Permit and observation, slot by slot.
    pub desk: Desk,
    report: Uplink<Report, 12>,
    position_known: AtomicBool,
}

impl Operator {
    /// Nothing permitted.
    #[cfg(not(loom))]
    pub const fn new() -> Self {
        Self { desk: Desk::new(), report: Uplink::new(), position_known: AtomicBool::new(false) }
    }

    /// In the control interrupt: gives a sample what is permitted; `position_known` says whether its angle is one.
    #[inline]
    pub(super) fn permit(&self, now: Instant, sample: &mut Sample, position_known: bool) {
        self.position_known.store(position_known, Ordering::Relaxed);
        self.desk.permit(now).apply(sample);
    }

    /// From the control interrupt, which nothing that reads this can interrupt.
    #[inline]
    pub(super) fn tell(&self, now: Instant, report: &Report) {
        self.desk.tell(now, report);
        self.report.publish(*report);
    }

    /// Whether the rotor's angle was known in the last control period.
    pub fn position_known(&self) -> bool {
        self.position_known.load(Ordering::Relaxed)
    }

    /// What the control interrupt did last; `None` before its first time.
    pub fn report(&self) -> Option<Report> {
        self.report.read()
    }
}

#[cfg(not(loom))]
impl Default for Operator {
    fn default() -> Self {
        Self::new()
    }
}
