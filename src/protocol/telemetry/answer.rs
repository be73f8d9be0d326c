//! The answer to a parameter request.

use crate::protocol::message::Message;
use crate::protocol::signal::{Payload, Signal};

pub(in crate::protocol) const ANSWER_RESULT: Signal = Signal::number("result", 12, 4, 0xF);
pub(in crate::protocol) const ANSWER_PARAMETER: Signal = Signal::number("parameter", 16, 8, 0xFF);
pub(in crate::protocol) const ANSWER_VALUE: Signal = Signal::float("value", 32);

/// The answer to a parameter request.
pub const PARAMETER_ANSWER: Message =
    Message::new("PARAMETER_ANSWER", 0x188, 12, 0, &[ANSWER_RESULT, ANSWER_PARAMETER, ANSWER_VALUE]);

/// The outcome of a parameter request.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(u8)]
#[non_exhaustive]
pub enum Outcome {
    /// Read or written.
    Done = 0,
    /// There is no such parameter.
    Unknown = 1,
    /// The value is out of the parameter's range.
    OutOfRange = 2,
    /// The drive is enabled: parameters are written only while the gates cannot pulse.
    Enabled = 3,
}

impl Outcome {
    /// All outcomes, by their codes.
    pub const ALL: [(Self, &'static str); 4] = [
        (Self::Done, "done"),
        (Self::Unknown, "unknown"),
        (Self::OutOfRange, "out_of_range"),
        (Self::Enabled, "enabled"),
    ];
}

/// Content of [`PARAMETER_ANSWER`].
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct ParameterAnswer {
    /// The outcome of the request.
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

    /// From a frame's content; `None` for an invalid outcome.
    pub fn decode(payload: Payload) -> Option<Self> {
        let (outcome, _) = *Outcome::ALL.get(ANSWER_RESULT.raw(payload) as usize)?;
        let parameter = ANSWER_PARAMETER.raw(payload) as u8;
        Some(Self { outcome, parameter, value: ANSWER_VALUE.get(payload) })
    }
}
