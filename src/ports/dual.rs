//! The port between a board and the ZS9's drive.

use crate::control::Demand;
use crate::frames::{Abc, Angle};
use crate::nine_switch::{GateTicks, Scheme};
use crate::protection::Fault;

/// The demand on one motor.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum MotorDemand {
    /// A torque.
    Torque(Demand),
    /// A mechanical speed to hold, in rad/s.
    Speed(f32),
}

/// The ZS9's sample for control. Motors in the order upper, lower.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct DualSample {
    /// Phase currents, positive into the motor, in A.
    pub currents_a: [Abc; 2],
    /// Rotor angles, electrical, of sensors that count the middle of the count; `None` while an angle is not yet known, or if the sensor itself has
    /// lost its rotor.
    pub angles: [Option<Angle>; 2],
    /// Capacitor voltage, mean of both, in V.
    pub capacitor_v: f32,
    /// Inductor current, mean of both, from source to bridge, in A.
    pub inductor_a: f32,
    /// Source voltage U_dc, in V.
    pub source_v: f32,
    /// `true` while the board lets the gates pulse: its enable input is high, and no break holds them.
    pub may_pulse: bool,
    /// The cause that turned the gates off in hardware; it lasts until it is acknowledged.
    pub hardware: Option<HardwareBreak>,
}

/// A cause that turned the gates off in hardware.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct HardwareBreak {
    /// Its name.
    pub fault: Fault,
    /// The place where it was seen, the fault's value: bits that the board explains.
    pub seen: u16,
}

/// The operator's command to the ZS9. Motors in the order upper, lower.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct DualDriveCommand {
    /// Gates may pulse.
    pub enable: bool,
    /// The demands on the motors.
    pub demands: [MotorDemand; 2],
    /// Largest torques that speed demands may use, in N·m; the machine's own limit holds as well.
    pub speed_torque_nm: [f32; 2],
    /// Desired link voltage outside shoot-through, U_in*, in V; 0 leaves it to the board.
    pub link_ref_v: f32,
    /// The place of the zero vectors.
    pub scheme: Scheme,
    /// Number of the operator's last acknowledge.
    pub acknowledge: u8,
    /// The zeros of both position sensors are to be calibrated, each as long as no torque is demanded of its motor.
    pub calibrate: bool,
}

impl DualDriveCommand {
    /// No demand.
    pub const NONE: Self = Self {
        enable: false,
        demands: [MotorDemand::Torque(Demand { torque_nm: 0.0, slew_limited: true }); 2],
        speed_torque_nm: [0.0; 2],
        link_ref_v: 0.0,
        scheme: Scheme::Rthd,
        acknowledge: 0,
        calibrate: false,
    };

    /// The torques, in N·m, of speed demands that nobody limits.
    pub const UNLIMITED_NM: [f32; 2] = [f32::INFINITY; 2];

    /// The same command with the board's link voltage, in V, if the operator leaves it to the board.
    #[inline]
    pub fn with_link(mut self, link_ref_v: f32) -> Self {
        let is_named = self.link_ref_v > 0.0;
        if !is_named {
            self.link_ref_v = link_ref_v;
        }
        self
    }
}

impl Default for DualDriveCommand {
    fn default() -> Self {
        Self::NONE
    }
}

/// The PWM interrupt's sample at the carrier's peak.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct PowerSample {
    /// Phase currents, in A.
    pub currents_a: [Abc; 2],
    /// Capacitor voltage, mean of both, in V.
    pub capacitor_v: f32,
    /// Source voltage U_dc, in V.
    pub source_v: f32,
    /// The feedback of the gates since the last peak.
    pub gates: GateFeedback,
}

/// Two latches a gate: one is set once it has been on, the other once it has been off. A bit each, in the order of [`crate::nine_switch::GATES`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct GateFeedback {
    /// Has been on.
    pub on: u16,
    /// Has been off.
    pub off: u16,
}

/// A carrier period as the timers play it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct PlayedPeriod {
    /// Every gate's pause in the rising half, in steps of the compare units; mirrored in the falling half.
    pub gates: [GateTicks; 9],
}
