//! What the operator permits, and what is told. Words between the idle loop, which serves the bus, and the control interrupt.

use crate::cell::Uplink;
use crate::drive::Report;
use crate::operator::Desk;

/// Permit in, observations and report out.
pub struct Operator {
    /// Permit in, observations out.
    pub desk: Desk,
    report: Uplink<Report, 12>,
}

impl Operator {
    /// Nothing permitted.
    #[cfg(not(loom))]
    pub const fn new() -> Self {
        Self { desk: Desk::new(), report: Uplink::new() }
    }

    /// From the control interrupt, which nothing that reads this can interrupt.
    #[inline]
    pub(super) fn tell(&self, report: &Report) {
        self.report.publish(*report);
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
