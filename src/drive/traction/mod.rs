//! The PMaSynRM drive: one control task, one PWM task, two cells.
//!
//! Control decides which voltage to apply; for the boundaries of the following period its task calls the modulator, which decides which pulses. The
//! PWM task loads each boundary's half; if the half is missing, that is a fault.
//!
//! Logical execution time: a command sampled at one control instant may be used from the next one on, and each task selects the other's words by
//! their instants, not by their arrival. So it makes no difference at which point one interrupt interrupts the other, and the same inputs give the
//! same pulses on every board and on the host.

mod applied;
mod control;
mod current_delay;
mod current_gains;
mod current_zeros;
mod pulses;
mod pwm;
mod six_step_exit;
mod slot;

use super::mailbox::OperatorMailboxes;
use super::messages::LOADED_WORDS;
use crate::cell::{History, Seqlock};
use crate::control::Gains;
use crate::modulation::SwitchLimits;
use crate::protection::Trip;
use crate::recorder::Recorder;
use crate::time::Clock;
use core::sync::atomic::AtomicU32;

pub use control::ControlTask;
pub use pulses::{PLANNED_SLOTS, Planned};
pub use pwm::PwmTask;
pub(super) use pwm::stale;

/// The settings of both tasks.
#[derive(Clone, Copy, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Settings {
    /// The timers' clock.
    pub clock: Clock,
    /// The inverter's devices.
    pub devices: SwitchLimits,
    /// The current loop's gains.
    pub gains: Gains,
    /// Age of the angle when it is sampled, in s; negative if it is read after the currents.
    pub angle_late_s: f32,
    /// Step of one count of the angle, electrical, in rad; 0: negligible.
    pub angle_step_rad: f32,
    /// Time constant of the current sensors' filter, in ticks, up to the shortest carrier half.
    pub current_filter_ticks: u32,
    /// The devices' drops.
    pub drops: Drops,
    /// The share of the machine's iron loss that is compensated, 0 ..= 1: [`Ratings::iron_share`](crate::machine::Ratings::iron_share), unless the
    /// drive is given another.
    pub iron_share: f32,
}

/// Voltage drops that the current through a leg takes from the link's voltage: means of IGBT and diode.
#[derive(Clone, Copy, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Drops {
    /// Constant part, whatever the current is, in V; 0: no compensation.
    pub threshold_v: f32,
    /// Part per ampere, in ohm.
    pub slope_ohm: f32,
}

impl Drops {
    /// Ideal devices.
    pub const NONE: Self = Self { threshold_v: 0.0, slope_ohm: 0.0 };

    fn is_none(&self) -> bool {
        self.threshold_v == 0.0
    }
}

/// Step of a count from which on the tracker's angle is nearer to the rotor's than the sensor's own, in rad: half a degree.
const COARSE_RAD: f32 = 8.727e-3;

impl Settings {
    /// Settings for a clock and the inverter's devices, with the default gains, and an angle without delay.
    pub const fn new(clock: Clock, devices: SwitchLimits) -> Self {
        Self {
            clock,
            devices,
            gains: Gains::DEFAULT,
            angle_late_s: 0.0,
            angle_step_rad: 0.0,
            current_filter_ticks: 0,
            drops: Drops::NONE,
            iron_share: 0.0,
        }
    }

    /// Step of a count, electrical, in rad, of an encoder with this many counts per shaft turn, at least 1.
    pub const fn step_rad(counts: u32, pole_pairs: f32) -> f32 {
        core::f32::consts::TAU * pole_pairs / counts as f32
    }

    /// `true` if the counts are so coarse that the speed tracker's angle is used, which the speed moves on between two counts.
    #[inline(always)]
    fn counts_coarsely(&self) -> bool {
        self.angle_step_rad > COARSE_RAD
    }
}

/// The cells between the two interrupts, the operator's mailboxes, and the flight recorder, if there is one.
pub struct Shared<'a> {
    /// The halves that control has planned.
    pub planned: Planned,
    /// The boundaries at which the PWM interrupt has loaded a half, and its samples there.
    pub loaded: History<LOADED_WORDS>,
    /// The fault that tripped the PWM interrupt.
    pub trip: Seqlock<Trip, 4>,
    /// Instant of the newest control interrupt, from the beginning of that interrupt on.
    pub began: AtomicU32,
    /// Between the operator in the idle loop and control.
    pub operator: OperatorMailboxes,
    recorder: Option<&'a Recorder>,
}

impl<'a> Shared<'a> {
    /// Empty cells.
    #[cfg(not(loom))]
    pub const fn new() -> Self {
        Self {
            operator: OperatorMailboxes::new(),
            planned: Planned::new(),
            loaded: History::new(),
            trip: Seqlock::new(),
            began: AtomicU32::new(0),
            recorder: None,
        }
    }

    /// The same with a flight recorder, which the control interrupt fills.
    #[cfg(not(loom))]
    pub const fn recorded_by(recorder: &'a Recorder) -> Self {
        Self { recorder: Some(recorder), ..Self::new() }
    }
}
