//! A timer's output stage (RM0440, 28.3.15 to 28.3.18): references, dead time, main output, break.

use crate::time::Time;

/// A channel's reference, and the instant since which it has had this level.
#[derive(Clone, Copy, Debug, Default)]
pub struct Reference {
    /// Its level.
    pub high: bool,
    /// The instant at which it took this level.
    pub since: Time,
}

impl Reference {
    /// The level at an instant.
    pub fn set(&mut self, high: bool, now: Time) {
        if self.high != high {
            *self = Self { high, since: now };
        }
    }

    /// The end of the dead time, if it runs.
    pub fn settles(&self, dead: Time, now: Time) -> Option<Time> {
        (self.since + dead > now).then_some(self.since + dead)
    }

    /// Output and complementary output behind the dead-time generator.
    pub fn outputs(&self, dead: Time, now: Time) -> (bool, bool) {
        let settled = now >= self.since + dead;
        (self.high && settled, !self.high && settled)
    }
}

/// A counter, and whether it counts down.
#[derive(Clone, Copy, Debug)]
pub struct Stand {
    /// Its count.
    pub count: u32,
    /// Its direction.
    pub down: bool,
}

impl Stand {
    /// `true` where PWM mode 1 is active: below the compare value and, when counting down, also at it.
    fn is_below(self, compare: u32) -> bool {
        if self.down { self.count <= compare } else { self.count < compare }
    }
}

/// The reference of a channel in an output mode; a mode that is not modelled gives `None`. `own` and `next` are the compares
/// of the channel and of its partner, `partner` the partner's mode.
pub fn level(mode: u32, at: Stand, own: u32, partner: u32, next: u32) -> Option<bool> {
    match mode {
        // Combined modes: the partner must be in the other one's base mode (RM0440, combined PWM mode).
        12 => Some(base(6, at, own)? || base(partner, at, next)?),
        13 => Some(base(7, at, own)? && base(partner, at, next)?),
        mode => base(mode, at, own),
    }
}

fn base(mode: u32, at: Stand, compare: u32) -> Option<bool> {
    match mode {
        6 | 12 => Some(at.is_below(compare)),
        7 | 13 => Some(!at.is_below(compare)),
        // Frozen: as it is after a reset, low.
        0 | 4 => Some(false),
        5 => Some(true),
        _ => None,
    }
}

/// The dead time of BDTR.DTG in periods of its clock.
pub fn dead_periods(code: u32) -> Time {
    let periods = match code >> 5 & 7 {
        0..=3 => code & 0x7F,
        4 | 5 => 2 * (64 + (code & 0x3F)),
        6 => 8 * (32 + (code & 0x1F)),
        _ => 16 * (32 + (code & 0x1F)),
    };
    periods.into()
}
