//! What the drive sends.

use super::commands::{LINK_V, TORQUE_NM};
use super::message::Message;
use super::signal::{Payload, Signal};
use crate::drive::dual::scheme_from_code;
use crate::modulation::Mode;
use crate::nine_switch::Scheme;
use crate::operator::{Refusal, State, Status};
use crate::protection::Trip;

const CURRENT_A: [f32; 2] = [-3_000.0, 3_000.0];
pub(super) const SPEED_RPM: [f32; 2] = [-16_000.0, 16_000.0];

pub(super) const STATE: Signal = Signal::number("state", 12, 4, 0xF);
pub(super) const FAULT: Signal = Signal::number("fault", 16, 8, 0xFF);
pub(super) const REFUSAL: Signal = Signal::number("refusal", 24, 8, 0xFF);
pub(super) const REFUSALS: Signal = Signal::number("refusals", 32, 8, 0xFF);
const MODE: Signal = Signal::number("mode", 40, 3, 7);
pub(super) const LISTENING: Signal = Signal::number("listening", 43, 2, 3);
pub(super) const PRECHARGE: Signal = Signal::flag("precharge", 45);
pub(super) const MAIN: Signal = Signal::flag("main", 46);
pub(super) const DISCHARGE: Signal = Signal::flag("discharge", 47);
pub(super) const CHOPPER: Signal =
    Signal { bits: 8, ..Signal::physical("chopper_percent", "%", 48, 0.5, [0.0, 100.0]) };
pub(super) const TAKEN: Signal = Signal::number("taken", 56, 8, 0xFF);

const SPEED: Signal = Signal::physical("speed_rpm", "r/min", 16, 0.5, SPEED_RPM);
const TORQUE: Signal = Signal::physical("torque_nm", "N.m", 32, 0.1, TORQUE_NM);
const LINK: Signal = Signal::physical("link_v", "V", 48, 0.1, LINK_V);

const CURRENT: Signal = Signal::physical("current_a", "A", 16, 0.1, [0.0, 3_000.0]);
const ID_REF: Signal = Signal::physical("id_ref_a", "A", 32, 0.1, CURRENT_A);
const IQ_REF: Signal = Signal::physical("iq_ref_a", "A", 48, 0.1, CURRENT_A);

const VOLTAGE: Signal = Signal::physical("voltage_v", "V", 16, 0.1, LINK_V);
const FREQUENCY: Signal = Signal::physical("frequency_hz", "Hz", 32, 0.05, [-1_600.0, 1_600.0]);
const TEMPERATURE: Signal = Signal::physical("temperature_c", "degC", 48, 0.1, [-100.0, 300.0]);

pub(super) const TRIP_FAULT: Signal = Signal::number("fault", 16, 8, 0xFF);
pub(super) const TRIP_VALUE: Signal = Signal::float("value", 32);
pub(super) const TRIP_LIMIT: Signal = Signal::float("limit", 32);

pub(super) const ANSWER_RESULT: Signal = Signal::number("result", 12, 4, 0xF);
pub(super) const ANSWER_PARAMETER: Signal = Signal::number("parameter", 16, 8, 0xFF);
pub(super) const ANSWER_VALUE: Signal = Signal::float("value", 32);

const PAGE: Signal = Signal::number("page", 12, 4, 2);
const fn counter(name: &'static str, index: u32) -> Signal {
    Signal::number(name, 16 + index % 3 * 16, 16, 0xFFFF).on_page(index / 3)
}

/// The page's number, then the counters in the order of [`Counts::to_array`].
pub(super) const COUNTER_SIGNALS: [Signal; 10] = [
    PAGE,
    counter("received", 0),
    counter("taken", 1),
    counter("lost", 2),
    counter("unknown", 3),
    counter("truncated", 4),
    counter("corrupted", 5),
    counter("repeated", 6),
    counter("disordered", 7),
    counter("out_of_range", 8),
];
const PAGES: u32 = 3;

/// State, fault, refusal, switches.
pub const STATUS: Message = Message::new(
    "STATUS",
    0x181,
    5,
    10,
    &[STATE, FAULT, REFUSAL, REFUSALS, MODE, LISTENING, PRECHARGE, MAIN, DISCHARGE, CHOPPER, TAKEN],
);
/// Speed, torque, link.
pub const MOTION: Message = Message::new("MOTION", 0x182, 6, 10, &[SPEED, TORQUE, LINK]);
/// Currents.
pub const CURRENTS: Message = Message::new("CURRENTS", 0x183, 7, 10, &[CURRENT, ID_REF, IQ_REF]);
/// Voltage, frequency, temperature.
pub const VOLTAGES: Message = Message::new("VOLTAGES", 0x184, 8, 10, &[VOLTAGE, FREQUENCY, TEMPERATURE]);
/// The latched fault and its value; sent while there is one.
pub const FAULT_VALUE: Message = Message::new("FAULT_VALUE", 0x185, 9, 100, &[TRIP_FAULT, TRIP_VALUE]);
/// The latched fault and its limit; sent while there is one.
pub const FAULT_LIMIT: Message = Message::new("FAULT_LIMIT", 0x186, 10, 100, &[TRIP_FAULT, TRIP_LIMIT]);
/// What became of the frames received, in pages.
pub const COUNTERS: Message = Message::new("COUNTERS", 0x187, 11, 100, &COUNTER_SIGNALS);
/// The answer to a parameter request.
pub const PARAMETER_ANSWER: Message =
    Message::new("PARAMETER_ANSWER", 0x188, 12, 0, &[ANSWER_RESULT, ANSWER_PARAMETER, ANSWER_VALUE]);

/// What becomes of the newest command.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(u8)]
pub enum Listening {
    /// No command has come yet, or it has been silent for so long that the drive is off.
    #[default]
    Off = 0,
    /// The newest command holds.
    Fresh = 1,
    /// Silent for some time: torque zero.
    ZeroTorque = 2,
}

impl Listening {
    /// All, by their codes.
    pub const ALL: [(Self, &'static str); 3] =
        [(Self::Off, "off"), (Self::Fresh, "fresh"), (Self::ZeroTorque, "zero_torque")];
}

/// What became of the frames received. Counts wrap; every frame received is counted once more, in one of the others but `lost`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Frames received.
    pub received: u32,
    /// Frames that took effect, or set the counter after a silence.
    pub taken: u32,
    /// Frames missing in a sequence that went on.
    pub lost: u32,
    /// Frames with an identifier that is none of ours.
    pub unknown: u32,
    /// Frames of another length than eight bytes.
    pub truncated: u32,
    /// Frames with a wrong CRC.
    pub corrupted: u32,
    /// Frames with the counter of the one before.
    pub repeated: u32,
    /// Frames whose counter is too far from the last.
    pub disordered: u32,
    /// Frames with a value out of its range, or with an unused bit.
    pub out_of_range: u32,
}

impl Counts {
    /// All, in the order of the message's pages.
    pub const fn to_array(self) -> [u32; 9] {
        let Self { received, taken, lost, unknown, truncated, corrupted, repeated, disordered, out_of_range } =
            self;
        [received, taken, lost, unknown, truncated, corrupted, repeated, disordered, out_of_range]
    }

    /// Frames that were rejected.
    pub const fn rejected(&self) -> u32 {
        self.unknown
            .wrapping_add(self.truncated)
            .wrapping_add(self.corrupted)
            .wrapping_add(self.repeated)
            .wrapping_add(self.disordered)
            .wrapping_add(self.out_of_range)
    }

    /// One page of the message, 0 ..= 2.
    pub fn encode(&self, page: u32) -> Payload {
        let mut payload = Payload::default();
        PAGE.put_raw(&mut payload, page);
        for (signal, count) in COUNTER_SIGNALS.iter().skip(1).zip(self.to_array()) {
            if signal.page == Some(page) {
                signal.put_raw(&mut payload, count);
            }
        }
        payload
    }

    /// Takes over one page of the message; counts come with their lower 16 bits.
    pub fn merge(&mut self, payload: Payload) {
        let mut counts = self.to_array();
        for (signal, count) in COUNTER_SIGNALS.iter().skip(1).zip(&mut counts) {
            if signal.page == Some(PAGE.raw(payload)) {
                *count = signal.raw(payload);
            }
        }
        let [received, taken, lost, unknown, truncated, corrupted, repeated, disordered, out_of_range] =
            counts;
        *self =
            Self { received, taken, lost, unknown, truncated, corrupted, repeated, disordered, out_of_range };
    }

    /// The page after this one.
    pub const fn page_after(page: u32) -> u32 {
        (page + 1) % PAGES
    }
}

/// How the gates are played, as the status has it.
pub trait Pattern: Copy {
    /// Its code, 0 ..= 7.
    fn code(self) -> u32;
    /// The one with this code; the default one for a code that is none.
    fn from_code(code: u32) -> Self;
}

impl Pattern for Mode {
    #[inline]
    fn code(self) -> u32 {
        self as u32
    }

    #[inline]
    fn from_code(code: u32) -> Self {
        Self::from_code(code)
    }
}

impl Pattern for Scheme {
    #[inline]
    fn code(self) -> u32 {
        self as u32
    }

    #[inline]
    fn from_code(code: u32) -> Self {
        scheme_from_code(code)
    }
}

/// Content of [`STATUS`], and of [`super::ZS9_STATUS`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StatusFrame<P = Mode> {
    /// The state; `None` for a code that is none.
    pub state: Option<State>,
    /// Code of the fault, 0 for none.
    pub fault: u8,
    /// The newest refusal.
    pub refusal: Option<Refusal>,
    /// Commands refused, modulo 256.
    pub refusals: u8,
    /// Pulse pattern, or where the zero vectors lie.
    pub mode: P,
    /// What becomes of the newest command.
    pub listening: Listening,
    /// Precharge relay, main contactor, discharge resistor.
    pub switches: [bool; 3],
    /// Braking chopper's duty, in percent.
    pub chopper_percent: Option<f32>,
    /// Frames taken, modulo 256.
    pub taken: u8,
}

impl<P: Pattern> StatusFrame<P> {
    /// Of the drive's status.
    pub fn new<T>(status: &Status<T>, mode: P, listening: Listening, counts: &Counts) -> Self {
        Self {
            state: Some(status.state),
            fault: status.trip.map_or(0, |trip| trip.fault as u8),
            refusal: status.refusal,
            refusals: status.refusals as u8,
            mode,
            listening,
            switches: [status.switches.precharge, status.switches.main, status.switches.discharge],
            chopper_percent: Some(100.0 * status.switches.chopper),
            taken: counts.taken as u8,
        }
    }

    /// As a frame's content.
    pub fn encode(&self) -> Payload {
        let mut payload = Payload::default();
        let refusal = self.refusal.map_or(0, |refusal| u32::from(refusal.code()) + 1);
        let [precharge, main, discharge] = self.switches;
        for (signal, raw) in [
            (&STATE, self.state.map_or(STATE.not_available(), |state| state.code().into())),
            (&FAULT, self.fault.into()),
            (&REFUSAL, refusal),
            (&REFUSALS, self.refusals.into()),
            (&MODE, self.mode.code()),
            (&LISTENING, self.listening as u32),
            (&PRECHARGE, precharge.into()),
            (&MAIN, main.into()),
            (&DISCHARGE, discharge.into()),
            (&TAKEN, self.taken.into()),
        ] {
            signal.put_raw(&mut payload, raw);
        }
        CHOPPER.put_measured(&mut payload, self.chopper_percent);
        payload
    }

    /// From a frame's content.
    pub fn decode(payload: Payload) -> Self {
        let listening = match LISTENING.raw(payload) {
            1 => Listening::Fresh,
            2 => Listening::ZeroTorque,
            _ => Listening::Off,
        };
        Self {
            state: State::from_code(STATE.raw(payload)),
            fault: FAULT.raw(payload) as u8,
            refusal: REFUSAL.raw(payload).checked_sub(1).and_then(Refusal::from_code),
            refusals: REFUSALS.raw(payload) as u8,
            mode: P::from_code(MODE.raw(payload)),
            listening,
            switches: [&PRECHARGE, &MAIN, &DISCHARGE].map(|signal| signal.is_set(payload)),
            chopper_percent: CHOPPER.get(payload),
            taken: TAKEN.raw(payload) as u8,
        }
    }
}

/// What is measured, and what control makes of it. `None`: not available.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Measured {
    /// Mechanical speed, in r/min.
    pub speed_rpm: Option<f32>,
    /// Torque demand after envelope, slew and limits, in N·m.
    pub torque_nm: Option<f32>,
    /// DC-link voltage, in V.
    pub link_v: Option<f32>,
    /// Largest magnitude of a phase current, in A.
    pub current_a: Option<f32>,
    /// Current reference, d, in A.
    pub id_ref_a: Option<f32>,
    /// Current reference, q, in A.
    pub iq_ref_a: Option<f32>,
    /// Commanded fundamental, peak phase, in V.
    pub voltage_v: Option<f32>,
    /// Stator frequency, in Hz, negative backward.
    pub frequency_hz: Option<f32>,
    /// Temperature, in °C.
    pub temperature_c: Option<f32>,
}

/// Three measurements.
#[inline(never)]
pub(super) fn encode(signals: [(&Signal, Option<f32>); 3]) -> Payload {
    let mut payload = Payload::default();
    for (signal, value) in signals {
        signal.put_measured(&mut payload, value);
    }
    payload
}

impl Measured {
    /// Content of [`MOTION`].
    pub fn motion(&self) -> Payload {
        encode([(&SPEED, self.speed_rpm), (&TORQUE, self.torque_nm), (&LINK, self.link_v)])
    }

    /// Content of [`CURRENTS`].
    pub fn currents(&self) -> Payload {
        encode([(&CURRENT, self.current_a), (&ID_REF, self.id_ref_a), (&IQ_REF, self.iq_ref_a)])
    }

    /// Content of [`VOLTAGES`].
    pub fn voltages(&self) -> Payload {
        let temperature = (&TEMPERATURE, self.temperature_c);
        encode([(&VOLTAGE, self.voltage_v), (&FREQUENCY, self.frequency_hz), temperature])
    }

    /// Takes over what a message of these three says.
    pub fn merge(&mut self, message: &Message, payload: Payload) {
        match message.id {
            id if id == MOTION.id => {
                self.speed_rpm = SPEED.get(payload);
                self.torque_nm = TORQUE.get(payload);
                self.link_v = LINK.get(payload);
            }
            id if id == CURRENTS.id => {
                self.current_a = CURRENT.get(payload);
                self.id_ref_a = ID_REF.get(payload);
                self.iq_ref_a = IQ_REF.get(payload);
            }
            id if id == VOLTAGES.id => {
                self.voltage_v = VOLTAGE.get(payload);
                self.frequency_hz = FREQUENCY.get(payload);
                self.temperature_c = TEMPERATURE.get(payload);
            }
            _ => (),
        }
    }
}

/// Contents of [`FAULT_VALUE`] and [`FAULT_LIMIT`].
pub fn trip_frames(trip: &Trip) -> [Payload; 2] {
    [(&TRIP_VALUE, trip.value), (&TRIP_LIMIT, trip.limit)].map(|(signal, number)| {
        let mut payload = Payload::default();
        TRIP_FAULT.put_raw(&mut payload, trip.fault as u32);
        signal.put_measured(&mut payload, Some(number));
        payload
    })
}

/// Code of the fault and number of a [`FAULT_VALUE`] or a [`FAULT_LIMIT`]; `None` for a number that is not finite.
pub fn trip_number(payload: Payload) -> (u8, Option<f32>) {
    (TRIP_FAULT.raw(payload) as u8, TRIP_VALUE.get(payload))
}

/// What became of a parameter request.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Outcome {
    /// Read or written.
    Done = 0,
    /// There is no such parameter.
    Unknown = 1,
    /// The value is out of the parameter's range.
    OutOfRange = 2,
    /// The drive is enabled: written is only while the gates cannot pulse.
    Enabled = 3,
}

impl Outcome {
    /// All, by their codes.
    pub const ALL: [(Self, &'static str); 4] = [
        (Self::Done, "done"),
        (Self::Unknown, "unknown"),
        (Self::OutOfRange, "out_of_range"),
        (Self::Enabled, "enabled"),
    ];
}

/// Content of [`PARAMETER_ANSWER`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ParameterAnswer {
    /// What became of the request.
    pub outcome: Outcome,
    /// The parameter's number.
    pub parameter: u8,
    /// Its value now; `None` if there is no such parameter.
    pub value: Option<f32>,
}

impl ParameterAnswer {
    /// As a frame's content.
    pub fn encode(&self) -> Payload {
        let mut payload = Payload::default();
        ANSWER_RESULT.put_raw(&mut payload, self.outcome as u32);
        ANSWER_PARAMETER.put_raw(&mut payload, self.parameter.into());
        ANSWER_VALUE.put_measured(&mut payload, self.value);
        payload
    }

    /// From a frame's content; `None` for an outcome that is none.
    pub fn decode(payload: Payload) -> Option<Self> {
        let (outcome, _) = *Outcome::ALL.get(ANSWER_RESULT.raw(payload) as usize)?;
        let parameter = ANSWER_PARAMETER.raw(payload) as u8;
        Some(Self { outcome, parameter, value: ANSWER_VALUE.get(payload) })
    }
}
