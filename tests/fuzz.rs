//! Anything into both drives: any words for measurements and demands, interrupts in any order. What must hold is in `fuzz/src/drive.rs`.
//!
//! `TRACTIVE_FUZZ_CASES=100000 cargo test --release --test fuzz` tries longer.

#[path = "../fuzz/src/bytes.rs"]
mod bytes;
#[path = "../fuzz/src/corpus.rs"]
mod corpus;
#[path = "../fuzz/src/drive.rs"]
mod drive;

use drive::{Call, ODD, check_traction, check_zs9};
use proptest::prelude::*;

fn config() -> ProptestConfig {
    let cases =
        std::env::var("TRACTIVE_FUZZ_CASES").ok().and_then(|cases| cases.parse().ok()).unwrap_or(1_000);
    ProptestConfig { cases, failure_persistence: None, ..ProptestConfig::default() }
}

/// Bits of a number: any at all, or one that is likely to matter.
fn bits() -> impl Strategy<Value = u32> {
    prop_oneof![
        any::<u32>(),
        prop::sample::select(ODD.to_vec()).prop_map(f32::to_bits),
        (-2e3_f32..2e3).prop_map(f32::to_bits),
    ]
}

fn call() -> impl Strategy<Value = Call> {
    let spoilt = || prop::option::of((0..16_u8, bits()));
    prop_oneof![
        1 => spoilt().prop_map(Call::Control),
        1 => spoilt().prop_map(Call::Pwm),
        1 => Just(Call::Revise),
        6 => (0..8_u16).prop_map(Call::Acknowledge),
        4 => prop_oneof![3 => 1..20_u16, 1 => 300..900_u16].prop_map(Call::Healthy),
        6 => ((0..16_u8, bits()), 1..12_u16).prop_map(|(spoilt, calls)| Call::Spoilt(spoilt, calls)),
    ]
}

/// Mostly a drive that has pulsed for a while before anything befalls it.
fn calls() -> impl Strategy<Value = Vec<Call>> {
    (prop_oneof![1 => Just(0_u16), 3 => Just(900)], prop::collection::vec(call(), 1..30)).prop_map(
        |(before, mut calls)| {
            calls.insert(0, Call::Healthy(before));
            calls
        },
    )
}

proptest! {
    #![proptest_config(config())]

    #[test]
    fn traction_takes_anything(
        omega in prop_oneof![Just(0.0_f32), -2600.0_f32..2600.0],
        first in any::<u32>(),
        calls in calls(),
    ) {
        check_traction(omega, first, &calls);
    }

    #[test]
    fn the_zs9_takes_anything(
        omega in prop_oneof![Just(0.0_f32), -700.0_f32..700.0],
        carrier_ticks in prop::sample::select(vec![2_500_u32, 1_250]),
        calls in calls(),
    ) {
        check_zs9(omega, carrier_ticks, &calls);
    }
}

#[test]
fn every_kept_input_is_taken() {
    corpus::each("fuzz/corpus/drive", drive::check);
}
