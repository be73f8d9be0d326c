//! The temperatures, and the share of the torque that they leave.

use crate::protocol::message::Message;
use crate::protocol::signal::{Payload, Signal};
use crate::thermal::Temperatures;

/// A temperature, in steps of half a kelvin.
const fn celsius(name: &'static str, start: u32) -> Signal {
    Signal { bits: 11, ..Signal::physical(name, "degC", start, 0.5, [-100.0, 300.0]) }
}

const WINDING: Signal = celsius("winding_c", 12);
const HEAT_SINK: Signal = celsius("heat_sink_c", 23);
const JUNCTION: Signal = celsius("junction_c", 34);
const MAGNETS: Signal = celsius("magnets_c", 45);
const SHARE: Signal =
    Signal { bits: 8, ..Signal::physical("torque_share_percent", "%", 56, 0.5, [0.0, 100.0]) };

/// Temperatures; sent by a drive that knows its sensors.
pub const TEMPERATURES: Message =
    Message::new("TEMPERATURES", 0x18C, 16, 100, &[WINDING, HEAT_SINK, JUNCTION, MAGNETS, SHARE]);

/// Content of [`TEMPERATURES`]. `None`: not available.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct TemperaturesFrame {
    /// The winding's hottest place, in °C.
    pub winding_c: Option<f32>,
    /// Heat sink, in °C.
    pub heat_sink_c: Option<f32>,
    /// The hottest junction, in °C.
    pub junction_c: Option<f32>,
    /// The magnets, in °C, as last estimated.
    pub magnets_c: Option<f32>,
    /// The share of the torque that they leave, in percent.
    pub torque_share_percent: Option<f32>,
}

impl From<&Temperatures> for TemperaturesFrame {
    fn from(known: &Temperatures) -> Self {
        Self {
            winding_c: Some(known.winding_c),
            heat_sink_c: Some(known.heat_sink_c),
            junction_c: Some(known.junction_c),
            magnets_c: known.magnets_c,
            torque_share_percent: Some(100.0 * known.torque_share),
        }
    }
}

impl TemperaturesFrame {
    /// As a frame's content.
    pub fn encode(&self) -> Payload {
        let mut payload = Payload::default();
        WINDING.put_measured(&mut payload, self.winding_c);
        HEAT_SINK.put_measured(&mut payload, self.heat_sink_c);
        JUNCTION.put_measured(&mut payload, self.junction_c);
        MAGNETS.put_measured(&mut payload, self.magnets_c);
        SHARE.put_measured(&mut payload, self.torque_share_percent);
        payload
    }

    /// From a frame's content.
    pub fn decode(payload: Payload) -> Self {
        Self {
            winding_c: WINDING.get(payload),
            heat_sink_c: HEAT_SINK.get(payload),
            junction_c: JUNCTION.get(payload),
            magnets_c: MAGNETS.get(payload),
            torque_share_percent: SHARE.get(payload),
        }
    }
}
