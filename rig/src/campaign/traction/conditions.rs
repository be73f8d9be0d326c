//! Everything about a case except its fault and its operating point: line, true machine, flaws of inverter and sensors, trajectory.

use crate::bench::Flaws;
use crate::plant::LineFilter;

/// The conditions of a case.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Conditions {
    /// The line's voltage, in V; `None` for the machine's nominal one.
    pub line_v: Option<f64>,
    /// The choke and capacitor in front of the inverter.
    pub filter: LineFilter,
    /// True flux linkage over the map's.
    pub flux_scale: f64,
    /// True stator resistance over the rating.
    pub resistance_scale: f64,
    /// Flaws of the sensors and ripple of the supply.
    pub flaws: Flaws,
    /// Dead time, which the firmware knows and compensates, in ticks.
    pub dead_time_ticks: u32,
    /// Acceleration of the rotor before and after the fault's instant, in r/min per s.
    pub acceleration_rpm_s: f64,
}

impl Conditions {
    /// Nominal line and machine, no flaw, a steady speed.
    pub const SOUND: Self = Self {
        line_v: None,
        filter: LineFilter::TRACTION,
        flux_scale: 1.0,
        resistance_scale: 1.0,
        flaws: Flaws::NONE,
        dead_time_ticks: 0,
        acceleration_rpm_s: 0.0,
    };

    /// Mean torque error that these conditions explain, as a share of the largest torque: in proportion to what the campaign allows if the
    /// machine differs by a fifth (a quarter), has twice the resistance (a tenth), or the angle is off by 2° (a tenth); plus twice a sensor's
    /// excess reading.
    pub(super) fn torque_share(&self) -> f64 {
        let Flaws { current_gain, udc_gain, angle_error_deg, .. } = self.flaws;
        1.25 * (self.flux_scale - 1.0).abs()
            + 0.1 * (self.resistance_scale - 1.0).abs()
            + 0.05 * angle_error_deg.abs()
            + 2.0 * (current_gain.abs() + udc_gain.abs())
    }
}
