//! The ports: the functions that each task needs from a board, and the samples and pulses that pass through them.

#![forbid(unsafe_code)]

mod dual;
mod report;

use crate::control::{Demand, LinkWindow, Measurements, Warmth};
use crate::frames::{Abc, Angle};
use crate::modulation::CarrierHalf;
use crate::protection::{Fault, LegFaults, SafeState};
use crate::time::Instant;

pub use dual::{
    DualDriveCommand, DualSample, GateFeedback, HardwareBreak, MotorDemand, PlayedPeriod, PowerSample,
};
pub use report::{DualReport, Report};

/// A control sample: the values of the converters and of the position sensor, and any cause that holds the gates off in hardware.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Sample {
    /// Phase currents at the control timer's nominal instant, positive into the machine, in A.
    pub currents_a: Abc,
    /// DC-link voltage at that instant, in V.
    pub udc_v: f32,
    /// Rotor angle at that instant, electrical, of a sensor that counts the middle of its count; `None` while it is not known, or no longer known.
    pub angle: Option<Angle>,
    /// `true` while the board lets the gates pulse: its enable input is high, and no break holds them.
    pub may_pulse: bool,
    /// The cause that holds the gates off in hardware.
    pub hardware: Option<Fault>,
}

impl Sample {
    /// The control law's measurements. An unknown angle counts as 0; no pulses are made from it.
    #[inline]
    pub fn measured(&self) -> Measurements {
        let Self { currents_a, udc_v, angle, .. } = *self;
        Measurements { currents_a, udc_v, angle: angle.unwrap_or(Angle::ZERO) }
    }
}

/// The operator's command to the drive.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct DriveCommand {
    /// Gates may pulse.
    pub enable: bool,
    /// The torque demand.
    pub demand: Demand,
    /// DC-link voltages at which torque is reduced to zero.
    pub window: LinkWindow,
    /// Number of the operator's last acknowledge: a new one, with the gates off, makes both interrupts forget their fault.
    pub acknowledge: u8,
    /// The warmth of the machine, if its temperatures are measured.
    pub warmth: Warmth,
    /// The position sensor's zero is to be calibrated, as long as no torque is demanded.
    pub calibrate: bool,
}

impl DriveCommand {
    /// No command.
    pub const NONE: Self = Self {
        enable: false,
        demand: Demand { torque_nm: 0.0, slew_limited: true },
        window: LinkWindow::OPEN,
        acknowledge: 0,
        warmth: Warmth::NONE,
        calibrate: false,
    };
}

impl Default for DriveCommand {
    fn default() -> Self {
        Self::NONE
    }
}

/// One of the two drives: the types that pass through its ports.
pub trait System {
    /// The sample of the control interrupt.
    type Sample;
    /// The operator's command.
    type Command;
    /// The report of the control task.
    type Report;
    /// The sample of the PWM interrupt.
    type PwmSample;
    /// The pulses that the timers play.
    type Pulses;
}

/// The PMaSynRM's two-level inverter.
#[derive(Clone, Copy, Debug)]
pub struct Traction;

/// The ZS9 with its two motors.
#[derive(Clone, Copy, Debug)]
pub struct Dual;

impl System for Traction {
    type Sample = Sample;
    type Command = DriveCommand;
    type Report = Report;
    /// Phase currents, in A.
    type PwmSample = Abc;
    type Pulses = CarrierHalf;
}

impl System for Dual {
    type Sample = DualSample;
    type Command = DualDriveCommand;
    type Report = DualReport;
    type PwmSample = PowerSample;
    type Pulses = PlayedPeriod;
}

/// The port of the control interrupt to a board.
pub trait ControlPort<S: System = Traction> {
    /// First call of every interrupt: clears the timer's flag. If control `revises` the pulses, the new half is ready, and the PWM interrupt has run when
    /// this returns.
    fn begin(&mut self, _revises: bool) {}
    /// The conversions that the control timer triggered at `now`.
    fn sample(&mut self, now: Instant) -> S::Sample;
    /// The command of this period, after [`Self::sample`]: the `operator`'s. A board that gets it from elsewhere, as a simulated one may, returns its
    /// own.
    #[inline]
    fn command(&mut self, _now: Instant, operator: impl FnOnce() -> S::Command) -> S::Command {
        operator()
    }
    /// Puts the gates into the safe state at once, until an acknowledge, whatever is being played. Gates off may become a short circuit later; a
    /// short circuit remains one, whatever either interrupt then orders.
    fn enter(&mut self, safe: SafeState, now: Instant);
    /// The number of ticks by which the interrupt, begun nominally at `now`, has exceeded `deadline_ticks`; 0 when in time.
    fn overrun_ticks(&mut self, now: Instant, deadline_ticks: u32) -> u32;
    /// The control task's report, for any observer; it is made only when called for.
    fn report(&mut self, now: Instant, report: impl FnOnce() -> S::Report);
    /// The faults that the power stage reports for its legs; none if it cannot report.
    fn leg_faults(&mut self) -> LegFaults {
        LegFaults::default()
    }
    /// Electrical turn of the rotor at the newest sample, since a position sensor that only counts began to count; asked for while that sensor has no
    /// angle. `None` if there is nothing to count.
    fn turned(&mut self) -> Option<Angle> {
        None
    }
    /// The electrical angle that the rotor had where the counting began: from the next sample on the sensor has an angle, until an index gives a
    /// better one. For a machine without magnets it may be half a turn off, which an index must leave: [`axis_error`](crate::start_up::axis_error).
    fn align(&mut self, _now: Instant, _zero: Angle) {}
}

/// The port of the PWM interrupt to a board.
pub trait PwmPort<S: System = Traction> {
    /// First call in the interrupt: takes the timer's flag back. `false` when the interrupt does not come for a boundary: it was requested not by the
    /// PWM timer but by control, to revise the pulses; or there is nothing to be done.
    fn begin(&mut self) -> bool {
        true
    }
    /// The conversions at the carrier boundary `now`; for the ZS9 at the carrier's peak.
    fn sample(&mut self, now: Instant) -> S::PwmSample;
    /// Loads the shadow registers: `next` takes over when the half that begins `now` ends; for the ZS9 at the next valley.
    fn play(&mut self, now: Instant, next: &S::Pulses);
    /// As [`ControlPort::enter`].
    fn enter(&mut self, safe: SafeState, now: Instant);
    /// `true` if the last pulses came after the half that they were for had ended; the gates are off then.
    fn is_late(&mut self) -> bool {
        false
    }
    /// Leaves the safe state: gates off, until pulses are played again. `false` when something holds the gates: a cause in hardware, or a board that
    /// requires a reset to continue.
    fn leave(&mut self, _now: Instant) -> bool {
        false
    }
    /// As [`ControlPort::leg_faults`].
    fn leg_faults(&mut self) -> LegFaults {
        LegFaults::default()
    }
}
