//! Any words over the wire between an emulated board and the rig: no panic, and what is understood says the same again.

use proptest::prelude::*;
use tractive::wire::{self, Block, DualRequest, Request};

/// Blocks of any words; the first often one of the streams' tags.
fn block() -> impl Strategy<Value = Block> {
    let tag = prop_oneof![any::<u32>(), 0..16_u32, prop::sample::select(tags())];
    (tag, any::<Block>()).prop_map(|(tag, mut block)| {
        block[0] = tag;
        block
    })
}

/// The first words of requests that the board sends.
fn tags() -> Vec<u32> {
    let known =
        |block: &Block| Request::from_block(block).is_some() || DualRequest::from_block(block).is_some();
    let blocks = (0..1_u32 << 12).map(|tag| {
        let mut block = [0; wire::BLOCK_WORDS];
        block[0] = tag;
        block
    });
    blocks.filter(known).map(|block| block[0]).collect()
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 5_000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn a_request_that_is_understood_says_the_same_again(block in block()) {
        if let Some(request) = Request::from_block(&block) {
            let said = request.to_block();
            prop_assert_eq!(Request::from_block(&said).map(Request::to_block), Some(said));
        }
        if let Some(request) = DualRequest::from_block(&block) {
            let said = request.to_block();
            prop_assert_eq!(DualRequest::from_block(&said).map(DualRequest::to_block), Some(said));
        }
    }

    #[test]
    fn answers_of_any_words_are_read_without_a_panic(block in block()) {
        let setup = wire::setup_to_block(wire::setup_from_block(&block));
        prop_assert_eq!(wire::setup_to_block(wire::setup_from_block(&setup)), setup);
        let dual = wire::dual_setup_to_block(wire::dual_setup_from_block(&block));
        prop_assert_eq!(wire::dual_setup_to_block(wire::dual_setup_from_block(&dual)), dual);
        let _ = (wire::sample_from_block(&block), wire::asked_from_block(&block), wire::start_from_block(&block));
        let _ = (wire::dual_sample_from_block(&block), wire::dual_asked_from_block(&block));
        let _ = (wire::currents_from_block(&block), wire::power_from_block(&block));
    }
}

#[test]
fn the_tags_of_requests_are_found() {
    assert!(tags().len() >= 4, "{:?}", tags());
}
