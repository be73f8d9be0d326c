//! A bench's time, in steps of the firmware's timers or in finer ones.

use super::BenchError;
use crate::trace::Tick;
use tractive::time::{Clock, Instant};

/// The times of a run.
#[derive(Clone, Debug)]
pub struct Timeline {
    clock: Clock,
    per_tick: Tick,
    /// Length of a step, in s.
    pub step_s: f64,
    /// The time at which the timers started.
    pub origin: Tick,
    /// Now.
    pub now: Tick,
    /// The time at which the recording begins.
    pub lead: Tick,
}

impl Timeline {
    /// At the first instant, with this many steps in a tick of the clock.
    pub fn new(clock: Clock, per_tick: u32, lead_s: f64) -> Self {
        let step_s = f64::from(clock.ticks_per_s).recip() / f64::from(per_tick);
        let mut new = Self { clock, per_tick: per_tick.into(), step_s, origin: 0, now: 0, lead: 0 };
        new.lead = new.steps(lead_s);
        new
    }

    /// The same, beginning at another step than 0.
    pub fn beginning_at(self, origin: Tick) -> Self {
        Self { origin: self.origin + origin, now: self.now + origin, lead: self.lead + origin, ..self }
    }

    /// Number of steps in this time, in s.
    pub fn steps(&self, seconds: f64) -> Tick {
        (seconds / self.step_s).round() as Tick
    }

    /// Number of steps in this many ticks of the clock.
    pub fn of_ticks(&self, ticks: impl Into<Tick>) -> Tick {
        ticks.into() * self.per_tick
    }

    /// The clock's tick now.
    pub fn tick(&self) -> Tick {
        self.now / self.per_tick
    }

    /// Now, as an instant of the firmware.
    pub fn instant(&self) -> Instant {
        Instant(self.tick() as u32)
    }

    /// Beginning of the operator's slot after the one that begins at `slot`.
    pub fn slot_after(&self, slot: Instant) -> Instant {
        slot.after(self.clock.millisecond_periods() * self.clock.control_ticks)
    }

    /// Steps from one control sample to the next.
    pub fn control(&self) -> Tick {
        self.of_ticks(self.clock.control_ticks)
    }

    /// The step of an instant near to now.
    pub fn widen(&self, instant: Instant) -> Tick {
        let ahead = i64::from(instant.since(self.instant()));
        self.tick().saturating_add_signed(ahead) * self.per_tick
    }

    /// The tick of an instant near to now, from which on something is to hold.
    pub fn coming(&self, from: Instant) -> Result<Tick, BenchError> {
        let step = self.widen(from);
        if step < self.now {
            return Err(BenchError::OperatorLate(self.seconds(step)));
        }
        Ok(step / self.per_tick)
    }

    /// Time of a step since the recording's beginning, in s.
    pub fn seconds(&self, at: Tick) -> f64 {
        (at as f64 - self.lead as f64) * self.step_s
    }

    /// The same for now.
    pub fn now_s(&self) -> f64 {
        self.seconds(self.now)
    }

    /// The step at which a row of the trace ends, by its time, in s; later than now.
    pub fn row_end(&self, end_s: f64) -> Tick {
        self.lead + self.steps(end_s).max(self.now + 1 - self.lead)
    }
}
