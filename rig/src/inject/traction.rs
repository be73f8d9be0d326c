//! Things that go wrong on purpose.

use super::sensor::{AngleFault, AngleSpoiler, CurrentFault, CurrentSpoiler};
use super::{ControlFault, GoesWrong, Injected, Injection};
use tractive::frames::Abc;
use tractive::ports::{DriveCommand, Sample};

/// The faults of the PMaSynRM drive.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kind {
    /// The current sensor of phase 0 ..= 2.
    Current(usize, CurrentFault),
    /// The angle sensor.
    Angle(AngleFault),
    /// The angle sensor gives no angle: a resolver without its excitation, a frame that is missing or not framed as it should be.
    AngleMissing,
    /// The supply.
    Supply(SupplyFault),
    /// A gate, in the order of [`crate::trace::GATES`], is stuck: on (true) or off.
    Gate(u8, bool),
    /// A device, in the order of [`crate::trace::GATES`], has failed and conducts for good.
    Device(u8),
    /// The monitor of leg 0 ..= 2 reports an output at the lower rail.
    Feedback(usize),
    /// The control interrupt.
    Control(ControlFault),
    /// The torque demand is NaN.
    DemandNotFinite,
    /// Nothing on the bench: what is wrong lies elsewhere.
    Elsewhere,
}

impl GoesWrong for Kind {
    fn control(self) -> Option<ControlFault> {
        match self {
            Self::Control(fault) => Some(fault),
            _ => None,
        }
    }
}

/// The fault of the supply.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SupplyFault {
    /// The line is cut off.
    Lost,
    /// The line goes to this voltage, in V.
    To(f64),
    /// The line swings by this amplitude (V) at this frequency (Hz).
    Swinging(f64, f64),
}

/// The effect of a fault on the samples.
#[derive(Clone, Debug, Default)]
pub struct Spoiler {
    /// The fault that is injected.
    pub injected: Injected<Kind>,
    current: Option<CurrentSpoiler>,
    angle: Option<AngleSpoiler>,
}

impl Spoiler {
    /// Spoils from the injection's instant on.
    pub fn new(injection: Option<Injection<Kind>>) -> Self {
        let (mut current, mut angle) = (None, None);
        match injection.map(|injection| injection.kind) {
            Some(Kind::Current(phase, fault)) => current = Some(CurrentSpoiler::new(phase, fault)),
            Some(Kind::Angle(fault)) => angle = Some(AngleSpoiler::new(fault)),
            _ => {}
        }
        Self { injected: Injected(injection), current, angle }
    }

    /// The fault of the supply, and the time at which it began, in s.
    pub fn supply(&self, t_s: f64) -> Option<(SupplyFault, f64)> {
        match self.injected.kind(t_s)? {
            Kind::Supply(fault) => Some((fault, self.injected.since_s(t_s))),
            _ => None,
        }
    }

    /// The converters' reading of the phase currents.
    pub fn currents(&mut self, t_s: f64, true_a: Abc) -> Abc {
        let broken = self.injected.kind(t_s).is_some();
        match &mut self.current {
            Some(sensor) => sensor.read(broken, true_a),
            None => true_a,
        }
    }

    /// Spoils control's sample, except the currents, and its command.
    pub fn control(&mut self, t_s: f64, sample: &mut Sample, command: &mut DriveCommand) {
        let kind = self.injected.kind(t_s);
        if let Some(sensor) = &mut self.angle {
            sample.angle = sample.angle.map(|angle| sensor.read(kind.is_some(), angle));
        }
        match kind {
            Some(Kind::AngleMissing) => sample.angle = None,
            Some(Kind::DemandNotFinite) => command.demand.torque_nm = f32::NAN,
            _ => {}
        }
    }
}
