//! Numbers on their way to registers: bit timings, gate feedback, compares of the ZS9's legs, settings of a power stage.

use nucleo_g474re::built_in::traction;
use nucleo_g474re::can::BitTiming;
use nucleo_g474re::patterns;
use nucleo_g474re::power_stage::{POWER_STAGE, PowerStage};
use nucleo_g474re::zs9::feedback::{decoded, encoded};
use nucleo_g474re::zs9::period::{LegCompares, PeriodCompares};
use nucleo_g474re::zs9::{HALF_CYCLES, settings};
use tractive::drive::traction::{Drops, Settings};
use tractive::machine::Ratings;
use tractive::nine_switch::GateTicks;
use tractive::ports::{GateFeedback, PlayedPeriod};

#[test]
fn a_bit_timing_fits_its_registers() {
    // A quantum of 1 MHz.
    let exact = |clock_hz, sample_point| BitTiming::exact(clock_hz, 62_500, sample_point);
    for (clock_hz, sample_point, timing) in [
        (1_000_000, 875, Some((1, 13, 2))),
        (512_000_000, 750, Some((512, 11, 4))),
        (513_000_000, 750, None),
        (0, 750, None),
        (1_000_000, 125, Some((1, 1, 14))),
        (1_000_000, 0, None),
        (1_000_000, 1_000, None),
    ] {
        let wanted = timing.map(|(prescaler, before_sample, after_sample)| BitTiming {
            prescaler,
            before_sample,
            after_sample,
        });
        assert_eq!(exact(clock_hz, sample_point), wanted, "{clock_hz} {sample_point}");
    }
}

#[test]
fn gate_feedback_has_its_marks() {
    for (on, off, words) in [
        (0, 0, [0xAA00, 0x5400]),
        (0x1FF, 0, [0xABFF, 0x5400]),
        (0x001, 0x100, [0xAA01, 0x5500]),
        (0x155, 0x0AA, [0xAB55, 0x54AA]),
    ] {
        let seen = GateFeedback { on, off };
        assert_eq!((encoded(seen), decoded(words.map(Some))), (words, seen), "{words:x?}");
        assert_eq!(encoded(GateFeedback { on: on | 0xFE00, off: off | 0xFE00 }), words, "no gate of a mark");
        for bit in 9..16 {
            for flipped in [[1 << bit, 0], [0, 1 << bit]] {
                let read = core::array::from_fn(|word| Some(words[word] ^ flipped[word]));
                assert_eq!(decoded(read), GateFeedback::default());
            }
        }
    }
}

/// The steps of so many cycles, five of which are 32 steps, rounded up.
fn at(cycles: u32) -> u32 {
    (cycles * 32).div_ceil(5)
}

/// Compares of a leg with pauses of H, M and L in cycles, with a dead time of 10 cycles.
fn leg(high: [u32; 2], middle: [u32; 2], low: [u32; 2]) -> Option<LegCompares> {
    steps([high, middle, low].map(|pause| pause.map(at)))
}

fn steps(pauses: [[u32; 2]; 3]) -> Option<LegCompares> {
    let [high, middle, low] = pauses.map(|[off_from, off_to]| GateTicks { off_from, off_to });
    let gates = [high, high, high, middle, middle, middle, low, low, low];
    let compares = PeriodCompares::new(&PlayedPeriod { gates }, 10)?;
    assert_eq!(compares.legs, [compares.legs[0]; 3]);
    Some(compares.legs[0])
}

const HALF: u32 = HALF_CYCLES as u32;
const NONE: [u32; 2] = [0, 0];

#[test]
fn a_pause_goes_to_the_nearest_cycle() {
    for (off, cycles) in [(0, 5_000), (3, 5_000), (4, 5_001), (6, 5_001), (7, 5_001)] {
        let high = [at(5_000) + off, settings().half_steps()];
        let compares = steps([high, NONE, NONE]).unwrap();
        assert_eq!((compares.high, compares.low), (cycles, 0), "{off} steps behind cycle 5,000");
    }
}

#[test]
fn compares_of_a_leg_are_its_pauses_without_what_the_dead_time_would_use_up() {
    for (high, middle, low, wanted) in [
        // M on all the time, with shoot-through between L and H, which the dead time uses up or not.
        ([5_000, HALF], NONE, [0, 3_000], [5_000, 3_000, 0, 0]),
        ([3_011, HALF], NONE, [0, 3_000], [3_011, 3_000, 0, 0]),
        ([3_010, HALF], NONE, [0, 3_000], [3_000, 3_000, 0, 0]),
        ([3_001, HALF], NONE, [0, 3_000], [3_000, 3_000, 0, 0]),
        ([3_000, HALF], NONE, [0, 3_000], [3_000, 3_000, 0, 0]),
        // M pauses.
        ([5_000, HALF], [4_000, 4_500], [0, 3_000], [5_000, 3_000, 4_000, 4_500]),
        ([4_511, HALF], [4_000, 4_500], [0, 3_989], [4_511, 3_989, 4_000, 4_500]),
        ([4_510, HALF], [4_000, 4_500], [0, 3_990], [4_510, 3_990, 3_990, 4_510]),
        ([4_501, HALF], [4_000, 4_500], [0, 3_999], [4_501, 3_999, 3_999, 4_501]),
        ([4_500, HALF], [4_000, 4_500], [0, 4_000], [4_500, 4_000, 4_000, 4_500]),
        // No pause of H, and none of L.
        (NONE, [4_000, HALF], [0, 4_000], [HALF, 4_000, 4_000, HALF]),
        ([4_000, HALF], [0, 4_000], NONE, [4_000, 0, 0, 4_000]),
    ] {
        let [high_at, low_at, middle_from, middle_to] = wanted.map(|cycles| cycles as u16);
        let wanted = LegCompares { high: high_at, low: low_at, middle_from, middle_to };
        assert_eq!(leg(high, middle, low), Some(wanted), "{high:?} {middle:?} {low:?}");
    }
}

#[test]
fn a_pause_that_rounding_would_swallow_is_one_cycle() {
    let end = settings().half_steps();
    for (pauses, wanted) in [
        ([[end - 2, end], [at(8_000), end - 2], [0, at(8_000)]], [HALF - 1, 8_000, 8_000, HALF - 1]),
        ([[at(500), end], [2, at(500)], [0, 2]], [500, 1, 1, 500]),
        ([[25_602, end], [25_600, 25_602], [0, 25_600]], [4_001, 4_000, 4_000, 4_001]),
        ([[0, 0], [end - 1, end], [0, end - 1]], [HALF, HALF - 1, HALF - 1, HALF]),
    ] {
        let [high, low, middle_from, middle_to] = wanted.map(|cycles| cycles as u16);
        assert_eq!(steps(pauses), Some(LegCompares { high, low, middle_from, middle_to }), "{pauses:?}");
    }
}

#[test]
fn what_the_timers_cannot_play_has_no_compares() {
    let fine = [at(5_000), settings().half_steps()];
    assert!(steps([fine, NONE, [0, at(3_000)]]).is_some());
    assert_eq!(steps([[at(5_000), at(8_000)], NONE, NONE]), None, "H is on again before the peak");
    assert_eq!(steps([fine, NONE, [at(10), at(3_000)]]), None, "L is on at the valley");
}

#[test]
fn settings_of_a_stage_have_its_times() {
    let ratings = &traction::BUILT_IN.ratings;
    let drops = Drops { threshold_v: 1.1, slope_ohm: 3e-3 };
    let stage = PowerStage { angle_late_s: 30e-6, current_filter_s: 4e-6, drops, ..POWER_STAGE };
    let got = stage.settings(ratings);
    assert_eq!((got.drops.threshold_v, got.drops.slope_ohm), (1.1, 3e-3));
    let half_s = 0.5 / (patterns::FREE_CARRIER_SHARE * ratings.max_switching_hz);
    assert_eq!(got.devices.shortest_half_ticks, (half_s * got.clock.ticks_per_s) as u32 + 1);
    assert_eq!(got.angle_late_s, 30e-6);
    assert_eq!(got.current_filter_ticks, (4e-6 * got.clock.ticks_per_s).round() as u32);
    assert!(got.current_filter_ticks > 10);
    assert_eq!(got.angle_step_rad, Settings::step_rad(stage.encoder_counts, ratings.pole_pairs));
    let short = PowerStage { current_filter_s: 0.6 / got.clock.ticks_per_s, ..stage };
    assert_eq!(short.settings(ratings).current_filter_ticks, 1, "to the nearest tick");
    let known = Ratings { iron_share: 0.5, ..*ratings };
    assert_eq!(stage.settings(&known).iron_share, 0.5, "the machine's iron loss is made up for");
    let usual = POWER_STAGE.settings(ratings);
    assert_eq!(
        format!("{:?} {:?}", got.clock, got.devices),
        format!("{:?} {:?}", usual.clock, usual.devices)
    );
}
