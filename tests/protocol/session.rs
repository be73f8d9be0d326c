//! The drive's end: requests that age, parameters, telemetry.

use crate::Stream;
use tractive::built_in::traction::BUILT_IN;
use tractive::modulation::Mode;
use tractive::operator::{Limits, Refusal, Request, Settings, State, Status, Switches, TrainLimits};
use tractive::protection::{Fault, SafeState, Trip};
use tractive::protocol::{
    COMMAND, COUNTERS, CanEndpoint, Command, Counts, FAULT_LIMIT, FAULT_VALUE, FROM_DRIVE, Frame, LIMITS,
    LINK_LIMITS, LinkLimits, Listening, MOTION, Measured, Outcome, PARAMETER_ANSWER, PARAMETER_REQUEST,
    PARAMETERS, ParameterAnswer, ParameterRequest, Payload, RPM_PER_RAD_S, STATUS, Scales, Session,
    StatusFrame, TEMPERATURES, TelemetrySource, TemperaturesFrame, TorqueLimits, trip_number,
};
use tractive::thermal::Temperatures;
use tractive::time::Instant;

fn status(state: State) -> Status {
    let switches = Switches::default();
    Status { state, trip: None, refusal: None, refusals: 0, torque_nm: 0.0, switches, temperatures: None }
}

struct Bench {
    session: Session,
    commands: Stream,
    parameters: Stream,
    sent: Vec<Frame>,
    status: Status,
    measured: Measured,
}

impl Bench {
    fn new() -> Self {
        Self {
            session: Session::new(&BUILT_IN.ratings),
            commands: Stream::of(&COMMAND),
            parameters: Stream::of(&PARAMETER_REQUEST),
            sent: Vec::new(),
            status: status(State::Ready),
            measured: Measured::default(),
        }
    }

    fn slot(&mut self, received: Option<Frame>) -> Request {
        let request = self.session.listen(1, received.as_ref());
        let told = TelemetrySource { status: &self.status, measured: &self.measured, mode: Mode::Off };
        self.sent.extend(self.session.tell(&told));
        request
    }

    fn command(&mut self, command: Command) -> Request {
        let frame = self.commands.frame(command.encode(Scales::USUAL).unwrap());
        self.slot(Some(frame))
    }

    /// A session that has heard the command's greeting and one at rest.
    fn armed() -> Self {
        let mut bench = Self::new();
        bench.command(Command::default());
        bench.command(Command::default());
        bench
    }

    fn silence(&mut self, ms: u32) -> Request {
        (0..ms).map(|_| self.slot(None)).last().unwrap()
    }

    fn parameter(&mut self, parameter: u8, write: Option<f32>) -> Option<ParameterAnswer> {
        let content = ParameterRequest { parameter, write }.encode().unwrap();
        let frame = self.parameters.frame(content);
        self.sent.clear();
        self.slot(Some(frame));
        self.silence(4);
        let answer = self.sent.iter().find(|frame| frame.id == PARAMETER_ANSWER.id)?;
        ParameterAnswer::decode(Payload(u64::from_le_bytes(answer.data)))
    }
}

const PULL: Command = Command { enable: true, torque_nm: 100.0, ..Command::AT_REST };

#[test]
fn silence_takes_the_torque_and_then_the_enable() {
    let mut bench = Bench::armed();
    let request = bench.command(PULL);
    assert!(request.enable && request.torque_nm == 100.0);
    let request = bench.silence(49);
    assert!(request.enable && request.torque_nm == 100.0);
    assert_eq!(bench.session.listening(), Listening::Fresh);
    let request = bench.silence(1);
    assert!(request.enable && request.torque_nm == 0.0, "50 ms");
    assert_eq!(bench.session.listening(), Listening::ZeroTorque);
    assert!(bench.silence(449).enable);
    let request = bench.silence(1);
    assert!(!request.enable && request.torque_nm == 0.0, "500 ms");
    assert_eq!(bench.session.listening(), Listening::Off);
}

#[test]
fn after_the_time_out_to_off_the_sender_begins_from_rest() {
    let mut bench = Bench::armed();
    bench.command(PULL);
    bench.silence(500);
    for _ in 0..20 {
        assert!(!bench.command(PULL).enable, "levels that were left set turn nothing on");
    }
    bench.command(Command::default());
    assert!(bench.command(PULL).enable);
}

#[test]
fn after_a_short_silence_the_next_frame_only_sets_the_counter() {
    let mut bench = Bench::armed();
    bench.command(PULL);
    bench.silence(60);
    assert_eq!(bench.command(PULL).torque_nm, 0.0);
    assert_eq!(bench.command(PULL).torque_nm, 100.0);
}

#[test]
fn a_session_that_was_never_spoken_to_asks_for_nothing() {
    let mut bench = Bench::new();
    for _ in 0..20 {
        assert_eq!(bench.command(PULL), Request::idle(&BUILT_IN.ratings));
    }
    assert!(bench.command(Command { off: true, ..PULL }).off, "off always counts");
}

#[test]
fn limits_are_the_senders_within_the_parameters() {
    let ratings = &BUILT_IN.ratings;
    let mut bench = Bench::armed();
    let rated = Limits::rated(ratings);
    let close = |a: f32, b: f32| (a - b).abs() <= 1e-4 * b.abs();
    let limits = bench.slot(None).limits;
    assert_eq!((limits.motoring_nm, limits.braking_nm), (rated.motoring_nm, rated.braking_nm));
    assert!(limits.speed_rad_s <= rated.speed_rad_s && close(limits.speed_rad_s, rated.speed_rad_s));
    let (mut torque, mut link) = (Stream::of(&LIMITS), Stream::of(&LINK_LIMITS));
    let max_rpm = ratings.max_speed_rad_s * 60.0 / core::f32::consts::TAU;
    let as_rated = TorqueLimits { motoring_nm: ratings.max_torque_nm, braking_nm: 100.0, speed_rpm: max_rpm };
    let at_link = LinkLimits { low_v: 1_100.0, high_v: 1_750.0 };
    let mut request = bench.slot(None);
    for _ in 0..2 {
        bench.slot(Some(torque.frame(as_rated.encode(Scales::USUAL).unwrap())));
        request = bench.slot(Some(link.frame(at_link.encode(Scales::USUAL).unwrap())));
    }
    let limits = request.limits;
    assert_eq!((limits.motoring_nm, limits.braking_nm), (rated.motoring_nm, 100.0));
    assert!(limits.speed_rad_s <= rated.speed_rad_s && close(limits.speed_rad_s, rated.speed_rad_s));
    assert_eq!((limits.link_low_v, limits.link_high_v), (1_100.0, 1_750.0));
    bench.parameter(3, None);
    bench.parameter(3, Some(500.0)).unwrap();
    assert_eq!(bench.slot(None).limits.motoring_nm, 500.0);
    let beyond = TorqueLimits { motoring_nm: ratings.max_torque_nm + 1.0, ..as_rated };
    let limits = bench.slot(Some(torque.frame(beyond.encode(Scales::USUAL).unwrap()))).limits;
    assert!(limits.motoring_nm > ratings.max_torque_nm, "the operator refuses it; nothing is clamped here");
}

#[test]
fn parameters_are_written_only_while_the_gates_cannot_pulse() {
    for state in State::ALL {
        let mut bench = Bench::armed();
        bench.status = status(state);
        assert_eq!(bench.parameter(3, None), None, "the greeting");
        let before = bench.parameter(3, None).unwrap();
        assert_eq!((before.outcome, before.value), (Outcome::Done, Some(BUILT_IN.ratings.max_torque_nm)));
        let after = bench.parameter(3, Some(321.0)).unwrap();
        let pulsing = matches!(state, State::Enabled | State::Running | State::Coasting | State::Stopping);
        let (outcome, value) =
            if pulsing { (Outcome::Enabled, before.value) } else { (Outcome::Done, Some(321.0)) };
        assert_eq!((after.outcome, after.value), (outcome, value), "{}", state.name());
    }
}

#[test]
fn parameters_have_ranges_and_nothing_is_clamped() {
    let mut bench = Bench::armed();
    bench.parameter(1, None);
    for parameter in PARAMETERS {
        let before = bench.parameter(parameter.id, None).unwrap().value.unwrap();
        assert!(before >= parameter.min && before <= parameter.max, "{}", parameter.name);
        for value in [parameter.min - 0.1, parameter.max * 1.01] {
            let answer = bench.parameter(parameter.id, Some(value)).unwrap();
            assert_eq!((answer.outcome, answer.value), (Outcome::OutOfRange, Some(before)));
        }
    }
    for unknown in (0..=255).filter(|id| PARAMETERS.iter().all(|parameter| parameter.id != *id)) {
        for write in [None, Some(1.0)] {
            let answer = bench.parameter(unknown, write).unwrap();
            assert_eq!((answer.outcome, answer.value), (Outcome::Unknown, None));
        }
    }
    let over_rating = bench.parameter(3, Some(BUILT_IN.ratings.max_torque_nm + 1.0)).unwrap();
    assert_eq!(over_rating.outcome, Outcome::OutOfRange);
    // Torque is zero before the drive stops.
    assert_eq!(bench.parameter(5, Some(501.0)).unwrap().outcome, Outcome::OutOfRange);
    assert_eq!(bench.parameter(6, Some(49.0)).unwrap().outcome, Outcome::OutOfRange);
    assert_eq!(bench.parameter(6, Some(100.0)).unwrap().outcome, Outcome::Done);
    assert_eq!(bench.parameter(5, Some(100.0)).unwrap().outcome, Outcome::Done);
    bench.command(PULL);
    bench.command(PULL);
}

/// Limits that are written over CAN are those that the operator works with.
#[test]
fn limits_of_line_and_rail_reach_the_operator() {
    let usual = Settings::rated(&BUILT_IN.ratings, 1e-3, None);
    let (mut endpoint, mut requests) = (CanEndpoint::new(&BUILT_IN.ratings), Stream::of(&PARAMETER_REQUEST));
    let before = endpoint.settings(&usual).train;
    assert_eq!(
        (before.motoring_a, before.braking_w),
        (TrainLimits::NONE.motoring_a, TrainLimits::NONE.braking_w)
    );
    assert!(before.acceleration_rad_s2 >= TrainLimits::NONE.acceleration_rad_s2);
    for (parameter, value) in [(7, 1.0), (7, 70.0), (8, 80.0), (9, 90.0), (10, 100.0), (11, 300.0)] {
        let content = ParameterRequest { parameter, write: Some(value) }.encode().unwrap();
        endpoint.listen(1, Some(requests.frame(content)));
    }
    let acceleration_rad_s2 = 300.0 / RPM_PER_RAD_S;
    let train = TrainLimits {
        motoring_a: 70.0,
        braking_a: 80.0,
        motoring_w: 90e3,
        braking_w: 100e3,
        acceleration_rad_s2,
    };
    assert_eq!(endpoint.settings(&usual).train, train);
}

#[test]
fn a_written_time_out_holds() {
    let mut bench = Bench::armed();
    bench.parameter(5, None);
    assert_eq!(bench.parameter(5, Some(20.0)).unwrap().outcome, Outcome::Done);
    bench.command(Command::default());
    bench.command(Command::default());
    bench.command(PULL);
    assert_eq!(bench.silence(19).torque_nm, 100.0);
    assert_eq!(bench.silence(1).torque_nm, 0.0);
}

#[test]
fn every_message_comes_with_its_period_protected_and_in_order() {
    let mut bench = Bench::armed();
    let trip = Trip {
        fault: Fault::Overcurrent,
        value: 512.5,
        limit: 450.0,
        at: Instant(0),
        safe: SafeState::GatesOff,
    };
    bench.status.trip = Some(trip);
    bench.status.temperatures = Some(TEMPERATURES_TOLD);
    let mut last = vec![None; FROM_DRIVE.len()];
    let mut counters = vec![None; FROM_DRIVE.len()];
    bench.sent.clear();
    for ms in 0..1_000_u32 {
        let before = bench.sent.len();
        bench.slot(None);
        assert!(bench.sent.len() - before <= 1);
        let Some(frame) = bench.sent.get(before) else { continue };
        let index = FROM_DRIVE.iter().position(|message| message.id == frame.id).unwrap();
        let message = FROM_DRIVE[index];
        assert!(message.is_intact(frame) && frame.length == 8);
        let counter = frame.data[1] & 0xF;
        if let Some((at, previous)) = last[index].zip(counters[index]) {
            assert_eq!(ms - at, u32::from(message.period_ms), "{}", message.name);
            assert_eq!(counter, (previous + 1_u8) % 16);
        }
        (last[index], counters[index]) = (Some(ms), Some(counter));
        let payload = Payload(u64::from_le_bytes(frame.data));
        if message.id == FAULT_VALUE.id {
            assert_eq!(trip_number(payload), (Fault::Overcurrent as u8, Some(512.5)));
        } else if message.id == FAULT_LIMIT.id {
            assert_eq!(trip_number(payload), (Fault::Overcurrent as u8, Some(450.0)));
        } else if message.id == TEMPERATURES.id {
            assert_eq!(
                TemperaturesFrame::decode(payload),
                TemperaturesFrame {
                    winding_c: Some(141.5),
                    heat_sink_c: Some(-12.0),
                    junction_c: Some(88.0),
                    magnets_c: None,
                    torque_share_percent: Some(92.5),
                }
            );
        }
    }
    let missing: Vec<_> =
        FROM_DRIVE.iter().zip(&last).filter(|(_, at)| at.is_none()).map(|(m, _)| m.name).collect();
    assert_eq!(missing, [PARAMETER_ANSWER.name], "which nobody asked for");
}

/// Temperatures of a winding in derating and cold devices.
const TEMPERATURES_TOLD: Temperatures = Temperatures {
    winding_c: 141.4,
    heat_sink_c: -12.1,
    junction_c: 87.9,
    magnets_c: None,
    torque_share: 0.926,
};

#[test]
fn a_drive_without_temperature_sensors_sends_no_temperatures() {
    let mut bench = Bench::armed();
    bench.sent.clear();
    bench.silence(500);
    assert!(bench.sent.len() > 200 && bench.sent.iter().all(|frame| frame.id != TEMPERATURES.id));
}

#[test]
fn what_is_told_is_what_arrives() {
    let mut bench = Bench::armed();
    bench.command(PULL);
    bench.status = Status {
        refusal: Some(Refusal::LinkNotCharged),
        refusals: 290,
        switches: Switches { main: true, chopper: 0.25, ..Switches::default() },
        ..status(State::Charged)
    };
    bench.measured = Measured {
        speed_rpm: Some(-1_234.5),
        torque_nm: Some(77.7),
        link_v: Some(f32::NAN),
        current_a: Some(412.3),
        id_ref_a: Some(-200.1),
        iq_ref_a: Some(1e9),
        voltage_v: Some(700.0),
        frequency_hz: Some(-82.3),
        torque_estimate_nm: Some(-78.9),
        temperature_c: None,
        angle_zero_deg: Some(179.99),
        calibrating: true,
    };
    bench.sent.clear();
    bench.silence(300);
    let (mut measured, mut counts, mut told) = (Measured::default(), Counts::default(), None);
    for frame in &bench.sent {
        let payload = Payload(u64::from_le_bytes(frame.data));
        let message = FROM_DRIVE.iter().find(|message| message.id == frame.id).unwrap();
        measured.merge(message, payload, Scales::USUAL);
        if frame.id == STATUS.id {
            told = told.or(Some(StatusFrame::<Mode>::decode(payload)));
        } else if frame.id == COUNTERS.id {
            counts.merge(payload);
        }
    }
    let status = told.unwrap();
    assert_eq!(
        (status.state, status.refusal, status.refusals),
        (Some(State::Charged), bench.status.refusal, 2)
    );
    assert_eq!((status.switches, status.chopper_percent), ([false, true, false], Some(25.0)));
    assert_eq!((status.listening, status.taken), (Listening::Fresh, 3));
    assert_eq!(counts, *bench.session.counts());
    let near = |a: Option<f32>, b: f32, step: f32| (a.unwrap() - b).abs() <= 0.51 * step;
    assert!(near(measured.speed_rpm, -1_234.5, 0.5) && near(measured.torque_nm, 77.7, 0.1));
    assert!(near(measured.current_a, 412.3, 0.1) && near(measured.id_ref_a, -200.1, 0.1));
    assert!(near(measured.voltage_v, 700.0, 0.1) && near(measured.frequency_hz, -82.3, 0.05));
    assert!(near(measured.torque_estimate_nm, -78.9, 0.1));
    assert!(near(measured.angle_zero_deg, 179.99, 0.01) && measured.calibrating);
    assert_eq!((measured.link_v, measured.iq_ref_a, measured.temperature_c), (None, None, None));
    assert!(bench.sent.iter().any(|frame| frame.id == MOTION.id));
}

#[test]
fn silence_is_measured_by_the_clock_however_seldom_anybody_looks() {
    for slots in [1, 5, 25] {
        let mut bench = Bench::armed();
        bench.command(PULL);
        let mut at_ms = |wanted: Listening| {
            let looks = (1..2_000).find(|_| {
                bench.session.listen(slots, None::<Frame>);
                bench.session.listening() == wanted
            });
            looks.unwrap() * slots
        };
        assert_eq!(at_ms(Listening::ZeroTorque), 50, "{slots} slots at a time");
        assert_eq!(50 + at_ms(Listening::Off), 500, "{slots} slots at a time");
    }
}

#[test]
fn all_frames_of_a_slot_are_taken() {
    let mut bench = Bench::armed();
    let (mut torque, mut link) = (Stream::of(&LIMITS), Stream::of(&LINK_LIMITS));
    let content =
        TorqueLimits { motoring_nm: 50.0, braking_nm: 40.0, speed_rpm: 600.0 }.encode(Scales::USUAL).unwrap();
    let at_link = LinkLimits { low_v: 1_100.0, high_v: 1_750.0 }.encode(Scales::USUAL).unwrap();
    let frames = [
        torque.frame(content),
        torque.frame(content),
        link.frame(at_link),
        link.frame(at_link),
        bench.commands.frame(PULL.encode(Scales::USUAL).unwrap()),
    ];
    let request = bench.session.listen(1, frames);
    assert_eq!(
        (request.torque_nm, request.limits.braking_nm, request.limits.link_low_v),
        (100.0, 40.0, 1_100.0)
    );
}
