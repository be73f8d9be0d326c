//! Any words over the wire between an emulated board and the rig, and out of the cells: no panic, and whatever is understood is encoded to the same
//! again.

use crate::bytes::Bytes;
use tractive::cell::Words;
use tractive::drive::{Observation, PlannedHalf, Timed, dual};
use tractive::operator::{Feedback, Request as Asked};
use tractive::ports::{DriveCommand, DualDriveCommand, DualReport, Report};
use tractive::protection::Trip;
use tractive::protocol::Frame;
use tractive::recorder::{DualRecord, Record};
use tractive::wire::{self, Block, DualRequest, Request};

/// Any bytes as a block; zeros where they end.
pub fn check(bytes: &[u8]) {
    let (mut bytes, mut block) = (Bytes(bytes), Block::default());
    block.iter_mut().for_each(|word| *word = bytes.word().unwrap_or(0));
    check_request(&block);
    check_answer(&block);
    check_cells(&block);
}

/// A request that is understood is encoded to the same words again.
pub fn check_request(block: &Block) {
    if let Some(request) = Request::from_block(block) {
        let said = request.to_block();
        assert_eq!(Request::from_block(&said).map(Request::to_block), Some(said));
    }
    if let Some(request) = DualRequest::from_block(block) {
        let said = request.to_block();
        assert_eq!(DualRequest::from_block(&said).map(DualRequest::to_block), Some(said));
    }
}

/// Answers of any words are read without a panic.
pub fn check_answer(block: &Block) {
    let setup = wire::setup_to_block(wire::setup_from_block(block));
    assert_eq!(wire::setup_to_block(wire::setup_from_block(&setup)), setup);
    let dual = wire::dual_setup_to_block(wire::dual_setup_from_block(block));
    assert_eq!(wire::dual_setup_to_block(wire::dual_setup_from_block(&dual)), dual);
    let _ = (wire::sample_from_block(block), wire::asked_from_block(block), wire::start_from_block(block));
    let _ = (wire::dual_sample_from_block(block), wire::dual_asked_from_block(block));
    let _ = (wire::currents_from_block(block), wire::power_from_block(block));
}

/// The contents of a cell are encoded to the same again, whatever its words.
pub fn check_cells(block: &Block) {
    says_the_same::<PlannedHalf, _>(block);
    says_the_same::<Timed<DriveCommand>, _>(block);
    says_the_same::<Timed<DualDriveCommand>, _>(block);
    says_the_same::<Observation<Report>, _>(block);
    says_the_same::<Observation<DualReport>, _>(block);
    says_the_same::<dual::DualCommand, _>(block);
    says_the_same::<dual::DualApplied, _>(block);
    says_the_same::<Asked, _>(block);
    says_the_same::<Feedback, _>(block);
    says_the_same::<Record, _>(block);
    says_the_same::<DualRecord, _>(block);
    says_the_same::<Option<Frame>, _>(block);
    says_the_same::<Trip, _>(block);
    says_the_same::<Report, _>(block);
    says_the_same::<DualReport, _>(block);
}

fn says_the_same<T: Words<N>, const N: usize>(block: &Block) {
    let mut words = [0; N];
    words.iter_mut().zip(block.iter().cycle()).for_each(|(word, any)| *word = *any);
    let said = T::from_words(words).to_words();
    assert_eq!(T::from_words(said).to_words(), said);
}
