//! Commands that only the holder of the key can send.

use tractive::built_in::traction::BUILT_IN;
use tractive::protocol::authentication::{Guard, Signer};
use tractive::protocol::e2e::{self, protect};
use tractive::protocol::{
    COMMAND, CanEndpoint, Command, Content, Frame, LIMITS, PARAMETER_REQUEST, Payload, Receiver, Reject,
    Scales, TorqueLimits,
};

/// The key of RFC 4493's examples.
const KEY: [u8; 16] = 0x2B7E_1516_28AE_D2A6_ABF7_1588_09CF_4F3C_u128.to_be_bytes();
const EPOCH: u64 = 0x0123_4567_89AB_CDEF;
const PULL: Command = Command { enable: true, torque_nm: 100.0, ..Command::AT_REST };

fn ends() -> (Signer, Guard) {
    (Signer::new(&KEY, EPOCH), Guard::new(&KEY, EPOCH))
}

fn content(command: Command) -> Payload {
    command.encode(Scales::USUAL).unwrap()
}

fn signed(signer: &mut Signer, command: Command) -> Frame {
    signer.frame(content(command)).unwrap()
}

/// By `openssl mac -cipher AES-128-CBC -macopt hexkey:2b7e… CMAC` over the 16 bytes that the module's page describes.
#[test]
fn the_tags_are_those_of_another_implementation() {
    let (mut signer, _) = ends();
    let frames: Vec<Frame> = (0..32).map(|_| signed(&mut signer, PULL)).collect();
    for (number, tag) in [(0, [0x38, 0xFE, 0x8F]), (1, [0x08, 0x60, 0x75]), (31, [0x5E, 0x7C, 0x97])] {
        let Frame { id, length, data } = frames[number];
        assert_eq!((id, length, &data[1..5]), (COMMAND.id, 8, &[0x10 | (number as u8 % 16), 0xE8, 3, 0][..]));
        assert_eq!(data[5..], tag, "{number}");
    }
}

#[test]
fn a_drive_behind_the_guard_follows_the_keys_holder() {
    let (mut signer, mut guard) = ends();
    let mut endpoint = CanEndpoint::new(&BUILT_IN.ratings);
    for (count, command) in
        [Command::AT_REST, Command::AT_REST, PULL].into_iter().cycle().take(99).enumerate()
    {
        let frame = signed(&mut signer, command);
        let request = endpoint.listen(1, [frame].into_iter().filter_map(|frame| guard.admit(&frame)));
        let torque_nm = if count == 0 { 0.0 } else { command.torque_nm };
        assert_eq!((request.torque_nm, request.enable), (torque_nm, command.enable && count > 0), "{count}");
    }
    assert_eq!((endpoint.counts().taken, endpoint.counts().received, guard.refused()), (99, 99, 0));
}

#[test]
fn a_drive_without_a_guard_refuses_a_tag() {
    let (mut signer, mut receiver) = (ends().0, Receiver::new());
    let mut receive = || receiver.receive(&signed(&mut signer, PULL), Scales::USUAL);
    assert_eq!([receive(), receive()], [Ok(Content::Greeting), Err(Reject::OutOfRange)]);
}

/// Anybody can make a CRC, but only the holder of the key a tag.
#[test]
fn a_frame_with_any_bit_changed_is_refused_even_with_a_right_crc() {
    let (mut signer, mut guard) = ends();
    let sound = signed(&mut signer, PULL);
    for bit in 8..64 {
        let mut data = (u64::from_le_bytes(sound.data) ^ 1 << bit).to_le_bytes();
        let counter = e2e::counter(&data);
        protect(&mut data, counter, COMMAND.data_ids());
        assert_eq!(guard.admit(&Frame { data, ..sound }), None, "bit {bit}");
    }
    assert_eq!(guard.refused(), 56);
    let mut strangers = [[0; 16], [0xFF; 16]].map(|key| Signer::new(&key, EPOCH));
    for stranger in &mut strangers {
        assert_eq!(guard.admit(&signed(stranger, PULL)), None);
    }
    assert!(guard.admit(&sound).is_some(), "what was refused has changed nothing");
}

#[test]
fn a_recorded_frame_is_refused_whatever_its_age() {
    let (mut signer, mut guard) = ends();
    let recorded: Vec<Frame> = (0..200).map(|_| signed(&mut signer, PULL)).collect();
    assert!(recorded.iter().all(|frame| guard.admit(frame).is_some()));
    assert!(recorded.iter().all(|frame| guard.admit(frame).is_none()));
    assert!(guard.admit(&signed(&mut signer, PULL)).is_some());
}

#[test]
fn a_recording_is_refused_after_a_reset_if_the_epoch_is_another_and_not_else() {
    let (mut signer, _) = ends();
    let recorded: Vec<Frame> = (0..50).map(|_| signed(&mut signer, PULL)).collect();
    let admitted = |epoch| {
        let mut guard = Guard::new(&KEY, epoch);
        recorded.iter().filter(|frame| guard.admit(frame).is_some()).count()
    };
    assert_eq!([admitted(EPOCH), admitted(EPOCH + 1), admitted(0)], [50, 0, 0]);
}

#[test]
fn sixty_three_frames_may_be_lost_in_a_row() {
    for lost in 0..80 {
        let (mut signer, mut guard) = ends();
        assert!(guard.admit(&signed(&mut signer, PULL)).is_some());
        for _ in 0..lost {
            signed(&mut signer, PULL);
        }
        assert_eq!(guard.admit(&signed(&mut signer, PULL)).is_some(), lost < 64, "{lost}");
    }
}

#[test]
fn other_messages_and_damaged_commands_are_left_to_the_receiver() {
    let (mut signer, mut guard) = ends();
    let limits = TorqueLimits { motoring_nm: 50.0, braking_nm: 40.0, speed_rpm: 600.0 };
    let others = [(&LIMITS, limits.encode(Scales::USUAL).unwrap()), (&PARAMETER_REQUEST, Payload(0))];
    let sound = signed(&mut signer, PULL);
    let mut damaged = sound;
    damaged.data[0] ^= 1;
    let short = Frame { length: 7, ..sound };
    let frames = others.map(|(message, content)| crate::Stream::of(message).frame(content));
    for frame in [&frames[..], &[damaged, short]].concat() {
        assert_eq!(guard.admit(&frame), Some(frame));
    }
    let [damaged, short] = [damaged, short].map(|frame| Receiver::new().receive(&frame, Scales::USUAL));
    assert_eq!((damaged, short, guard.refused()), (Err(Reject::Corrupted), Err(Reject::Truncated), 0));
    assert!(guard.admit(&sound).is_some());
}

#[test]
fn a_content_in_the_tags_place_is_not_signed() {
    let (mut signer, _) = ends();
    assert_eq!(signer.frame(Payload(1 << 40)), None);
    assert!(signer.frame(Payload((1 << 40) - 1)).is_some());
}
