//! Whatever may come: nothing panics, only valid frames take effect, the counters add up.

use proptest::prelude::*;
use tractive::built_in::traction::BUILT_IN;
use tractive::cell::Words;
use tractive::protocol::e2e::Counter;
use tractive::protocol::{
    COMMAND, Command, Content, Counts, Frame, LIMITS, LINK_LIMITS, Listening, Measured, PARAMETER_REQUEST,
    Payload, Receiver, Scales, Session, TO_DRIVE,
};

/// The injuries that a bus, or somebody on it, does to frames.
#[derive(Clone, Debug)]
enum Event {
    /// Any bytes under any identifier.
    Noise(u16, u8, [u8; 8]),
    /// A protected frame of one of our messages, with any content.
    Protected(usize, u64),
    /// A valid command.
    Valid(f32),
    /// A frame seen before, by its number.
    Replay(prop::sample::Index),
    /// The last frame with bits turned.
    Flip(u64),
    /// Frames lost.
    Lose(u8),
    /// Time passes.
    Silence(u32),
}

fn event() -> impl Strategy<Value = Event> {
    let our_id = prop::sample::select(TO_DRIVE.map(|message| message.id).to_vec());
    prop_oneof![
        1 => (any::<u16>(), 0_u8..16, any::<[u8; 8]>()).prop_map(|(id, length, data)| Event::Noise(id, length, data)),
        1 => (our_id, 0_u8..16, any::<[u8; 8]>()).prop_map(|(id, length, data)| Event::Noise(id, length, data)),
        1 => (0..TO_DRIVE.len(), any::<u64>()).prop_map(|(message, content)| Event::Protected(message, content)),
        3 => (-3_000.0_f32..3_000.0).prop_map(Event::Valid),
        1 => any::<prop::sample::Index>().prop_map(Event::Replay),
        1 => (1_u64..).prop_map(Event::Flip),
        1 => (1_u8..10).prop_map(Event::Lose),
        1 => (1_u32..1_200).prop_map(Event::Silence),
    ]
}

/// The sender's side, so that the test knows what is valid.
#[derive(Default)]
struct Bus {
    counters: [Counter; 4],
    seen: Vec<Frame>,
}

impl Bus {
    fn send(&mut self, message: usize, content: Payload) -> Frame {
        TO_DRIVE[message].frame(content, &mut self.counters[message])
    }

    fn frame(&mut self, event: &Event) -> Option<Frame> {
        let frame = match event {
            Event::Noise(id, length, data) => Frame { id: *id, length: *length, data: *data },
            Event::Protected(message, content) => self.send(*message, Payload(*content)),
            Event::Valid(torque_nm) => {
                let command = Command { torque_nm: *torque_nm, ..Command::default() };
                self.send(0, command.encode(Scales::USUAL).unwrap())
            }
            Event::Replay(index) => *self.seen.get(index.index(self.seen.len().max(1)))?,
            Event::Flip(bits) => {
                let last = self.seen.last()?;
                let data = (u64::from_le_bytes(last.data) ^ bits).to_le_bytes();
                Frame { data, ..*last }
            }
            Event::Lose(count) => {
                for _ in 0..*count {
                    self.send(0, Payload(0));
                }
                return None;
            }
            Event::Silence(_) => return None,
        };
        self.seen.push(frame);
        Some(frame)
    }
}

fn adds_up(counts: &Counts) -> bool {
    counts.received == counts.taken + counts.rejected()
}

proptest! {
    #[test]
    fn only_intact_frames_take_effect_and_the_counters_add_up(events in prop::collection::vec(event(), 1..200)) {
        let (mut bus, mut receiver) = (Bus::default(), Receiver::new());
        let mut received = 0;
        for event in &events {
            if let Event::Silence(ms) = event {
                (0..*ms).for_each(|_| receiver.wait(1, 50));
            }
            receiver.wait(1, 50);
            let Some(frame) = bus.frame(event) else { continue };
            received += 1;
            let before = *receiver.counts();
            let verdict = receiver.receive(&frame, Scales::USUAL);
            let counts = *receiver.counts();
            prop_assert!(adds_up(&counts) && counts.received == received);
            prop_assert_eq!(counts.taken - before.taken, u32::from(verdict.is_ok()));
            if let Ok(content) = verdict {
                let message = TO_DRIVE.into_iter().find(|message| message.id == frame.id).unwrap();
                prop_assert!(message.is_intact(&frame) && frame.length == 8);
                // What took effect is what the frame says, with nothing clamped on the way.
                let zero = Payload(u64::from_le_bytes(frame.data) & !0xFFF);
                let same = match content {
                    Content::Greeting => true,
                    Content::Command(command) => message.id == COMMAND.id && command.encode(Scales::USUAL) == Ok(zero),
                    Content::Limits(limits) => message.id == LIMITS.id && limits.encode(Scales::USUAL) == Ok(zero),
                    Content::LinkLimits(limits) => message.id == LINK_LIMITS.id && limits.encode(Scales::USUAL) == Ok(zero),
                    Content::Parameter(request) => message.id == PARAMETER_REQUEST.id && request.encode() == Ok(zero),
                };
                prop_assert!(same, "{content:?} {frame:?}");
            }
        }
    }

    /// A request never asks for more than the newest valid command did, and for nothing once that is old.
    #[test]
    fn a_request_follows_valid_commands_only(events in prop::collection::vec(event(), 1..200)) {
        let (mut bus, mut session, mut judge) = (Bus::default(), Session::new(&BUILT_IN.ratings), Receiver::new());
        let (mut torque_nm, mut age_ms) = (0.0, u32::MAX);
        for event in &events {
            let ms = if let Event::Silence(ms) = event { *ms } else { 1 };
            let frame = bus.frame(event);
            for slot in 0..ms {
                judge.wait(1, 50);
                age_ms = age_ms.saturating_add(1);
                let frame = frame.as_ref().filter(|_| slot == 0);
                if let Some(Ok(Content::Command(command))) = frame.map(|frame| judge.receive(frame, Scales::USUAL)) {
                    (torque_nm, age_ms) = (command.torque_nm, 0);
                }
                let request = session.listen(1, frame);
                prop_assert!(request.torque_nm == 0.0 || (request.torque_nm == torque_nm && age_ms < 50));
                prop_assert!(!(request.enable && age_ms >= 500));
                prop_assert_eq!(session.listening() == Listening::Fresh, age_ms < 50);
            }
        }
        prop_assert_eq!(session.counts(), judge.counts());
    }

    #[test]
    fn any_words_are_a_frame_or_none(words: [u32; 3]) {
        if let Some(frame) = Option::<Frame>::from_words(words) {
            prop_assert_eq!(Option::<Frame>::from_words(Some(frame).to_words()), Some(frame));
            let _ = Receiver::new().receive(&frame, Scales::USUAL);
        }
    }

    #[test]
    fn any_telemetry_is_decoded_without_a_panic(bits: u64) {
        use tractive::modulation::Mode;
        use tractive::protocol::{FROM_DRIVE, ParameterAnswer, StatusFrame, trip_number};
        let payload = Payload(bits);
        let (mut measured, mut counts) = (Measured::default(), Counts::default());
        for message in FROM_DRIVE {
            measured.merge(message, payload, Scales::USUAL);
        }
        counts.merge(payload);
        let status = StatusFrame::<Mode>::decode(payload);
        prop_assert_eq!(StatusFrame::decode(status.encode()), status);
        let _ = (ParameterAnswer::decode(payload), trip_number(payload));
    }
}
