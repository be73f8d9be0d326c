//! The limits of the ZS9's link: source, capacitors, shoot-through duty.

use super::{FailedCheck, Fault};

/// The ZS9's limits besides those of its motors.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct LinkLimits {
    /// Source voltage below which the drive trips, in V.
    pub source_min_v: f32,
    /// Capacitor voltage above which the drive trips, in V.
    pub capacitor_max_v: f32,
    /// Largest shoot-through duty, 0 ..= 0.5.
    pub duty_max: f32,
}

impl LinkLimits {
    /// The failed check of the duty that a link voltage needs, `(1 − U_dc/U_in)/2`, if it is outside the range.
    pub fn check_link_reference(&self, link_v: f32, source_v: f32) -> Option<FailedCheck> {
        if !link_v.is_finite() {
            return Some((Fault::NotFinite, link_v, f32::MAX));
        }
        let duty = if link_v > source_v { 0.5 - 0.5 * source_v / link_v } else { 0.0 };
        self.check_duty(duty)
    }

    /// The check of a commanded duty.
    pub fn check_duty(&self, duty: f32) -> Option<FailedCheck> {
        // NaN is outside as well.
        let inside = (0.0..=self.duty_max).contains(&duty);
        (!inside).then_some((Fault::DutyRange, duty, self.duty_max))
    }

    /// The check of source and capacitors.
    pub fn check_link(&self, source_v: f32, capacitor_v: f32) -> Option<FailedCheck> {
        if !(source_v + capacitor_v).is_finite() {
            return Some((Fault::NotFinite, source_v + capacitor_v, f32::MAX));
        }
        if source_v < self.source_min_v {
            return Some((Fault::SourceUndervoltage, source_v, self.source_min_v));
        }
        if capacitor_v > self.capacitor_max_v {
            return Some((Fault::CapacitorOvervoltage, capacitor_v, self.capacitor_max_v));
        }
        None
    }
}
