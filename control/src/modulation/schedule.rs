//! The choice of the mode, and the angles at which it may change.
//!
//! The modes of a ladder form a row; each border between two neighbours has a frequency and a modulation index. Above
//! either, the drive goes up; below both, less a hysteresis, it comes down, and no sooner than a dwell time after
//! the last switch. A switch waits for the end of a whole carrier at an angle where both modes' carriers end.

use super::mode::{Regulation, Row};
use super::{Mode, Reference, SwitchLimits};
use crate::frames::{Angle, UNITS_PER_RADIAN, six_step_v};
use crate::time::{Clock, Instant};

/// The border at which a mode gives way to the next one up. Frequencies are shares of the highest switching frequency; the first of each pair
/// is for going up, the second for coming down.
#[derive(Clone, Copy, Debug)]
pub struct Border {
    shares: (f32, f32),
    indices: (f32, f32),
}

impl Border {
    /// The border of a mode that gives way to none.
    pub(super) const NEVER: Self =
        Self { shares: (f32::INFINITY, f32::INFINITY), indices: (f32::INFINITY, f32::INFINITY) };

    /// A border given in Hz for devices of 900 Hz.
    pub(super) const fn new(hz: (f32, f32), indices: (f32, f32)) -> Self {
        Self { shares: (hz.0 / 900.0, hz.1 / 900.0), indices }
    }

    /// The modulation index at which the mode gives way on the way up.
    pub(super) const fn highest_index(&self) -> f32 {
        self.indices.0
    }
}

/// The locked modes that a drive uses above the asynchronous one, from the lowest frequency up. The drive leaves each of them where that
/// mode's row says.
#[derive(Clone, Copy, Debug)]
pub struct Ladder(&'static [Mode]);

impl Ladder {
    /// The paper's modes.
    pub const PAPER: Self = Self::of(&[Mode::Sync15, Mode::Sync12, Mode::Mid7, Mode::Mid3, Mode::Square]);

    /// The optimised patterns.
    #[cfg(feature = "optimal")]
    pub const OPTIMAL: Self = Self::of(&OPTIMAL_RUNGS);

    /// A ladder of these modes; without any, the asynchronous mode serves at every frequency.
    pub const fn of(locked: &'static [Mode]) -> Self {
        Self(locked)
    }

    /// `true` for a ladder of optimised patterns.
    #[cfg(feature = "optimal")]
    fn is_optimal(&self) -> bool {
        self.0.first().is_some_and(|lowest| lowest.is_optimal())
    }

    /// The modes, from the lowest frequency up.
    pub fn modes(&self) -> impl Iterator<Item = Mode> {
        [Mode::Async].into_iter().chain(self.0.iter().copied())
    }
}

/// The optimised patterns and square wave.
#[cfg(feature = "optimal")]
static OPTIMAL_RUNGS: [Mode; Mode::OPTIMAL.len() + 1] = {
    let mut rungs = [Mode::Square; Mode::OPTIMAL.len() + 1];
    let mut place = 0;
    while place < Mode::OPTIMAL.len() {
        rungs[place] = Mode::OPTIMAL[place];
        place += 1;
    }
    rungs
};

/// Room kept between a mode's largest modulation index and the border above it, and the hysteresis kept below a border that
/// the shortest pulse has lowered; shares of six-step.
const DEPTH_ROOM: f32 = 0.002;
const INDEX_HYSTERESIS: f32 = 0.012;

/// Shortest time between two switches of mode, in s.
const DWELL_S: f32 = 0.03;

/// Share of six-step below which a middle-60° pattern does not wait for that time: there it is made of little but notches, and three pulses leave more current
/// than the machine has at full torque. A reluctance machine whose line, and so its torque, was lost just after a switch to them tripped.
const PATTERN_WAITS: f32 = 0.75;

/// The choice of mode.
#[derive(Clone, Copy, Debug)]
pub struct Schedule {
    ladder: Ladder,
    fixed: Option<Mode>,
    last_switch: Option<Instant>,
    dwell_ticks: i32,
    /// The mode that catches a machine if the ladder's rung is an optimised pattern.
    #[cfg(feature = "optimal")]
    catches: Mode,
}

impl Schedule {
    /// The paper's modes by frequency and modulation index.
    pub const fn new(clock: &Clock) -> Self {
        Self::on(Ladder::PAPER, clock)
    }

    /// The modes of a ladder, by frequency and modulation index.
    pub const fn on(ladder: Ladder, clock: &Clock) -> Self {
        Self {
            ladder,
            fixed: None,
            last_switch: None,
            dwell_ticks: (DWELL_S * clock.ticks_per_s) as i32,
            #[cfg(feature = "optimal")]
            catches: Mode::Async,
        }
    }

    /// Always the same mode, whatever its pulses lead to.
    pub const fn fixed(mode: Mode, clock: &Clock) -> Self {
        Self { fixed: Some(mode), ..Self::new(clock) }
    }

    /// The mode that this reference should have, given the present one; the dwell time is respected. Out of rest, a mode that can catch the machine
    /// comes before an optimised pattern.
    #[cfg(feature = "optimal")]
    #[inline(never)]
    pub fn wanted(&mut self, now: Instant, mode: Mode, seen: &Reference, devices: &SwitchLimits) -> Mode {
        /// Modulation index up to which the free carrier can catch it, whatever has to be regulated meanwhile, and the share of the highest switching
        /// frequency up to which it has five pulses a turn: with three it beats by ± 75 A at 4,400 r/min.
        const CARRIER_CATCHES: f32 = 0.85;
        const CARRIER_CATCHES_SHARE: f32 = 0.2;
        /// Amount by which the modulation index may stay below the operating point's by the map.
        const MAP_ROOM: f32 = 0.02;
        let asked_index = seen.modulation_index;
        let seen = &Reference { modulation_index: self.filled_index(seen, devices), ..*seen };
        // No branch has less than its smallest index: if the machine has less flux linkage than its map, or the link jumps up, the index that
        // is made counts, at once.
        let seen = &match mode.branch() {
            Some(branch) => {
                let made = seen.voltage_v / six_step_v(seen.udc_v) + MAP_ROOM;
                if made < branch.first {
                    self.last_switch = None;
                }
                Reference {
                    modulation_index: if made < seen.modulation_index { made } else { seen.modulation_index },
                    ..*seen
                }
            }
            None => *seen,
        };
        match self.ladders_choice(now, mode, seen, devices) {
            wanted if mode != Mode::Off || !wanted.is_optimal() || self.fixed.is_some() => wanted,
            _ => {
                // The first command is made for the mode announced while there was no voltage.
                if seen.voltage_v == 0.0 {
                    let carrier =
                        asked_index < CARRIER_CATCHES && share(seen, devices) < CARRIER_CATCHES_SHARE;
                    self.catches = if carrier { Mode::Async } else { Mode::Mid3 };
                }
                let reach = pick(reached(Mode::Mid3.row(), shortest_notch(seen.rate, devices)), false);
                if self.catches == Mode::Mid3 && asked_index >= reach { Mode::Square } else { self.catches }
            }
        }
    }

    /// The modulation index compared with the ladder's borders: the branches of optimised patterns are chosen by the index that control fills them up to.
    #[cfg(feature = "optimal")]
    #[inline(always)]
    fn filled_index(&self, seen: &Reference, devices: &SwitchLimits) -> f32 {
        let floor = index_floor(seen.rate, devices);
        let is_filled = self.ladder.is_optimal() && floor > seen.modulation_index;
        if is_filled { floor } else { seen.modulation_index }
    }

    /// The mode that this reference should have, given the present one; the dwell time is respected.
    #[cfg(not(feature = "optimal"))]
    #[inline(never)]
    pub fn wanted(&mut self, now: Instant, mode: Mode, seen: &Reference, devices: &SwitchLimits) -> Mode {
        self.ladders_choice(now, mode, seen, devices)
    }

    /// The ladder's rung for this reference.
    #[inline(always)]
    fn ladders_choice(&mut self, now: Instant, mode: Mode, seen: &Reference, devices: &SwitchLimits) -> Mode {
        if let Some(fixed) = self.fixed {
            return fixed;
        }
        if let Some(last) = self.last_switch
            && mode != Mode::Off
        {
            if !self.is_low(mode, seen) && (0..self.dwell_ticks).contains(&now.since(last)) {
                return mode;
            }
            self.last_switch = None;
        }
        let share = share(seen, devices);
        let Ladder(rungs @ [lowest, ..]) = self.ladder else { return Mode::Async };
        if share < pick(Mode::Async.row().until.shares, mode.carriers() > 0) {
            return Mode::Async;
        }
        let notch = shortest_notch(seen.rate, devices);
        // A free carrier first gives way to a locked one, which leads the flux to where a pattern begins: from a free one the pattern begins at any angle, and
        // a machine of 12 kHz that weakened there had a third more current.
        let free = mode == Mode::Async;
        let passes = |below: Mode, from_above: bool| {
            let row = below.row();
            // Modes with the same number of pulses are told apart by modulation index alone.
            let faster = !from_above || row.until.shares != mode.row().until.shares;
            faster && share >= pick(row.until.shares, from_above)
                || !(free && below.is_carrier())
                    && seen.modulation_index >= pick(reached(row, notch), from_above)
        };
        // From the present rung: up past every border that is passed, else down past those that no longer are.
        let place = rungs.iter().position(|rung| *rung == mode).unwrap_or(0);
        let (lower, upper) = rungs.split_at_checked(place).unwrap_or((&[], rungs));
        let mut wanted = *upper.first().unwrap_or(lowest);
        for pair in upper.windows(2) {
            let [below, above] = pair else { break };
            if !passes(*below, false) {
                break;
            }
            wanted = *above;
        }
        if wanted != mode {
            return wanted;
        }
        for below in lower.iter().rev() {
            if passes(*below, true) {
                break;
            }
            wanted = *below;
        }
        wanted
    }

    /// `true` if a middle-60° pattern of the ladder makes so little voltage that its dwell time does not count. A pattern that only catches a machine for
    /// optimised patterns stays.
    #[inline(always)]
    fn is_low(&self, mode: Mode, seen: &Reference) -> bool {
        mode.is_pattern()
            && seen.voltage_v < PATTERN_WAITS * six_step_v(seen.udc_v)
            && self.ladder.0.contains(&mode)
    }

    /// Tells the schedule that the mode changed at this instant.
    pub fn switched(&mut self, now: Instant) {
        self.last_switch = Some(now);
    }
}

/// The stator frequency as a share of the highest switching frequency.
#[inline(always)]
fn share(seen: &Reference, devices: &SwitchLimits) -> f32 {
    frequency_share(seen.rate, devices)
}

/// The same for a `rate` in angle units per tick.
#[inline(always)]
fn frequency_share(rate: f32, devices: &SwitchLimits) -> f32 {
    rate * (2.0 / 4_294_967_296.0) * devices.shortest_half_ticks as f32
}

/// The value of a border's pair for this side.
fn pick((up, down): (f32, f32), from_above: bool) -> f32 {
    if from_above { down } else { up }
}

/// The indices of a mode's border, lowered if the shortest pulse keeps the mode from reaching them.
fn reached(row: &Row, notch: f32) -> (f32, f32) {
    #[cfg(feature = "optimal")]
    if row.branch.is_some() {
        return row.until.indices;
    }
    let reach = row.largest - row.notch_sum * notch - DEPTH_ROOM;
    if reach < row.until.indices.0 { (reach, reach - INDEX_HYSTERESIS) } else { row.until.indices }
}

/// Sine of half the shortest notch, with `rate` in angle units per tick: an angle of a few degrees.
#[inline(always)]
fn shortest_notch(rate: f32, devices: &SwitchLimits) -> f32 {
    let half_notch_rad = rate.abs() * (0.5 / UNITS_PER_RADIAN) * devices.min_pulse_ticks as f32;
    half_notch_rad - half_notch_rad * half_notch_rad * half_notch_rad * (1.0 / 6.0)
}

/// The largest fundamental of a mode whose notches are not shorter than that.
#[inline(always)]
fn largest(row: &Row, notch: f32) -> f32 {
    match row.regulation {
        Regulation::Fundamental => row.largest - row.notch_sum * notch,
        Regulation::Mean | Regulation::Angle => row.largest,
        #[cfg(feature = "optimal")]
        Regulation::Path => row.largest,
    }
}

/// The largest fundamental of a mode as a share of six-step 2 udc/π, with `rate` in angle units per tick: udc/√3 for
/// the carriers, what the shortest notch leaves for middle 60°, 1 for the square wave.
pub fn index_limit(mode: Mode, rate: f32, devices: &SwitchLimits) -> f32 {
    largest(mode.row(), shortest_notch(rate, devices))
}

/// The least fundamental that a pattern should have, as a share of six-step, with `rate` in angle units per tick: it rises to the whole where
/// the devices no longer allow three pulses a turn, so that square wave finds the flux linkage that it forces. Below the frequency at which
/// it begins it is negative, and no bound. Without it the flux linkage had to grow by a quarter within a turn if no torque was wanted and the link was
/// high: 194 A at 1,750 V, now 88 A, which square wave itself needs.
#[inline(always)]
pub fn index_floor(rate: f32, devices: &SwitchLimits) -> f32 {
    /// Share of the highest switching frequency at which it is zero, and the share over which it rises to the whole: it is 0.918 where square wave gives
    /// way on the way down, as much as the pattern of three pulses near six-step is for. If sooner, magnets are not learnt at 4,000 r/min without torque.
    const FROM_SHARE: f32 = 0.235;
    const OVER_SHARE: f32 = 0.095;
    (frequency_share(rate.abs(), devices) - FROM_SHARE) * (1.0 / OVER_SHARE)
}

/// The most fundamental that a pattern should have, as a share of six-step, with `rate` in angle units per tick: between the two frequencies of the free
/// carrier's border it falls from the whole to the carrier's, so that the free carrier finds the flux linkage that it can hold. Without it a machine of 600 V
/// and 3 kHz that weakens there lost 93 of 739 N·m for 5 ms when the free carrier took over from square wave.
#[inline(always)]
pub fn index_ceiling(rate: f32, devices: &SwitchLimits) -> f32 {
    const BORDER: (f32, f32) = Mode::Async.row().until.shares;
    const CARRIERS: f32 = Mode::Async.row().largest;
    const PER_SHARE: f32 = (1.0 - CARRIERS) / (BORDER.0 - BORDER.1);
    let beyond = (frequency_share(rate.abs(), devices) - BORDER.1) * PER_SHARE;
    if beyond > 0.0 { CARRIERS + beyond } else { CARRIERS }
}

/// `true` if the carrier that ends where half number `next_half` begins may give way to `to`: a locked carrier must have
/// ended, at a multiple of 360°/gcd(N1, N2); a free one at its valley. Optimised patterns give way to each other where
/// their flux paths meet.
pub fn may_switch(from: Mode, to: Mode, next_half: u32) -> bool {
    if from == Mode::Off || to == Mode::Off {
        return true;
    }
    #[cfg(feature = "optimal")]
    if let Some(old) = from.branch() {
        match to.branch() {
            Some(new) => return next_half % (2 * old.halves) == old.takes_over(new, (to as u8) > from as u8),
            None if to == Mode::Async => return old.is_calm(next_half),
            None => {}
        }
    }
    if next_half & 1 != 0 {
        return false;
    }
    if from.carriers() == 0 || to.carriers() == 0 {
        return true;
    }
    // A whole number of the new mode's carriers must have passed.
    (next_half / 2 * to.carriers()).is_multiple_of(from.carriers())
}

/// The number of the new mode's first half. Between locked modes it begins at the very angle. From a free carrier (or none) a pattern begins with the carrier
/// start nearest to the pulse angle, an optimised one with the nearest half, whose length makes up the difference. A carrier begins with the
/// start that has just passed and catches up: shorter halves have less ripple; longer ones had up to 5 % more of a small current.
pub fn first_half(from: Mode, to: Mode, next_half: u32, pulse: Angle) -> u32 {
    match (from.carriers(), to.carriers()) {
        (_, 0) => 0,
        #[cfg(feature = "optimal")]
        (0, new) if to.is_optimal() => nearest(2 * new, pulse),
        (0, new) if to.is_carrier() => begun(new, pulse) * 2,
        (0, new) => nearest(new, pulse) * 2,
        (old, new) => next_half * new / old,
    }
}

/// The number of the part that contains a pulse angle, of so many in a turn.
#[inline(always)]
fn begun(parts: u32, pulse: Angle) -> u32 {
    ((u64::from(pulse.0) * u64::from(parts)) >> 32) as u32
}

/// The number of the part that begins nearest to a pulse angle, of so many in a turn.
#[inline(always)]
pub(super) fn nearest(parts: u32, pulse: Angle) -> u32 {
    let part = ((u64::from(pulse.0) * u64::from(parts) + (1 << 31)) >> 32) as u32;
    if part >= parts { 0 } else { part }
}

#[cfg(test)]
mod proofs;

#[cfg(test)]
mod tests {
    extern crate std;

    use super::super::half::boundary;
    use super::*;
    use std::{vec, vec::Vec};

    #[test]
    fn the_floor_rises_from_211_hz_to_297() {
        let clock = Clock::new(25_000_000, 2_500);
        let devices = SwitchLimits::new(250, 0, 900.0, &clock);
        for (hz, floor) in
            [(0.0, -2.474), (211.5, 0.0), (243.0, 0.368), (290.0, 0.918), (297.0, 1.0), (-297.0, 1.0)]
        {
            let found = index_floor(clock.angle_rate(hz * core::f32::consts::TAU), &devices);
            assert!((found - floor).abs() < 1e-3, "{hz}: {found}");
        }
    }

    /// The ceiling of devices of 900 Hz is the carrier's up to where the free one takes over on the way down, and none from where it ends on the way up.
    #[test]
    fn the_ceiling_rises_from_38_hz_to_40() {
        let clock = Clock::new(25_000_000, 2_500);
        let devices = SwitchLimits::new(250, 0, 900.0, &clock);
        let carriers = index_limit(Mode::Async, 0.0, &devices);
        for (hz, ceiling) in [(0.0, carriers), (38.0, carriers), (39.0, 0.953), (-39.0, 0.953), (40.0, 1.0)] {
            let found = index_ceiling(clock.angle_rate(hz * core::f32::consts::TAU), &devices);
            assert!((found - ceiling).abs() < 1e-3, "{hz}: {found}");
        }
    }

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

    /// With halves of 2¹⁴ ticks a share of the highest switching frequency is a rate to the bit.
    #[test]
    fn at_a_border_of_frequency_it_has_been_passed() {
        let devices = SwitchLimits { min_pulse_ticks: 250, dead_time_ticks: 0, shortest_half_ticks: 1 << 14 };
        let at = |share: f32| Reference { rate: share * 131_072.0, udc_v: 1_500.0, ..Reference::NONE };
        let (up, down) = Mode::Async.row().until.shares;
        let clock = Clock::new(25_000_000, 2_500);
        for (mode, border) in [(Mode::Async, up), (Mode::Sync15, down)] {
            for (share, wanted) in [(border, false), (border * 0.999_999, true)] {
                let got = Schedule::new(&clock).wanted(Instant(0), mode, &at(share), &devices);
                assert_eq!(got == Mode::Async, wanted, "{mode:?} at {share}");
            }
        }
    }

    /// Whatever the modulation index, the free carrier gives way to a locked one where that still has its frequency; a locked one gives way by index.
    #[test]
    fn a_free_carrier_gives_way_to_a_locked_one() {
        let devices = SwitchLimits { min_pulse_ticks: 250, dead_time_ticks: 0, shortest_half_ticks: 1 << 14 };
        let clock = Clock::new(25_000_000, 2_500);
        for (mode, share, index, wanted) in [
            (Mode::Async, 0.05, 0.97, Mode::Sync15),
            (Mode::Async, 0.07, 0.97, Mode::Sync12),
            (Mode::Async, 0.09, 0.97, Mode::Mid3),
            (Mode::Off, 0.05, 0.97, Mode::Mid3),
            (Mode::Sync15, 0.05, 0.97, Mode::Mid3),
            (Mode::Sync15, 0.05, 0.5, Mode::Sync15),
        ] {
            let seen = Reference {
                rate: share * 131_072.0,
                udc_v: 1_500.0,
                modulation_index: index,
                ..Reference::NONE
            };
            assert_eq!(
                Schedule::new(&clock).wanted(Instant(0), mode, &seen, &devices),
                wanted,
                "{mode:?} {share} {index}"
            );
        }
    }

    /// At its borders a carrier no longer catches; three pulses do so up to what the machine itself needs, however far the fundamental is to be filled.
    #[cfg(feature = "optimal")]
    #[test]
    fn a_carrier_catches_below_its_borders_alone() {
        let devices = SwitchLimits { min_pulse_ticks: 250, dead_time_ticks: 0, shortest_half_ticks: 1 << 14 };
        let clock = Clock::new(25_000_000, 2_500);
        for (index, share, catches) in [
            (0.84, 0.19, Mode::Async),
            (0.85, 0.19, Mode::Mid3),
            (0.84, 0.2, Mode::Mid3),
            (0.8, 0.3295, Mode::Mid3),
            (0.985, 0.3295, Mode::Square),
        ] {
            let seen = Reference {
                rate: share * 131_072.0,
                udc_v: 1_500.0,
                modulation_index: index,
                ..Reference::NONE
            };
            let mut schedule = Schedule::on(Ladder::OPTIMAL, &clock);
            assert_eq!(schedule.wanted(Instant(0), Mode::Off, &seen, &devices), catches, "{index} {share}");
        }
    }
}
