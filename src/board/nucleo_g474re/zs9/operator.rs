//! What the operator asks the ZS9 for, and what is told. Words between the idle loop and the control interrupt.

use crate::board::MotorDemand;
use crate::cell::Uplink;
use crate::control::Demand;
use crate::drive::dual::DualReport;
use core::sync::atomic::{AtomicU32, Ordering};

/// Demands in, report out.
pub struct Operator {
    torques_nm: [AtomicU32; 2],
    link_v: AtomicU32,
    report: Uplink<DualReport, 11>,
}

impl Operator {
    /// No torque, and this link voltage outside shoot-through, in V.
    #[cfg(not(loom))]
    pub const fn new(link_v: f32) -> Self {
        Self {
            torques_nm: [const { AtomicU32::new(0) }; 2],
            link_v: AtomicU32::new(link_v.to_bits()),
            report: Uplink::new(),
        }
    }

    /// Sets the torque demands, in N·m: upper motor, lower motor; their rates of change are limited to the machine's slew rate.
    pub fn ask(&self, torques_nm: [f32; 2]) {
        for (cell, torque_nm) in self.torques_nm.iter().zip(torques_nm) {
            cell.store(torque_nm.to_bits(), Ordering::Relaxed);
        }
    }

    /// Sets the link voltage outside shoot-through, in V.
    pub fn ask_link(&self, link_v: f32) {
        self.link_v.store(link_v.to_bits(), Ordering::Relaxed);
    }

    /// The demands.
    #[inline]
    pub fn demands(&self) -> [MotorDemand; 2] {
        self.torques_nm.each_ref().map(|cell| {
            let torque_nm = f32::from_bits(cell.load(Ordering::Relaxed));
            MotorDemand::Torque(Demand { torque_nm, slew_limited: true })
        })
    }

    /// The link voltage that is wanted, in V.
    #[inline]
    pub fn link_v(&self) -> f32 {
        f32::from_bits(self.link_v.load(Ordering::Relaxed))
    }

    /// From the control interrupt, which nothing that reads this can interrupt.
    #[inline]
    pub(super) fn tell(&self, report: &DualReport) {
        self.report.publish(*report);
    }

    /// What the control interrupt did last; `None` before its first time.
    pub fn report(&self) -> Option<DualReport> {
        self.report.read()
    }
}
