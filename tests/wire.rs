//! Any words over the wire between an emulated board and the rig, and out of the cells. What must hold is in `fuzz/src/wire.rs`.

#[path = "../fuzz/src/bytes.rs"]
mod bytes;
#[path = "../fuzz/src/corpus.rs"]
mod corpus;
#[path = "../fuzz/src/wire.rs"]
mod wire;

use proptest::prelude::*;
use tractive::wire::{BLOCK_WORDS, Block, DualRequest, Request};
use wire::{check_answer, check_cells, check_request};

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
        let mut block = [0; BLOCK_WORDS];
        block[0] = tag;
        block
    });
    blocks.filter(known).map(|block| block[0]).collect()
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 5_000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn what_is_understood_says_the_same_again(block in block()) {
        check_request(&block);
        check_answer(&block);
        check_cells(&block);
    }
}

#[test]
fn every_kept_input_is_read() {
    corpus::each("fuzz/corpus/wire", wire::check);
}

#[test]
fn the_tags_of_requests_are_found() {
    assert!(tags().len() >= 4, "{:?}", tags());
}
