//! Arbitrary traffic on the bus: nothing panics, only valid frames take effect, the counters add up, a request follows the newest command alone and
//! ages, and what the drive sends is a frame of its messages.

use crate::bytes::Bytes;
use tractive::built_in::{traction, zs9};
use tractive::cell::Words;
use tractive::machine::Ratings;
use tractive::modulation::Mode;
use tractive::operator::{State, Status, Switches, Wanted};
use tractive::protocol::e2e::Counter;
use tractive::protocol::{
    COMMAND, Command, Content, Counts, ExperimentFrame, FROM_DRIVE, Frame, LIMITS, LINK_LIMITS, LinkLimits,
    Listening, Measured, Message, ObservationFrame, PARAMETER_REQUEST, ParameterAnswer, ParameterRequest,
    Payload, Receiver, Scales, Session, StatusFrame, TO_DRIVE, TO_ZS9, TelemetrySource, TemperaturesFrame,
    TorqueLimits, Zs9Command, Zs9Demands, Zs9Link, Zs9Session, trip_number,
};

/// The errors that a bus, or some node on it, causes in frames.
#[derive(Clone, Debug)]
pub enum Event {
    /// Any bytes under any identifier.
    Noise(u16, u8, [u8; 8]),
    /// A protected frame of one of our messages, with any content.
    Protected(usize, u64),
    /// A valid command.
    Valid(f32),
    /// A frame seen before, by its number.
    Replay(usize),
    /// The last frame with bits turned.
    Flip(u64),
    /// Frames lost.
    Lose(u8),
    /// Time passes.
    Silence(u32),
    /// The drive changes its state.
    State(usize),
}

/// Events from any bytes, at most so many.
fn events(bytes: &mut Bytes, to_drive: &[&Message]) -> Vec<Event> {
    const MOST: usize = 200;
    let mut next = || {
        Some(match bytes.byte()? % 9 {
            0 => Event::Noise(bytes.short()?, bytes.byte()? % 16, bytes.take()?),
            1 => {
                let message = to_drive[usize::from(bytes.byte()?) % to_drive.len()];
                Event::Noise(message.id, bytes.byte()? % 16, bytes.take()?)
            }
            2 => Event::Protected(usize::from(bytes.byte()?) % to_drive.len(), bytes.long()?),
            3 => Event::Valid(f32::from(bytes.short()? as i16 % 30_000) * 0.1),
            4 => Event::Replay(bytes.byte()?.into()),
            5 => Event::Flip(bytes.long()?),
            6 => Event::Lose(bytes.byte()? % 10),
            7 => Event::Silence(u32::from(bytes.short()?) % 1_200),
            _ => Event::State(bytes.byte()?.into()),
        })
    };
    std::iter::from_fn(&mut next).take(MOST).collect()
}

/// The sender's side, so that the test knows what is valid.
struct Bus {
    to_drive: &'static [&'static Message],
    /// A valid command's content, of a torque in N·m.
    pull: fn(f32) -> Payload,
    counters: [Counter; 5],
    seen: Vec<Frame>,
}

impl Bus {
    fn new() -> Self {
        let pull = |torque_nm| Command { torque_nm, ..Command::default() }.encode(Scales::USUAL).unwrap();
        Self { to_drive: &TO_DRIVE, pull, counters: [Counter::new(); 5], seen: Vec::new() }
    }

    fn of_zs9() -> Self {
        let pull = |torque_nm| {
            let demands = Zs9Demands::Torques([torque_nm; 2]);
            Zs9Command { demands, ..Zs9Command::AT_REST }.encode(Scales::USUAL).unwrap()
        };
        Self { to_drive: &TO_ZS9, pull, ..Self::new() }
    }

    fn send(&mut self, message: usize, content: Payload) -> Frame {
        self.to_drive[message].frame(content, &mut self.counters[message])
    }

    fn frame(&mut self, event: &Event) -> Option<Frame> {
        let frame = match event {
            Event::Noise(id, length, data) => Frame { id: *id, length: *length, data: *data },
            Event::Protected(message, content) => self.send(*message, Payload(*content)),
            Event::Valid(torque_nm) => self.send(0, (self.pull)(*torque_nm)),
            Event::Replay(number) => *self.seen.get(number % self.seen.len().max(1))?,
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
            Event::Silence(_) | Event::State(_) => return None,
        };
        self.seen.push(frame);
        Some(frame)
    }
}

fn adds_up(counts: &Counts) -> bool {
    counts.received == counts.taken + counts.rejected()
}

/// Any bytes: the first chooses what they are.
pub fn check(bytes: &[u8]) {
    let mut bytes = Bytes(bytes);
    match bytes.byte() {
        Some(0) => check_receiver(&events(&mut bytes, &TO_DRIVE)),
        Some(1) => check_session(&events(&mut bytes, &TO_DRIVE)),
        Some(2) => check_zs9(&events(&mut bytes, &TO_ZS9)),
        Some(3) => {
            if let (Some(one), Some(two), Some(three)) = (bytes.word(), bytes.word(), bytes.word()) {
                check_words([one, two, three]);
            }
        }
        Some(_) => {
            if let (Some(content), Some(scales)) = (bytes.long(), scales(&mut bytes)) {
                check_content(Payload(content), scales);
            }
        }
        None => (),
    }
}

/// The scales of any machine.
fn scales(bytes: &mut Bytes) -> Option<Scales> {
    let mut number = || bytes.word().map(f32::from_bits);
    Some(Scales::of(&Ratings {
        pole_pairs: number()?,
        max_torque_nm: number()?,
        max_current_a: number()?,
        max_speed_rad_s: number()?,
        dc_link_nominal_v: number()?,
        trip_current_a: number()?,
        trip_dc_over_v: number()?,
        trip_speed_rad_s: number()?,
        ..traction::BUILT_IN.ratings
    }))
}

/// Only intact frames take effect, unchanged, and the counters add up.
pub fn check_receiver(events: &[Event]) {
    let (mut bus, mut receiver) = (Bus::new(), Receiver::new());
    let mut received = 0;
    for event in events {
        if let Event::Silence(ms) = event {
            (0..*ms).for_each(|_| receiver.wait(1, 50));
        }
        receiver.wait(1, 50);
        let Some(frame) = bus.frame(event) else { continue };
        received += 1;
        let before = *receiver.counts();
        let verdict = receiver.receive(&frame, Scales::USUAL);
        let counts = *receiver.counts();
        assert!(adds_up(&counts) && counts.received == received);
        assert_eq!(counts.taken - before.taken, u32::from(verdict.is_ok()));
        if let Ok(content) = verdict {
            let message = TO_DRIVE.into_iter().find(|message| message.id == frame.id).unwrap();
            assert!(message.is_intact(&frame) && frame.length == 8);
            // What took effect is what the frame says; nothing was clamped on the way.
            let zero = Payload(u64::from_le_bytes(frame.data) & !0xFFF);
            let same = match content {
                Content::Greeting => true,
                Content::Command(command) => {
                    message.id == COMMAND.id && command.encode(Scales::USUAL) == Ok(zero)
                }
                Content::Limits(limits) => {
                    message.id == LIMITS.id && limits.encode(Scales::USUAL) == Ok(zero)
                }
                Content::LinkLimits(limits) => {
                    message.id == LINK_LIMITS.id && limits.encode(Scales::USUAL) == Ok(zero)
                }
                Content::Parameter(request) => {
                    message.id == PARAMETER_REQUEST.id && request.encode() == Ok(zero)
                }
            };
            assert!(same, "{content:?} {frame:?}");
        }
    }
}

fn status(state: usize) -> Status {
    Status {
        state: State::from_code(state as u32 % 16).unwrap_or(State::Init),
        trip: None,
        refusal: None,
        refusals: 0,
        torque_nm: 0.0,
        switches: Switches::default(),
        temperatures: None,
    }
}

/// A request never asks for more than the newest valid command did, and asks for nothing once that is old; whatever is sent is a valid frame.
pub fn check_session(events: &[Event]) {
    let ratings = &traction::BUILT_IN.ratings;
    let (mut bus, mut session, mut judge) = (Bus::new(), Session::new(ratings), Receiver::new());
    let (mut torque_nm, mut age_ms, mut state) = (0.0, u32::MAX, 0);
    for event in events {
        let ms = if let Event::Silence(ms) = event { *ms } else { 1 };
        state = if let Event::State(state) = event { *state } else { state };
        let frame = bus.frame(event);
        for slot in 0..ms {
            // Both times are parameters and may be written.
            let before = *session.parameters();
            judge.wait(1, before.command_zero_ms as u32);
            age_ms = age_ms.saturating_add(1);
            if age_ms as f32 >= before.command_off_ms {
                age_ms = u32::MAX;
            }
            let frame = frame.as_ref().filter(|_| slot == 0);
            if let Some(Ok(Content::Command(command))) =
                frame.map(|frame| judge.receive(frame, Scales::USUAL))
            {
                (torque_nm, age_ms) = (command.torque_nm, 0);
            }
            let request = session.listen(1, frame);
            let is_fresh = (age_ms as f32) < session.parameters().command_zero_ms;
            assert!(request.torque_nm == 0.0 || (request.torque_nm == torque_nm && is_fresh));
            assert!(!(request.enable && age_ms == u32::MAX));
            assert_eq!(session.listening() == Listening::Fresh, is_fresh);
            let mode = Mode::from_code(state as u32 / 16);
            let told = session.tell(&TelemetrySource {
                status: &status(state),
                measured: &Measured::default(),
                mode,
            });
            if let Some(frame) = told {
                let message = FROM_DRIVE.into_iter().find(|message| message.id == frame.id).unwrap();
                assert!(
                    message.is_intact(&frame) && message.is_tidy(Payload(u64::from_le_bytes(frame.data)))
                );
            }
        }
    }
    assert_eq!(session.counts(), judge.counts());
}

/// The ZS9 asks for nothing that is no number, and for nothing once no frame has been taken for long.
pub fn check_zs9(events: &[Event]) {
    static RATINGS: std::sync::OnceLock<Ratings> = std::sync::OnceLock::new();
    let ratings =
        RATINGS.get_or_init(|| tractive::drive::dual::Settings::operator_ratings(&zs9::BUILT_IN.ratings));
    let (mut bus, mut session) = (Bus::of_zs9(), Zs9Session::new(ratings));
    let (mut age_ms, mut received) = (u32::MAX, 0);
    for event in events {
        let ms = if let Event::Silence(ms) = event { *ms } else { 1 };
        let frame = bus.frame(event);
        received += u32::from(frame.is_some() && ms > 0);
        for slot in 0..ms {
            let off_ms = session.parameters().command_off_ms;
            let taken = session.counts().taken;
            let request = session.listen(1, frame.as_ref().filter(|_| slot == 0));
            age_ms = if session.counts().taken > taken { 0 } else { age_ms.saturating_add(1) };
            assert!(adds_up(session.counts()) && session.counts().received == received);
            assert!(request.link_ref_v.is_finite());
            assert!(!(request.levels.enable && age_ms as f32 >= off_ms));
            let is_fresh = (age_ms as f32) < session.parameters().command_zero_ms;
            for motor in request.motors {
                let (Wanted::Torque(wanted) | Wanted::Speed(wanted)) = motor.wanted;
                assert!(wanted.is_finite() && (wanted == 0.0 || is_fresh), "{motor:?}");
            }
        }
    }
}

/// Any words are a frame or no frame; a frame is received.
pub fn check_words(words: [u32; 3]) {
    if let Some(frame) = Option::<Frame>::from_words(words) {
        assert_eq!(Option::<Frame>::from_words(Some(frame).to_words()), Some(frame));
        let _ = Receiver::new().receive(&frame, Scales::USUAL);
    }
}

/// Any content of any message is decoded without a panic; what was decoded is encoded to the same bytes.
pub fn check_content(payload: Payload, scales: Scales) {
    let (mut measured, mut counts) = (Measured::default(), Counts::default());
    for message in FROM_DRIVE {
        measured.merge(message, payload, scales);
    }
    counts.merge(payload);
    let status = StatusFrame::<Mode>::decode(payload);
    assert_eq!(StatusFrame::decode(status.encode()), status);
    let _ = (ParameterAnswer::decode(payload), trip_number(payload), TemperaturesFrame::decode(payload));
    // Without CRC and counter.
    let payload = Payload(payload.0 & !0xFFF);
    let again = [
        Command::decode(payload, scales).map(|command| command.encode(scales)),
        TorqueLimits::decode(payload, scales).map(|limits| limits.encode(scales)),
        LinkLimits::decode(payload, scales).map(|limits| limits.encode(scales)),
        ParameterRequest::decode(payload).map(|request| request.encode()),
        Zs9Command::decode(payload, scales).map(|command| command.encode(scales)),
        Zs9Link::decode(payload, scales).map(|link| link.encode(scales)),
    ];
    for (place, again) in again.into_iter().enumerate() {
        assert!(again.is_none_or(|again| again == Ok(payload)), "{place}: {payload:?}, not {again:?}");
    }
    if let Some(frame) = ExperimentFrame::decode(payload) {
        assert_eq!(ExperimentFrame::decode(frame.encode()), Some(frame));
    }
    if let Some(frame) = ObservationFrame::decode(payload) {
        assert_eq!(ObservationFrame::decode(frame.encode()), Some(frame));
    }
}
