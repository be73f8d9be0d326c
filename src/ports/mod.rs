//! The ports: what each task needs of a board, and the samples and pulses that pass through them.

#![forbid(unsafe_code)]

mod dual;
mod report;

use crate::control::{Demand, LinkWindow, Measurements};
use crate::frames::{Abc, Angle};
use crate::modulation::CarrierPeriod;
use crate::protection::{Fault, LegFaults, SafeState};
use crate::time::Instant;

pub use dual::{
    DualControlPort, DualPwmPort, DualSample, GateFeedback, HardwareBreak, MotorDemand, PlayedPeriod,
    PowerSample,
};
pub use report::{DualReport, Report};

/// A control sample: what the converters hold, and what the operator wants.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Phase currents at the control timer's nominal instant, positive into the machine, in A.
    pub currents_a: Abc,
    /// DC-link voltage at that instant, in V.
    pub udc_v: f32,
    /// Rotor angle at that instant, electrical; `None` while it is not known, or no longer.
    pub angle: Option<Angle>,
    /// The torque demand.
    pub demand: Demand,
    /// Whether the gates may be on.
    pub enable: bool,
    /// DC-link voltages at which torque ends.
    pub window: LinkWindow,
    /// Number of the operator's last acknowledge; a new one makes the drive forget its fault.
    pub acknowledge: u8,
    /// What holds the gates off in hardware.
    pub hardware: Option<Fault>,
}

impl Sample {
    /// The control law's measurements. An angle that is not known counts as 0; no pulses are made of it.
    #[inline]
    pub fn measured(&self) -> Measurements {
        let Self { currents_a, udc_v, angle, .. } = *self;
        Measurements { currents_a, udc_v, angle: angle.unwrap_or(Angle::ZERO) }
    }
}

/// What the control interrupt needs of a board.
pub trait ControlPort {
    /// The conversions that the control timer triggered at `now`.
    fn sample(&mut self, now: Instant) -> Sample;
    /// Puts the gates into the safe state at once, whatever the modulator plays.
    fn enter(&mut self, safe: SafeState, now: Instant);
    /// By how many ticks the interrupt, begun nominally at `now`, has outlived its period; 0 when in time.
    fn overrun_ticks(&mut self, now: Instant) -> u32;
    /// What the control task did, for whoever watches.
    fn report(&mut self, now: Instant, report: &Report);
    /// What the power stage tells of itself; nothing where it cannot.
    fn leg_faults(&mut self) -> LegFaults {
        LegFaults::default()
    }
}

/// What the PWM interrupt needs of a board.
pub trait PwmPort {
    /// Phase currents, sampled at the carrier boundary `now`.
    fn sample(&mut self, now: Instant) -> Abc;
    /// Loads the shadow registers: `next` takes over when the half that begins `now` ends.
    fn play(&mut self, now: Instant, next: &CarrierPeriod);
    /// Puts the gates into the safe state at once, whatever is played.
    fn enter(&mut self, safe: SafeState, now: Instant);
    /// Whether what was played last came after the half that it was for had ended; the gates are off then.
    fn is_late(&mut self) -> bool {
        false
    }
    /// Leaves the safe state: gates off, until pulses are played again. `false` when something holds the gates: a cause in
    /// hardware, or a board that only a reset lets go on.
    fn leave(&mut self, _now: Instant) -> bool {
        false
    }
    /// As [`ControlPort::leg_faults`].
    fn leg_faults(&mut self) -> LegFaults {
        LegFaults::default()
    }
}
