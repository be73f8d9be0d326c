//! WHICH mode, and at which angle it may change.
//!
//! The modes stand in a row; each border between two neighbours has a frequency and a modulation depth. Above
//! either the drive goes up, below both, less a hysteresis, it comes down, and no sooner than a dwell time after
//! the last switch. A switch waits for the end of a whole carrier at an angle where both modes' carriers end.

use super::{Devices, Mode, Reference, middle60::notch_sum};
use crate::frames::Angle;
use crate::time::{Clock, Instant};

/// A border between a mode and the next one up. Frequencies are shares of the highest switching frequency.
#[derive(Clone, Copy, Debug)]
struct Border {
    above: Mode,
    up_share: f32,
    down_share: f32,
    /// Depths for going up and coming down; `None` where depth alone does not matter.
    depths: Option<(f32, f32)>,
}

/// A border given in Hz for devices of 900 Hz.
const fn border(above: Mode, hz: (f32, f32), depths: Option<(f32, f32)>) -> Border {
    Border { above, up_share: hz.0 / 900.0, down_share: hz.1 / 900.0, depths }
}

/// Carrier modes end at udc/√3 = 0.907 of six-step. The frequencies lie a little below what the devices allow (for
/// 900 Hz: 60, 75, 128.6, 300 Hz), so that waiting for a legal angle on the steepest ramp stays within it. Depth alone does not
/// end the asynchronous mode: at a low frequency a pattern of few pulses would leave more ripple than the tenth of voltage is
/// worth that it adds.
const BORDERS: [Border; 5] = [
    border(Mode::Sync15, (40.0, 38.0), None),
    border(Mode::Sync12, (59.5, 57.0), Some((0.88, 0.84))),
    border(Mode::Mid7, (74.5, 72.0), Some((0.88, 0.84))),
    border(Mode::Mid3, (126.0, 121.0), Some((0.913, 0.885))),
    border(Mode::Square, (297.0, 290.0), Some((0.990, 0.978))),
];

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
    pub fn wanted(&mut self, now: Instant, mode: Mode, seen: &Reference, devices: &Devices) -> Mode {
        if let Some(fixed) = self.fixed {
            return fixed;
        }
        let dwelling = match self.last_switch {
            Some(last) if mode != Mode::Off => {
                let elapsed = now.since(last);
                if elapsed < 0 || elapsed >= self.dwell_ticks {
                    self.last_switch = None;
                }
                (0..self.dwell_ticks).contains(&elapsed)
            }
            _ => false,
        };
        if dwelling {
            return mode;
        }
        let switching_turns = 2.0 * devices.shortest_half_ticks as f32;
        let share = seen.rate * switching_turns * (1.0 / 4_294_967_296.0);
        let mut best = Mode::Async;
        for (index, border) in BORDERS.iter().enumerate() {
            let below = Mode::from_code(index as u32 + Mode::Async as u32);
            let here = rank(mode) > index;
            let fast = share >= if here { border.down_share } else { border.up_share };
            let deep = match border.depths {
                None => false,
                Some(_) if best == Mode::Async => false,
                Some(depths) => {
                    let (up, down) = lowered(depths, depth_limit(below, seen.rate, devices) - DEPTH_ROOM);
                    seen.depth >= if here { down } else { up }
                }
            };
            if fast || deep {
                best = border.above;
            }
        }
        best
    }

    /// Tells the schedule that the mode changed at this instant.
    pub fn switched(&mut self, now: Instant) {
        self.last_switch = Some(now);
    }
}

/// Place of a mode in the row; `Off` and `Async` are at its foot.
fn rank(mode: Mode) -> usize {
    (mode as usize).saturating_sub(Mode::Async as usize)
}

/// A border's depths, lowered where the mode below does not reach them because of the shortest pulse.
fn lowered((up, down): (f32, f32), reach: f32) -> (f32, f32) {
    if reach < up { (reach, reach - DEPTH_HYSTERESIS) } else { (up, down) }
}

/// The largest fundamental of a mode as a share of six-step 2 udc/π, with `rate` in angle units per tick: udc/√3 for
/// the carriers, what the shortest notch leaves for middle 60°, 1 for the square wave.
pub fn depth_limit(mode: Mode, rate: f32, devices: &Devices) -> f32 {
    /// (1/√3) / (2/π).
    const CARRIER: f32 = 0.906_899_7;
    match mode {
        Mode::Square => 1.0,
        Mode::Mid7 | Mode::Mid3 => {
            let half_notch = Angle((0.5 * rate.abs() * devices.min_pulse_ticks as f32) as u32);
            1.0 - notch_sum(mode) * half_notch.sin_cos().sin
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
    let common = gcd(from.carriers(), to.carriers());
    let carriers_between = from.carriers() / common;
    (next_half / 2).is_multiple_of(carriers_between)
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

fn gcd(a: u32, b: u32) -> u32 {
    let (mut a, mut b) = (a, b);
    // Euclid on carrier numbers below 32 takes at most seven steps.
    for _ in 0..8 {
        if b == 0 {
            break;
        }
        (a, b) = (b, a.checked_rem(b).unwrap_or(0));
    }
    a
}

#[cfg(test)]
mod tests {
    extern crate std;

    use super::super::boundary;
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
