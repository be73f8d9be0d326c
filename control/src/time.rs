//! Time in whole ticks of the timers' clock. Instants wrap; differences between instants less than half the range
//! apart (86 s at 25 MHz) do not.

#![forbid(unsafe_code)]

use crate::frames::UNITS_PER_RADIAN;

/// An instant, in ticks of the timers' clock, modulo 2³².
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Instant(pub u32);

impl Instant {
    /// This instant plus a number of ticks.
    #[inline]
    pub fn after(self, ticks: u32) -> Self {
        Self(self.0.wrapping_add(ticks))
    }

    /// This instant minus a number of ticks.
    #[inline]
    pub fn before(self, ticks: u32) -> Self {
        Self(self.0.wrapping_sub(ticks))
    }

    /// Ticks from `earlier` to this instant; negative when `earlier` is later.
    #[inline]
    pub fn since(self, earlier: Self) -> i32 {
        self.0.wrapping_sub(earlier.0) as i32
    }

    /// `true` if this instant is `other` or later.
    #[inline]
    pub fn reached(self, other: Self) -> bool {
        self.since(other) >= 0
    }
}

/// The clock both timers count, and the control timer's period on it.
#[derive(Clone, Copy, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Clock {
    /// Length of one tick, in s.
    pub tick_s: f32,
    /// Ticks per second, in Hz.
    pub ticks_per_s: f32,
    /// Period of the control timer, in ticks.
    pub control_ticks: u32,
    /// The same, in s.
    pub control_s: f32,
}

impl Clock {
    /// A clock of `hz` ticks per second with control at every `control_ticks`.
    pub const fn new(hz: u32, control_ticks: u32) -> Self {
        let tick_s = 1.0 / hz as f32;
        Self { tick_s, ticks_per_s: hz as f32, control_ticks, control_s: control_ticks as f32 * tick_s }
    }

    /// The control rate for devices with a given highest switching frequency, in Hz, unless another rate is asked for: 10 kHz, or 20 kHz if a
    /// carrier would otherwise have less than one command.
    pub const fn control_hz(max_switching_hz: f32) -> u32 {
        const USUAL_HZ: u32 = 10_000;
        if max_switching_hz > USUAL_HZ as f32 { 2 * USUAL_HZ } else { USUAL_HZ }
    }

    /// A number of ticks, in s.
    #[inline]
    pub const fn seconds(&self, ticks: i32) -> f32 {
        ticks as f32 * self.tick_s
    }

    /// Angle units per tick at an electrical angular speed in rad/s.
    #[inline]
    pub fn angle_rate(&self, omega: f32) -> f32 {
        omega * (UNITS_PER_RADIAN * self.tick_s)
    }

    /// Control periods in a millisecond: the nearest whole number, at least 1.
    #[inline]
    pub const fn millisecond_periods(&self) -> u32 {
        let control_ticks = if self.control_ticks > 0 { self.control_ticks } else { 1 };
        let periods = ((1e-3 * self.ticks_per_s) as u32).wrapping_add(control_ticks / 2) / control_ticks;
        if periods > 0 { periods } else { 1 }
    }

    /// The control timer's period, in s.
    #[inline]
    pub const fn control_s(&self) -> f32 {
        self.control_s
    }
}
