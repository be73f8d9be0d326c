//! The meeting of two branches: where one takes over from the other, and the half that leads the flux there.

use super::Branch;
use super::pulses::{Part, played};
use crate::frames::{Abc, AlphaBeta};
use crate::modulation::{CarrierHalf, SwitchLimits};

impl Branch {
    /// The half, counted from 0° and again every 60°, with which the `next` branch takes over, which lies above this one or below. There
    /// the half before can lead the flux from path to path at any modulation index ([`last_half`]).
    pub fn takes_over(&self, next: &Self, is_above: bool) -> u32 {
        let sector = 2 * self.halves;
        let joint = |lower: &Self, upper: &Self| match upper.place {
            2 => sector - 1,
            1 if lower.angles != upper.angles => 2,
            _ => 0,
        };
        match [self.place, next.place] {
            // Before two phases have edges again: for 40° before it only one phase has edges, and an error then stays.
            _ if self.halves == next.halves && self.angles > next.angles => sector - 1,
            _ if self.halves == next.halves && is_above => joint(self, next),
            // The last half is the same in a turn seen backward.
            _ if self.halves == next.halves => (sector + 1 - joint(next, self)) % sector,
            [2, 3] | [3, 2] if self.angles == next.angles => sector / 6,
            [0, 1..=3] | [1..=3, 0] | [1, 1 | 3] | [3, 1] | [2, 2] => 0,
            // Seven pulses and five; from five to three the loop leaves 64 N·m there, 13 N·m at 30°.
            [2, 1] | [1, 2] if self.angles + next.angles == 5 => 0,
            // Near six-step `opp7e` and `opp5c` likewise: 51 N·m there, 3 N·m at 30°.
            [2, 4] | [4, 2] if self.angles == next.angles => 0,
            _ => self.halves,
        }
    }
}

/// The last half of the branch `from` before the branch `to`, with the volt-seconds of a half of `from` and `more_ticks`. At its end are the
/// levels of either branch: those with which its edges come nearer to what is wanted.
pub fn last_half(
    (from, to): (&Branch, &Branch),
    half: u32,
    period_ticks: u32,
    (index, more_ticks): (f32, AlphaBeta),
    devices: &SwitchLimits,
) -> CarrierHalf {
    let own = from.parts(half, index);
    let ends = to.parts((half + 1) * to.halves / from.halves + 4 * to.quarter() - 1, index);
    let mut joined = own;
    for (part, end) in joined.iter_mut().zip(ends) {
        let changes = part.level != end.ends_at();
        *part = Part { edge: changes.then_some(0.5), jumps: (part.jumps.0, end.jumps.1), ..*part };
    }
    let wanted_ticks = volt_shares(&own) * period_ticks as f32 + more_ticks;
    let [own, joined] = [own, joined].map(|parts| {
        let more_ticks = wanted_ticks - volt_shares(&parts) * period_ticks as f32;
        let half = played(&parts, period_ticks, more_ticks, devices);
        let [a, b, c] = half.on_ticks(0).map(|on| on as f32);
        ((wanted_ticks - Abc { a, b, c }.clarke()).squared(), half)
    });
    if joined.0 < own.0 { joined.1 } else { own.1 }
}

/// The mean voltage of a half of these parts, over the link's.
fn volt_shares(parts: &[Part; 3]) -> AlphaBeta {
    let [a, b, c] = parts.each_ref().map(Part::on);
    Abc { a, b, c }.clarke()
}

#[cfg(test)]
mod tests {
    extern crate std;

    use super::super::flux::ripple;
    use super::*;
    use crate::frames::six_step_v;
    use crate::modulation::{Ladder, Mode, schedule};
    use std::vec::Vec;

    const LINK_V: f32 = 1_500.0;
    const PERIOD: u32 = 10_000;
    const DEVICES: SwitchLimits =
        SwitchLimits { min_pulse_ticks: 50, dead_time_ticks: 0, shortest_half_ticks: 10_000 };

    /// The missing flux, as a share of the fundamental's, if `to` takes over from `from` after its last half number `half`.
    fn missing(from: Mode, to: Mode, half: u32, index: f32) -> f32 {
        let (old, new) = (from.branch().unwrap(), to.branch().unwrap());
        let voltage_v = index * six_step_v(LINK_V);
        let at = |mode: Mode, half: u32| ripple(mode, half, voltage_v, LINK_V, 1.0).unwrap();
        let next = schedule::first_half(from, to, half + 1, crate::frames::Angle::ZERO);
        let led = at(to, next) - at(from, half + 1);
        let to_ticks = PERIOD as f32 / (LINK_V * old.half_rad());
        let last = last_half((old, new), half, PERIOD, (index, led * to_ticks), &DEVICES);
        let own = volt_shares(&old.parts(half, index)) * PERIOD as f32;
        let [a, b, c] = last.on_ticks(0).map(|on| on as f32);
        let got = Abc { a, b, c }.clarke() - own;
        (got - led * to_ticks).squared().sqrt() / to_ticks / voltage_v
    }

    /// `true` if two modes have modulation indices in common.
    fn overlap(one: Mode, other: Mode) -> bool {
        let (one, other) = (one.branch().unwrap(), other.branch().unwrap());
        one.first.max(other.first) + 0.005 < one.last.min(other.last)
    }

    /// Both ways between two modes, at each modulation index that both have, and every 60°. Returns the largest missing share.
    fn worst(lower: Mode, upper: Mode) -> f32 {
        let (below, above) = (lower.branch().unwrap(), upper.branch().unwrap());
        // Three pulses are for frequencies at which the reference machine's magnets alone take half of the link.
        let least = if upper.turn_ons() == 3 { 0.55 } else { 0.1 };
        let (first, last) = (below.first.max(above.first).max(least), below.last.min(above.last));
        let mut worst: f32 = 0.0;
        for (from, to) in [(lower, upper), (upper, lower)] {
            let halves = 1..2 * from.carriers();
            let ends: Vec<_> = halves.filter(|half| schedule::may_switch(from, to, *half)).collect();
            assert!(ends.len() >= 5, "{from:?} {to:?} {ends:?}");
            for step in 0..=((last - first) / 0.005) as u32 {
                let index = first + 0.005 * step as f32;
                worst = ends.iter().map(|end| missing(from, to, end - 1, index)).fold(worst, f32::max);
            }
        }
        worst
    }

    /// Branches of one number of pulses follow each other where the index alone changes, and numbers where the frequency does.
    #[test]
    fn the_last_half_leads_the_flux_to_the_path_of_the_branch_that_takes_over() {
        let modes: Vec<_> = Ladder::OPTIMAL.modes().filter(|mode| mode.branch().is_some()).collect();
        let mut pairs = 0;
        for (place, lower) in modes.iter().enumerate() {
            let mut other_counts = Vec::new();
            for upper in modes[place + 1..].iter().filter(|upper| overlap(*lower, **upper)) {
                let (pulses, of_lower) = (upper.turn_ons(), lower.turn_ons());
                if pulses != of_lower && !other_counts.contains(&pulses) {
                    other_counts.push(pulses);
                }
                if other_counts.len() > 1 {
                    break;
                }
                let most = match (*lower, *upper) {
                    _ if lower.carriers() == upper.carriers() => 0.0002,
                    // Only where the index falls while the frequency rises.
                    (Mode::Opp5c, Mode::Opp3a) => 0.045,
                    _ => 0.012,
                };
                let worst = worst(*lower, *upper);
                assert!(worst < most, "{lower:?} {upper:?}: {worst}");
                pairs += 1;
            }
        }
        assert!(pairs > 20, "{pairs}");
    }

    /// Both branches have an edge at the end of the last half, or neither, where they meet.
    #[test]
    fn edges_at_the_end_are_those_of_both() {
        let branches = || Mode::ALL.into_iter().filter_map(|mode| Some((mode, mode.branch()?)));
        let mut met = 0;
        for ((old, from), (new, to)) in branches().flat_map(|old| branches().map(move |new| (old, new))) {
            let turn = 4 * from.quarter();
            for half in
                (0..turn).filter(|half| old != new && schedule::may_switch(old, new, (half + 1) % turn))
            {
                let ends = to.parts((half + 1) * to.halves / from.halves + 4 * to.quarter() - 1, 0.9);
                let jump = |parts: [Part; 3]| parts.map(|part| part.jumps.1);
                assert_eq!(jump(from.parts(half, 0.9)), jump(ends), "{old:?} {new:?} {half}");
                met += 1;
            }
        }
        assert!(met > 100, "{met}");
    }
}
