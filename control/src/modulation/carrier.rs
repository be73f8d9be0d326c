//! The modes with a triangular carrier: SPWM with the min-max zero sequence, sampled twice per carrier.
//!
//! Even halves rise from the valley (all upper devices on) to the peak (all off), odd halves fall. The
//! reference is sampled in the middle of its half, where a turning vector has its mean over the half.

use super::{CarrierHalf, Reference, SwitchLimits};
use crate::frames::{Abc, AlphaBeta};
use crate::time::Instant;

/// A half of the asynchronous carrier that begins at an instant and lasts so many ticks, with additional volt-ticks over the link's voltage.
pub fn asynchronous(
    half: u32,
    (start, period_ticks): (Instant, u32),
    seen: &Reference,
    led: AlphaBeta,
    devices: &SwitchLimits,
) -> CarrierHalf {
    let share = seen.share_within(start, period_ticks) + led * (1.0 / period_ticks as f32);
    synchronous(half, period_ticks, Zeros::Even, share, devices)
}

/// The division of a half's zero vectors between its start and its end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Zeros {
    /// Evenly.
    Even,
    /// Most at the start: in the last half before a pattern, so that the flux goes more or less straight to where the pattern
    /// begins, not far beyond and back.
    Early,
    /// Most at the end: in the first half after a pattern, which leaves the flux at its farthest; when braking, zero voltage would
    /// lead it farther still.
    Late,
}

impl Zeros {
    /// Share of the zero vectors at the start. Early and late are compromises: motoring wants more, braking less.
    const fn at_start(self) -> f32 {
        match self {
            Self::Even => 0.5,
            Self::Early => 0.8,
            Self::Late => 0.18,
        }
    }
}

/// A half of a given length, anywhere in the turn, whose mean voltage is a share of the link's.
pub fn synchronous(
    half: u32,
    period_ticks: u32,
    zeros: Zeros,
    voltage: AlphaBeta,
    devices: &SwitchLimits,
) -> CarrierHalf {
    let rising = half & 1 == 0;
    // A rising half starts with all upper devices on.
    let all_on = if rising { zeros.at_start() } else { 1.0 - zeros.at_start() };
    let shares = on_shares(voltage, all_on);
    let mut out = CarrierHalf { period_ticks, start_levels: [rising; 3], ..CarrierHalf::default() };
    for (compare, share) in out.compare_ticks.iter_mut().zip([shares.a, shares.b, shares.c]) {
        let on = whole_pulse(share, period_ticks, devices.min_pulse_ticks);
        *compare = if rising { on } else { period_ticks - on };
    }
    out
}

/// The share of the half for which each upper device is on, 0 ..= 1, for a voltage as a share of the link's, with a share
/// `all_on` of the zero vectors made by all three of them: a share of one half is the min-max zero sequence.
fn on_shares(voltage: AlphaBeta, all_on: f32) -> Abc {
    let phase = voltage.abc();
    let high = max(phase.a, max(phase.b, phase.c));
    let low = min(phase.a, min(phase.b, phase.c));
    let centre = all_on * (1.0 - high) - (1.0 - all_on) * low;
    Abc { a: phase.a + centre, b: phase.b + centre, c: phase.c + centre }
}

fn max(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

fn min(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

/// The on-time in ticks. A pulse spans two halves, so a half may hold half the shortest pulse; a shorter one is
/// left out or filled up, whichever is nearer.
fn whole_pulse(share: f32, period_ticks: u32, min_pulse_ticks: u32) -> u32 {
    // The conversion makes 0 of what is below 0 or NaN.
    let on = ((share * period_ticks as f32 + 0.5) as u32).min(period_ticks);
    let pause = period_ticks - on;
    let shortest = min_pulse_ticks.div_ceil(2);
    if on < shortest {
        if on * 2 < shortest { 0 } else { shortest.min(period_ticks) }
    } else if pause < shortest {
        if pause * 2 < shortest { period_ticks } else { period_ticks.saturating_sub(shortest) }
    } else {
        on
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every on-time of every half up to 120 ticks, with every shortest pulse up to 130: there is nothing but comparisons behind it. And what is
    /// no share.
    #[test]
    fn a_pulse_is_whole_or_not_there() {
        for (period, min_pulse) in
            (0..=120_u32).flat_map(|period| (0..=130_u32).map(move |pulse| (period, pulse)))
        {
            let shortest = min_pulse.div_ceil(2);
            for on in 0..=period {
                let got = whole_pulse(on as f32 / period.max(1) as f32, period, min_pulse);
                let is_whole = (shortest..=period.saturating_sub(shortest)).contains(&got);
                let told = || (period, min_pulse, on, got);
                if 2 * shortest > period {
                    assert!(got <= period, "{:?}", told());
                    continue;
                }
                assert!(got == 0 || got == period || is_whole, "{:?}", told());
                // To the nearer one of the allowed values.
                assert!(got == on || on < shortest || period - on < shortest, "{:?}", told());
                assert!(got.abs_diff(on) <= shortest.div_ceil(2), "{:?}", told());
            }
            let [none, all] = [[f32::NAN, f32::NEG_INFINITY, -1.0], [f32::INFINITY, 2.0, 1.0]];
            assert!(none.into_iter().all(|share| whole_pulse(share, period, min_pulse) == 0));
            let fits = |share: f32| 2 * shortest > period || whole_pulse(share, period, min_pulse) == period;
            assert!(all.into_iter().all(fits));
        }
    }

    #[test]
    fn the_zero_sequence_centres_the_three_phases() {
        // 866 V of 1,500 V at 30°.
        let shares = on_shares(AlphaBeta { alpha: 0.5, beta: 0.288_7 }, 0.5);
        assert!((shares.a - 1.0).abs() < 1e-3 && shares.c.abs() < 1e-3, "{shares:?}");
    }

    /// A pulse as near to none as to the shortest one is made, and so is one of just the shortest length, if its pause is as long.
    #[test]
    fn a_pulse_of_just_half_the_shortest_is_made() {
        for (on, period, min_pulse, got) in [
            (5.0, 100, 20, 10),
            (95.0, 100, 20, 90),
            (10.0, 100, 20, 10),
            (90.0, 100, 20, 90),
            (10.0, 15, 20, 5),
        ] {
            assert_eq!(whole_pulse(on / period as f32, period, min_pulse), got, "{on} of {period}");
        }
    }
}
