//! Middle-60° modulation and the square wave.
//!
//! In each sector of 60° of the pulse angle only one phase may switch, the one in the middle of its half wave
//! (order b, a, c, b, a, c from 0°). Each carrier holds one notch of that phase in its middle, of width β; during
//! the notch all three phases are at one level and the voltage is zero. A notch spans both halves of its carrier,
//! and each half sets its own part anew.

use super::{CarrierHalf, Mode, Reference, SwitchLimits};
use crate::frames::{UNITS_PER_RADIAN, limit, six_step_v};

/// Share of six-step from which square wave needs no notch.
const WHOLE: f32 = 0.99;

/// β/2 in rad for a fundamental of `voltage_v` (peak phase) on a link of `udc_v`: equations (16) and (17), which
/// are one: `sin(β/2) = (1 − π u/(2 udc)) / sum`. A voltage beyond six-step gives 0.
pub fn half_notch_rad(mode: Mode, voltage_v: f32, udc_v: f32) -> f32 {
    let modulation_index = core::f32::consts::FRAC_PI_2 * voltage_v / udc_v;
    asin_up_to_30_degrees(limit((1.0 - modulation_index) / mode.row().notch_sum, 0.0, 0.5))
}

/// Half the zero voltage of a sector, as an angle in rad. A mode that gives all that the link has (square wave) has some only if less
/// voltage is asked for, after a jump of the link.
#[inline(never)]
pub fn zero_rad(mode: Mode, voltage_v: f32, udc_v: f32) -> f32 {
    if mode.is_whole() && voltage_v > WHOLE * six_step_v(udc_v) {
        return 0.0;
    }
    half_notch_rad(mode, voltage_v, udc_v) * mode.notches() as f32
}

/// Half the zero voltage of a sector that a mode will have, as an angle in rad: that of its shortest notches, or more.
#[inline(never)]
pub fn least_zero_rad(mode: Mode, seen: &Reference, devices: &SwitchLimits) -> f32 {
    if mode.is_whole() {
        return 0.0;
    }
    let least_rad = seen.rate * (0.5 / UNITS_PER_RADIAN) * (devices.min_pulse_ticks * mode.notches()) as f32;
    let zero_rad = zero_rad(mode, seen.voltage_v, seen.udc_v);
    if zero_rad > least_rad { zero_rad } else { least_rad }
}

/// asin on 0 ..= 0.5, error below 2e-7 rad (the notch is at most 60° wide, its half 30°).
fn asin_up_to_30_degrees(x: f32) -> f32 {
    let z = x * x;
    let series = ((((4.216_32e-2 * z + 2.418_131e-2) * z + 4.547_002_7e-2) * z + 7.495_300_3e-2) * z
        + 1.666_675_2e-1)
        * z;
    x + x * series
}

/// The levels without a notch in sector `sector` of 60°, and the phase that may switch there.
fn sector_levels(sector: u32) -> ([bool; 3], usize) {
    match sector {
        0 => ([true, false, true], 1),
        1 => ([true, false, false], 0),
        2 => ([true, true, false], 2),
        3 => ([false, true, false], 1),
        4 => ([false, true, true], 0),
        _ => ([false, false, true], 2),
    }
}

/// A half of a pattern's carrier, `period_ticks` long. Its last part or, in the second half, its first part is a notch of
/// `notch_ticks`. No notch at all makes square wave.
pub fn half(
    mode: Mode,
    half: u32,
    period_ticks: u32,
    notch_ticks: Option<f32>,
    devices: &SwitchLimits,
) -> CarrierHalf {
    let (mut levels, switching) = sector_levels(half / mode.sector_halves().max(1));
    let mut compare_ticks = [u32::MAX; 3];
    if let (Some(compare), Some(level), Some(notch_ticks)) =
        (compare_ticks.get_mut(switching), levels.get_mut(switching), notch_ticks)
    {
        let notch = whole_notch(notch_ticks, period_ticks, devices.min_pulse_ticks);
        let opening = half & 1 == 0;
        if opening {
            *compare = period_ticks - notch;
        } else {
            *compare = notch;
            *level = !*level;
        }
    }
    CarrierHalf { period_ticks, compare_ticks, start_levels: levels, ..CarrierHalf::default() }
}

/// The notch's part in this half, in ticks: never shorter than half the shortest pulse (the schedule leaves the
/// mode before that matters), and leaving as much between two notches.
fn whole_notch(wanted_ticks: f32, period_ticks: u32, min_pulse_ticks: u32) -> u32 {
    let shortest = min_pulse_ticks.div_ceil(2).min(period_ticks / 2);
    let notch = (wanted_ticks + 0.5) as u32;
    notch.max(shortest).min(period_ticks - shortest)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_arc_sine_keeps_its_documented_error() {
        for k in 0..=5000 {
            let x = k as f32 / 10_000.0;
            let error = f64::from(asin_up_to_30_degrees(x)) - f64::from(x).asin();
            assert!(error.abs() < 2e-7, "{x} {error}");
        }
    }

    /// Every notch of every half up to 120 ticks, with every shortest pulse up to 130, and values that are no length.
    #[test]
    fn a_notch_and_what_is_beside_it_are_no_shorter_than_half_the_shortest_pulse() {
        for (period, min_pulse) in
            (0..=120_u32).flat_map(|period| (0..=130_u32).map(move |pulse| (period, pulse)))
        {
            let shortest = min_pulse.div_ceil(2).min(period / 2);
            for wanted in 0..=130 {
                let got = whole_notch(wanted as f32, period, min_pulse);
                assert_eq!(got, wanted.clamp(shortest, period - shortest), "{period} {min_pulse} {wanted}");
            }
            let limits = [f32::NAN, f32::NEG_INFINITY, -1.0, f32::INFINITY, f32::MAX];
            let got = limits.map(|wanted| whole_notch(wanted, period, min_pulse));
            let longest = period - shortest;
            assert_eq!(got, [shortest, shortest, shortest, longest, longest], "{period} {min_pulse}");
        }
    }

    #[test]
    fn notches_follow_equations_16_and_17() {
        let beta3 = 2.0 * half_notch_rad(Mode::Mid3, 700.0, 1500.0);
        let exact3 = 2.0 * (0.5 - core::f64::consts::PI * 700.0 / 6000.0).asin();
        assert!((f64::from(beta3) - exact3).abs() < 1e-6);
        let beta7 = 2.0 * half_notch_rad(Mode::Mid7, 700.0, 1500.0);
        let sum = 4.0 * 70_f64.to_radians().sin() + 2.0;
        let exact7 = 2.0 * ((1.0 - core::f64::consts::PI * 700.0 / 3000.0) / sum).asin();
        assert!((f64::from(beta7) - exact7).abs() < 1e-6);
        assert_eq!(half_notch_rad(Mode::Mid3, 2000.0, 1500.0), 0.0);
    }

    #[test]
    fn square_wave_is_whole_above_its_border_alone() {
        let border_v = WHOLE * six_step_v(1_500.0);
        assert!(zero_rad(Mode::Square, border_v, 1_500.0) > 0.0);
        assert_eq!(zero_rad(Mode::Square, border_v * 1.000_001, 1_500.0), 0.0);
    }
}
