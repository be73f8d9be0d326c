//! The ZS9's messages: those of the PMaSynRM drive, with the demands, limits and measurements of two motors, and the link's.

use super::commands::{
    ACKNOWLEDGE, BRAKING, CHARGE, COAST, DISCHARGE as DISCHARGE_COMMAND, ENABLE, LINK_V, MOTORING, OFF,
    PARAMETER, ParameterRequest, SPEED as SPEED_LIMIT, TORQUE_NM, TorqueLimits, VALUE, WITH_TORQUE, WRITE,
    levels, put_levels,
};
use super::message::Message;
use super::message_set::{MessageSet, Taken, motor_limits};
use super::parameters::{Parameters, RPM_PER_RAD_S};
use super::scales::{Quantity, Scales};
use super::signal::{OutOfRange, Payload, Signal};
use super::telemetry::{
    ANSWER_PARAMETER, ANSWER_RESULT, ANSWER_VALUE, CHOPPER, COUNTER_SIGNALS, DISCHARGE, FAULT, LISTENING,
    MAIN, PRECHARGE, REFUSAL, REFUSALS, SPEED_RPM, STATE, TAKEN, TRIP_FAULT, TRIP_LIMIT, TRIP_VALUE, encode,
    pattern,
};
use crate::drive::dual;
use crate::machine::Ratings;
use crate::nine_switch::Scheme;
use crate::operator::{DualDemands, DualRequest, Levels, MotorRequest, Wanted};
use crate::ports::DualReport;
use crate::thermal::Temperatures;

/// [`COMMAND`](super::COMMAND)'s, in another message: [`ZS9_COMMAND`] is full.
const CALIBRATE: Signal = Signal::flag("calibrate", 32);
const KIND: Signal = Signal::number("page", 35, 1, 1);
const TORQUES: [Signal; 2] = [
    Signal::physical("torque1_nm", "N.m", 16, 0.1, TORQUE_NM).of(Quantity::Torque).on_page(0),
    Signal::physical("torque2_nm", "N.m", 48, 0.1, TORQUE_NM).of(Quantity::Torque).on_page(0),
];
const SPEEDS: [Signal; 2] = [
    Signal::physical("speed1_rpm", "r/min", 16, 0.5, SPEED_RPM).of(Quantity::Speed).on_page(1),
    Signal::physical("speed2_rpm", "r/min", 48, 0.5, SPEED_RPM).of(Quantity::Speed).on_page(1),
];
const LINK_REF: Signal = Signal::physical("link_ref_v", "V", 16, 0.1, LINK_V).of(Quantity::Voltage);

const SCHEME: Signal = pattern("scheme");
const SPEED: Signal = Signal::physical("speed_rpm", "r/min", 16, 0.5, SPEED_RPM).of(Quantity::Speed);
const TORQUE: Signal = Signal::physical("torque_nm", "N.m", 32, 0.1, TORQUE_NM).of(Quantity::Torque);
const CURRENT: Signal = Signal::physical("current_a", "A", 48, 0.1, [0.0, 3_000.0]).of(Quantity::Current);
const LINK: Signal = Signal::physical("link_v", "V", 16, 0.1, LINK_V).of(Quantity::Voltage);
const CAPACITOR: Signal = Signal::physical("capacitor_v", "V", 32, 0.1, LINK_V).of(Quantity::Voltage);
const DUTY: Signal = Signal::physical("duty_percent", "%", 48, 0.01, [0.0, 100.0]);
const ZEROS: [Signal; 2] = [
    Signal::physical("angle_zero1_deg", "deg", 16, 0.01, [-180.0, 180.0]),
    Signal::physical("angle_zero2_deg", "deg", 32, 0.01, [-180.0, 180.0]),
];
const CALIBRATING: [Signal; 2] = [Signal::flag("calibrating1", 48), Signal::flag("calibrating2", 49)];

/// Levels and demands: torques on page 0, speeds on page 1. Without this message the drive does nothing.
pub const ZS9_COMMAND: Message = Message::new(
    "ZS9_COMMAND",
    0x111,
    17,
    10,
    &[
        ENABLE,
        WITH_TORQUE,
        OFF,
        COAST,
        CHARGE,
        DISCHARGE_COMMAND,
        ACKNOWLEDGE,
        KIND,
        TORQUES[0],
        TORQUES[1],
        SPEEDS[0],
        SPEEDS[1],
    ],
)
.telling(36, &[Quantity::Torque, Quantity::Speed]);
/// Limits of torque and speed of the upper motor and of the lower one; the rated ones until they come.
pub const ZS9_LIMITS: [Message; 2] = [
    Message::new("ZS9_LIMITS_1", 0x112, 18, 100, &[MOTORING, BRAKING, SPEED_LIMIT])
        .telling(12, &[Quantity::Torque, Quantity::Speed]),
    Message::new("ZS9_LIMITS_2", 0x113, 19, 100, &[MOTORING, BRAKING, SPEED_LIMIT])
        .telling(12, &[Quantity::Torque, Quantity::Speed]),
];
/// The link's voltage outside shoot-through, and whether the zeros of both position sensors are to be calibrated; the nominal voltage and no calibration until
/// this message comes.
pub const ZS9_LINK: Message =
    Message::new("ZS9_LINK", 0x114, 20, 100, &[LINK_REF, CALIBRATE]).telling(12, &[Quantity::Voltage]);
/// Reads or writes a parameter.
pub const ZS9_PARAMETER_REQUEST: Message =
    Message::new("ZS9_PARAMETER_REQUEST", 0x115, 21, 0, &[WRITE, PARAMETER, VALUE]);

/// State, fault, refusal, switches.
pub const ZS9_STATUS: Message = Message::new(
    "ZS9_STATUS",
    0x191,
    22,
    10,
    &[STATE, FAULT, REFUSAL, REFUSALS, SCHEME, LISTENING, PRECHARGE, MAIN, DISCHARGE, CHOPPER, TAKEN],
);
// One gives the steps of torque and the other those of current; together with the command, which gives those of torque and speed combined, none is
// misread.
const MOTOR_1: Message =
    Message::new("ZS9_MOTOR_1", 0x192, 23, 10, &[SPEED, TORQUE, CURRENT]).telling(12, &[Quantity::Torque]);
const MOTOR_2: Message =
    Message::new("ZS9_MOTOR_2", 0x193, 24, 10, &[SPEED, TORQUE, CURRENT]).telling(12, &[Quantity::Current]);
const LINK_STATE: Message =
    Message::new("ZS9_LINK_STATE", 0x194, 25, 10, &[LINK, CAPACITOR, DUTY]).telling(12, &[Quantity::Voltage]);
/// Corrections of both position sensors' zeros.
const ANGLE_ZEROS: Message =
    Message::new("ZS9_ANGLE_ZEROS", 0x199, 31, 100, &[ZEROS[0], ZEROS[1], CALIBRATING[0], CALIBRATING[1]]);
const FAULT_VALUE: Message = Message::new("ZS9_FAULT_VALUE", 0x195, 26, 100, &[TRIP_FAULT, TRIP_VALUE]);
const FAULT_LIMIT: Message = Message::new("ZS9_FAULT_LIMIT", 0x196, 27, 100, &[TRIP_FAULT, TRIP_LIMIT]);
const COUNTERS: Message = Message::new("ZS9_COUNTERS", 0x197, 28, 100, &COUNTER_SIGNALS);
const PARAMETER_ANSWER: Message =
    Message::new("ZS9_PARAMETER_ANSWER", 0x198, 29, 0, &[ANSWER_RESULT, ANSWER_PARAMETER, ANSWER_VALUE]);

/// The messages to the ZS9.
pub const TO_ZS9: [&Message; 5] =
    [&ZS9_COMMAND, &ZS9_LIMITS[0], &ZS9_LIMITS[1], &ZS9_LINK, &ZS9_PARAMETER_REQUEST];

/// The messages from the ZS9.
pub const FROM_ZS9: [&Message; 9] = [
    &ZS9_STATUS,
    &MOTOR_1,
    &MOTOR_2,
    &LINK_STATE,
    &FAULT_VALUE,
    &FAULT_LIMIT,
    &COUNTERS,
    &PARAMETER_ANSWER,
    &ANGLE_ZEROS,
];

/// Demands of the upper motor and of the lower one.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Zs9Demands {
    /// Torques, in N·m.
    Torques([f32; 2]),
    /// Mechanical speeds, in r/min.
    Speeds([f32; 2]),
}

/// Content of [`ZS9_COMMAND`].
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Zs9Command {
    /// Levels.
    pub levels: Levels,
    /// Demands.
    pub demands: Zs9Demands,
}

impl Zs9Command {
    /// The command that asks for nothing.
    pub const AT_REST: Self = Self { levels: Levels::NONE, demands: Zs9Demands::Torques([0.0; 2]) };

    /// As a frame's content.
    pub fn encode(&self, scales: Scales) -> Result<Payload, OutOfRange> {
        let mut payload = put_levels(&self.levels);
        let (kind, signals, values) = match self.demands {
            Zs9Demands::Torques(values) => (0, &TORQUES, values),
            Zs9Demands::Speeds(values) => (1, &SPEEDS, values),
        };
        KIND.put_raw(&mut payload, kind);
        for (signal, value) in signals.iter().zip(values) {
            signal.put_on(scales, &mut payload, value)?;
        }
        Ok(payload)
    }

    /// From a frame's content; `None` if a value is out of its range or an unused bit is set.
    pub fn decode(payload: Payload, scales: Scales) -> Option<Self> {
        ZS9_COMMAND.is_tidy(payload).then_some(())?;
        let is_speed = KIND.is_set(payload);
        let [first, second] = if is_speed { &SPEEDS } else { &TORQUES };
        let values = [first.get_on(scales, payload)?, second.get_on(scales, payload)?];
        let demands = if is_speed { Zs9Demands::Speeds(values) } else { Zs9Demands::Torques(values) };
        Some(Self { levels: levels(payload), demands })
    }
}

/// Content of [`ZS9_LINK`].
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Zs9Link {
    /// Desired link voltage outside shoot-through, in V.
    pub link_ref_v: f32,
    /// The zeros of both position sensors are to be calibrated, as long as no torque is demanded.
    pub calibrate: bool,
}

impl Zs9Link {
    /// As a frame's content.
    pub fn encode(&self, scales: Scales) -> Result<Payload, OutOfRange> {
        let mut payload = Payload::default();
        LINK_REF.put_on(scales, &mut payload, self.link_ref_v)?;
        CALIBRATE.put_raw(&mut payload, self.calibrate.into());
        Ok(payload)
    }

    /// From a frame's content; `None` if the value is out of its range or an unused bit is set.
    pub fn decode(payload: Payload, scales: Scales) -> Option<Self> {
        ZS9_LINK.is_tidy(payload).then_some(())?;
        Some(Self { link_ref_v: LINK_REF.get_on(scales, payload)?, calibrate: CALIBRATE.is_set(payload) })
    }
}

/// The content of an accepted frame.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Zs9Content {
    /// The first frame of its message, or the first after a silence: it only set the counter.
    Greeting,
    /// A command.
    Command(Zs9Command),
    /// Limits of torque and speed of the upper motor (0) or of the lower one (1).
    Limits(usize, TorqueLimits),
    /// The link's voltage, and the calibration.
    Link(Zs9Link),
    /// A parameter is to be read or written.
    Parameter(ParameterRequest),
}

/// The measurements of one motor. `None`: not available.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct MotorMeasured {
    /// Mechanical speed, in r/min.
    pub speed_rpm: Option<f32>,
    /// Torque reference after all limits, in N·m.
    pub torque_nm: Option<f32>,
    /// Largest magnitude of a phase current, in A.
    pub current_a: Option<f32>,
}

/// The measurements. `None`: not available.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Zs9Measured {
    /// Upper motor, lower motor.
    pub motors: [MotorMeasured; 2],
    /// Link voltage outside shoot-through, U_in, in V.
    pub link_v: Option<f32>,
    /// Capacitor voltage, U_c, in V.
    pub capacitor_v: Option<f32>,
    /// Shoot-through duty, in percent.
    pub duty_percent: Option<f32>,
    /// Corrections of the position sensors' zeros, electrical, in degrees: the drive adds each to its sensor's angle.
    pub angle_zeros_deg: [Option<f32>; 2],
    /// Flags of those that are just being found.
    pub calibrating: [bool; 2],
}

impl Zs9Measured {
    /// Content of the message of the zeros.
    fn angle_zeros(&self) -> Payload {
        let mut payload = Payload::default();
        for (signal, degrees) in ZEROS.iter().zip(self.angle_zeros_deg) {
            signal.put_measured(&mut payload, degrees);
        }
        for (signal, calibrating) in CALIBRATING.iter().zip(self.calibrating) {
            signal.put_raw(&mut payload, calibrating.into());
        }
        payload
    }

    /// Adopts the content of one of the four messages.
    pub fn merge(&mut self, message: &Message, payload: Payload, scales: Scales) {
        let [first, second] = &mut self.motors;
        let motor = match message.id {
            id if id == MOTOR_1.id => first,
            id if id == MOTOR_2.id => second,
            id if id == LINK_STATE.id => {
                self.link_v = LINK.get_on(scales, payload);
                self.capacitor_v = CAPACITOR.get_on(scales, payload);
                self.duty_percent = DUTY.get_on(scales, payload);
                return;
            }
            id if id == ANGLE_ZEROS.id => {
                self.angle_zeros_deg = ZEROS.each_ref().map(|zero| zero.get(payload));
                self.calibrating = CALIBRATING.each_ref().map(|flag| flag.is_set(payload));
                return;
            }
            _ => return,
        };
        motor.speed_rpm = SPEED.get_on(scales, payload);
        motor.torque_nm = TORQUE.get_on(scales, payload);
        motor.current_a = CURRENT.get_on(scales, payload);
    }
}

/// The contents that the ZS9 received last.
#[derive(Clone, Copy, Debug)]
pub struct Zs9 {
    command: Zs9Command,
    limits: [Option<TorqueLimits>; 2],
    link: Option<Zs9Link>,
}

impl MessageSet for Zs9 {
    type Demands = DualDemands;
    type Content = Zs9Content;
    type Measured = Zs9Measured;
    type Pattern = Scheme;

    const TO_DRIVE: &'static [&'static Message] = &TO_ZS9;
    const FROM_DRIVE: &'static [&'static Message] = &FROM_ZS9;
    const IS_ZS9: bool = true;
    const GREETING: Zs9Content = Zs9Content::Greeting;
    const SILENT: Self = Self { command: Zs9Command::AT_REST, limits: [None; 2], link: None };

    fn decode(id: u16, payload: Payload, scales: Scales) -> Option<Zs9Content> {
        let [first, second] = &ZS9_LIMITS;
        Some(match id {
            id if id == ZS9_COMMAND.id => Zs9Content::Command(Zs9Command::decode(payload, scales)?),
            id if id == first.id => Zs9Content::Limits(0, TorqueLimits::decode(payload, scales)?),
            id if id == second.id => Zs9Content::Limits(1, TorqueLimits::decode(payload, scales)?),
            id if id == ZS9_LINK.id => Zs9Content::Link(Zs9Link::decode(payload, scales)?),
            id if id == ZS9_PARAMETER_REQUEST.id => Zs9Content::Parameter(ParameterRequest::decode(payload)?),
            _ => return None,
        })
    }

    fn take(&mut self, content: Zs9Content) -> Taken {
        match content {
            Zs9Content::Greeting => {}
            Zs9Content::Command(command) => {
                self.command = command;
                let levels = Levels { off: false, ..command.levels };
                return Taken::Command { at_rest: levels == Zs9Command::AT_REST.levels };
            }
            Zs9Content::Limits(motor, limits) => {
                if let Some(kept) = self.limits.get_mut(motor) {
                    *kept = Some(limits);
                }
            }
            Zs9Content::Link(link) => self.link = Some(link),
            Zs9Content::Parameter(request) => return Taken::Parameter(request),
        }
        Taken::Kept
    }

    fn rest(&mut self) {
        self.command = Zs9Command::AT_REST;
    }

    /// Once the command is old, a speed demand becomes zero torque.
    fn request(&self, armed: bool, fresh: bool, parameters: &Parameters, ratings: &Ratings) -> DualRequest {
        let Zs9Command { levels, demands } = self.command;
        let wanted = match demands {
            _ if !armed || !fresh => [Wanted::Torque(0.0); 2],
            Zs9Demands::Torques(torques_nm) => torques_nm.map(Wanted::Torque),
            Zs9Demands::Speeds(speeds_rpm) => speeds_rpm.map(|rpm| Wanted::Speed(rpm / RPM_PER_RAD_S)),
        };
        let ([first, second], [limits1, limits2]) = (wanted, &self.limits);
        let motor = |wanted, sent: &Option<TorqueLimits>| MotorRequest {
            wanted,
            limits: motor_limits(sent.as_ref(), parameters, ratings),
        };
        let [_, _, nominal_v] = dual::Settings::link_range_v(ratings);
        let link = self.link.unwrap_or(Zs9Link { link_ref_v: nominal_v, calibrate: false });
        let levels = if armed { levels } else { Levels { off: levels.off, ..Zs9Command::AT_REST.levels } };
        DualRequest {
            levels: Levels { calibrate: armed && fresh && link.calibrate, ..levels },
            motors: [motor(first, limits1), motor(second, limits2)],
            link_ref_v: link.link_ref_v,
        }
    }

    fn observed(
        report: Option<&DualReport>,
        _temperatures: Option<&Temperatures>,
        ratings: &Ratings,
    ) -> (Zs9Measured, Scheme) {
        let Some(report) = report else {
            return (Zs9Measured::default(), Scheme::default());
        };
        let motor = |omega: f32, torque_nm, current_a| MotorMeasured {
            speed_rpm: report.speed_known.then_some(omega / ratings.pole_pairs * RPM_PER_RAD_S),
            torque_nm: Some(torque_nm),
            current_a: Some(current_a),
        };
        let ([w1, w2], [t1, t2], [i1, i2]) = (report.omega, report.torque_nm, report.current_a);
        let measured = Zs9Measured {
            motors: [motor(w1, t1, i1), motor(w2, t2, i2)],
            link_v: Some(report.link_v()),
            capacitor_v: Some(report.capacitor_v),
            duty_percent: Some(100.0 * report.duty),
            angle_zeros_deg: report.angle_zeros.map(|zero| Some(zero.signed_radians().to_degrees())),
            calibrating: report.calibrating,
        };
        (measured, report.scheme)
    }

    fn measured(measured: &Zs9Measured, message: usize, scales: Scales) -> Payload {
        let [first, second] = &measured.motors;
        let motor = match message {
            0 => first,
            1 => second,
            4 => return measured.angle_zeros(),
            _ => {
                let link = [
                    (&LINK, measured.link_v),
                    (&CAPACITOR, measured.capacitor_v),
                    (&DUTY, measured.duty_percent),
                ];
                return encode(&link, scales);
            }
        };
        encode(&[(&SPEED, motor.speed_rpm), (&TORQUE, motor.torque_nm), (&CURRENT, motor.current_a)], scales)
    }
}
