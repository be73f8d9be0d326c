//! The ZS9's end: two motors' demands, limits and measurements in the same session.

use super::Stream;
use tractive::built_in::zs9::BUILT_IN;
use tractive::drive::dual::Settings;
use tractive::frames::Angle;
use tractive::nine_switch::Scheme;
use tractive::operator::{DualRequest, DualStatus, Levels, State, Switches, Wanted};
use tractive::ports::DualReport;
use tractive::protocol::{
    FROM_ZS9, Frame, MessageSet, ParameterRequest, Payload, Scales, StatusFrame, TO_ZS9, TorqueLimits,
    ZS9_COMMAND, ZS9_LIMITS, ZS9_LINK, ZS9_PARAMETER_REQUEST, Zs9, Zs9CanEndpoint, Zs9Command, Zs9Demands,
    Zs9Link, Zs9Measured, Zs9Session,
};

fn ratings() -> &'static tractive::machine::Ratings {
    Box::leak(Box::new(Settings::operator_ratings(&BUILT_IN.ratings)))
}

fn command(enable: bool, demands: Zs9Demands) -> Payload {
    Zs9Command { levels: Levels { enable, ..Levels::default() }, demands }.encode(Scales::USUAL).unwrap()
}

/// A session that has been greeted and armed.
fn armed(stream: &mut Stream) -> Zs9Session {
    let mut session = Zs9Session::new(ratings());
    for _ in 0..2 {
        session.listen(1, Some(&stream.frame(command(false, Zs9Demands::Torques([0.0; 2])))));
    }
    session
}

fn wanted(request: &DualRequest) -> [Wanted; 2] {
    request.motors.map(|motor| motor.wanted)
}

#[test]
fn each_motor_has_its_demand_and_silence_takes_both() {
    let mut stream = Stream::of(&ZS9_COMMAND);
    let mut session = armed(&mut stream);
    let request = session.listen(1, Some(&stream.frame(command(true, Zs9Demands::Torques([20.0, -30.0])))));
    assert_eq!(wanted(&request), [Wanted::Torque(20.0), Wanted::Torque(-30.0)]);
    assert!(request.levels.enable);
    let request = session.listen(1, Some(&stream.frame(command(true, Zs9Demands::Speeds([600.0, -300.0])))));
    let [Wanted::Speed(first), Wanted::Speed(second)] = wanted(&request) else { panic!("{request:?}") };
    assert!((first - 62.832).abs() < 0.01 && (second + 31.416).abs() < 0.01);
    // 50 ms: no torque of either, still enabled; 500 ms: off.
    let request = (0..50).map(|_| session.listen(1, None::<Frame>)).last().unwrap();
    assert_eq!((wanted(&request), request.levels.enable), ([Wanted::Torque(0.0); 2], true));
    let request = (0..450).map(|_| session.listen(1, None::<Frame>)).last().unwrap();
    assert!(!request.levels.enable);
}

#[test]
fn nothing_counts_before_a_command_at_rest() {
    let (mut session, mut stream) = (Zs9Session::new(ratings()), Stream::of(&ZS9_COMMAND));
    for _ in 0..3 {
        let request = session.listen(1, Some(&stream.frame(command(true, Zs9Demands::Torques([5.0; 2])))));
        assert_eq!((wanted(&request), request.levels), ([Wanted::Torque(0.0); 2], Levels::default()));
    }
}

#[test]
fn each_motor_has_its_limits_and_the_link_its_voltage() {
    let mut command_stream = Stream::of(&ZS9_COMMAND);
    let mut session = armed(&mut command_stream);
    let nominal = session.listen(1, None::<Frame>);
    assert!((nominal.link_ref_v - 666.7).abs() < 1.0, "{}", nominal.link_ref_v);
    let limits = TorqueLimits { motoring_nm: 50.0, braking_nm: 40.0, speed_rpm: 900.0 };
    for (motor, message) in [(0, TO_ZS9[1]), (1, TO_ZS9[2])] {
        assert_eq!(message.id, ZS9_LIMITS[motor].id);
        let mut stream = Stream::of(message);
        let mut session = session;
        for _ in 0..2 {
            session.listen(1, Some(&stream.frame(limits.encode(Scales::USUAL).unwrap())));
        }
        let request = session.listen(1, None::<Frame>);
        let [limited, other] = [motor, 1 - motor].map(|motor| request.motors[motor].limits);
        assert_eq!((limited.motoring_nm, limited.braking_nm), (50.0, 40.0));
        assert_eq!(other, nominal.motors[0].limits);
    }
    let mut stream = Stream::of(&ZS9_LINK);
    for calibrate in [true, true, false] {
        let link = Zs9Link { link_ref_v: 700.0, calibrate };
        session.listen(1, Some(&stream.frame(link.encode(Scales::USUAL).unwrap())));
    }
    assert_eq!(session.listen(1, None::<Frame>).link_ref_v, 700.0);
}

/// The zeros are calibrated while the message says so, and no longer than commands come.
#[test]
fn the_zeros_are_calibrated_while_commands_come() {
    let (mut commands, mut links) = (Stream::of(&ZS9_COMMAND), Stream::of(&ZS9_LINK));
    let mut session = armed(&mut commands);
    let at_rest = || command(true, Zs9Demands::Torques([0.0; 2]));
    let calibrates = |session: &mut Zs9Session, links: &mut Stream, calibrate| {
        let link = Zs9Link { link_ref_v: 667.0, calibrate };
        session.listen(1, Some(&links.frame(link.encode(Scales::USUAL).unwrap()))).levels.calibrate
    };
    assert!(!calibrates(&mut session, &mut links, true), "the first frame only sets the counter");
    assert!(calibrates(&mut session, &mut links, true));
    assert!(!calibrates(&mut session, &mut links, false));
    assert!(calibrates(&mut session, &mut links, true));
    assert!(session.listen(1, Some(&commands.frame(at_rest()))).levels.calibrate);
    let silent_ms = (0..2_000).find(|_| !session.listen(1, None::<Frame>).levels.calibrate);
    assert!(silent_ms.is_some_and(|ms| ms < 200), "commands have stopped: {silent_ms:?}");
}

#[test]
fn hostile_frames_are_rejected_and_counted() {
    let mut stream = Stream::of(&ZS9_COMMAND);
    let mut session = armed(&mut stream);
    let good = stream.frame(command(true, Zs9Demands::Torques([20.0, -30.0])));
    let request = session.listen(1, Some(&good));
    let mut corrupted = stream.frame(command(false, Zs9Demands::Torques([0.0; 2])));
    corrupted.data[7] ^= 4;
    // A torque out of range, an unused bit.
    let beyond = stream.frame(Payload(0x7FFF << 48));
    let untidy = stream.frame(Payload(1 << 40));
    let truncated = Frame { length: 5, ..good };
    let misrouted = Frame { id: ZS9_LINK.id, ..good };
    for frame in [good, corrupted, beyond, untidy, truncated, misrouted, Frame { id: 0x101, ..good }] {
        assert_eq!(session.listen(1, Some(&frame)), request, "{frame:?}");
    }
    let counts = session.counts();
    let rejected = [counts.repeated, counts.corrupted, counts.out_of_range, counts.truncated, counts.unknown];
    assert_eq!(rejected, [1, 2, 2, 1, 1]);
}

/// Every other slot is free for an answer: it has one message fewer than the other drive, and that slot is free too.
#[test]
fn an_answer_comes_within_two_slots() {
    let status = DualStatus {
        state: State::Ready,
        trip: None,
        refusal: None,
        refusals: 0,
        torque_nm: tractive::ports::DualDriveCommand::NONE.demands,
        switches: Switches::default(),
        temperatures: None,
    };
    for before in 0..20_u8 {
        let (mut station, mut stream) = (Zs9CanEndpoint::new(ratings()), Stream::of(&ZS9_PARAMETER_REQUEST));
        let mut request = || stream.frame(ParameterRequest { parameter: 1, write: None }.encode().unwrap());
        // The first frame only sets the counter.
        station.listen(1, Some(request()));
        for _ in 0..before {
            station.tell(&status, None);
        }
        station.listen(1, Some(request()));
        let answer = FROM_ZS9[7].id;
        let mut told = (0..2).filter_map(|_| station.tell(&status, None));
        assert!(told.any(|frame| frame.id == answer), "after {before} slots");
    }
}

#[test]
fn the_telemetry_says_what_is_measured() {
    let mut station = Zs9CanEndpoint::new(ratings());
    let report = DualReport {
        torque_nm: [60.0, -20.0],
        omega: [418.879, -209.44],
        current_a: [40.0, 12.5],
        capacitor_v: 533.0,
        source_v: 400.0,
        duty: 0.2,
        scheme: Scheme::Zvo,
        speed_known: true,
        angle_zeros: [Angle::DEG_90, Angle(0xE000_0000)],
        calibrating: [false, true],
        ..DualReport::default()
    };
    let status = DualStatus {
        state: State::Running,
        trip: None,
        refusal: None,
        refusals: 0,
        torque_nm: tractive::ports::DualDriveCommand::NONE.demands,
        switches: Switches { main: true, ..Switches::default() },
        temperatures: None,
    };
    let (mut measured, mut told) = (Zs9Measured::default(), None);
    for _ in 0..100 {
        station.listen(1, None::<Frame>);
        let Some(frame) = station.tell(&status, Some(&report)) else { continue };
        let message = FROM_ZS9.into_iter().find(|message| message.id == frame.id).unwrap();
        assert!(message.is_intact(&frame));
        let payload = Payload(u64::from_le_bytes(frame.data));
        measured.merge(message, payload, Scales::USUAL);
        if message.id == Zs9::FROM_DRIVE[0].id {
            told = Some(StatusFrame::<Scheme>::decode(payload));
        }
    }
    let told = told.unwrap();
    assert_eq!(
        (told.state, told.mode, told.switches),
        (Some(State::Running), Scheme::Zvo, [false, true, false])
    );
    let [first, second] = measured.motors;
    let near = |found: Option<f32>, wanted: f32, step: f32| (found.unwrap() - wanted).abs() <= step;
    assert!(near(first.speed_rpm, 1_000.0, 0.5) && near(second.speed_rpm, -500.0, 0.5));
    assert!(near(first.torque_nm, 60.0, 0.1) && near(second.torque_nm, -20.0, 0.1));
    assert!(near(first.current_a, 40.0, 0.1) && near(second.current_a, 12.5, 0.1));
    assert!(near(measured.link_v, 666.0, 0.1) && near(measured.capacitor_v, 533.0, 0.1));
    assert!(near(measured.duty_percent, 20.0, 0.02));
    let [zero1, zero2] = measured.angle_zeros_deg;
    assert!(near(zero1, 90.0, 0.02) && near(zero2, -45.0, 0.02), "{zero1:?} {zero2:?}");
    assert_eq!(measured.calibrating, [false, true]);
}
