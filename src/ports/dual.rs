//! What a board gives the ZS9's drive.

use super::DualReport;
use crate::control::Demand;
use crate::frames::{Abc, Angle};
use crate::nine_switch::{GateTicks, Scheme};
use crate::protection::Fault;
use crate::time::Instant;

/// What one motor is to do.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum MotorDemand {
    /// Give a torque.
    Torque(Demand),
    /// Keep to a mechanical speed, in rad/s.
    Speed(f32),
}

/// What the ZS9's control samples, and what the operator wants. Motors in the order upper, lower.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DualSample {
    /// Phase currents, positive into the motor, in A.
    pub currents_a: [Abc; 2],
    /// Rotor angles, electrical; `None` while one is not known, or no longer: the sensor itself has lost its rotor.
    pub angles: [Option<Angle>; 2],
    /// Capacitor voltage, mean of both, in V.
    pub capacitor_v: f32,
    /// Inductor current, mean of both, from source to bridge, in A.
    pub inductor_a: f32,
    /// Source voltage U_dc, in V.
    pub source_v: f32,
    /// What the motors are to do.
    pub demands: [MotorDemand; 2],
    /// Link voltage wanted outside shoot-through, U_in*, in V.
    pub link_ref_v: f32,
    /// Where the zero vectors lie.
    pub scheme: Scheme,
    /// Whether the gates may be on.
    pub enable: bool,
    /// Largest torques that speed demands may take, in N·m; the machine's own holds as well.
    pub speed_torque_nm: [f32; 2],
    /// Number of the operator's last acknowledge.
    pub acknowledge: u8,
    /// What turned the gates off in hardware; it lasts until it is acknowledged.
    pub hardware: Option<HardwareBreak>,
}

/// A cause that turned the gates off in hardware.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct HardwareBreak {
    /// Its name.
    pub fault: Fault,
    /// Where it was seen, the fault's value: bits that the board explains.
    pub seen: u16,
}

impl DualSample {
    /// Without limits or commands of an operator: for boards that have none.
    pub const UNLIMITED_NM: [f32; 2] = [f32::INFINITY; 2];
}

/// What the PWM interrupt samples at the carrier's peak.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PowerSample {
    /// Phase currents, in A.
    pub currents_a: [Abc; 2],
    /// Capacitor voltage, mean of both, in V.
    pub capacitor_v: f32,
    /// Source voltage U_dc, in V.
    pub source_v: f32,
    /// What the gates have done since the last peak.
    pub gates: GateFeedback,
}

/// Two latches a gate: whether it has been on, and whether it has been off. A bit each, in the order of
/// [`crate::nine_switch::GATES`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct GateFeedback {
    /// Has been on.
    pub on: u16,
    /// Has been off.
    pub off: u16,
}

/// A carrier period as the timers play it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PlayedPeriod {
    /// Every gate's pause in the rising half, in steps of the compare units; mirrored in the falling half.
    pub gates: [GateTicks; 9],
}

/// What the ZS9's control interrupt needs of a board.
pub trait DualControlPort {
    /// The conversions that the control timer triggered at `now`.
    fn sample(&mut self, now: Instant) -> DualSample;
    /// Turns all nine gates off at once, until an acknowledge, whatever is played.
    fn gates_off(&mut self, now: Instant);
    /// By how many ticks the interrupt, begun nominally at `now`, has outlived `deadline_ticks`; 0 when in time.
    fn overrun_ticks(&mut self, now: Instant, deadline_ticks: u32) -> u32;
    /// What the control task did, for whoever watches.
    fn report(&mut self, now: Instant, report: &DualReport);
}

/// What the ZS9's PWM interrupt needs of a board.
pub trait DualPwmPort {
    /// The conversions at the carrier's peak `now`.
    fn sample(&mut self, now: Instant) -> PowerSample;
    /// Loads the shadow registers: `next` takes over at the next valley.
    fn play(&mut self, now: Instant, next: &PlayedPeriod);
    /// Turns all nine gates off at once, until an acknowledge, whatever is played.
    fn gates_off(&mut self, now: Instant);
    /// Lets the gates be played again, after an acknowledge; they stay off until then. `false` when something holds them: a cause in
    /// hardware, or a board that only a reset lets go on.
    fn leave(&mut self, _now: Instant) -> bool {
        false
    }
}
