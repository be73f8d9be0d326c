//! The measurements: motion, currents, voltages.

use crate::protocol::commands::{LINK_V, TORQUE_NM};
use crate::protocol::message::Message;
use crate::protocol::scales::{Quantity, Scales};
use crate::protocol::signal::{Payload, Signal};

/// Range of every current, in A.
pub(in crate::protocol) const CURRENT_A: [f32; 2] = [-3_000.0, 3_000.0];
/// Range of every transmitted speed, in r/min.
pub(in crate::protocol) const SPEED_RPM: [f32; 2] = [-16_000.0, 16_000.0];

/// Range of the stator frequency, in Hz.
pub(in crate::protocol) const FREQUENCY_HZ: [f32; 2] = [-1_600.0, 1_600.0];

const SPEED: Signal = Signal::physical("speed_rpm", "r/min", 16, 0.5, SPEED_RPM).of(Quantity::Speed);
const TORQUE: Signal = Signal::physical("torque_nm", "N.m", 32, 0.1, TORQUE_NM).of(Quantity::Torque);
const LINK: Signal = Signal::physical("link_v", "V", 48, 0.1, LINK_V).of(Quantity::Voltage);

const CURRENT: Signal = Signal::physical("current_a", "A", 16, 0.1, [0.0, 3_000.0]).of(Quantity::Current);
const ID_REF: Signal = Signal::physical("id_ref_a", "A", 32, 0.1, CURRENT_A).of(Quantity::Current);
const IQ_REF: Signal = Signal::physical("iq_ref_a", "A", 48, 0.1, CURRENT_A).of(Quantity::Current);

const ESTIMATE: Signal =
    Signal::physical("torque_estimate_nm", "N.m", 16, 0.1, TORQUE_NM).of(Quantity::Torque);

const VOLTAGE: Signal = Signal::physical("voltage_v", "V", 16, 0.1, LINK_V).of(Quantity::Voltage);
const FREQUENCY: Signal = Signal::physical("frequency_hz", "Hz", 32, 0.05, FREQUENCY_HZ).of(Quantity::Speed);
const TEMPERATURE: Signal = Signal::physical("temperature_c", "degC", 48, 0.1, [-100.0, 300.0]);

const ZERO: Signal = Signal::physical("angle_zero_deg", "deg", 16, 0.01, [-180.0, 180.0]);
const CALIBRATING: Signal = Signal::flag("calibrating", 32);

/// Speed, torque, link.
pub const MOTION: Message = Message::new("MOTION", 0x182, 6, 10, &[SPEED, TORQUE, LINK])
    .telling(12, &[Quantity::Speed, Quantity::Torque, Quantity::Voltage]);
/// Currents.
pub const CURRENTS: Message =
    Message::new("CURRENTS", 0x183, 7, 10, &[CURRENT, ID_REF, IQ_REF]).telling(12, &[Quantity::Current]);
/// Voltage, frequency, temperature.
pub const VOLTAGES: Message = Message::new("VOLTAGES", 0x184, 8, 10, &[VOLTAGE, FREQUENCY, TEMPERATURE])
    .telling(12, &[Quantity::Voltage]);
/// The torque that flows.
pub const TORQUE_ESTIMATE: Message =
    Message::new("TORQUE_ESTIMATE", 0x189, 13, 10, &[ESTIMATE]).telling(12, &[Quantity::Torque]);

/// Correction of the position sensor's zero.
pub const ANGLE_ZERO: Message = Message::new("ANGLE_ZERO", 0x18D, 30, 100, &[ZERO, CALIBRATING]);

/// The measurements, and the values that control derives from them. `None`: not available.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Measured {
    /// Mechanical speed, in r/min.
    pub speed_rpm: Option<f32>,
    /// Torque demand after envelope, slew and limits, in N·m.
    pub torque_nm: Option<f32>,
    /// Torque of the machine from its currents, its flux map and the map's error as far as it is known, in N·m.
    pub torque_estimate_nm: Option<f32>,
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
    /// The winding's hottest place, in °C.
    pub temperature_c: Option<f32>,
    /// Correction of the position sensor's zero, electrical, in degrees: the drive adds it to the sensor's angle.
    pub angle_zero_deg: Option<f32>,
    /// `true` while that is being found.
    pub calibrating: bool,
}

/// Measurements of one message.
#[inline(never)]
pub(in crate::protocol) fn encode(signals: &[(&Signal, Option<f32>)], scales: Scales) -> Payload {
    let mut payload = Payload::default();
    for (signal, value) in signals {
        signal.put_measured_on(scales, &mut payload, *value);
    }
    payload
}

impl Measured {
    /// Content, without its mark, of [`MOTION`].
    pub fn motion(&self, scales: Scales) -> Payload {
        encode(&[(&SPEED, self.speed_rpm), (&TORQUE, self.torque_nm), (&LINK, self.link_v)], scales)
    }

    /// Content, without its mark, of [`CURRENTS`].
    pub fn currents(&self, scales: Scales) -> Payload {
        encode(&[(&CURRENT, self.current_a), (&ID_REF, self.id_ref_a), (&IQ_REF, self.iq_ref_a)], scales)
    }

    /// Content, without its mark, of [`VOLTAGES`].
    pub fn voltages(&self, scales: Scales) -> Payload {
        let temperature = (&TEMPERATURE, self.temperature_c);
        encode(&[(&VOLTAGE, self.voltage_v), (&FREQUENCY, self.frequency_hz), temperature], scales)
    }

    /// Content, without its mark, of [`TORQUE_ESTIMATE`].
    pub fn torque_estimate(&self, scales: Scales) -> Payload {
        encode(&[(&ESTIMATE, self.torque_estimate_nm)], scales)
    }

    /// Content of [`ANGLE_ZERO`].
    pub fn angle_zero(&self) -> Payload {
        let mut payload = Payload::default();
        ZERO.put_measured(&mut payload, self.angle_zero_deg);
        CALIBRATING.put_raw(&mut payload, self.calibrating.into());
        payload
    }

    /// Adopts the content of one of these five messages, without its mark.
    pub fn merge(&mut self, message: &Message, payload: Payload, scales: Scales) {
        match message.id {
            id if id == MOTION.id => {
                self.speed_rpm = SPEED.get_on(scales, payload);
                self.torque_nm = TORQUE.get_on(scales, payload);
                self.link_v = LINK.get_on(scales, payload);
            }
            id if id == CURRENTS.id => {
                self.current_a = CURRENT.get_on(scales, payload);
                self.id_ref_a = ID_REF.get_on(scales, payload);
                self.iq_ref_a = IQ_REF.get_on(scales, payload);
            }
            id if id == VOLTAGES.id => {
                self.voltage_v = VOLTAGE.get_on(scales, payload);
                self.frequency_hz = FREQUENCY.get_on(scales, payload);
                self.temperature_c = TEMPERATURE.get_on(scales, payload);
            }
            id if id == ANGLE_ZERO.id => {
                self.angle_zero_deg = ZERO.get(payload);
                self.calibrating = CALIBRATING.is_set(payload);
            }
            id if id == TORQUE_ESTIMATE.id => self.torque_estimate_nm = ESTIMATE.get_on(scales, payload),
            _ => (),
        }
    }
}
