//! WHICH mode, and at which angle it may change.
//!
//! The modes stand in a row; each border between two neighbours has a frequency and a modulation depth. Above
//! either the drive goes up, below both, less a hysteresis, it comes down, and no sooner than a dwell time after
//! the last switch. A switch waits for the end of a whole carrier at an angle where both modes' carriers end.

use super::{Devices, Mode, Reference, middle60::notch_sum};
use crate::frames::{Angle, UNITS_PER_RADIAN};
use crate::time::{Clock, Instant};

/// A border between a mode and the next one up. Frequencies are shares of the highest switching frequency; each of the pair
/// is for going up and for coming down.
#[derive(Clone, Copy, Debug)]
struct Border {
    below: Mode,
    above: Mode,
    shares: (f32, f32),
    depths: (f32, f32),
}

/// A border given in Hz for devices of 900 Hz.
const fn border(below: Mode, above: Mode, hz: (f32, f32), depths: (f32, f32)) -> Border {
    Border { below, above, shares: (hz.0 / 900.0, hz.1 / 900.0), depths }
}

/// Carrier modes end at udc/√3 = 0.907 of six-step. The frequencies lie a little below what the devices allow (for
/// 900 Hz: 60, 75, 128.6, 300 Hz), so that waiting for a legal angle on the steepest ramp stays within it. Depth alone does not
/// end the asynchronous mode: at a low frequency a pattern of few pulses would leave more ripple than the tenth of voltage is
/// worth that it adds.
const BORDERS: [Border; 4] = [
    border(Mode::Mid3, Mode::Square, (297.0, 290.0), (0.990, 0.978)),
    border(Mode::Mid7, Mode::Mid3, (126.0, 121.0), (0.913, 0.885)),
    border(Mode::Sync12, Mode::Mid7, (74.5, 72.0), (0.88, 0.84)),
    border(Mode::Sync15, Mode::Sync12, (59.5, 57.0), (0.88, 0.84)),
];
/// Where the asynchronous mode ends.
const FREE_SHARES: (f32, f32) = (40.0 / 900.0, 38.0 / 900.0);

/// Room kept between a mode's largest depth and the border above it, and the hysteresis kept below a border that
/// the shortest pulse has lowered; shares of six-step.
const DEPTH_ROOM: f32 = 0.002;
const DEPTH_HYSTERESIS: f32 = 0.012;

/// Shortest time between two switches of mode, in s.
const DWELL_S: f32 = 0.03;

/// The choice of mode.
#[derive(Clone, Copy, Debug)]
pub struct Schedule {
    fixed: Option<Mode>,
    last_switch: Option<Instant>,
    dwell_ticks: i32,
}

impl Schedule {
    /// By frequency and modulation depth.
    pub const fn new(clock: &Clock) -> Self {
        Self { fixed: None, last_switch: None, dwell_ticks: (DWELL_S * clock.ticks_per_s) as i32 }
    }

    /// Always the same mode, wherever its pulses lead.
    pub const fn fixed(mode: Mode, clock: &Clock) -> Self {
        Self { fixed: Some(mode), ..Self::new(clock) }
    }

    /// The mode that this reference should have, given the present one; the dwell time is respected.
    #[inline(never)]
    pub fn wanted(&mut self, now: Instant, mode: Mode, seen: &Reference, devices: &Devices) -> Mode {
        if let Some(fixed) = self.fixed {
            return fixed;
        }
        if let Some(last) = self.last_switch
            && mode != Mode::Off
        {
            if (0..self.dwell_ticks).contains(&now.since(last)) {
                return mode;
            }
            self.last_switch = None;
        }
        let share = seen.rate * (2.0 / 4_294_967_296.0) * devices.shortest_half_ticks as f32;
        // Whoever passes a border passes those of lower frequencies as well, so the highest one decides.
        if share < pick(FREE_SHARES, mode > Mode::Async) {
            return Mode::Async;
        }
        for border in &BORDERS {
            let from_above = mode > border.below;
            let fast = share >= pick(border.shares, from_above);
            if fast || seen.depth >= pick(reached(border, seen.rate, devices), from_above) {
                return border.above;
            }
        }
        Mode::Sync15
    }

    /// Tells the schedule that the mode changed at this instant.
    pub fn switched(&mut self, now: Instant) {
        self.last_switch = Some(now);
    }
}

/// Of a border's pair of values the one for this side.
fn pick((up, down): (f32, f32), from_above: bool) -> f32 {
    if from_above { down } else { up }
}

/// A border's depths, lowered where the mode below does not reach them because of the shortest pulse.
fn reached(border: &Border, rate: f32, devices: &Devices) -> (f32, f32) {
    let reach = depth_limit(border.below, rate, devices) - DEPTH_ROOM;
    if reach < border.depths.0 { (reach, reach - DEPTH_HYSTERESIS) } else { border.depths }
}

/// The largest fundamental of a mode as a share of six-step 2 udc/π, with `rate` in angle units per tick: udc/√3 for
/// the carriers, what the shortest notch leaves for middle 60°, 1 for the square wave.
pub fn depth_limit(mode: Mode, rate: f32, devices: &Devices) -> f32 {
    /// (1/√3) / (2/π).
    const CARRIER: f32 = 0.906_899_7;
    match mode {
        Mode::Square => 1.0,
        Mode::Mid7 | Mode::Mid3 => {
            let half_notch_rad = rate.abs() * (0.5 / UNITS_PER_RADIAN) * devices.min_pulse_ticks as f32;
            // The sine of an angle of a few degrees.
            let sine = half_notch_rad - half_notch_rad * half_notch_rad * half_notch_rad * (1.0 / 6.0);
            1.0 - notch_sum(mode) * sine
        }
        _ => CARRIER,
    }
}

/// Whether the carrier that ends where half number `next_half` begins may give way to `to`: a locked carrier must have
/// ended, at a multiple of 360°/gcd(N1, N2); a free one at its valley.
pub fn may_switch(from: Mode, to: Mode, next_half: u32) -> bool {
    if from == Mode::Off || to == Mode::Off {
        return true;
    }
    if next_half & 1 != 0 {
        return false;
    }
    if from.carriers() == 0 || to.carriers() == 0 {
        return true;
    }
    // So many of the new mode's carriers have passed, if that is a whole number.
    (next_half / 2 * to.carriers()).is_multiple_of(from.carriers())
}

/// The number of the new mode's first half. Between locked modes it begins at the very angle; from a free carrier
/// (or none) at the carrier start nearest to the pulse angle, and its length makes up the difference.
pub fn first_half(from: Mode, to: Mode, next_half: u32, pulse: Angle) -> u32 {
    match (from.carriers(), to.carriers()) {
        (_, 0) => 0,
        (0, new) => {
            let carrier = ((u64::from(pulse.0) * u64::from(new) + (1 << 31)) >> 32) as u32;
            if carrier >= new { 0 } else { carrier * 2 }
        }
        (old, new) => next_half * new / old,
    }
}

#[cfg(test)]
mod tests {
    extern crate std;

    use super::super::period::boundary;
    use super::*;
    use std::{vec, vec::Vec};

    fn legal_degrees(from: Mode, to: Mode) -> Vec<f64> {
        (0..from.carriers() * 2)
            .filter(|half| may_switch(from, to, *half))
            .map(|half| f64::from(boundary(half, from.carriers()).0) / 4_294_967_296.0 * 360.0)
            .map(f64::round)
            .collect()
    }

    #[test]
    fn switches_are_legal_where_the_specification_says() {
        let every_120 = vec![0.0, 120.0, 240.0];
        let every_60 = vec![0.0, 60.0, 120.0, 180.0, 240.0, 300.0];
        assert_eq!(legal_degrees(Mode::Sync15, Mode::Sync12), every_120);
        assert_eq!(legal_degrees(Mode::Sync12, Mode::Sync15), every_120);
        assert_eq!(legal_degrees(Mode::Sync15, Mode::Mid7), every_120);
        for (from, to) in [(Mode::Sync12, Mode::Mid7), (Mode::Mid7, Mode::Mid3), (Mode::Mid3, Mode::Square)] {
            assert_eq!(legal_degrees(from, to), every_60);
            assert_eq!(legal_degrees(to, from), every_60);
        }
    }

    #[test]
    fn a_locked_switch_keeps_the_angle() {
        for from in &Mode::ALL[2..] {
            for to in &Mode::ALL[2..] {
                for half in (0..from.carriers() * 2).filter(|half| may_switch(*from, *to, *half)) {
                    let new = first_half(*from, *to, half, Angle::ZERO);
                    let gap = boundary(half, from.carriers()) - boundary(new, to.carriers());
                    assert!(gap.signed().abs() < 8, "{from:?} {to:?} {half}");
                }
            }
        }
    }
}
