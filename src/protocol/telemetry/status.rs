//! The status: state, fault, refusal, switches.

use super::Counts;
use crate::modulation::{MODE_CODES, Mode};
use crate::nine_switch::Scheme;
use crate::operator::{Refusal, State, Status};
use crate::protocol::message::Message;
use crate::protocol::signal::{Payload, Signal};

pub(in crate::protocol) const STATE: Signal = Signal::number("state", 12, 4, 0xF);
pub(in crate::protocol) const FAULT: Signal = Signal::number("fault", 16, 8, 0xFF);
pub(in crate::protocol) const REFUSAL: Signal = Signal::number("refusal", 24, 8, 0xFF);
pub(in crate::protocol) const REFUSALS: Signal = Signal::number("refusals", 32, 5, 0x1F);
const MODE: Signal = pattern("mode");
pub(in crate::protocol) const LISTENING: Signal = Signal::number("listening", 43, 2, 3);
pub(in crate::protocol) const PRECHARGE: Signal = Signal::flag("precharge", 45);
pub(in crate::protocol) const MAIN: Signal = Signal::flag("main", 46);
pub(in crate::protocol) const DISCHARGE: Signal = Signal::flag("discharge", 47);
pub(in crate::protocol) const CHOPPER: Signal =
    Signal { bits: 8, ..Signal::physical("chopper_percent", "%", 48, 0.5, [0.0, 100.0]) };
pub(in crate::protocol) const TAKEN: Signal = Signal::number("taken", 56, 8, 0xFF);

/// The code of a pulse pattern, or of the place of the zero vectors: room for [`MODE_CODES`] of them.
pub(in crate::protocol) const fn pattern(name: &'static str) -> Signal {
    Signal::number(name, 37, MODE_CODES.ilog2(), MODE_CODES - 1)
}

/// State, fault, refusal, switches.
pub const STATUS: Message = Message::new(
    "STATUS",
    0x181,
    5,
    10,
    &[STATE, FAULT, REFUSAL, REFUSALS, MODE, LISTENING, PRECHARGE, MAIN, DISCHARGE, CHOPPER, TAKEN],
);

/// The use that is made of the newest command.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(u8)]
pub enum Listening {
    /// No command has come yet, or there has been silence for so long that the drive is off.
    #[default]
    Off = 0,
    /// The newest command is in force.
    Fresh = 1,
    /// Silent for some time: torque zero.
    ZeroTorque = 2,
}

impl Listening {
    /// All, by their codes.
    pub const ALL: [(Self, &'static str); 3] =
        [(Self::Off, "off"), (Self::Fresh, "fresh"), (Self::ZeroTorque, "zero_torque")];
}

/// The pulse pattern of the gates, as the status carries it.
pub trait Pattern: Copy {
    /// Its code, below [`MODE_CODES`].
    fn code(self) -> u32;
    /// The pattern with this code; the default one for an invalid code.
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
        Scheme::from_code(code)
    }
}

/// Content of [`STATUS`], and of [`crate::protocol::ZS9_STATUS`].
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct StatusFrame<P = Mode> {
    /// The state; `None` for an invalid code.
    pub state: Option<State>,
    /// Code of the fault, 0 for none.
    pub fault: u8,
    /// The newest refusal.
    pub refusal: Option<Refusal>,
    /// Commands refused, modulo 32.
    pub refusals: u8,
    /// Pulse pattern, or the place of the zero vectors.
    pub mode: P,
    /// The use that is made of the newest command.
    pub listening: Listening,
    /// Precharge relay, main contactor, discharge resistor.
    pub switches: [bool; 3],
    /// Braking chopper's duty, in percent.
    pub chopper_percent: Option<f32>,
    /// Frames taken, modulo 256.
    pub taken: u8,
}

impl<P: Pattern> StatusFrame<P> {
    /// The frame of the drive's status.
    pub fn new<T>(status: &Status<T>, mode: P, listening: Listening, counts: &Counts) -> Self {
        Self {
            state: Some(status.state),
            fault: status.trip.map_or(0, |trip| trip.fault as u8),
            refusal: status.refusal,
            refusals: (status.refusals & REFUSALS.not_available()) as u8,
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_status_comes_back_with_whatever_it_says_of_commands() {
        for (raw, listening) in [(0, Listening::Off), (1, Listening::Fresh), (2, Listening::ZeroTorque)] {
            let mut payload = Payload::default();
            LISTENING.put_raw(&mut payload, raw);
            STATE.put_raw(&mut payload, STATE.not_available());
            TAKEN.put_raw(&mut payload, 5);
            MAIN.put_raw(&mut payload, 1);
            let status = StatusFrame::<Mode>::decode(payload);
            assert_eq!((status.listening, status.state, status.taken), (listening, None, 5));
            assert_eq!((status.switches, status.refusal), ([false, true, false], None));
            assert_eq!(StatusFrame::<Mode>::decode(status.encode()), status);
        }
    }
}
