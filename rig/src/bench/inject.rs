//! Things that go wrong on purpose.

use crate::sensor_faults::{AngleFault, AngleSpoiler, CurrentFault, CurrentSpoiler};
use tractive::board::Sample;
use tractive::frames::Abc;

/// What goes wrong.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kind {
    /// The current sensor of phase 0 ..= 2.
    Current(usize, CurrentFault),
    /// The angle sensor.
    Angle(AngleFault),
    /// The supply.
    Supply(SupplyFault),
    /// A gate, in the order of [`super::GATES`], is stuck: on (true) or off.
    Gate(u8, bool),
    /// A device, in the order of [`super::GATES`], has failed and conducts for good.
    Device(u8),
    /// The monitor of leg 0 ..= 2 tells of an output at the lower rail.
    Feedback(usize),
    /// The control interrupt ends this many ticks after its period.
    ControlLate(u32),
    /// The control interrupt comes no more: no new commands.
    ControlStopped,
    /// The torque demand is NaN.
    DemandNotFinite,
    /// Nothing on the bench: what is wrong lies elsewhere.
    Elsewhere,
}

/// What the supply does wrong.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SupplyFault {
    /// The line is cut off.
    Lost,
    /// The line goes to this voltage, in V.
    To(f64),
    /// The line swings by this amplitude (V) at this frequency (Hz).
    Swinging(f64, f64),
}

/// What goes wrong, and when.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Injection {
    /// What.
    pub kind: Kind,
    /// From this instant of the recording on, in s.
    pub at_s: f64,
    /// Seed of what is random in it.
    pub seed: u64,
}

/// Holds what a fault does to the samples.
#[derive(Clone, Debug, Default)]
pub struct Spoiler {
    injection: Option<Injection>,
    current: Option<CurrentSpoiler>,
    angle: Option<AngleSpoiler>,
}

impl Spoiler {
    /// Spoils from the injection's instant on.
    pub fn new(injection: Option<Injection>) -> Self {
        let (mut current, mut angle) = (None, None);
        match injection {
            Some(Injection { kind: Kind::Current(phase, fault), seed, .. }) => {
                current = Some(CurrentSpoiler::new(phase, fault, seed));
            }
            Some(Injection { kind: Kind::Angle(fault), .. }) => angle = Some(AngleSpoiler::new(fault)),
            _ => {}
        }
        Self { injection, current, angle }
    }

    /// What is wrong at an instant, if anything is.
    pub fn kind(&self, t_s: f64) -> Option<Kind> {
        self.injection.filter(|injection| t_s >= injection.at_s - 1e-9).map(|injection| injection.kind)
    }

    /// What is wrong with the supply, and since when, in s.
    pub fn supply(&self, t_s: f64) -> Option<(SupplyFault, f64)> {
        let since_s = t_s - self.injection?.at_s;
        match self.kind(t_s)? {
            Kind::Supply(fault) => Some((fault, since_s)),
            _ => None,
        }
    }

    /// What the converters make of the phase currents.
    pub fn currents(&mut self, t_s: f64, true_a: Abc) -> Abc {
        let broken = self.kind(t_s).is_some();
        match &mut self.current {
            Some(sensor) => sensor.read(broken, true_a),
            None => true_a,
        }
    }

    /// What control sees, the currents apart.
    pub fn control(&mut self, t_s: f64, sample: &mut Sample) {
        let kind = self.kind(t_s);
        if let Some(sensor) = &mut self.angle {
            sample.measured.angle = sensor.read(kind.is_some(), sample.measured.angle);
        }
        if kind == Some(Kind::DemandNotFinite) {
            sample.demand.torque_nm = f32::NAN;
        }
    }
}
