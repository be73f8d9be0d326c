//! Sensors that fail at an instant, and their readings from then on.

use rand::SeedableRng;
use rand::rngs::StdRng;
use rand_distr::{Distribution, Normal};
use serde::Serialize;
use std::collections::VecDeque;
use tractive::frames::{Abc, Angle};

/// The fault of a current sensor.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum CurrentFault {
    /// Repeats its last reading.
    Stuck,
    /// Reads nothing.
    Open,
    /// Reads too much by this offset, in A.
    Offset(f64),
    /// Reads this many times the current.
    Scaled(f64),
    /// Adds white noise of this rms value, in A.
    Noisy(f64),
    /// Reads the end of its range, in A.
    Railed(f64),
    /// Reads NaN.
    NotFinite,
}

/// The fault of an angle sensor. Angles electrical, in degrees.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum AngleFault {
    /// Stands still.
    Frozen,
    /// Is off by this angle from then on.
    Jump(f64),
    /// Is off by this angle once in this many samples.
    Glitches(f64, u32),
    /// Counts the other way.
    Reversed,
    /// Lags by this many samples.
    Late(usize),
}

/// Seed of a sensor's noise.
const SEED: u64 = 1;

/// One current sensor of three, from an instant on.
#[derive(Clone, Debug)]
pub struct CurrentSpoiler {
    phase: usize,
    fault: CurrentFault,
    last_a: f32,
    random: StdRng,
}

impl CurrentSpoiler {
    /// The sensor of phase 0 ..= 2.
    pub fn new(phase: usize, fault: CurrentFault) -> Self {
        Self { phase, fault, last_a: 0.0, random: StdRng::seed_from_u64(SEED) }
    }

    /// The reading while `true_a` flows.
    pub fn read(&mut self, broken: bool, mut true_a: Abc) -> Abc {
        let reading = match self.phase {
            0 => &mut true_a.a,
            1 => &mut true_a.b,
            _ => &mut true_a.c,
        };
        if !broken {
            self.last_a = *reading;
            return true_a;
        }
        *reading = match self.fault {
            CurrentFault::Stuck => self.last_a,
            CurrentFault::Open => 0.0,
            CurrentFault::Offset(offset_a) => *reading + offset_a as f32,
            CurrentFault::Scaled(factor) => *reading * factor as f32,
            CurrentFault::Noisy(rms_a) => {
                let noise = Normal::new(0.0, rms_a).map_or(0.0, |noise| noise.sample(&mut self.random));
                *reading + noise as f32
            }
            CurrentFault::Railed(end_a) => end_a as f32,
            CurrentFault::NotFinite => f32::NAN,
        };
        true_a
    }
}

/// An angle sensor, from an instant on.
#[derive(Clone, Debug)]
pub struct AngleSpoiler {
    fault: AngleFault,
    /// The true angles of the last samples, the newest one last.
    last: VecDeque<Angle>,
    broken_for: u32,
    broke_at: Angle,
}

impl AngleSpoiler {
    /// A sensor that is still good.
    pub fn new(fault: AngleFault) -> Self {
        Self { fault, last: VecDeque::new(), broken_for: 0, broke_at: Angle::ZERO }
    }

    /// The reading when the rotor is at `angle`; called once a sample.
    pub fn read(&mut self, broken: bool, angle: Angle) -> Angle {
        let kept = if let AngleFault::Late(samples) = self.fault { samples } else { 0 };
        self.last.push_back(angle);
        while self.last.len() > kept + 1 {
            self.last.pop_front();
        }
        if !broken {
            self.broke_at = angle;
            return angle;
        }
        let sample = self.broken_for;
        self.broken_for += 1;
        match self.fault {
            AngleFault::Frozen => self.broke_at,
            AngleFault::Jump(degrees) => angle + electrical(degrees),
            AngleFault::Glitches(degrees, every) if sample.is_multiple_of(every) => {
                angle + electrical(degrees)
            }
            AngleFault::Glitches(..) => angle,
            AngleFault::Reversed => self.broke_at + (self.broke_at - angle),
            AngleFault::Late(_) => self.last.front().copied().unwrap_or(angle),
        }
    }
}

fn electrical(degrees: f64) -> Angle {
    Angle((degrees / 360.0 * 4_294_967_296.0).round() as i64 as u32)
}
