//! The frames that take effect, and the counts of the others.

use crate::Stream;
use tractive::protocol::e2e::MAX_DELTA;
use tractive::protocol::{
    COMMAND, Command, Content, Counts, Frame, LIMITS, LINK_LIMITS, LinkLimits, PARAMETER_REQUEST,
    ParameterRequest, Payload, Receiver, Reject, STATUS, Scales, TorqueLimits,
};

fn command(torque_nm: f32) -> Payload {
    Command { torque_nm, ..Command::default() }.encode(Scales::USUAL).unwrap()
}

/// A receiver that has heard the first frame, and the stream that goes on from it.
fn met() -> (Receiver, Stream) {
    let (mut receiver, mut stream) = (Receiver::new(), Stream::of(&COMMAND));
    assert_eq!(receiver.receive(&stream.frame(command(0.0)), Scales::USUAL), Ok(Content::Greeting));
    (receiver, stream)
}

fn torque(verdict: Result<Content, Reject>) -> Option<f32> {
    match verdict {
        Ok(Content::Command(command)) => Some(command.torque_nm),
        _ => None,
    }
}

#[test]
fn frames_in_order_take_effect() {
    let (mut receiver, mut stream) = met();
    for k in 0..40 {
        let torque_nm = k as f32;
        assert_eq!(
            torque(receiver.receive(&stream.frame(command(torque_nm)), Scales::USUAL)),
            Some(torque_nm)
        );
    }
    assert_eq!(*receiver.counts(), Counts { received: 41, taken: 41, ..Counts::default() });
}

#[test]
fn each_cause_is_named_and_counted() {
    let (mut receiver, mut stream) = met();
    let good = stream.frame(command(10.0));
    assert!(receiver.receive(&good, Scales::USUAL).is_ok());
    assert_eq!(receiver.receive(&good, Scales::USUAL), Err(Reject::Repeated));
    assert_eq!(receiver.receive(&Frame { id: 0x7FF, ..good }, Scales::USUAL), Err(Reject::Unknown));
    assert_eq!(receiver.receive(&Frame { id: STATUS.id, ..good }, Scales::USUAL), Err(Reject::Unknown));
    for length in (0..8).chain(9..16) {
        assert_eq!(receiver.receive(&Frame { length, ..good }, Scales::USUAL), Err(Reject::Truncated));
    }
    for bit in 0..64 {
        let mut bad = stream.frame(command(20.0));
        bad.data[bit / 8] ^= 1 << (bit % 8);
        assert_eq!(receiver.receive(&bad, Scales::USUAL), Err(Reject::Corrupted), "bit {bit}");
    }
    // The 64 corrupted frames have taken the counter round four times.
    assert_eq!(torque(receiver.receive(&stream.frame(command(30.0)), Scales::USUAL)), Some(30.0));
    assert_eq!(receiver.receive(&good, Scales::USUAL), Err(Reject::Disordered), "an old frame");
    let mut reserved = command(40.0);
    reserved.0 |= 1 << 63;
    assert_eq!(receiver.receive(&stream.frame(reserved), Scales::USUAL), Err(Reject::OutOfRange));
    let counts = *receiver.counts();
    let wanted = Counts {
        received: 87,
        taken: 3,
        lost: 0,
        unknown: 2,
        truncated: 15,
        corrupted: 64,
        repeated: 1,
        disordered: 1,
        out_of_range: 1,
    };
    assert_eq!(counts, wanted);
    assert_eq!(counts.received, counts.taken + counts.rejected());
}

#[test]
fn frames_that_change_places_lose_the_late_one() {
    let (mut receiver, mut stream) = met();
    let (first, second, third) =
        (stream.frame(command(1.0)), stream.frame(command(2.0)), stream.frame(command(3.0)));
    assert_eq!(torque(receiver.receive(&second, Scales::USUAL)), Some(2.0));
    assert_eq!(receiver.receive(&first, Scales::USUAL), Err(Reject::Disordered));
    assert_eq!(torque(receiver.receive(&third, Scales::USUAL)), Some(3.0));
    assert_eq!((receiver.counts().lost, receiver.counts().disordered), (1, 1));
}

#[test]
fn up_to_two_lost_frames_are_forgiven_and_counted_more_wait_for_the_silence() {
    for lost in 0..6 {
        let (mut receiver, mut stream) = met();
        for _ in 0..lost {
            stream.frame(command(0.0));
        }
        let verdict = receiver.receive(&stream.frame(command(5.0)), Scales::USUAL);
        assert_eq!(verdict.is_ok(), lost <= 2, "{lost}");
        assert_eq!(receiver.counts().lost, if lost <= 2 { lost } else { 0 });
        (0..50).for_each(|_| receiver.wait(1, 50));
        assert_eq!(
            receiver.receive(&stream.frame(command(6.0)), Scales::USUAL),
            Ok(Content::Greeting),
            "after the silence"
        );
        assert_eq!(torque(receiver.receive(&stream.frame(command(7.0)), Scales::USUAL)), Some(7.0));
    }
}

#[test]
fn a_wrong_counter_is_no_sign_of_life() {
    let (mut receiver, mut stream) = met();
    let old = stream.frame(command(10.0));
    assert!(receiver.receive(&old, Scales::USUAL).is_ok());
    for _ in 0..MAX_DELTA {
        stream.frame(command(20.0));
    }
    let far = stream.frame(command(20.0));
    // A sender that repeats itself, or that is too far on, is silent: after the time-out the sequence begins anew.
    for slots in [20, 40, 60, 80] {
        receiver.wait(20, 100);
        assert_eq!(receiver.receive(&old, Scales::USUAL), Err(Reject::Repeated), "{slots} ms");
        assert_eq!(receiver.receive(&far, Scales::USUAL), Err(Reject::Disordered), "{slots} ms");
    }
    receiver.wait(20, 100);
    assert_eq!(receiver.receive(&far, Scales::USUAL), Ok(Content::Greeting));
}

#[test]
fn out_of_range_is_rejected_whole_in_every_message() {
    let bad_torque = |raw: u64| Payload(raw << 16);
    for (stream, contents) in [
        (&COMMAND, vec![bad_torque(30_001), bad_torque(0x8000), bad_torque(0x7FFF), Payload(1 << 40)]),
        (&LIMITS, vec![Payload(30_001 << 16 | 1 << 48), Payload(0), Payload(1 << 12 | 1 << 48)]),
        (&LINK_LIMITS, vec![Payload(2 << 16 | 1 << 32), Payload(0), Payload(65_001 << 32)]),
        (
            &PARAMETER_REQUEST,
            vec![
                Payload(1 << 12 | u64::from(f32::NAN.to_bits()) << 32),
                Payload(1 << 12 | u64::from(f32::INFINITY.to_bits()) << 32),
                Payload(u64::from(1.0_f32.to_bits()) << 32),
            ],
        ),
    ] {
        let (mut receiver, mut stream) = (Receiver::new(), Stream::of(stream));
        receiver.receive(&stream.frame(contents[0]), Scales::USUAL).unwrap();
        for content in &contents {
            assert_eq!(
                receiver.receive(&stream.frame(*content), Scales::USUAL),
                Err(Reject::OutOfRange),
                "{content:X?}"
            );
        }
    }
}

#[test]
fn every_message_says_what_was_put_in() {
    let mut receiver = Receiver::new();
    let limits = TorqueLimits { motoring_nm: 1_235.0, braking_nm: 600.5, speed_rpm: 2_100.0 };
    let link = LinkLimits { low_v: 1_000.0, high_v: 1_800.0 };
    let request = ParameterRequest { parameter: 3, write: Some(500.0) };
    let command =
        Command { enable: true, coast: true, acknowledge: true, torque_nm: -77.5, ..Command::default() };
    for (message, content, wanted) in [
        (&COMMAND, command.encode(Scales::USUAL).unwrap(), Content::Command(command)),
        (&LIMITS, limits.encode(Scales::USUAL).unwrap(), Content::Limits(limits)),
        (&LINK_LIMITS, link.encode(Scales::USUAL).unwrap(), Content::LinkLimits(link)),
        (&PARAMETER_REQUEST, request.encode().unwrap(), Content::Parameter(request)),
    ] {
        let mut stream = Stream::of(message);
        assert_eq!(receiver.receive(&stream.frame(content), Scales::USUAL), Ok(Content::Greeting));
        assert_eq!(receiver.receive(&stream.frame(content), Scales::USUAL), Ok(wanted));
    }
}
