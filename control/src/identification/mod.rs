//! Identification of a machine by its own drive: a control law whose voltages are an experiment.
//!
//! The law knows only the machine's ratings: pole pairs, largest current, largest speed; neither its flux map nor its resistance. It
//! wants a certain change of current from each command, finds out which volt-seconds that takes, and tells at each carrier boundary what
//! acted and what flowed ([`Observation`]). The map is fitted elsewhere.
//!
//! 1. **Probe**: nothing at first, which shows the [noise](Noise) of the currents; then pulses along d, longer each time, until a current moves.
//! 2. **Staircase**: direct currents along d, which give no torque: stator resistance and the inverter's voltage error. If they turn a free
//!    rotor, the angle's zero is off: a current along q brings the rotor back, and the frame turns until none is needed.
//! 3. **Pulses** along d, along q, along both: alternating voltages that are reversed when the current would leave the bound at the end
//!    of the commanded half. Torque of one sign follows torque of the other, and the side that has turned the rotor further is
//!    given less: a free rotor swings, and stays where it is.
//! 4. **Turn**: a little torque until the rotor turns slowly, no current for a while, and the same torque against it: the magnets'
//!    flux and the inertia.
//!
//! From boundary to boundary, the stator equation in the stationary frame, `Δψ = ∫u dt − R ∫i dt`, holds whatever the rotor does meanwhile.

#![forbid(unsafe_code)]

mod course;
mod followed;
mod gathered;
mod inductance;
mod noise;
mod observation;
mod packed;
mod pulses;
mod zero;

use crate::control::{
    AimInput, Boundary, Committed, ControlLaw, Law, ModeLimits, Regulated, RotorSample, SpeedTracker, Target,
    VoltageVector,
};
use crate::frames::{AlphaBeta, Dq, SinCos, six_step_v};
use crate::machine::Tables;
use crate::time::Clock;
use course::{Course, Seen};
use gathered::Gathered;
use inductance::Inductance;

pub use course::QUIET_CHANGES;
pub use noise::{Noise, PROBED_NOISE_SHARE};
pub use observation::{OBSERVATION_WORDS, Observation, Stage};
pub use packed::{PACKED_WORDS, Packed, Units};

/// Share of the largest voltage of a carrier that the experiment uses.
const USED_SHARE: f32 = 0.95;

const NONE: Dq = Dq { d: 0.0, q: 0.0 };

/// The law's state between two control periods.
#[derive(Clone, Copy, Debug)]
pub struct Identification {
    speed: SpeedTracker,
    target: Target,
    course: Course,
    /// Incremental inductance where the current is.
    inductance: Inductance,
    /// The current of the newest boundary in A, and the direction of the rotor's d axis there by the angle.
    last: Option<(Dq, SinCos)>,
    /// The current in the middle of the way made by the newest command, in A: its inductance is the way's. With that of the way's beginning, 13 of 56
    /// experiments with an L_q that falls to 0.4 of itself go a tenth beyond the bound; with this one, none.
    middle: Dq,
    told: Option<Observation>,
    gathered: Gathered,
    /// Samples since the last operating point.
    samples: u32,
    /// The largest voltage that may be made, in V.
    limit_v: f32,
    /// DC-link voltage, in V.
    udc_v: f32,
}

impl Identification {
    /// Before the experiment.
    pub const fn new() -> Self {
        Self {
            speed: SpeedTracker::new(),
            target: Target::NONE,
            course: Course::new(),
            inductance: Inductance::UNKNOWN,
            last: None,
            middle: NONE,
            told: None,
            gathered: Gathered::NOTHING,
            samples: 0,
            limit_v: 0.0,
            udc_v: 0.0,
        }
    }

    /// The newest observation, once.
    pub fn take(&mut self) -> Option<Observation> {
        self.told.take()
    }

    /// The part of the experiment in progress.
    pub fn stage(&self) -> Stage {
        self.course.stage()
    }

    /// The voltage that changes a current by so much within an interval, within the limit.
    fn voltage(&self, ahead: Dq, change: Dq, frame: SinCos, interval_s: f32) -> Dq {
        let drop = self.course.drop_v(ahead + change * 0.5, frame);
        let wanted = self.inductance.flux(change) * (1.0 / interval_s) + drop;
        let length = wanted.length();
        if length > self.limit_v { wanted * (self.limit_v / length) } else { wanted }
    }
}

impl ControlLaw for Identification {
    // Its operating point is the experiment's next step.
    const POINT_SERVES: bool = false;

    fn tracker(&self) -> &SpeedTracker {
        &self.speed
    }

    fn tracker_mut(&mut self) -> &mut SpeedTracker {
        &mut self.speed
    }

    fn passed_s(&self, clock: &Clock) -> f32 {
        self.samples as f32 * clock.control_s()
    }

    fn target(&self) -> &Target {
        &self.target
    }

    fn idle(&mut self) {
        // What has not begun is as before.
        if self.last.is_some() || !self.inductance.is_unknown() {
            *self = Self { speed: self.speed, ..Self::new() };
        }
        (self.samples, self.target) = (0, Target::NONE);
    }

    fn begin_without_torque(&mut self) {}

    fn observe(&mut self, _sample: &RotorSample, _tables: &Tables) {
        self.samples += 1;
    }

    fn learn(&mut self, boundary: &Boundary, sample: &RotorSample, _follows: Regulated, law: &Law) {
        let (current, frame) = self.course.zero().seen(sample.current, sample.frame);
        let before = self.last.replace((current, sample.frame));
        let volt_seconds = boundary.volt_seconds.unwrap_or_default();
        let ratings = &law.tables.ratings;
        if let (Some((before, from)), Some(acted)) = (before, boundary.volt_seconds) {
            let seen = Seen {
                before,
                current,
                acted: acted.park(frame),
                turned: sample.frame.sin * from.cos - sample.frame.cos * from.sin,
                length_s: boundary.length_s,
                omega: self.speed.omega(),
                frame,
            };
            self.inductance.at((seen.before + seen.current) * 0.5, ratings.max_current_a);
            self.course.learn(&seen, &mut self.inductance, ratings);
        }
        let observation = Observation {
            stage: self.course.stage(),
            volt_seconds,
            length_s: boundary.length_s,
            current: sample.current,
            frame: sample.frame,
            udc_v: self.udc_v,
        };
        self.told = if observation.stage == Stage::Turn {
            self.gathered.take(observation)
        } else {
            Some(observation)
        };
    }

    fn aim(&mut self, input: &AimInput, _law: &Law) {
        self.samples = 0;
        self.udc_v = input.udc_v;
        self.limit_v = USED_SHARE * input.limits.index_limit * six_step_v(input.udc_v);
        self.target = Target { voltage_limit_v: self.limit_v, ..Target::NONE };
    }

    fn regulate(
        &mut self,
        sample: &RotorSample,
        committed: &Committed,
        _limits: &ModeLimits,
        law: &Law,
    ) -> VoltageVector {
        // Gates that are still off begin without voltage.
        let (here, frame) = self.course.zero().seen(sample.current, sample.frame);
        let voltage = committed.volt_seconds.map_or(NONE, |volt_seconds| {
            let interval_s = committed.interval_s;
            let bound_a = law.tables.ratings.max_current_a;
            self.inductance.at(self.middle, bound_a);
            let left = self.course.drop_v(here, frame) * committed.horizon_s;
            let ahead = here + self.inductance.current(volt_seconds.park(frame) - left);
            self.inductance.at(ahead, bound_a);
            let reach = self.limit_v * interval_s;
            self.course.lasts(interval_s);
            let change = self.course.change(ahead, reach, &mut self.inductance, &law.tables.ratings);
            self.middle = ahead + change * 0.5;
            self.inductance.at(self.middle, bound_a);
            self.voltage(ahead, change, frame, interval_s)
        });
        let (length_v, vector): (f32, AlphaBeta) = (voltage.length(), voltage.unpark(frame));
        VoltageVector { voltage_v: length_v, vector, carrier: vector, steady_v: length_v }
    }
}
