//! The bus in the hands of an adversary: how far the drive follows recordings, a second master and a babbling node. Cases that the
//! protection cannot tell apart are tested here as well, and `docs/protocol.md` names them.

use crate::Stream;
use tractive::built_in::traction::BUILT_IN;
use tractive::modulation::Mode;
use tractive::operator::{Request, State, Status, Switches};
use tractive::protocol::authentication::{Guard, Signer};
use tractive::protocol::{
    COMMAND, Command, Content, Frame, LENGTH, LIMITS, Listening, Measured, PARAMETER_ANSWER,
    PARAMETER_REQUEST, PARAMETERS, ParameterRequest, Payload, Receiver, Scales, Session, TO_DRIVE,
    TelemetrySource,
};

const PULL: Command = Command { enable: true, torque_nm: 100.0, ..Command::AT_REST };
const PUSH: Command = Command { torque_nm: -100.0, ..PULL };
/// COMMAND's period, in ms.
const PERIOD_MS: u32 = 10;
/// Frames of eight bytes in a millisecond, the most that 500 kbit/s carry: 111 bits without stuffing, with the space between frames.
const MOST: usize = 5;

fn content(command: Command) -> Payload {
    command.encode(Scales::USUAL).unwrap()
}

/// The commands of a start, as they are on the bus: a greeting, rest, torque.
fn recording(stream: &mut Stream) -> Vec<Frame> {
    let commands = [Command::AT_REST; 10].into_iter().chain([PULL; 90]);
    commands.map(|command| stream.frame(content(command))).collect()
}

/// The requests of a drive that hears these frames, one in each period.
fn requests(session: &mut Session, frames: impl IntoIterator<Item = Frame>) -> Vec<Request> {
    frames.into_iter().map(|frame| session.listen(PERIOD_MS, [frame])).collect()
}

fn does_anything(request: &Request) -> bool {
    request.enable || request.charge || request.discharge || request.acknowledge || request.torque_nm != 0.0
}

/// A drive that follows the frames of the stream.
fn following(stream: &mut Stream) -> Session {
    let mut session = Session::new(&BUILT_IN.ratings);
    let frames = recording(stream);
    assert!(requests(&mut session, frames).last().unwrap().enable);
    session
}

/// Numbers without an order, always the same.
struct Noise(u64);

impl Noise {
    fn next(&mut self) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0
    }
}

#[test]
fn an_old_frame_is_taken_where_the_counter_cannot_tell_its_age_and_nowhere_else() {
    let mut stream = Stream::of(&COMMAND);
    let recorded = recording(&mut stream);
    let mut receiver = Receiver::new();
    assert!(recorded.iter().all(|frame| receiver.receive(frame, Scales::USUAL).is_ok()));
    let coming: Vec<Frame> = (0..8).map(|_| stream.frame(content(PULL))).collect();
    for (age, old) in recorded.iter().rev().enumerate() {
        let mut receiver = receiver;
        let is_taken = receiver.receive(old, Scales::USUAL).is_ok();
        assert_eq!(is_taken, age % 16 >= 13, "{age}");
        // The cost to the true sender.
        let lost = coming.iter().filter(|frame| receiver.receive(frame, Scales::USUAL).is_err()).count();
        assert_eq!(lost, if is_taken { 16 - age % 16 } else { 0 }, "{age}");
    }
}

/// The whole of a recorded start is followed after a reset: the drive cannot tell it from the sender's own.
#[test]
fn a_recording_from_rest_on_is_followed_after_a_reset_and_none_that_begins_later() {
    let recorded = recording(&mut Stream::of(&COMMAND));
    let is_followed = |from: usize| {
        let mut session = Session::new(&BUILT_IN.ratings);
        requests(&mut session, recorded[from..].iter().copied()).iter().any(does_anything)
    };
    let followed: Vec<usize> = (0..recorded.len()).filter(|from| is_followed(*from)).collect();
    // The first that is heard only sets the counter: from the last but one at rest on.
    assert_eq!(followed, (0..9).collect::<Vec<_>>());
}

#[test]
fn with_the_commands_signed_no_recording_is_followed_after_a_reset() {
    let key = [0x5A; 16];
    let mut signer = Signer::new(&key, 1);
    let commands = [Command::AT_REST; 10].into_iter().chain([PULL; 90]);
    let recorded: Vec<Frame> = commands.map(|command| signer.frame(content(command)).unwrap()).collect();
    for (epoch, followed) in [(1, true), (2, false)] {
        let (mut guard, mut session) = (Guard::new(&key, epoch), Session::new(&BUILT_IN.ratings));
        let admitted = recorded.iter().filter_map(|frame| guard.admit(frame));
        assert_eq!(requests(&mut session, admitted).iter().any(does_anything), followed, "epoch {epoch}");
    }
}

#[test]
fn the_counter_goes_round_with_up_to_two_frames_lost_at_any_place() {
    for place in 0..16 {
        for lost in 0..=2 {
            let (mut receiver, mut stream) = (Receiver::new(), Stream::of(&COMMAND));
            for number in 0..160 {
                if number % 16 == place {
                    for _ in 0..lost {
                        stream.frame(content(PULL));
                    }
                }
                assert!(receiver.receive(&stream.frame(content(PULL)), Scales::USUAL).is_ok(), "{number}");
            }
            assert_eq!(
                (receiver.counts().lost, receiver.counts().taken),
                (if place == 0 { 9 } else { 10 } * lost, 160)
            );
        }
    }
}

#[test]
fn of_two_masters_in_step_one_is_followed_and_the_others_frames_are_counted() {
    for ahead in 0..16 {
        let mut streams = [Stream::of(&COMMAND), Stream::of(&COMMAND)];
        let mut session = following(&mut streams[0]);
        // The recording has taken the counter to 4.
        for _ in 0..4 + ahead {
            streams[1].frame(content(PUSH));
        }
        let before = *session.counts();
        let mut torques: Vec<f32> = Vec::new();
        for _ in 0..200 {
            for (stream, command) in streams.iter_mut().zip([PULL, PUSH]) {
                torques.push(session.listen(PERIOD_MS / 2, [stream.frame(content(command))]).torque_nm);
            }
        }
        let counts = session.counts();
        // The second one takes over if it is ahead by no more frames than may be lost.
        let wins = if (1..=3).contains(&ahead) { -100.0 } else { 100.0 };
        assert!(torques[2..].iter().all(|torque_nm| *torque_nm == wins), "{ahead}: {torques:?}");
        let rejected = counts.repeated + counts.disordered - before.repeated - before.disordered;
        assert!((199..=200).contains(&rejected), "{ahead}: {rejected}");
    }
}

/// Their counters drift past each other: the drive follows now the one, now the other. It cannot know which is the right one; the supervisor
/// sees it in the counts.
#[test]
fn two_masters_out_of_step_are_followed_by_turns_and_seen_within_a_tenth_of_a_second() {
    for other_ms in [7, 9, 11, 13] {
        let mut streams = [Stream::of(&COMMAND), Stream::of(&COMMAND)];
        let mut session = following(&mut streams[0]);
        let (rejected, mut seen_ms) = (session.counts().rejected(), None);
        let mut torques = std::collections::BTreeSet::new();
        for ms in 1..=5_000 {
            let speak = [(PERIOD_MS, PULL), (other_ms, PUSH)].into_iter().zip(&mut streams);
            let frames = speak.filter_map(|((period_ms, command), stream)| {
                (ms % period_ms == 0).then(|| stream.frame(content(command)))
            });
            torques.insert(session.listen(1, frames.collect::<Vec<_>>()).torque_nm as i32);
            if session.counts().rejected() > rejected {
                seen_ms.get_or_insert(ms);
            }
        }
        // Nothing but what one of them asks for, or none.
        assert!(torques.iter().all(|torque_nm| [-100, 0, 100].contains(torque_nm)), "{torques:?}");
        assert!(torques.contains(&-100) && torques.contains(&100), "{other_ms} ms: {torques:?}");
        assert!(seen_ms.is_some_and(|ms| ms <= 100), "{other_ms} ms: {seen_ms:?}");
    }
}

/// Its counter is the next one due once in each round of the true sender's: then it is followed until the true sender's has passed it.
#[test]
fn a_node_that_repeats_a_frame_without_end_is_followed_a_quarter_of_the_time_and_alone_not_at_all() {
    let mut stream = Stream::of(&COMMAND);
    let mut session = following(&mut stream);
    let babble = stream.frame(content(PUSH));
    let before = session.counts().rejected();
    let mut followed_ms = 0;
    for ms in 1..=1_600_u32 {
        let own = ms.is_multiple_of(PERIOD_MS).then(|| stream.frame(content(PULL)));
        let request = session.listen(1, [babble; MOST].into_iter().chain(own));
        assert!(request.enable && session.listening() == Listening::Fresh, "{ms} ms");
        followed_ms += u32::from(request.torque_nm == -100.0);
    }
    // Four of sixteen periods, and three commands late in each round.
    assert!((350..=400).contains(&followed_ms), "{followed_ms}");
    assert!((1..=2 * 10).contains(&(session.counts().rejected() - before - 1_600 * MOST as u32)));
    session.listen(1, [stream.frame(content(PULL))]);
    for ms in 2..=600_u32 {
        let request = session.listen(1, [babble; MOST]);
        let limit_ms = |limit_ms| ms <= limit_ms;
        assert_eq!((request.enable, request.torque_nm != 0.0), (limit_ms(500), limit_ms(50)), "{ms} ms");
    }
}

/// Of frames of random bits, one in 256 has a valid CRC, and some of those have the counter that is due. They then fail by a command's
/// unused bits; but they advance the counter, and so the true sender's frames are lost until a silence.
#[test]
fn a_node_that_babbles_at_random_commands_nothing_and_at_worst_there_is_no_torque() {
    let (mut stream, mut noise) = (Stream::of(&COMMAND), Noise(0x9E37_79B9_7F4A_7C15));
    let mut session = following(&mut stream);
    let (mut intact, mut without) = (0, 0);
    for ms in 1..=100_000_u32 {
        let junk =
            [(); MOST].map(|()| Frame { id: COMMAND.id, length: LENGTH, data: noise.next().to_le_bytes() });
        intact += junk.iter().filter(|frame| COMMAND.is_intact(frame)).count();
        let own = ms.is_multiple_of(PERIOD_MS).then(|| stream.frame(content(PULL)));
        let torque_nm = session.listen(1, junk.into_iter().chain(own)).torque_nm;
        assert!([0.0, 100.0].contains(&torque_nm), "{ms} ms: {torque_nm}");
        without += u32::from(torque_nm == 0.0);
    }
    let share = intact as f64 / (100_000 * MOST) as f64;
    assert!((share * 256.0 - 1.0).abs() < 0.1, "{share}");
    assert!(session.counts().out_of_range > 100 && without > 0, "{without} {:?}", session.counts());
}

/// LIMITS has fewer unused bits than a command.
#[test]
fn of_a_million_random_limits_a_few_are_taken() {
    let (mut receiver, mut noise) = (Receiver::new(), Noise(0x9E37_79B9_7F4A_7C15));
    let mut babble = || {
        let frame = Frame { id: LIMITS.id, length: LENGTH, data: noise.next().to_le_bytes() };
        matches!(receiver.receive(&frame, Scales::USUAL), Ok(Content::Limits(_)))
    };
    let taken = (0..1_000_000).filter(|_| babble()).count();
    assert!((1..40).contains(&taken), "{taken}");
}

/// Five slots in ten are free for answers; all else keeps its place.
#[test]
fn a_flood_of_requests_moves_no_telemetry() {
    let told_with = |flood: bool| {
        let (mut session, mut stream) = (Session::new(&BUILT_IN.ratings), Stream::of(&PARAMETER_REQUEST));
        let read = ParameterRequest { parameter: 3, write: None }.encode().unwrap();
        let switches = Switches::default();
        let status = Status {
            state: State::Ready,
            trip: None,
            refusal: None,
            refusals: 0,
            torque_nm: 0.0,
            switches,
            temperatures: None,
        };
        let told = TelemetrySource { status: &status, measured: &Measured::default(), mode: Mode::Off };
        let mut sent = Vec::new();
        for ms in 0..1_000 {
            let frames: Vec<Frame> = (0..if flood { MOST } else { 0 }).map(|_| stream.frame(read)).collect();
            session.listen(1, frames);
            sent.extend(session.tell(&told).map(|frame| (ms, frame.id)));
        }
        sent
    };
    let (answers, others): (Vec<_>, Vec<_>) =
        told_with(true).into_iter().partition(|(_, id)| *id == PARAMETER_ANSWER.id);
    assert_eq!(others, told_with(false));
    assert_eq!(answers.len(), 400);
}

/// A bus-off ends after 100 ms; until then nothing is heard.
#[test]
fn a_bus_off_takes_the_torque_and_the_second_frame_behind_it_brings_it_back() {
    let mut stream = Stream::of(&COMMAND);
    let mut session = following(&mut stream);
    for ms in 1..=100_u32 {
        // The sender goes on, and is not heard.
        ms.is_multiple_of(PERIOD_MS).then(|| stream.frame(content(PULL)));
        let request = session.listen(1, None::<Frame>);
        assert_eq!((request.enable, request.torque_nm == 100.0), (true, ms < 50), "{ms} ms");
    }
    let back: Vec<f32> = (0..3).map(|_| session.listen(1, [stream.frame(content(PULL))]).torque_nm).collect();
    assert_eq!(back, [0.0, 100.0, 100.0]);
    assert_eq!(session.listening(), Listening::Fresh);
}

/// The longest time that anybody can have looked away.
#[test]
fn ages_do_not_wrap() {
    let mut stream = Stream::of(&COMMAND);
    let mut session = following(&mut stream);
    session.listen(20, None::<Frame>);
    for _ in 0..3 {
        let request = session.listen(u32::MAX, None::<Frame>);
        assert!(!does_anything(&request) && session.listening() == Listening::Off);
    }
}

/// Every message of another length, of other identifiers and with each bit of its counter: none is taken.
#[test]
fn a_message_under_every_identifier_and_of_every_length_is_taken_where_it_belongs_alone() {
    for message in TO_DRIVE {
        let (receiver, mut stream) = (Receiver::new(), Stream::of(message));
        let frame = stream.frame(Payload(0));
        for id in 0..0x800 {
            for length in 0..=LENGTH {
                let verdict = { receiver }.receive(&Frame { id, length, ..frame }, Scales::USUAL);
                let belongs = id == message.id && length == LENGTH;
                assert_eq!(verdict == Ok(Content::Greeting), belongs, "{id:#x} {length}");
            }
        }
    }
}

/// The parameters after a write; `None` where it is refused.
fn written(parameter: u8, value: f32) -> Option<f32> {
    let (mut session, mut stream) = (Session::new(&BUILT_IN.ratings), Stream::of(&PARAMETER_REQUEST));
    let request = ParameterRequest { parameter, write: Some(value) };
    let before = *session.parameters();
    for _ in 0..2 {
        session.listen(1, [stream.frame(request.encode().unwrap())]);
    }
    let read = session.parameters().read(parameter);
    (*session.parameters() != before || read == Some(value)).then_some(read).flatten()
}

#[test]
fn a_parameter_is_written_up_to_its_borders_and_not_a_bit_beyond() {
    let rated = *Session::new(&BUILT_IN.ratings).parameters();
    for parameter in PARAMETERS {
        let id = parameter.id;
        let (low, high) = match id {
            1 | 3 | 4 => (parameter.min, rated.read(id).unwrap()),
            // Torque is zero before the drive stops.
            5 => (parameter.min, rated.command_off_ms),
            6 => (rated.command_zero_ms, parameter.max),
            _ => (parameter.min, parameter.max),
        };
        for inside in [low, high] {
            assert_eq!(written(id, inside), Some(inside), "{}", parameter.name);
        }
        for outside in [low.next_down(), high.next_up(), -high, f32::MAX, f32::MIN] {
            assert_eq!(written(id, outside), None, "{} {outside}", parameter.name);
        }
    }
    // Nothing that is not a number gets as far as the parameters.
    let float = |value: f32| Payload(1 << 12 | 3 << 16 | u64::from(value.to_bits()) << 32);
    for value in [f32::NAN, -f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        assert_eq!(ParameterRequest::decode(float(value)), None, "{value}");
    }
    assert!(ParameterRequest::decode(float(1.0)).is_some());
}
