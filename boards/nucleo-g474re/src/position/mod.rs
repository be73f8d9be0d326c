//! The rotor's position: a trait, and four sensors.

mod absolute;
mod biss;
mod encoder;
mod resolver;

pub use absolute::{Absolute, decoded};
pub use biss::{Biss, CHANNELS, FRAME, checksum, position};
pub use encoder::{BY_TIM2, Encoder, TIM4_BY_TIM3};
pub use resolver::Resolver;

use super::pins::Pin;
use super::power_stage::PowerStage;
use super::registers::Registers;
use super::start::{StartError, Wait};
use core::sync::atomic::{AtomicU32, Ordering};
use tractive::frames::Angle;
use tractive::machine::Ratings;

// The sensor that the power stage's file names: the build script writes its type.
include!(concat!(env!("OUT_DIR"), "/position.rs"));

/// A source of the electrical angle. The power stage's file says which one the image contains.
pub trait Position: Sized {
    /// Its pins, in addition to those of [`PINS`](crate::pins::PINS).
    const PINS: &'static [Pin];

    /// Configures what the sensor needs, before the timers run.
    ///
    /// # Errors
    /// If a converter does not come up.
    fn prepare(registers: &Registers, stage: &PowerStage, wait: &mut dyn Wait) -> Result<(), StartError>;

    /// Starts, once the timers run, what they trigger.
    fn follow(_registers: &Registers, _wait: &mut dyn Wait) {}

    /// The sensor on the shaft of a machine of these ratings.
    fn of(registers: &Registers, stage: &PowerStage, ratings: &'static Ratings) -> Self;

    /// The angle at the control timer's update; `None` while it is not known, which keeps the gates off. Called in the control interrupt: it may not wait.
    fn angle(&mut self) -> Option<Angle>;

    /// `true` once the sensor has noticed that it lost its rotor: a fault, and for good.
    fn is_lost(&self) -> bool {
        false
    }

    /// Electrical turn since the sensor began to count, at the newest [`Position::angle`], while the angle is not known; `None` if nothing counts.
    fn counted(&self) -> Option<Angle> {
        None
    }

    /// Takes the electrical angle that the rotor had when the sensor began to count: the angle is known from now on.
    fn align(&mut self, _zero: Angle) {}
}

/// The state of a drive's position sensors: one word from the control interrupt, which reads them, to the idle loop.
#[derive(Debug)]
pub struct PositionState(AtomicU32);

impl PositionState {
    const KNOWN: u32 = 1;
    const LOST: u32 = 2;
    const COUNTED: u32 = 4;

    /// Nothing read yet.
    pub const fn new() -> Self {
        Self(AtomicU32::new(0))
    }

    /// Called in the control interrupt: the angles that the sensors gave, `true` for each that has lost its rotor, and `true` if the drive can find the
    /// angles.
    #[inline]
    pub(super) fn tell<const N: usize>(&self, angles: &[Option<Angle>; N], lost: &[bool; N], counted: bool) {
        let counted = if counted { Self::COUNTED } else { 0 };
        let known = if angles.iter().all(Option::is_some) { Self::KNOWN } else { 0 };
        let lost = if lost.contains(&true) { Self::LOST } else { 0 };
        self.0.store(known | lost | counted, Ordering::Relaxed);
    }

    /// `true` while an angle is unknown that the drive can find.
    pub fn is_counted(&self) -> bool {
        self.0.load(Ordering::Relaxed) & Self::COUNTED != 0
    }

    /// `true` once all angles are known.
    pub fn is_known(&self) -> bool {
        self.0.load(Ordering::Relaxed) & Self::KNOWN != 0
    }

    /// `true` once a sensor has noticed that it lost its rotor.
    pub fn is_lost(&self) -> bool {
        self.0.load(Ordering::Relaxed) & Self::LOST != 0
    }
}

/// The angle that the drive is given: `None` if the sensor has lost its rotor.
#[inline]
pub(super) fn reported(angle: Option<Angle>, lost: bool) -> Option<Angle> {
    if lost { None } else { angle }
}
