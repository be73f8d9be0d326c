//! Things that go wrong on purpose.

use super::network::{NetworkFault, NetworkSpoiler};
use super::sensor::{AngleFault, AngleSpoiler, CurrentFault, CurrentSpoiler};
use super::{ControlFault, GoesWrong, Injected, Injection};
use std::str::FromStr;
use tractive::frames::Abc;
use tractive::ports::{DualDriveCommand, DualSample, MotorDemand, PowerSample};
use tractive::protection::{Fault, LinkLimits};

/// The faults of the ZS9.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Kind {
    /// The source is shorted.
    SourceShort,
    /// The source is cut off: the capacitor behind its contactor feeds the network.
    SourceLost,
    /// The source falls to 0.625 of its voltage, 250 V of the paper's 400, or below its trip level if that is lower.
    SourceLow,
    /// The source jumps to 2.25 times its voltage, 900 V of the paper's 400, or above the capacitors' trip level, and charges them.
    SourceHigh,
    /// The upper motor's sensor reports that it has lost the rotor.
    SensorLost1,
    /// The lower motor's.
    SensorLost2,
    /// The upper motor's angle stands still.
    SensorFrozen1,
    /// The lower motor's.
    SensorFrozen2,
    /// The lower motor's angle jumps by 90 degrees.
    SensorJump2,
    /// A phase current reads three times its size.
    Overcurrent,
    /// A phase current reads as not a number.
    NotFinite,
    /// Leg v, middle gate: never seen off.
    LegStuckOn,
    /// Leg w, upper gate: never seen on.
    LegStuckOff,
    /// The current sensor of phase 0 ..= 2 of motor 0 or 1.
    Current(usize, usize, CurrentFault),
    /// The angle sensor of motor 0 or 1.
    Angle(usize, AngleFault),
    /// A sensor of the network.
    Network(NetworkFault),
    /// A gate's order, in the order of [`tractive::nine_switch::GATES`], is stuck, on (true) or off, until the gates are turned off
    /// for good.
    Gate(u8, bool),
    /// All gates of leg 0 ..= 2 are on, until the gates are turned off for good.
    ShootThrough(u8),
    /// The source's switch no longer turns on; only its diode is left.
    SourceSwitchOpen,
    /// The source swings by this amplitude (V) at this frequency (Hz).
    SourceSwings(f64, f64),
    /// The capacitors lose half of their capacitance.
    CapacitorsHalved,
    /// The control interrupt.
    Control(ControlFault),
    /// A torque demand is NaN.
    DemandNotFinite,
    /// The demanded link voltage needs too much shoot-through.
    LinkOutOfRange,
    /// The gate drivers are not ready for 50 ms.
    GateDriver,
    /// Nothing on the bench: what is wrong lies elsewhere.
    Elsewhere,
}

const NAMES: [(&str, Kind); 13] = [
    ("source-short", Kind::SourceShort),
    ("source-low", Kind::SourceLow),
    ("source-high", Kind::SourceHigh),
    ("sensor-lost-1", Kind::SensorLost1),
    ("sensor-lost-2", Kind::SensorLost2),
    ("sensor-frozen-1", Kind::SensorFrozen1),
    ("sensor-frozen-2", Kind::SensorFrozen2),
    ("sensor-jump-2", Kind::SensorJump2),
    ("overcurrent", Kind::Overcurrent),
    ("not-finite", Kind::NotFinite),
    ("leg-stuck-on", Kind::LegStuckOn),
    ("leg-stuck-off", Kind::LegStuckOff),
    ("gate-driver", Kind::GateDriver),
];

impl GoesWrong for Kind {
    fn control(self) -> Option<ControlFault> {
        match self {
            Self::Control(fault) => Some(fault),
            _ => None,
        }
    }
}

/// Written `NAME@S`.
impl FromStr for Injection<Kind> {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let parse = || {
            let (name, at) = text.split_once('@')?;
            let (_, kind) = NAMES.into_iter().find(|(known, _)| *known == name)?;
            let at_s = at.parse::<f64>().ok().filter(|at_s| at_s.is_finite())?;
            Some(Self { kind, at_s })
        };
        let names = NAMES.map(|(name, _)| name).join(", ");
        parse().ok_or_else(|| format!("must be NAME@SECONDS, NAME one of {names}"))
    }
}

/// Levels that an injected fault is measured by.
#[derive(Clone, Copy, Debug, Default)]
pub struct Levels {
    /// The upper motor's largest current, in A.
    pub largest_a: f64,
    /// Trip level of the source, in V.
    pub source_min_v: f64,
    /// The capacitors', in V.
    pub capacitor_max_v: f64,
}

impl Levels {
    /// Of a motor with this largest current, in A, on a link with these limits.
    pub fn new(largest_a: f64, limits: &LinkLimits) -> Self {
        let LinkLimits { source_min_v, capacitor_max_v, .. } = *limits;
        Self { largest_a, source_min_v: source_min_v.into(), capacitor_max_v: capacitor_max_v.into() }
    }
}

/// The effect of a fault on the samples.
#[derive(Clone, Debug, Default)]
pub struct Spoiler {
    /// The fault that is injected.
    pub injected: Injected<Kind>,
    before: Option<DualSample>,
    current: Option<(usize, CurrentSpoiler)>,
    angle: Option<(usize, AngleSpoiler)>,
    network: Option<NetworkSpoiler>,
    levels: Levels,
}

/// A low and a high source, over its voltage: 250 and 900 V of 400.
const LOW: f64 = 0.625;
const HIGH: f64 = 2.25;
/// The same over the trip levels of source and capacitors, at most and at least.
const BELOW: f64 = 0.9;
const ABOVE: f64 = 1.1;
/// An overcurrent over a machine's largest current: 200 A of 85.
const OVER: f64 = 200.0 / 85.0;

/// The time for which the gate drivers are not ready, in s.
const DRIVER_FAULT_S: f64 = 0.05;

impl Spoiler {
    /// Spoils from the injection's instant on, measured by these levels.
    pub fn new(injection: Option<Injection<Kind>>, levels: Levels) -> Self {
        let (mut current, mut angle, mut network) = (None, None, None);
        match injection.map(|injection| injection.kind) {
            Some(Kind::Current(motor, phase, fault)) => {
                current = Some((motor, CurrentSpoiler::new(phase, fault)));
            }
            Some(Kind::Angle(motor, fault)) => angle = Some((motor, AngleSpoiler::new(fault))),
            Some(Kind::Network(fault)) => network = Some(NetworkSpoiler::new(fault)),
            _ => {}
        }
        Self { injected: Injected(injection), before: None, current, angle, network, levels }
    }

    /// The converters' reading of the phase currents.
    fn currents(&mut self, t_s: f64, currents_a: &mut [Abc; 2]) {
        let broken = self.injected.kind(t_s).is_some();
        if let Some((motor, sensor)) = &mut self.current
            && let Some(currents_a) = currents_a.get_mut(*motor)
        {
            *currents_a = sensor.read(broken, *currents_a);
        }
    }

    /// The cause that holds the gates off in hardware at an instant.
    pub fn hardware(&self, t_s: f64) -> Option<Fault> {
        let injection = self.injected.0.filter(|injection| injection.kind == Kind::GateDriver)?;
        (0.0..DRIVER_FAULT_S).contains(&(t_s - injection.at_s)).then_some(Fault::GateDriver)
    }

    /// The source's true voltage, in V, of a healthy one's.
    pub fn source_v(&self, t_s: f64, source_v: f64) -> f64 {
        match self.injected.kind(t_s) {
            Some(Kind::SourceShort) => 1.0,
            Some(Kind::SourceLow) => (LOW * source_v).min(BELOW * self.levels.source_min_v),
            Some(Kind::SourceHigh) => (HIGH * source_v).max(ABOVE * self.levels.capacitor_max_v),
            Some(Kind::SourceSwings(amplitude_v, hz)) => {
                let since_s = self.injected.since_s(t_s);
                source_v + amplitude_v * libm::sin(core::f64::consts::TAU * hz * since_s)
            }
            _ => source_v,
        }
    }

    /// Spoils control's sample and its command.
    pub fn control(&mut self, t_s: f64, sample: &mut DualSample, command: &mut DualDriveCommand) {
        let before = self.before.replace(*sample).unwrap_or(*sample);
        self.currents(t_s, &mut sample.currents_a);
        let kind = self.injected.kind(t_s);
        if let Some(network) = &mut self.network {
            network.read(kind.is_some(), &mut sample.capacitor_v, &mut sample.source_v);
            sample.inductor_a = network.read_inductor(kind.is_some(), sample.inductor_a);
        }
        if let Some((motor, sensor)) = &mut self.angle
            && let Some(Some(angle)) = sample.angles.get_mut(*motor)
        {
            *angle = sensor.read(kind.is_some(), *angle);
        }
        let [first, second] = &mut sample.angles;
        match self.injected.kind(t_s) {
            Some(Kind::SensorLost1) => *first = None,
            Some(Kind::SensorLost2) => *second = None,
            Some(Kind::SensorFrozen1) => {
                *first = before.angles[0];
                self.before = Some(*sample);
            }
            Some(Kind::SensorFrozen2) => {
                *second = before.angles[1];
                self.before = Some(*sample);
            }
            Some(Kind::SensorJump2) => {
                if let Some(angle) = second {
                    angle.0 = angle.0.wrapping_add(1 << 30);
                }
            }
            Some(Kind::NotFinite) => sample.currents_a[1].b = f32::NAN,
            Some(Kind::DemandNotFinite) => command.demands[1] = MotorDemand::Speed(f32::NAN),
            Some(Kind::LinkOutOfRange) => command.link_ref_v *= 2.0,
            _ => {}
        }
    }

    /// Spoils the PWM interrupt's sample.
    pub fn power(&mut self, t_s: f64, sample: &mut PowerSample) {
        self.currents(t_s, &mut sample.currents_a);
        let broken = self.injected.kind(t_s).is_some();
        if let Some(network) = &mut self.network {
            network.read(broken, &mut sample.capacitor_v, &mut sample.source_v);
        }
        match self.injected.kind(t_s) {
            Some(Kind::Overcurrent) => {
                let current = &mut sample.currents_a[0].a;
                *current = ((OVER * self.levels.largest_a) as f32).copysign(*current);
            }
            Some(Kind::LegStuckOn) => sample.gates.off &= !(1 << 4),
            Some(Kind::LegStuckOff) => sample.gates.on &= !(1 << 2),
            _ => {}
        }
    }
}
