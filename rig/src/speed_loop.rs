//! The vehicle's speed loop: a torque that brings the measured speed to a smoothly moving reference.

use core::f64::consts::TAU;

/// Bandwidth, in rad/s: the telemetry gives a speed every 10 ms.
const BANDWIDTH_RAD_S: f64 = 6.0;
/// Corner of the integral part, as a share of it.
const INTEGRAL_SHARE: f64 = 0.4;

/// Time in which the reference reaches its slope, in s: the drive's torque is limited in its rate, too.
const TAKE_UP_S: f64 = 0.3;
/// The rate at which the reference approaches its target, in 1/s.
const LANDING_1_S: f64 = 4.0;

/// Holds a speed.
#[derive(Clone, Copy, Debug)]
pub struct SpeedLoop {
    inertia_kg_m2: f64,
    largest_nm: f64,
    reference_rpm: f64,
    target_rpm: f64,
    /// Largest slope of the reference, and its slope now, in r/min per second.
    largest_rpm_s: f64,
    slope_rpm_s: f64,
    integral_nm: f64,
}

impl SpeedLoop {
    /// Starts from the present speed and torque.
    pub fn new(inertia_kg_m2: f64, largest_nm: f64, speed_rpm: f64, torque_nm: f64) -> Self {
        Self {
            inertia_kg_m2,
            largest_nm,
            reference_rpm: speed_rpm,
            target_rpm: speed_rpm,
            largest_rpm_s: 0.0,
            slope_rpm_s: 0.0,
            integral_nm: torque_nm,
        }
    }

    /// Sets a new target, and the slope with which the reference goes there, in r/min per second.
    pub fn aim(&mut self, target_rpm: f64, slope_rpm_s: f64) {
        (self.target_rpm, self.largest_rpm_s) = (target_rpm, slope_rpm_s);
    }

    /// The torque for a measured speed, `dt_s` after the last step.
    pub fn step(&mut self, speed_rpm: f64, dt_s: f64) -> f64 {
        let largest = self.largest_rpm_s;
        let wanted = (LANDING_1_S * (self.target_rpm - self.reference_rpm)).clamp(-largest, largest);
        let step = largest * dt_s / TAKE_UP_S;
        self.slope_rpm_s += (wanted - self.slope_rpm_s).clamp(-step, step);
        self.reference_rpm += self.slope_rpm_s * dt_s;
        let acceleration_rad_s2 = self.slope_rpm_s * TAU / 60.0;
        let error_rad_s = (self.reference_rpm - speed_rpm) * TAU / 60.0;
        let gain = self.inertia_kg_m2 * BANDWIDTH_RAD_S;
        let wanted = self.inertia_kg_m2 * acceleration_rad_s2 + gain * error_rad_s + self.integral_nm;
        let torque_nm = wanted.clamp(-self.largest_nm, self.largest_nm);
        // The integral stops while the torque cannot follow.
        if torque_nm == wanted {
            self.integral_nm += INTEGRAL_SHARE * BANDWIDTH_RAD_S * gain * error_rad_s * dt_s;
        }
        torque_nm
    }
}
