//! What the operator asks for, and what is told. Words between the idle loop and the control interrupt; a bus driver
//! will write the first and read the second.

use crate::cell::Uplink;
use crate::control::Demand;
use crate::drive::Report;
use core::sync::atomic::{AtomicU32, Ordering};

/// Demand in, report out.
pub struct Operator {
    torque_nm: AtomicU32,
    report: Uplink<Report, 12>,
}

impl Operator {
    /// No torque.
    #[cfg(not(loom))]
    pub const fn new() -> Self {
        Self { torque_nm: AtomicU32::new(0), report: Uplink::new() }
    }

    /// Sets the torque demand, in N·m; its rate of change is limited to the machine's slew rate.
    pub fn ask(&self, torque_nm: f32) {
        self.torque_nm.store(torque_nm.to_bits(), Ordering::Relaxed);
    }

    /// The demand.
    #[inline]
    pub fn demand(&self) -> Demand {
        Demand { torque_nm: f32::from_bits(self.torque_nm.load(Ordering::Relaxed)), slew_limited: true }
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
