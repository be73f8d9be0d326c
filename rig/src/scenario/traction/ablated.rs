//! The project's control law with one part of it taken away, to show the benefit of that part.
//!
//! Each stage of the law is called with inputs other than the drive's, so the law itself is the image's, instruction for instruction.

use clap::ValueEnum;
use serde::Serialize;
use tractive::control::{
    AimInput, Boundary, Committed, ControlLaw, Controller, DeadTime, Gains, Law, ModeLimits, Regulated,
    RotorSample, SpeedTracker, Target, VoltageVector,
};
use tractive::frames::AlphaBeta;
use tractive::machine::Tables;
use tractive::time::Clock;

/// A part of the law.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Part {
    /// Prediction over committed pulses: the loop then closes on the flux linkage at the sample
    Prediction,
    /// Subtraction of the pattern's ripple
    Ripple,
    /// Observer of the disturbance: no integral part, and no estimate of the map's error
    Observer,
    /// The sixth harmonic in the observer
    Sixth,
    /// Torque of the ripple, predicted from the map
    Foreseen,
    /// Trim of mean torque
    Trim,
    /// Damping of the link behind a line filter
    Damping,
}

/// The law without a part.
#[derive(Clone, Copy, Debug)]
pub struct Ablated {
    controller: Controller,
    part: Part,
}

impl Ablated {
    /// At rest.
    pub const fn new(part: Part) -> Self {
        Self { controller: Controller::new(), part }
    }

    /// The gains that are left.
    fn gains(&self, gains: &Gains) -> Gains {
        match self.part {
            Part::Sixth => Gains { sixth_turn_rad: 0.0, ..*gains },
            Part::Damping => Gains { link_damping: 0.0, ..*gains },
            _ => *gains,
        }
    }
}

impl ControlLaw for Ablated {
    fn tracker(&self) -> &SpeedTracker {
        self.controller.tracker()
    }

    fn tracker_mut(&mut self) -> &mut SpeedTracker {
        self.controller.tracker_mut()
    }

    fn link_scale(&self) -> f32 {
        self.controller.link_scale()
    }

    fn map_error(&self) -> f32 {
        self.controller.map_error()
    }

    fn passed_s(&self, clock: &Clock) -> f32 {
        self.controller.passed_s(clock)
    }

    fn target(&self) -> &Target {
        self.controller.target()
    }

    fn idle(&mut self) {
        self.controller.idle();
    }

    fn begin_without_torque(&mut self) {
        self.controller.begin_without_torque();
    }

    fn observe(&mut self, sample: &RotorSample, tables: &Tables) {
        self.controller.observe(sample, tables);
    }

    fn learn(&mut self, boundary: &Boundary, sample: &RotorSample, follows: Regulated, law: &Law) {
        if self.part != Part::Observer {
            let gains = self.gains(law.gains);
            self.controller.learn(boundary, sample, follows, &Law { gains: &gains, ..*law });
        }
    }

    fn explain(&mut self, dead: DeadTime, law: &Law) {
        self.controller.explain(dead, law);
    }

    fn aim(&mut self, input: &AimInput, law: &Law) {
        let gains = self.gains(law.gains);
        let limits = match self.part {
            Part::Foreseen => ModeLimits { ripple_s2: None, ..*input.limits },
            // No ripple that tells anything.
            Part::Trim => ModeLimits { ripple_share: 0.0, ..*input.limits },
            _ => *input.limits,
        };
        self.controller.aim(&AimInput { limits: &limits, ..*input }, &Law { gains: &gains, ..*law });
    }

    fn regulate(
        &mut self,
        sample: &RotorSample,
        committed: &Committed,
        limits: &ModeLimits,
        law: &Law,
    ) -> VoltageVector {
        let now = committed.volt_seconds.map(|_| AlphaBeta::default());
        let committed = match self.part {
            Part::Prediction => Committed { horizon_s: 0.0, volt_seconds: now, ..*committed },
            Part::Ripple => Committed { ripple_wb: None, ..*committed },
            _ => *committed,
        };
        self.controller.regulate(sample, &committed, limits, law)
    }
}
