//! Whatever may come: nothing panics, only valid frames take effect, the counters add up. What must hold is in `fuzz/src/protocol.rs`.

#[path = "../../fuzz/src/protocol.rs"]
mod protocol;

use crate::corpus;
use proptest::prelude::*;
use protocol::{Event, check_content, check_receiver, check_session, check_words, check_zs9};
use tractive::protocol::{Payload, Scales, TO_DRIVE};

fn event() -> impl Strategy<Value = Event> {
    let our_id = prop::sample::select(TO_DRIVE.map(|message| message.id).to_vec());
    prop_oneof![
        1 => (any::<u16>(), 0_u8..16, any::<[u8; 8]>()).prop_map(|(id, length, data)| Event::Noise(id, length, data)),
        1 => (our_id, 0_u8..16, any::<[u8; 8]>()).prop_map(|(id, length, data)| Event::Noise(id, length, data)),
        1 => (0..TO_DRIVE.len(), any::<u64>()).prop_map(|(message, content)| Event::Protected(message, content)),
        3 => (-3_000.0_f32..3_000.0).prop_map(Event::Valid),
        1 => any::<usize>().prop_map(Event::Replay),
        1 => (1_u64..).prop_map(Event::Flip),
        1 => (1_u8..10).prop_map(Event::Lose),
        1 => (1_u32..1_200).prop_map(Event::Silence),
        1 => any::<usize>().prop_map(Event::State),
    ]
}

proptest! {
    #[test]
    fn only_intact_frames_take_effect_and_the_counters_add_up(events in prop::collection::vec(event(), 1..200)) {
        check_receiver(&events);
    }

    #[test]
    fn a_request_follows_valid_commands_only(events in prop::collection::vec(event(), 1..200)) {
        check_session(&events);
    }

    #[test]
    fn the_zs9_asks_for_nothing_once_nothing_comes(events in prop::collection::vec(event(), 1..200)) {
        check_zs9(&events);
    }

    #[test]
    fn any_words_are_a_frame_or_none(words: [u32; 3]) {
        check_words(words);
    }

    #[test]
    fn any_telemetry_is_decoded_without_a_panic(bits: u64) {
        check_content(Payload(bits), Scales::USUAL);
    }
}

#[test]
fn every_kept_input_is_taken() {
    corpus::each("fuzz/corpus/protocol", protocol::check);
}
